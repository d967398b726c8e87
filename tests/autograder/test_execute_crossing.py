"""Executing a notebook in two places: what crosses between a test cell and the submission, and as what."""

# ruff: noqa: E501  (cells of a notebook are quoted as one line of text)

from __future__ import annotations


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
