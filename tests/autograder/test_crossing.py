"""Tests of other courses that count on one program: what works in two all the same, and what waits for a person."""

# ruff: noqa: E501  (cells of a notebook are quoted as one line of text)

from __future__ import annotations

import random

import nbformat
import numpy as np
import pytest
from nbformat.v4 import new_code_cell, new_notebook
from temporary_course import ASSIGNMENT, NOTEBOOK, Course, cell, hidden, solution

from autograder.worker import randomness

DOG = "class Animal: pass\nclass Dog(Animal): pass"


@pytest.mark.parametrize(
    ("answer", "test", "reason"),
    [
        ("def f(): return int(input())", "input = lambda *_: '3'\nassert f() == 3", "builtin input"),
        ("def f(): return int(input())", "import sys, io\nsys.stdin = io.StringIO('3')\nassert f() == 3", "changes sys"),
        ("def f(): return int(input())", "import builtins\nsetattr(builtins, 'input', lambda *_: '3')\nassert f() == 3", "changes builtins"),
        ("def g(): return 1\ndef f(): return g()", "def g(): return 2\nassert f() == 2", "defines g anew"),
        ("def g(): return 1\ndef f(): return g()", "from unittest import mock\nwith mock.patch('__main__.g', return_value=2):\n    assert f() == 2", "replaces parts"),
        ("import os\ndef f(): return os.environ.get('HOME2')", "import os\nos.environ['HOME2'] = 'x'\nassert f() == 'x'", "changes os"),
        ("f = 4", "assert Out[1] == 4", "what cells have shown"),
        ("import warnings\ndef f(): warnings.warn('careful')", "import warnings\nwith warnings.catch_warnings(record=True) as w:\n    f()\nassert len(w) == 1", "warnings"),
        ("import matplotlib.pyplot as plt\ndef f(): plt.plot([1, 2])", "import matplotlib.pyplot as plt\nf()\nassert len(plt.gca().lines) == 1", "figures"),
        ("def f(): open('out.txt', 'w').write('3')", "f()\nassert open('out.txt').read() == '3'", "FileNotFoundError"),
        ("def f(): open('out.txt', 'w').write('3')", "import os\nf()\nassert os.path.exists('out.txt')", "looks for files"),
        ("f = 4", "import helpers_of_the_course\nassert f == 4", "ModuleNotFoundError"),
        (DOG, "assert issubclass(Dog, Animal)", "__subclasscheck__"),
        (DOG, "assert isinstance(Dog(), Animal)", "__instancecheck__"),
        (DOG, "assert Dog.__bases__", "__bases__"),
        (DOG, "class Cat(Animal): pass\nassert Cat()", "__mro_entries__"),
        ("class MyErr(Exception): pass\ndef f(): raise MyErr", "try:\n    f()\nexcept MyErr:\n    pass\nelse:\n    assert 0", "catches an exception"),
        ("class MyErr(Exception): pass\ndef f(): raise MyErr", "import unittest\nwith unittest.TestCase().assertRaises(MyErr):\n    f()", "sandbox"),
        ("def f(x: int = 2) -> int: return x", "import inspect\nassert inspect.signature(f).parameters['x'].default == 2", "isinstance"),
        ("from collections import namedtuple\nPose = namedtuple('Pose', 'x y')\ndef f(): return Pose(1, 2)", "assert f().x == 1", "type Pose"),
        ("from collections import Counter\ndef f(): return Counter('aab')", "assert f()['z'] == 0", "type Counter"),
    ],
)  # fmt: skip
def test_a_right_answer_is_never_a_silent_zero(execute, answer, test, reason):
    """What works in one program only is for a person where it fails in two, and the reason says what it is."""
    run = execute(("answer", answer, "f = ..."), ("test", test))
    assert reason in run.flags[0], (run.flags, run.error())


@pytest.mark.parametrize(
    ("answer", "test"),
    [
        ("import numpy as np\ndef f(): return np.random.rand(3)", "import numpy as np\nnp.random.seed(1)\nw = np.random.rand(4)\nnp.random.seed(1)\nassert (f() == w[:3]).all() and np.random.rand() == w[3]"),
        ("import random\ndef f(): return random.random()", "import random\nfor _ in range(2):\n    random.seed(5)\n    a = f(), f()\n    random.seed(5)\n    assert a == (random.random(), random.random())"),
        ("import numpy as np\nn = [0]\ndef f():\n    return np.random.rand()", "import numpy as np\nnp.random.seed(2)\nassert f() != f()"),
        ("from scipy.optimize import minimize\ndef f(): return minimize(lambda x: (x[0] - 2)**2, [0.0])", "r = f()\nassert r.success and abs(r.x[0] - 2) < 1e-4"),
        ("from collections import namedtuple\nPose = namedtuple('Pose', 'x y')\ndef f(): return Pose(1, 2)", "x, y = f()\nassert (x, y) == f() == (1, 2)"),
        ("def f(): print('hello')", "import contextlib, io\nwith contextlib.redirect_stdout(io.StringIO()) as s:\n    f()\nassert s.getvalue() == 'hello\\n'"),
    ],
    ids=["numpy's seed", "random's seed", "a stream goes on", "a solver's result", "a named tuple", "what is printed"],
)  # fmt: skip
def test_what_works_in_one_program_works_in_two(execute, answer, test):
    """The state of shared random generators goes to the submission and back, and attributes of results are asked."""
    run = execute(("given", "import numpy as np"), ("answer", answer, "f = ..."), ("test", test))
    assert (run.scores, run.flags) == ([2], [""]), run.error()


@pytest.mark.parametrize(
    ("answer", "test"),
    [
        ("def f(): return 2", "assert f() == 3"),
        ("def f(): return [1, 2]", "assert f().shape == (2,)"),
        ("def f(): return {}", "assert f()['x'] == 1"),
        ("def f(): return open('nothing.txt').read()", "assert f() == 3"),
        ("import nothing_of_that_name\ndef f(): return 3", "assert f() == 3"),
        ("x = 3\nx = x + 1\ndef f(): return x", "x = 5\nassert f() == 5"),
        ("import numpy as np\ndef f(): return np.random.rand() + 1", "import numpy as np\nnp.random.seed(1)\nassert f() < 1"),
        ("def f(): raise ModuleNotFoundError", "f()"),
    ],
)  # fmt: skip
def test_a_wrong_answer_is_no_work_for_a_person(execute, answer, test):
    """What fails for the submission's own reasons scores nothing, as before."""
    run = execute(("answer", answer, "f = ..."), ("test", test))
    assert (run.scores, run.flags) == ([0], [""]), run.error()


@pytest.mark.parametrize(
    "said",
    [
        None, [], [1] * 7, ["MT19937", b"", 0, 0, 0.0, [], None], ["PCG64", b"\0" * 2496, 0, 0, 0.0, [0] * 625, None],
        ["MT19937", b"\0" * 2496, 625, 0, 0.0, [0] * 625, None], ["MT19937", b"\0" * 2496, -1, 0, 0.0, [0] * 625, None],
        ["MT19937", b"\0" * 2496, 0, 2, 0.0, [0] * 625, None], ["MT19937", b"\0" * 2496, 0, 0, 0.0, [0] * 624 + [700], None],
        ["MT19937", b"\0" * 2496, 0, 0, 0.0, ["a"] * 624 + [0], None], ["MT19937", b"\0" * 2496, 0, 0, 0.0, [2**33] + [0] * 624, None],
        ["MT19937", b"\0" * 2496, 0, 0, 0.0, [0] * 625, "x"],
    ],
)  # fmt: skip
def test_a_forged_state_of_the_generators_is_refused(said):
    """What a submission's process says of them is a state or nothing: a place outside the buffer would be read."""
    before = randomness.states()
    with pytest.raises(ValueError, match="expected the state"):
        randomness.put(said)
    assert randomness.states() == before


def test_the_shared_generators_have_all_their_state():
    """Numbers that a generator keeps for its next answer are part of it, for both."""
    np.random.seed(3), random.seed(3)  # noqa: NPY002
    np.random.normal(), random.gauss(0, 1)  # noqa: NPY002
    kept = randomness.states()
    first = np.random.normal(), random.gauss(0, 1)  # noqa: NPY002
    randomness.put(kept)
    assert (np.random.normal(), random.gauss(0, 1)) == first  # noqa: NPY002


# ---------------------------------------------------------------- files beside the notebook

HELPERS = "def twice(x):\n    return 2 * x\n"
ANSWER = "def area(k):\n    return twice(sides[k]) + len(open('sides.csv').read())"
TEST = "import helpers, os\nassert area(1) == helpers.twice(np.loadtxt('sides.csv')[1]) + 6\nassert MORE == 8"


def beside_source():
    """Return a notebook whose given cell and test read and import what lies beside it."""
    test = {"grade": True, "locked": True}
    given = "import numpy as np\nfrom helpers import twice\nsides = np.loadtxt('sides.csv')\nMORE = twice(4)"
    return new_notebook(
        cells=[
            cell(new_code_cell, given, "given", locked=True),
            cell(new_code_cell, solution(ANSWER), "area", solution=True),
            cell(new_code_cell, hidden(TEST), "area-test", points=2, **test),
        ],
        metadata={"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}},
    )


@pytest.fixture(scope="module")
def beside(tmp_path_factory):
    """Make the course, and grade a right answer, a wrong one, one with helpers of its own, and one that deletes cells."""
    root = tmp_path_factory.mktemp("beside") / "course"
    folder = root / "source" / ASSIGNMENT
    folder.mkdir(parents=True)
    (folder / "helpers.py").write_text(HELPERS, encoding="utf-8")
    (folder / "sides.csv").write_text("1\n2\n3\n", encoding="utf-8")
    (root / "nbgrader_config.py").write_text("", encoding="utf-8")
    nbformat.write(beside_source(), folder / f"{NOTEBOOK}.ipynb")
    course = Course(root)
    with course.api() as api:
        assert api.generate_assignment(ASSIGNMENT)["success"]
    wrong = ANSWER.replace("twice(sides[k])", "0")
    for student, answer in {"right": ANSWER, "wrong": wrong, "own": wrong, "short": ANSWER}.items():
        notebook = course.released()
        notebook.cells[1].source = answer
        if student == "short":
            del notebook.cells[0]
        course.submit_file(student, nbformat.writes(notebook))
    course.submit_file("own", "import os\nos._exit(0)\n", "helpers.py")
    course.submit_file("own", "import os\nos._exit(0)\n", "os.py")
    course.grade()
    return course


def test_files_of_the_instructors_lie_beside_the_test(beside):
    """A test reads and imports what the release has beside the notebook, whatever a submission puts there."""
    found = {student: row["area-test"] for student, row in beside.rows().items()}
    assert found == {"right": (2, False), "wrong": (0, False), "own": (0, False), "short": (2, False)}


def test_nothing_of_them_is_left(beside):
    """Afterwards this process has neither the files nor the modules, and the course's folder is as it was."""
    assert not {"helpers.py", "sides.csv"} & {path.name for path in beside.root.iterdir()}
    assert not (beside.root / "source" / ASSIGNMENT / "__pycache__").exists()
