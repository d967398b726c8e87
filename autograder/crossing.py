"""Why a test that failed might pass where test and submission are one program.

The test cells of other courses may do what only works there: replace `input`, look at the figure a submission has drawn
or the file it has written. Such a test counts where it passes. Where it fails nobody can say whose fault it is, and a
person looks: never a silent 0 for a right answer.
"""

from __future__ import annotations

import ast
import functools
from typing import TYPE_CHECKING

from .analysis import BUILTINS, UNREADABLE, transformed

if TYPE_CHECKING:
    from collections.abc import Collection

_NAMES = {
    **dict.fromkeys(("Out", "In", "_oh", "_ih"), "reads what cells have shown"),
    **dict.fromkeys(
        ("catch_warnings", "simplefilter", "assert_warns", "assertWarns", "assertWarnsRegex", "warns"),
        "looks at warnings",
    ),
    **dict.fromkeys(("redirect_stderr", "assertLogs"), "looks at the error stream or the log"),
    **dict.fromkeys(("gca", "gcf", "get_fignums"), "looks at figures"),
    **dict.fromkeys(
        ("exists", "isfile", "isdir", "is_file", "is_dir", "listdir", "glob", "iterdir", "getsize"),
        "looks for files",
    ),
    **dict.fromkeys(("mock", "patch", "MagicMock", "Mock"), "replaces parts of a program"),
}
_SEEDS = frozenset({"seed", "set_state", "setstate"})


def _names(tree: ast.AST) -> set[str]:
    """Return all names and attributes that a program mentions, those of imports included."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Name):
            found.add(node.id)
        elif isinstance(node, ast.Attribute):
            found.add(node.attr)
        elif isinstance(node, ast.alias):
            found |= set(node.name.split("."))
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= set(node.module.split("."))
    return found


@functools.lru_cache(maxsize=1024)  # a class has the same tests
def _read(source: str) -> tuple[frozenset[str], frozenset[str], frozenset[str]]:
    """Return what a test cell mentions, what it changes a part of, and the functions and classes it defines."""
    try:
        tree = ast.parse(transformed(source))
    except UNREADABLE:
        return frozenset(), frozenset(), frozenset()
    changed = set()
    for node in ast.walk(tree):
        if isinstance(node, (ast.Attribute, ast.Subscript)) and isinstance(node.ctx, (ast.Store, ast.Del)):
            root: ast.expr = node
            while isinstance(root, (ast.Attribute, ast.Subscript)):
                root = root.value
            if isinstance(root, ast.Name):
                changed.add(root.id)
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "setattr":
            changed |= {argument.id for argument in node.args[:1] if isinstance(argument, ast.Name)}
    defined = {
        node.name
        for node in tree.body
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef))
    }
    return frozenset(_names(tree)), frozenset(changed), frozenset(defined)


def seeds(source: str) -> bool:
    r"""Return whether a test cell may set the state of the generators that all of a program shares.

    Examples
    --------
    >>> seeds("np.random.seed(1)\nassert draw() > 0")
    True
    """
    return not _SEEDS.isdisjoint(_read(source)[0])


def out_of_reach(
    source: str, stores: Collection[str], modules: Collection[str], theirs: Collection[str]
) -> str:
    r"""Say what of a test the submission does not see, or what of the submission does not come back.

    Parameters
    ----------
    source : str
        The test cell.
    stores : collection of str
        The names it binds.
    modules : collection of str
        The names it has for modules.
    theirs : collection of str
        Names that the submission binds and reads.

    Returns
    -------
    str
        For a person; empty where there is nothing of that kind.

    Examples
    --------
    >>> out_of_reach("sys.stdin = io.StringIO('3')\nassert ask() == 3", (), {"sys", "io"}, ())
    'the test changes sys, and the submission runs elsewhere'
    >>> out_of_reach("assert square(3) == 9", (), (), ())
    ''
    """
    mentioned, changed, defined = _read(source)
    for name in sorted(mentioned & _NAMES.keys()):
        return f"the test {_NAMES[name]} ({name}), and the submission runs elsewhere"
    for name in sorted(changed & set(modules)):
        return f"the test changes {name}, and the submission runs elsewhere"
    for name in sorted(BUILTINS & set(stores)):
        return f"the test replaces the builtin {name}, and the submission runs elsewhere"
    for name in sorted(defined & set(theirs)):
        return f"the test defines {name} anew, and the submission's functions go on with their own"
    return ""


def out_of_place(error: BaseException | None, cast: Collection[str]) -> str:
    """Say why an exception that ended a test may come from where the test runs.

    Parameters
    ----------
    error : BaseException or None
        What ended it.
    cast : collection of str
        The classes of what came back as plain data.

    Returns
    -------
    str
        For a person; empty where there is no such reason.

    Examples
    --------
    >>> out_of_place(FileNotFoundError(2, "No such file or directory", "path.csv"), ())
    "the test itself failed with FileNotFoundError: [Errno 2] No such file or directory: 'path.csv'"
    >>> out_of_place(AttributeError("'tuple' object has no attribute 'theta'"), {"Pose"})
    'an object of type Pose crosses as plain data, and the test may need more of it'
    """
    if error is None or hasattr(error, "line"):  # the submission's own: see `remote.rebuild_exception`
        return ""
    if isinstance(error, (OSError, ImportError, EOFError)):
        return f"the test itself failed with {type(error).__name__}: {error}"
    if isinstance(error, TypeError) and "catching classes" in str(error):
        return "the test catches an exception of a class that stays in the sandbox"
    if cast and isinstance(error, (AttributeError, KeyError, TypeError)):
        return f"an object of type {min(cast)} crosses as plain data, and the test may need more of it"
    return ""
