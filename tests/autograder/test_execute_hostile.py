"""What a submission may try while it is executed: it shadows, forges and remembers, and earns nothing by it."""

# ruff: noqa: E501  (cells of a notebook are quoted as one line of text)

from __future__ import annotations

import sys
import time
from dataclasses import replace

import pytest

from autograder import outputs


@pytest.mark.parametrize(
    "shadow",
    [
        "def assert_equal(*a): pass",
        "def isinstance(*a): return True",
        "abs = lambda x: 0\nall = any = lambda x: True\nlen = lambda x: 3\nround = lambda *a: 9",
        "import builtins\nbuiltins.abs = lambda x: 0\nbuiltins.all = lambda x: True\nbuiltins.isinstance = lambda *a: True",
        "class np:\n    class testing:\n        assert_allclose = staticmethod(lambda *a, **k: None)",
        "import numpy as np\nnp.testing.assert_allclose = lambda *a, **k: None\nnp.allclose = lambda *a, **k: True",
        "def close(*a): return True",
        "expected = [0]",
        "AssertionError = ValueError",
        "def check(*a): pass",
        "import sys, types\nm = types.ModuleType('nose')\nm.assert_equal = lambda *a: 0\nsys.modules['numpy.testing'] = m",
    ],
    ids=lambda shadow: shadow.split("\n")[0][:40],
)  # fmt: skip
def test_nothing_of_the_instructors_can_be_shadowed(execute, shadow):
    """Builtins, given helpers, given data and imported modules are the instructor's, whatever a submission binds."""
    run = execute(
        ("given", "import numpy as np\nfrom numpy.testing import assert_equal\nexpected = [9.0]"),
        ("given", "def close(a, b):\n    return abs(a - b) < 1e-9\ndef check(f):\n    assert close(f(3), 9)"),
        ("answer", shadow + "\ndef f(x):\n    return 0.0", "def f(x): ..."),
        ("plain", shadow),
        ("test", "assert isinstance(f(3), str)"),
        ("test", "assert_equal(f(3), 9)"),
        ("test", "np.testing.assert_allclose(f(3), 9)"),
        ("test", "assert abs(f(3) - 9) < 1e-9 and all([f(3) == 9]) and len([1]) == 1"),
        ("test", "check(f)"),
        ("test", "assert close(f(3), expected[0])"),
    )
    assert run.scores == [0] * 6
    assert [flag for flag in run.flags if flag and "another value than a given cell" not in flag] == []
    right = [("answer", "def f(x):\n    return 9.0", "def f(x): ..."), ("plain", shadow)]
    again = execute(*run.source[:2], *right, *run.source[4:])
    assert again.scores == [0, 2, 2, 2, 2, 2], [again.error(i) for i in range(6)]


@pytest.mark.parametrize(
    "source",
    [
        ("class E:\n    def __eq__(s, o): return True\n    __lt__ = __gt__ = __le__ = __ge__ = __eq__\n"
        "    def __sub__(s, o): return 0.0\n    __rsub__ = __abs__ = __sub__\n"
        "    def __float__(s): return 9.0\n    def __array__(s, *a, **k): return __import__('numpy').array(9.0)\n"
        "    def __bool__(s): return True\ndef f(x): return E()"),
        ("class E(float):\n    def __eq__(s, o): return True\n    def __sub__(s, o): return 0.0\n"
        "    __hash__ = None\ndef f(x): return E(1)"),
        ("import numpy as np\nclass E(np.ndarray):\n    def __eq__(s, o): return True\n"
        "    def __array_ufunc__(s, *a, **k): return True\ndef f(x): return np.zeros(1).view(E)"),
        "from unittest.mock import ANY, MagicMock\ndef f(x): return ANY",
        "from unittest.mock import MagicMock\ndef f(x): return MagicMock()",
        "f = type('F', (), {'__call__': lambda s, x: s, '__eq__': lambda s, o: True})()",
    ],
    ids=["object", "float", "array", "ANY", "mock", "callable"],
)  # fmt: skip
def test_always_equal_objects_earn_nothing(execute, source):
    """An object that is equal to everything gives no point: it arrives as plain data, or a person looks at the cell."""
    run = execute(
        ("given", "import numpy as np"),
        ("answer", source, "def f(x): ..."),
        ("test", "assert f(3) == 9"),
        ("test", "np.testing.assert_allclose(f(3), 9)"),
        ("test", "assert abs(f(3) - 9) < 1e-9"),
        ("test", "if f(3) != 9:\n    raise AssertionError"),
    )
    for score, flag in zip(run.scores, run.flags, strict=True):
        assert score == 0 or flag


def test_hostile_symbolic_answers(execute):
    """A symbolic answer that lies when it is evaluated gives numbers or an error, never a pass by being an object."""
    run = execute(
        ("given", "import sympy as sp\nr = sp.Symbol('r')\nfrom autograder.remote import evaluate"),
        (
            "answer",
            (
                "class E(sp.Symbol):\n    def evalf(self, *a, **k): return ANY\nfrom unittest.mock import ANY\nv = E('r')\n"
                "class M(sp.Expr):\n    free_symbols = set()\n    def evalf(self, *a, **k):\n        while True: pass\nw = M()"
            ),
            "v = w = ...",
        ),
        ("test", "assert evaluate(v, {'r': 2.0}) == 5.0"),
        ("test", "assert evaluate(w, {'r': 2.0}) == 5.0"),
    )
    assert run.scores == [0, 0]


@pytest.mark.parametrize(
    "change",
    [
        "x.resize(0, refcheck=False)",
        "x.shape = (1, -1)",
        "x.dtype = 'int64'",
        "x.flags.writeable = True; x[:] = 0",
        "l[:] = [object()]",
        "l.append(l)",
    ],
)
def test_no_change_of_an_argument_is_hidden(execute, change):
    """What a call did to an argument and the test cannot be shown is for a person, not for full marks."""
    run = execute(
        ("given", "import numpy as np"),
        ("answer", f"def f(x, l):\n    {change}\n    return 9", "def f(x, l): ..."),
        (
            "test",
            "x, l = np.ones(2), [1]\nx.flags.writeable = False\nassert f(x, l) == 9 and x.sum() == 2 and l == [1]",
        ),
    )
    assert (run.scores, bool(run.flags[0])) != ([2], False)


def test_changes_inside_a_tuple_are_seen(execute):
    """A list or an array that a call reaches through a tuple is changed for the test too."""
    run = execute(
        ("given", "import numpy as np"),
        ("answer", "def f(t):\n    t[0][0] = 7\n    t[1].append(8)", "def f(t): ..."),
        ("test", "t = (np.zeros(2), [])\nf(t)\nassert t[0].tolist() == [7, 0] and t[1] == [8]"),
    )
    assert run.scores == [2], run.error()


# No hidden input comes out.

SECRET = 987654321


@pytest.mark.parametrize(
    "carry",
    [
        "kept = []\ndef f(x):\n    kept.append(x)\n    return x",
        (
            "def f(x):\n    open('kept', 'a').write(str(x)); open('/tmp/kept', 'a').write(str(x))\n"
            "    open('/dev/shm/kept', 'a').write(str(x))\n    return x"
        ),
        "import mmap\nfile = open('mapped', 'wb+')\nfile.truncate(4096)\nshared = mmap.mmap(file.fileno(), 4096)\ndef f(x):\n    shared[:len(str(x))] = str(x).encode()\n    return x",
        "import os\nr, w = os.pipe()\nos.set_blocking(r, False)\ndef f(x):\n    os.write(w, str(x).encode())\n    return x",
        (
            "import os, socket\na, b = socket.socketpair()\nb.setblocking(False)\n"
            "if os.fork() == 0:\n    os.setsid()\n    while True:\n        a.sendall(a.recv(100))\n"
            "def f(x):\n    b.send(str(x).encode())\n    return x"
        ),
    ],
    ids=["global", "file", "shared memory", "pipe", "daemon"],
)
def test_no_hidden_input_reaches_an_output(execute, carry):
    """Whatever a function does with a hidden input, no cell of the submission shows it, before or after the test."""
    look = (
        "import os\nfor name in ('kept', '/tmp/kept', '/dev/shm/kept'):\n"
        "    if os.path.exists(name): print(open(name).read())\n"
        "print(globals().get('kept'))\nif 'shared' in globals(): print(shared[:20])\n"
        "try: print(os.read(r, 100))\nexcept (NameError, OSError): pass\n"
        "try: print(b.recv(100))\nexcept (NameError, OSError): pass"
    )
    run = execute(
        ("answer", carry, "def f(x): ..."),
        ("test", f"### BEGIN HIDDEN TESTS\nassert f({SECRET}) == {SECRET}\n### END HIDDEN TESTS"),
        ("plain", look),
        ("test", f"### BEGIN HIDDEN TESTS\nassert f({SECRET}) == {SECRET}\n### END HIDDEN TESTS"),
        ("plain", look),
    )
    assert run.scores == [2, 2], run.error()
    assert str(SECRET) not in run.text


def test_no_state_of_one_test_is_in_the_next(execute):
    """A function cannot learn in one test what it is asked in another."""
    run = execute(
        ("answer", "seen = []\ndef f(x):\n    seen.append(x)\n    return len(seen)", "def f(x): ..."),
        ("test", "assert f(1) == 1 and f(1) == 2"),
        ("test", "assert f(1) == 1"),
    )
    assert run.scores == [2, 2]


def test_the_test_cells_source_is_not_in_the_sandbox(execute):
    """No part of a test cell is in the history or memory that the submission can look through."""
    marker = "needle_in_the_test"
    run = execute(
        ("answer", ("import gc\ndef f(x):\n    return [s[:9] for s in gc.get_objects() if type(s) is str and 'needle_in' in s]"
                   "\ndef g(): return str(get_ipython().user_ns['In']).count('needle' + '_in_the')"), "def f(x): ..."),
        ("test", f"### BEGIN HIDDEN TESTS\n{marker} = 3\nassert f(1) == [] and g() == 0\n### END HIDDEN TESTS"),
    )  # fmt: skip
    assert run.scores == [2], run.error()


def test_forged_outputs_are_only_outputs(execute):
    """Printed protocol lines, forged results and patched displays in the submission's cells move no score."""
    run = execute(
        (
            "answer",
            (
                'print(\'{"output_type": "execute_result"}\')\nimport IPython\nip = get_ipython()\n'
                "ip.recorder.data('execute_result', {'text/plain': '2.0'}, {}, execution_count=1)\n"
                "ip.ast_transformers.append(type('T', (), {'visit': lambda s, n: n})())\n"
                "def f(x):\n    print(2.0)\n    ip.recorder.data('execute_result', {'text/plain': '2.0'}, {})\n    return 0"
            ),
            "def f(x): ...",
        ),
        ("test", "assert f(3) == 9"),
        ("test", "f(3)"),
    )
    assert run.scores == [0, 0]


@pytest.mark.parametrize("answer", ["{!r}", "[{!r}, 1]", "({!r},)", "np.array([{!r}])"])
def test_a_symbolic_answer_that_is_text_is_not_run_here(execute, tmp_path, answer):
    """Text comes to the grader as plain data; what it says is not evaluated there, where the gradebook is in reach."""
    ran = tmp_path / "ran"
    attack = f"__import__('pathlib').Path({str(ran)!r}).touch()"
    run = execute(
        ("given", "import numpy as np"),
        ("answer", f"g = {answer.format(attack)}", "g = None"),
        ("test", "from autograder.remote import evaluate\nassert evaluate(g, {'r': 2.0}) is not None"),
        ("test", 'from autograder import grade_expression\ngrade_expression("differential_drive.g", g, 2)'),
    )
    assert run.scores == [0, 0]
    assert run.error()[0] == "TypeError"
    assert not ran.exists()


def test_a_submission_does_not_start_programs_of_the_grader(execute):
    """A name that stands for a module is no request to import whatever is installed where tests run."""
    answer = "import types\nf = types.ModuleType('unittest.__main__')"
    run = execute(("answer", answer, "def f(x): ..."), ("test", "f(1)"), ("test", "assert True"))
    assert run.scores == [0, 2]
    assert "unittest.__main__" not in sys.modules
    assert run.error()[0] == "NameError"


def test_the_end_of_an_iteration_is_an_error(execute):
    """A call that raises StopIteration does not end the loop of a test before it has compared anything."""
    answer = ("answer", "def f(x):\n    raise StopIteration", "def f(x): ...")
    test = "for got, right in zip(map(f, [1, 2]), [1, 4]):\n    assert got == right"
    assert execute(answer, ("test", test)).scores == [0]


def test_cleaning_that_takes_too_long_is_left_to_a_person(execute, limits, monkeypatch):
    """Where what a cell shows keeps the grader busy for ever, its tests wait for a person, each with the reason."""
    monkeypatch.setattr(outputs, "clean", lambda _: time.sleep(60))
    short = replace(limits, notebook_cpu=0.2, wall_factor=1.0, wall_extra=1.0)
    run = execute(("answer", "f = 1", "f = 0"), ("test", "assert f"), limits=short)
    assert run.flags == ["the test itself did not come to an end"]
