"""Executing a notebook in two places: every undeserved point, leak and silent zero that could be."""

# ruff: noqa: E501  (cells of a notebook are quoted as one line of text)

from __future__ import annotations

from dataclasses import replace

import pytest

from autograder.execute import read_folder

SQUARES = "def squares(n):\n    return [i ** 2 for i in range(1, n + 1)]"
STUB = "def squares(n):\n    ..."


def test_honest_cells_score_as_in_one_process(execute):
    """A right function passes, a wrong one fails, and outputs of the student's cells are kept in order."""
    run = execute(
        ("given", "import numpy as np\ndata = np.arange(3)"),
        ("answer", SQUARES + "\nprint('defined')\nsquares(2)", STUB),
        ("test", "assert squares(3) == [1, 4, 9]\nassert squares(int(data[1])) == [1]"),
        ("test", "assert squares(3) == [1, 4]"),
        ("plain", "import matplotlib.pyplot as plt\nplt.plot(data);"),
    )
    assert run.scores == [2, 0]
    assert run.flags == ["", ""]
    assert run.printed(1) == "defined\n"
    assert run.cells[1].outputs[1].data["text/plain"] == "[1, 4]"
    assert "image/png" in run.cells[4].outputs[-1].data
    assert run.error(1)[0] == "AssertionError"


def test_the_pattern_of_nbgraders_own_quickstart(execute):
    """A test that deletes a function to see that another uses it, and puts it back, works as in one process."""
    test = (
        "orig_squares = squares\ndel squares\ntry:\n    sum_of_squares(1)\nexcept NameError:\n    pass\nelse:\n"
        "    raise AssertionError('sum_of_squares does not use squares')\nfinally:\n    squares = orig_squares"
    )
    uses = "def sum_of_squares(n):\n    return sum(squares(n))"
    own = "def sum_of_squares(n):\n    return n * (n + 1) * (2 * n + 1) // 6"
    for source, score in ((uses, 2), (own, 0)):
        run = execute(
            ("answer", SQUARES, STUB),
            ("answer", source, "def sum_of_squares(n):\n    ..."),
            ("test", test + "\nassert sum_of_squares(2) == 5"),
            ("test", "assert squares(2) == [1, 4]"),
        )
        assert run.scores == [score, 2], run.error()
        assert run.flags == ["", ""]


def test_a_test_may_replace_a_function_of_the_release(execute):
    """A test's own data under a student's name is what the student's functions see, and only in that test."""
    run = execute(
        ("answer", "rate = 2\ndef f(x):\n    return rate * x", "rate = ...\ndef f(x): ..."),
        ("test", "rate = 10\nassert f(1) == 10\nrate = 20\nassert f(1) == 20"),
        ("test", "assert f(1) == 2 and rate == 2"),
    )
    assert run.scores == [2, 2], [run.error(i) for i in (0, 1)]


# A submission cannot reach into the test.


def test_a_tests_own_variable_stays_hidden(execute):
    """A submission that has a variable of a test's name, even to return it, does not see the test's."""
    run = execute(
        ("plain", "expected = answer = result = None"),
        (
            "answer",
            "def f(x):\n    return expected if expected is not None else globals().get('answer')",
            "def f(x): ...",
        ),
        ("test", "expected = 42\nanswer = 42\nassert f(1) == expected"),
        ("test", "answer = 42\nexpected = 42\nassert expected == 42\nassert f(1) == expected"),
    )
    assert run.scores == [0, 0]


def test_an_earlier_tests_variable_is_not_the_submissions(execute):
    """What an earlier test cell computed is what a later one reads, also where a submission has that name too."""
    run = execute(
        ("plain", "expected = 0"),
        ("answer", "def f(x):\n    return 0", "def f(x): ..."),
        ("test", "expected = 42\nassert expected == 42"),
        ("test", "assert f(1) == expected"),
    )
    assert run.scores == [2, 0]


@pytest.mark.parametrize(
    "test",
    [
        "assert isinstance(robot, int)", "assert len(robot) == 3", "for item in robot:\n    pass", "assert robot",
        "assert robot == robot", "robot[0]", "robot + 1", "float(robot)", "'a' in robot", "robot",
        "try:\n    len(robot)\nexcept Exception:\n    pass", "try:\n    len(robot)\nexcept:\n    pass",
        "try:\n    bool(robot)\nexcept BaseException:\n    pass\nassert True", "robot.x = 3", "assert not robot",
        "np.asarray(robot)", "assert type(robot).__name__ == 'X' or robot.__class__", "import copy; copy.deepcopy(robot)",
        "assert callable(robot) and hash(robot) and isinstance(robot, int)", "object() in [robot]",
    ],
)  # fmt: skip
def test_what_needs_the_object_itself_is_flagged(execute, test):
    """A test that needs the student's object itself is never passed and never a silent zero: a person looks at it."""
    run = execute(
        ("given", "import numpy as np"),
        ("answer", "class Robot:\n    pass\nrobot = Robot()", "robot = ..."),
        ("test", test),
        ("test", "assert 1 + 1 == 2"),
    )
    assert run.flags[0]
    assert run.error(0)[0] == "GraderError"
    assert (run.scores[1], run.flags[1]) == (2, "")


# What crosses.


def test_methods_and_attributes_of_instances(execute):
    """An instance's attributes and methods are asked where it lives; its state goes on within the test cell."""
    run = execute(
        (
            "answer",
            (
                "class Robot:\n    def __init__(self, x=0.0): self.x = x\n    def drive(self, v, dt=1.0):\n"
                "        self.x += v * dt\n        return self\n    def pose(self): return (self.x, 0.0)"
            ),
            "class Robot: ...",
        ),
        (
            "test",
            "r = Robot(x=1.0)\nr.drive(2.0).drive(v=1.0, dt=0.5)\nassert r.x == 3.5\nassert r.pose() == (3.5, 0.0)",
        ),
        ("test", "r = Robot()\nassert Robot(2.0).x == 2.0 and r.x == 0.0"),
        (
            "test",
            "try:\n    Robot().fly()\nexcept AttributeError as e:\n    assert 'fly' in str(e)\nelse:\n    assert 0",
        ),
    )
    assert run.scores == [2, 2, 2], [run.error(i) for i in range(3)]


def test_changes_of_arguments_are_seen(execute):
    """A list, dict, set, array or generator that a call changes is changed for the test, and only those it changed."""
    run = execute(
        ("given", "import numpy as np"),
        (
            "answer",
            ("def f(l, d, s, a, rng=None, b=None):\n    l.append(4); d['k'] = 1; s.discard(1); a[0] = 7\n"
            "    if b is not None: b += b'!'\n    return rng.normal() if rng is not None else None"),
            "def f(l, d, s, a, rng=None): ...",
        ),
        (
            "test",
            ("l, d, s, a, b = [1], {}, {1, 2}, np.zeros((2, 2), order='F'), bytearray(b'x')\nalias = l\n"
            "rng, same = np.random.default_rng(3), np.random.default_rng(3)\n"
            "value = f(l, d, s, a, rng=rng, b=b)\n"
            "assert l == [1, 4] and alias is l and d == {'k': 1} and s == {2} and b == b'x!'\n"
            "assert a[0].tolist() == [7, 7] and a.flags.f_contiguous\n"
            "assert value == same.normal() and rng.normal() == same.normal()"),
        ),
        ("answer", "def g(a):\n    a[0] = 1", "def g(a): ..."),
        ("test", "a = np.zeros(2); a.flags.writeable = False\ntry:\n    g(a)\nexcept ValueError:\n    pass\nelse:\n    assert 0"),
        ("test", "t = ([0],)\ng(t[0])\nassert t == ([1],)"),
    )  # fmt: skip
    assert run.scores == [2, 2, 2], [run.error(i) for i in range(3)]
    assert run.flags == [""] * 3


def test_exceptions_come_as_themselves(execute):
    """A builtin or library exception comes as its class, with the student's line; any other says its name."""
    run = execute(
        ("given", "import numpy as np\nfrom autograder.remote import StudentError"),
        (
            "answer",
            ("class Odd(Exception): pass\nclass AssertionErrorX(AssertionError): pass\n"
            "def f(k):\n    if k == 0: raise ValueError('bad k')\n    if k == 1: return [][3]\n"
            "    if k == 2: return np.linalg.inv(np.zeros((2, 2)))\n    if k == 3: raise Odd('odd')\n"
            "    if k == 4: raise SystemExit\n    if k == 5: raise UnicodeDecodeError('a', b'b', 0, 1, 'c')\n"
            "    if k == 6: raise GeneratorExit\n    if k == 7: return missing_name\n    raise AssertionErrorX"),
            "def f(k): ...",
        ),
        (
            "test",
            ("def caught(k):\n    try:\n        f(k)\n    except Exception as e:\n        return e\n"
            "assert type(caught(0)) is ValueError and str(caught(0)) == 'bad k'\n"
            "assert caught(0).line == 4 and 'bad k' in caught(0).source\n"
            "assert type(caught(1)) is IndexError\nassert type(caught(2)) is np.linalg.LinAlgError\n"
            "assert type(caught(3)) is StudentError and caught(3).ename == 'Odd' and caught(3).evalue == 'odd'\n"
            "assert type(caught(4)) is StudentError and type(caught(5)) is StudentError\n"
            "assert type(caught(6)) is StudentError and type(caught(7)) is NameError and type(caught(8)) is StudentError"),
        ),
        ("test", "f(0)"),
        ("test", "import pytest\nwith np.testing.assert_raises(ValueError):\n    f(0)".replace("import pytest\n", "")),
    )  # fmt: skip
    assert run.scores == [2, 0, 2], [run.error(i) for i in range(3)]
    assert run.error(1) == ("ValueError", "bad k")


def test_functions_as_arguments(execute):
    """A library's function may be handed over, a student's own too; a test's own function is a grader error."""
    run = execute(
        ("given", "import numpy as np, math"),
        ("answer", "def apply(f, x):\n    return f(x)\ndef double(x): return 2 * x", "def apply(f, x): ...\ndef double(x): ..."),
        ("test", "assert apply(np.cos, 0.0) == 1.0 and apply(math.sqrt, 4.0) == 2.0 and apply(abs, -1) == 1"),
        ("test", "assert apply(double, 4) == 8 and apply(f=double, x=5) == 10"),
        ("test", "assert apply(lambda x: x, 1) == 1"),
    )  # fmt: skip
    assert run.scores[:2] == [2, 2], [run.error(i) for i in range(2)]
    assert run.flags[:2] == ["", ""]
    assert run.flags[2]


def test_modules_are_the_graders_own(execute):
    """A module that only the submission imported is the grader's own import in a test; a forged one is not."""
    run = execute(
        ("plain", ("import math as m\nimport types\nfake = types.ModuleType('math')\nfake.sqrt = lambda x: 5\n"
                  "evil = types.ModuleType('autograder.remote')")),
        ("test", "assert m.sqrt(4) == 2 and m.__name__ == 'math'"),
        ("test", "assert fake.sqrt(4) == 5"),
        ("test", "evil.GraderError"),
    )  # fmt: skip
    assert run.scores[:2] == [2, 0]
    assert run.scores[2] == 0


def test_symbolic_answers(execute):
    """Symbolic answers are compared as numbers: symbols by name, matrices; what cannot be evaluated says why."""
    run = execute(
        ("given", "import sympy as sp\nr, b, wl, wr = sp.symbols('r b w_l w_r')"),
        (
            "answer",
            (
                "v = r * (wl + wr) / 2\nG = sp.Matrix([[r / 2, r / 2], [-r / b, r / b]])\nq = sp.Symbol('other') * r\n"
                "z = 1 / (wl - wl)\nn = 3\nw = 'r'\nh = lambda: 1\ns = sp.Symbol('r', positive=True)"
            ),
            "v = G = q = z = n = w = h = s = ...",
        ),
        ("given", "from autograder.remote import evaluate\np = {'r': 2.0, 'b': 4.0, 'w_l': 1.0, 'w_r': 3.0}"),
        ("test", "assert evaluate(v, p) == 4.0 and evaluate(s, p) == 2.0"),
        ("test", "import numpy as np\nnp.testing.assert_array_equal(evaluate(G, p), [[1, 1], [-0.5, 0.5]])"),
        (
            "test",
            "try:\n    evaluate(q, p)\nexcept ValueError as e:\n    assert 'other' in str(e)\nelse:\n    assert 0",
        ),
        ("test", "try:\n    evaluate(z, p)\nexcept ValueError:\n    pass\nelse:\n    assert 0"),
        ("test", "assert evaluate(n, p) == 3"),
        ("test", "evaluate(h, p)"),
    )
    assert run.scores == [2, 2, 2, 2, 2, 0], [run.error(i) for i in range(6)]
    assert run.flags == [""] * 6


# Fails closed.


@pytest.mark.parametrize("result", ["float('nan')", "-1.0", "2.5", "1e9", "float('inf')", "-float('inf')"])
def test_impossible_scores_are_flagged(execute, result):
    """A score that is not between 0 and the points is not believed."""
    run = execute(("answer", "x = 1", "x = ..."), ("test", result))
    assert run.flags[0]
    assert run.scores == [0]


@pytest.mark.parametrize(
    "test",
    [
        "%no_such_magic",
        "class E(Exception):\n    def _render_traceback_(self): raise ValueError\nraise E",
        "%%no_such_magic\nassert f() == 2",
    ],
    ids=["magic", "unshowable", "cell magic"],
)
def test_a_test_whose_error_cannot_be_shown_is_flagged(execute, test):
    """A test cell that failed without an error among its outputs is no pass: nbgrader would give it all points."""
    run = execute(("answer", "def f(): return 1", "def f(): ..."), ("test", test))
    assert run.flags[0]
    assert run.scores == [0]


def test_partial_scores(execute):
    """A number between 0 and the points is the score, as under nbgrader."""
    run = execute(
        ("answer", "def f(): return 1.5", "def f(): ..."), ("test", "f()"), ("test", "0"), ("test", "2")
    )
    assert run.scores == [1.5, 0, 2]
    assert run.flags == [""] * 3


@pytest.mark.parametrize(
    ("source", "ename"),
    [
        ("import os\ndef f(x): os._exit(0)", "ProcessDied"),
        ("import os\ndef f(x): os.kill(os.getpid(), 9)", "ProcessDied"),
        ("import ctypes\ndef f(x): ctypes.string_at(0)", "ProcessDied"),
        ("def f(x):\n    while True: pass", "LimitExceeded"),
        ("def f(x):\n    while True:\n        try:\n            while True: pass\n        except BaseException: pass",
         "LimitExceeded"),
        ("import time\ndef f(x): time.sleep(1000)", "LimitExceeded"),
        ("import sys\ndef f(x): sys.exit(0)", "StudentError"),
        ("def f(x): raise KeyboardInterrupt", "StudentError"),
        ("import numpy as np\ndef f(x): return np.ones(2**30)", None),
        ("def f(x): return f(x)", "RecursionError"),
        ("def f(x):\n    y = []\n    y.append(y)\n    return y", "GraderError"),
        ("pass", "NameError"),
        ("f = None", "TypeError"),
        ("def f(): return 9", "TypeError"),
        ("f = 9", "TypeError"),
        ("def f(x) return 9", "NameError"),
        ("raise SystemExit\ndef f(x): return 9", "NameError"),
        ("import os\ndef f(x): return 9\nos._exit(0)", "NameError"),
    ],
    ids=str,
)  # fmt: skip
def test_failures_score_zero_with_a_reason_and_the_next_test_runs(execute, limits, source, ename):
    """Exit, crash, time-out and missing functions score 0 in their test, which says which; the next test is scored."""
    run = execute(
        ("answer", source, "def f(x): ..."),
        ("answer", "def g(x): return x + 1", "def g(x): ..."),
        ("test", "assert f(3) == 9"),
        ("test", "assert g(1) == 2"),
        limits=replace(limits, call_cpu=0.4, wall_factor=1.0, wall_extra=0.6),
    )
    assert run.scores == [0, 2], [run.error(i) for i in (0, 1)]
    if ename is not None:
        assert run.error(0)[0] == ename
    assert run.flags[1] == ""


def test_a_test_that_does_not_end_is_flagged(execute, limits):
    """A test cell that loops by itself, even one that swallows what stops it once, ends and waits for a person."""
    run = execute(
        ("answer", "n = 10**18\ndef f(): return range(n)", "def f(): ..."),
        ("test", "for i in f():\n    pass"),
        ("test", "while True:\n    pass"),
        ("test", "assert len([1]) == 1"),
        limits=replace(limits, call_cpu=0.2, cell_cpu=0.2, notebook_cpu=0.3, wall_factor=0.1, wall_extra=0.5),
    )
    assert run.flags[0]
    assert run.flags[1]
    assert run.scores[:2] == [0, 0]


def test_warnings_cost_nothing(execute):
    """What the submission or a test writes to standard error costs no point."""
    run = execute(
        ("answer", ("import sys, warnings\ndef f(x):\n    warnings.warn('careful')\n    print('note', file=sys.stderr)\n"
                   "    import os; os.write(2, b'raw')\n    return x"), "def f(x): ..."),
        ("test", "import sys\nprint('by the test', file=sys.stderr)\nassert f(2) == 2"),
    )  # fmt: skip
    assert run.scores == [2]


def test_given_data_that_a_submission_redefines(execute):
    """Where a test fails and the submission gave given data another value, a person decides; a pass stands."""
    cells = [
        ("given", "dt = 0.1"),
        ("answer", "dt = mine = 0.2\ndef step(v): return v * mine", "def step(v): ..."),
        ("test", "assert step(1.0) == 1.0 * dt"),
    ]
    run = execute(*cells)
    assert "dt" in run.flags[0]
    cells[1] = ("answer", "dt = 0.2\ndef step(v): return v * 0.1", "def step(v): ...")
    run = execute(*cells)
    assert (run.scores, run.flags) == ([2], [""])
    run = execute(cells[0], ("answer", "def step(v): return v", "def step(v): ..."), cells[2])
    assert (run.scores, run.flags) == ([0], [""])
    wrong = ("answer", "import numpy as np\ndef step(v): return v", "def step(v): ...")
    run = execute(("given", "import numpy as np"), wrong, ("test", "assert np.isclose(step(1.0), 0.5)"))
    assert (run.scores, run.flags) == ([0], [""])


def test_a_name_of_a_test_that_a_later_cell_needs(execute):
    """A later cell that reads what only a test cell binds finds it; of a hidden part it finds nothing."""
    run = execute(
        ("answer", "def f(x): return x", "def f(x): ..."),
        ("test", "seen = f(3)\n### BEGIN HIDDEN TESTS\nhidden = 77\nassert f(4) == 4\n### END HIDDEN TESTS"),
        ("plain", "print(seen)"),
        ("plain", "print(hidden)"),
    )
    assert run.scores == [2]
    assert run.printed(2) == "3\n"
    assert "77" not in str(run.cells[3].outputs)


def test_given_cells_that_use_the_submission(execute):
    """A given cell that needs a student's function gives its names to the tests all the same."""
    run = execute(
        ("answer", "def f(x): return x * 2", "def f(x): ..."),
        ("given", "table = [f(i) for i in range(3)]\ndef helper(x): return f(x) + 1"),
        ("test", "assert table == [0, 2, 4]\nassert helper(2) == 5"),
    )
    assert (run.scores, run.flags) == ([2], [""]), run.error()


def test_read_folder(tmp_path):
    """The folder's files come with their mode; links are left out; too much is an error."""
    (tmp_path / "a").write_bytes(b"12345")
    (tmp_path / "a").chmod(0o640)
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "b").write_bytes(b"x")
    (tmp_path / "link").symlink_to("/etc/passwd")
    (tmp_path / "folder").symlink_to("/etc")
    found = read_folder(str(tmp_path), 100)
    assert set(found) == {"a", "sub/b"}
    assert found["a"] == (b"12345", 0o640)
    with pytest.raises(ValueError, match="5 bytes"):
        read_folder(str(tmp_path), 5)
