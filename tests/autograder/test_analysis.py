"""Which names a cell binds, reads and deletes."""

from __future__ import annotations

import pytest

from autograder.analysis import BUILTINS, Names, analyse


def loads(source):
    """Return what a cell reads, builtins left out."""
    return set(analyse(source).loads - BUILTINS)


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("a + b", {"a", "b"}),
        ("def f(x, y=a):\n    z = x + b\n    return z", {"a", "b"}),
        ("lambda x: x + a", {"a"}),
        ("[x for x in xs if x > low]", {"xs", "low"}),
        ("class C(B):\n    k = a\n    def m(self):\n        return k2", {"B", "a", "k2"}),
        ("@deco\ndef f():\n    pass", {"deco"}),
        ("def f() -> T:\n    def g():\n        return deep\n    return g", {"T", "deep"}),
        ("f'{a:{w}}'", {"a", "w"}),
        ("a[i].b = c", {"a", "i", "c"}),
        ("assert f(3) == 9, message", {"f", "message"}),
        ("try:\n    f()\nexcept E as e:\n    print(e)", {"f", "E", "e"}),
        ("with open(p) as h:\n    h.read()", {"p", "h"}),
        ("if (n := f()) > 0:\n    n", {"f", "n"}),
        ("def f():\n    x = 1\n    def g():\n        return x\n    return g", set()),
    ],
)
def test_loads(source, expected):
    """What is read from outside is found in every construct; local variables are not names of the cell."""
    assert loads(source) == expected


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("a = b = 1", {"a", "b"}),
        ("a, (b, *c) = f()", {"a", "b", "c"}),
        ("for i in x:\n    j = i", {"i", "j"}),
        ("def f():\n    x = 1", {"f"}),
        ("def f():\n    global g\n    g = 1", {"f", "g"}),
        ("class C:\n    k = 1", {"C"}),
        ("import a.b, c as d\nfrom e import f as g, h", {"a", "d", "g", "h"}),
        ("n += 1", {"n"}),
        ("if (m := 3):\n    pass", {"m"}),
        ("with f() as h:\n    pass", {"h"}),
        ("x: int = 3", {"x"}),
        ("if c:\n    def f(): pass\nelse:\n    f = 1", {"f"}),
    ],
)
def test_stores(source, expected):
    """Every way to bind a global name is found."""
    assert set(analyse(source).stores) == expected


def test_deletes():
    """Names that are deleted are found; deleting an item or attribute deletes no name."""
    assert analyse("del f, g[0], h.x").deletes == {"f"}


def test_imports():
    """Imports at the top level are kept with where they lead; a relative or a star import leads nowhere."""
    source = "import numpy as np, os.path\nfrom math import sin as s, cos\nfrom x import *\ndef f():\n    import re"
    assert analyse(source).imports == {
        "np": ("numpy", None),
        "os": ("os", None),
        "s": ("math", "sin"),
        "cos": ("math", "cos"),
    }


def test_magics_are_no_error():
    """IPython's magics and shell lines do not hide the names around them."""
    names = analyse("%matplotlib inline\nfiles = !ls\ny = f(x)\nf?")
    assert {"f", "x"} <= names.loads
    assert {"y", "files"} <= names.stores


@pytest.mark.parametrize(
    "source",
    [
        "def f(:",
        "x = 'open",
        "\0",
        "(" * 5000,
        "a = " + "-" * 100_000 + "1",
        "é" * 3 + "\ud800",
        "",
        "a;" * 100_001,
        "%time 1\n" * 51,
    ],
)
def test_what_does_not_parse_has_no_names(source):
    """Broken, hostile or empty source has no names and raises nothing."""
    assert analyse(source) == Names()
