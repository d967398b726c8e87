"""Executing a notebook in two places: every undeserved point, leak and silent zero that could be."""

# ruff: noqa: E501  (cells of a notebook are quoted as one line of text)

from __future__ import annotations

from dataclasses import replace

import pytest

from autograder.isolated import read_folder

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
