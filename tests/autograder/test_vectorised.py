"""Extra credit for loops removed: no disguise of a loop earns it, every way of doing without does."""

# ruff: noqa: E501  (cells of a notebook are quoted as one line of text)

import threading

import numpy as np
import pytest

from autograder import grading, vectorised
from autograder.check import Check, Stage
from autograder.checks.kinds import each
from autograder.loops import find
from autograder.reading import Unreadable
from autograder.roles import EXTRA
from autograder.worker.lines import count

HEAD = "import functools\nimport itertools\nimport numpy as np\nimport sys\n"
LINES = np.array([[0.0, 1.5, 3.0], [2.0, 2.5, 3.0]])


def clouds(M):
    """Return arguments for M particles."""
    rng = np.random.default_rng(M)
    return rng.normal(size=(M, 3)), LINES, 0.1


def distances(xs, map_lines, shift):
    """Return the distance of every line from every particle, (M, J), shifted."""
    x, y, _ = xs.T
    alpha, r = map_lines
    return r - np.outer(x, np.cos(alpha)) - np.outer(y, np.sin(alpha)) + shift


def make():
    """Return a stage with one check."""
    stage = Stage(
        "test.distances", ("d",), distances, lambda *args: np.full((len(args[0]), 3), 1e-9), (), many=clouds
    )
    check = Check("right", 1, each(lambda rng: (stage.case(rng.normal(size=(20, 3)), LINES, rng.random()),)))
    return Stage(**{**stage.__dict__, "checks": (check,)})


@pytest.fixture(autouse=True)
def stage(monkeypatch):
    """Know the stage of these tests."""
    monkeypatch.setitem(vectorised.STAGES, "test.distances", make())


def earned(execute, *cells):
    """Return what a submission earns and what is said of it."""
    stub = "def distances(xs, map_lines, shift):\n    ..."
    *before, own = cells
    test = "from autograder import grade_vectorised\ngrade_vectorised('test.distances', distances, extra=2)"
    with grading.grading_run(secret="a course"):  # noqa: S106
        run = execute(*(("plain", cell) for cell in before), ("answer", own, stub), ("test", test))
    assert run.flags == [""]
    (cell,) = run.tests
    (shown,) = [output for output in cell.outputs if output.output_type == "display_data"]
    (result,) = [output for output in cell.outputs if output.output_type == "execute_result"]
    assert result.data["text/plain"] == "0"
    return shown.data[EXTRA]["earned"], shown.data["text/plain"]


ONE = "def one(p, m, s):\n    return m[1] - p[0] * np.cos(m[0]) - p[1] * np.sin(m[0]) + s\n"
DEF = "def distances(xs, map_lines, shift):\n    "
LOOPS = {
    "for": "out = []\n    for p in xs:\n        out.append(one(p, map_lines, shift))\n    return np.array(out)",
    "index": "out = np.empty((len(xs), 3))\n    for i in range(xs.shape[0]):\n        out[i] = one(xs[i], map_lines, shift)\n    return out",
    "hidden count": "M, _ = (xs * 1).shape\n    out = np.empty((M, 3))\n    for i in np.arange(M):\n        out[i] = one(xs[i], map_lines, shift)\n    return out",
    "while": "out = np.empty((len(xs), 3))\n    i = 0\n    while i < len(out):\n        out[i] = one(xs[i], map_lines, shift)\n        i += 1\n    return out",
    "list comprehension": "return np.array([one(p, map_lines, shift) for p in xs])",
    "generator": "return np.stack(tuple(one(p, map_lines, shift) for p in list(xs)))",
    "map": "return np.array(list(map(lambda p: one(p, map_lines, shift), xs)))",
    "map of a library function": "c = np.array(list(map(np.cos, xs[:, 0])))\n    x, y, _ = xs.T\n    a, r = map_lines\n    return r - np.outer(x, np.cos(a)) - np.outer(y, np.sin(a)) + shift",
    "map by another name": "m = map\n    c = list(m(np.cos, xs[:, 0]))\n    x, y, _ = xs.T\n    a, r = map_lines\n    return r - np.outer(x, np.cos(a)) - np.outer(y, np.sin(a)) + shift",
    "filter": "list(filter(None, xs[:, 0]))\n    x, y, _ = xs.T\n    a, r = map_lines\n    return r - np.outer(x, np.cos(a)) - np.outer(y, np.sin(a)) + shift",
    "sum": "sum(xs)\n    x, y, _ = xs.T\n    a, r = map_lines\n    return r - np.outer(x, np.cos(a)) - np.outer(y, np.sin(a)) + shift",
    "reduce": "return functools.reduce(lambda a, p: np.vstack([a, one(p, map_lines, shift)]), xs, np.empty((0, 3)))",
    "itertools": "return np.array(list(itertools.starmap(lambda *p: one(p, map_lines, shift), xs)))",
    "vectorize": "f = np.vectorize(lambda x, y: one((x, y), map_lines, shift), signature='(),()->(n)')\n    return f(xs[:, 0], xs[:, 1])",
    "apply_along_axis": "return np.apply_along_axis(one, 1, xs, map_lines, shift)",
    "fromiter": "return np.fromiter((v for p in xs for v in one(p, map_lines, shift)), float).reshape(-1, 3)",
    "frompyfunc": "f = np.frompyfunc(lambda x, y, a, r: one((x, y), (a, r), shift), 4, 1)\n    return f(xs[:, :1], xs[:, 1:2], *map_lines).astype(float)",
    "objects": "x, y, _ = xs.astype(object).T\n    a, r = map_lines\n    return (r - np.outer(x, np.cos(a)) - np.outer(y, np.sin(a)) + shift).astype(float)",
    "recursion": "if len(xs) == 1:\n        return one(xs[0], map_lines, shift)[None]\n    h = len(xs) // 2\n    return np.vstack([distances(xs[:h], map_lines, shift), distances(xs[h:], map_lines, shift)])",
    "a helper": "return helper(xs, map_lines, shift)",
    "a class": "return Helper()(xs, map_lines, shift)",
    "a lambda in a name": "return go(xs, map_lines, shift)",
    "tracing off": "sys.settrace(None)\n    return np.array([one(p, map_lines, shift) for p in xs])",
    "a string": "place = dict(xs=xs, m=map_lines, s=shift, one=one, np=np)\n    exec('out = np.array([one(p, m, s) for p in xs])', place)\n    return place['out']",
    "a name from nowhere": "return getattr(np, 'apply_along' + '_axis')(one, 1, xs, map_lines, shift)",
    "as many lines for any cloud": "out = np.empty((len(xs), 3))\n    for i in range(9000):\n        if i < len(out):\n            out[i] = one(xs[i], map_lines, shift)\n    return out if len(out) < 9000 else one(xs.T[..., None], map_lines[:, None], shift)",
}
HELPERS = (
    ONE
    + "def helper(xs, m, s):\n    return np.array([one(p, m, s) for p in xs])\n"
    + "class Helper:\n    def __call__(self, xs, m, s):\n        return np.array([one(p, m, s) for p in xs])\n"
    + "go = lambda xs, m, s: np.array([one(p, m, s) for p in xs])\n"
)
WITHOUT = {
    "outer": "x, y, _ = xs.T\n    a, r = map_lines\n    return r - np.outer(x, np.cos(a)) - np.outer(y, np.sin(a)) + shift",
    "broadcasting": "return map_lines[1] - xs[:, :1] * np.cos(map_lines[0]) - xs[:, 1:2] * np.sin(map_lines[0]) + shift",
    "einsum": "n = np.array([np.cos(map_lines[0]), np.sin(map_lines[0])])\n    return map_lines[1] + shift - np.einsum('mk,kj->mj', xs[:, :2], n)",
    "product": "n = np.array([f(map_lines[0]) for f in (np.cos, np.sin)])\n    return map_lines[1] + shift - xs[:, :2] @ n",
    "complex": "z = xs[:, 0] + 1j * xs[:, 1]\n    return map_lines[1] + shift - (z[:, None] * np.exp(-1j * map_lines[0])).real",
    "a list": "a, r = map_lines\n    return (r - np.outer(xs[:, 0], np.cos(a)) - np.outer(xs[:, 1], np.sin(a)) + shift).tolist()",
    "over lines": "J = map_lines.shape[1]\n    out = np.empty((xs.shape[0], J))\n    for j in range(J):\n        out[:, j] = one(xs.T, map_lines[:, j], shift)\n    return out",
    "comprehension over lines": "return np.stack([one(xs.T, m, shift) for m in map_lines.T], axis=1)",
    "lines by a map": "return np.stack(list(map(lambda m: one(xs.T, m, shift), map_lines.T)), axis=1)",
    "a sum over two axes": "n = [np.cos(map_lines[0]), np.sin(map_lines[0])]\n    return map_lines[1] + shift - sum(np.outer(xs[:, k], n[k]) for k in range(2))",
    "a helper": "return one(xs.T[..., None], map_lines[:, None], shift)",
    "an import inside": "import numpy\n    a, r = map_lines\n    return r + shift - numpy.tensordot(xs[:, :2], numpy.stack([numpy.cos(a), numpy.sin(a)]), 1)",
}


@pytest.mark.parametrize("name", LOOPS)
def test_a_loop_in_any_disguise_earns_nothing(execute, name):
    """Each way of going from particle to particle is right in its result, and earns 0, said without reproach."""
    got, said = earned(execute, HEAD + HELPERS, DEF + LOOPS[name])
    assert got == 0
    assert "0 of 2 extra points" in said
    assert "The points of the stage itself are not touched by this." in said
    assert "passes every check" not in said


@pytest.mark.parametrize("name", WITHOUT)
def test_every_way_without_earns_all(execute, name):
    """Whole arrays, products, complex numbers, and loops over the lines of the map earn all."""
    got, said = earned(execute, HEAD + ONE, DEF + WITHOUT[name])
    assert got == 2, said
    assert "1000 particles took" in said


def text_of(body, *before):
    """Return what reading finds in a function, without running it."""
    cells = [(HEAD + ONE, False), *((cell, False) for cell in before), (DEF + body, False)]
    return find(cells, "distances", {0: 2})


@pytest.mark.parametrize(
    ("before", "word"),
    [
        ("sys.settrace(None)", "settrace"),
        ("np.cos = lambda a: a", "part of a library"),
        ("np.cos.__code__ = None", "__code__"),
        ("sys.modules['roboloc'] = None", "modules"),
        ("import threading", "threading"),
        ("from unittest import mock", "unittest"),
        ("setattr(np, 'cos', abs)", "setattr"),
        ("exec('x = 1')", "exec"),
        ("%run other.py", "magic command"),
        ("!pip install other", "command of the system"),
        ("%time exec('x = 1')", "exec"),
        ("__builtins__.eval('1')", "eval"),
        ("other = __builtins__", "__builtins__"),
        ("print.eval('1')", "eval"),
        ("import sympy", "sympy"),
        ("from helper import go", "helper"),
        ("import sys\nsys._getframe()", "_getframe"),
        ("np.testing.runstring('1', {})", "runstring"),
        ("from numpy.testing import runstring", "runstring"),
        ("from IPython import get_ipython", "IPython"),
        ("get_ipython().ev('1')", "ev"),
        ("shell = get_ipython()", "get_ipython"),
        ("get_ipython().run_cell_magic('time', '', np)", "magic command"),
        ("a;" * 100_001, "too long"),
    ],
)
def test_what_can_change_other_code_is_refused(before, word):
    """One such cell anywhere before the test, and the text no longer says what runs."""
    with pytest.raises(Unreadable, match=word):
        text_of(WITHOUT["outer"], before)


@pytest.mark.parametrize(
    ("before", "word"),
    [
        ("from numpy import *", "import"),
        ("with open('f') as other: pass", "open"),
        ("for other in (abs,): pass", "depends on how the cells ran"),
        ("def f():\n    global other\n    other = abs", "depends on how the cells ran"),
        ("import pandas as other", "pandas"),
        ("pass", "no cell before the test says"),
    ],
)
def test_a_name_that_the_text_does_not_explain_is_refused(before, word):
    """Loops over names, names of other functions, libraries that are not read, and names of nothing."""
    with pytest.raises(Unreadable, match=word):
        text_of("return other(xs)", before)


@pytest.mark.parametrize(
    "before",
    [
        "%matplotlib inline",
        "%%time\nx = 3",
        "import matplotlib.pyplot as plt\nplt.rcParams['figure.dpi'] = 80\nfig, ax = plt.subplots()\nax.title.x = 3",
        "for i in range(3):\n    print(i)",
        "not python",
        "def distances(xs, map_lines, shift):\n    return [x for x in xs]",
        "class Particle:\n    def __init__(self, x):\n        self.x = x",
    ],
)
def test_honest_cells_do_not_matter(before):
    """Plots, times, loops elsewhere, a cell that does not parse, and an earlier attempt cost nothing."""
    assert text_of(WITHOUT["outer"], before) == ()


def test_all_that_a_name_may_stand_for_is_read():
    """A definition that may not have run counts with the one before it; a later one takes its place."""
    loop, plain = (f"def other(xs):\n    return {text}" for text in ("[x for x in xs]", "xs"))
    assert text_of("return other(xs)", loop, plain) == ()
    indented = "if xs is None:\n    " + plain.replace("\n", "\n    ")
    assert text_of("return other(xs)", loop, indented)
    assert text_of("return other(xs)", f"{loop}\nother += 1")
    assert text_of("f = other\n    return f(xs)", loop)


@pytest.mark.parametrize(
    ("body", "refused"),
    [
        ("M = len(xs)\n    return [m for m in range(M)]", [True]),
        ("M, k = xs.shape\n    return [m for m in range(M)], [j for j in range(k)]", [True]),
        ("return [m for m in range(xs.shape[0])], [j for j in range(xs.shape[-1])]", [True]),
        ("return [m for m in range(xs.shape[-2])]", [True]),
        ("return [x for x, m in zip(xs, map_lines)]", []),
        ("return [x for x in xs.T]", [False]),
        ("xs = xs.T\n    return [x for x in xs]", [False]),
        ("return [x for x in xs.tolist()]", [True]),
        ("for i, x in enumerate(xs):\n        pass", [True]),
        ("def f(k):\n        return [a for a in k]\n    return f(xs)", [False]),
        ("return min(xs[:, 0]), max(0.1, shift)", [True]),
        ("return np.sum(xs), xs.sum(), xs.max(), np.add.reduce(xs)", []),
        ("map = map_lines\n    return map[0]", []),
        ("f = [sum][0]\n    return f(xs)", [True]),
        ("return np.array(xs, dtype='O')", [True]),
        ("@np.vectorize\n    def f(x):\n        return x\n    return f(xs)", [True]),
        ("def f(x, g=map):\n        return g\n    return f(xs)", [True]),
    ],
)
def test_what_a_loop_goes_over(body, refused):
    """Loops that certainly go over particles are refused by reading, those over lines left out, others left to count."""
    assert [loop.refused for loop in text_of(body)] == refused


def test_hostile_counting_earns_nothing(execute):
    """A submission that takes the worker's counting over is refused by its text, whatever count comes back."""
    cell = "for name, module in list(sys.modules.items()):\n    if name.endswith('worker.lines'):\n        module.count = lambda f, a, most, watched: (3, f(*a))"
    got, said = earned(execute, HEAD + ONE, cell, DEF + LOOPS["hidden count"])
    assert got == 0
    assert "took 3 lines of Python" in said
    assert "a cell uses modules" in said


@pytest.mark.parametrize(
    "body",
    [
        "sys.settrace(None)",
        "t = sys.gettrace()\n    sys.settrace(None)\n    sys.settrace(t)",
        "import os\n    os.fork() or os._exit(0)",
    ],
)
def test_a_count_that_was_disturbed_is_none(execute, body):
    """The worker notices who sets a tracer, also one that puts it back, or starts a process."""
    got, said = earned(execute, HEAD + ONE, DEF + body + "\n    " + WITHOUT["outer"])
    assert got == 0
    assert "something else used Python's tracing, a thread or a process" in said


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ("raise NotImplementedError", "not written yet"),
        ("return np.zeros((len(xs), 3))", "another result than it should"),
        ("if len(xs) > 500:\n        return None\n    " + LOOPS["for"], "another result than it should"),
        (
            "if len(xs) < 500:\n        return None\n    " + WITHOUT["outer"],
            "passes every check of its stage",
        ),
        ("while True:\n        pass", "goes from particle to particle"),
        ("x = 2\n    while True:\n        x = x ** x ** x", "used more time"),
    ],
)
def test_only_a_right_function_earns(execute, body, words):
    """A function that is not written, wrong, wrong for many or for few, or that does not end, earns nothing."""
    got, said = earned(execute, HEAD + ONE, DEF + body)
    assert got == 0
    assert words in said


def test_a_function_that_is_here_is_judged_as_well():
    """Without a sandbox the text comes from the notebook that runs, or from the file."""
    with grading.grading_run(secret="a course"):  # noqa: S106
        for body, reason in ((WITHOUT["outer"], []), (LOOPS["for"], ["Line 3 of a cell: a for loop over the particles."])):  # fmt: skip
            space = {"In": ["", HEAD + ONE, DEF + body]}
            for cell in space["In"]:
                exec(cell, space)  # noqa: S102
            assert vectorised.judged(make(), space["distances"])[0][1:] == reason


def test_lines_of_threads_count():
    """What a call does in threads of its own counts as what it does itself."""

    def work(numbers):
        for _ in numbers:
            pass

    def call(size):
        thread = threading.Thread(target=work, args=(range(size),))
        thread.start()
        thread.join()

    few, many = (count(call, [size], 10_000)[0] for size in (10, 1000))
    assert many - few > 900


def test_a_wrong_request_is_the_instructors_error():
    """A stage that is not there or not on particles, and points that are none, are refused."""
    for name, extra in (
        ("none", 1),
        ("motion.compute_dynamics", 1),
        ("test.distances", 0),
        ("test.distances", "1"),
    ):
        with pytest.raises(ValueError, match=r"stage: expected|extra: expected"):
            vectorised.grade_vectorised(name, distances, extra)
