"""Loops in a student's function, found in its text: in its own lines and in all that it calls of the student's.

Some loops show in the number of lines that run, and there a loop over the lines of a map is as good as none: those are
named and left to the count (`autograder.worker.lines`). Some do not: `map` of a function of NumPy's, `sum` over an
array, an array of objects go from particle to particle without a line of Python. And some go over particles as plainly
as can be. These are refused by reading, unless what they go over is as plainly something else: see `lengths`.
"""

from __future__ import annotations

import ast
import builtins
from typing import TYPE_CHECKING, NamedTuple

from .lengths import COMPREHENSIONS, FUNCTIONS, Length, Scope, library
from .reading import TOOLS, Reading, Unreadable, safe

if TYPE_CHECKING:
    from collections.abc import Sequence

# Python's loops inside libraries, by the last part of their name, and those that builtins are.
_LOOPING = frozenset(
    {
        "vectorize", "apply_along_axis", "apply_over_axes", "fromiter", "frompyfunc", "nditer", "ndenumerate",
        "ndindex", "nested_iters",
    }
)  # fmt: skip
_CONSUMING = frozenset(["map", "filter", "sum", "any", "all", "min", "max", "sorted"])
_CONSUMING_FULL = frozenset(
    {"functools.reduce", "math.fsum", "math.prod", "math.sumprod", "collections.Counter"}
)
_CLOSED = frozenset({"ctypeslib", "f2py", "LowLevelCallable", "load", "memmap", "lib", "_core", "core"})
_HARMLESS = frozenset(
    name for name in dir(builtins) if not name.startswith("_")
) - TOOLS - {"compile", "help", "exit", "quit", "object", "memoryview"}  # fmt: skip


class Loop(NamedTuple):
    """A loop in the text: its line in its cell, what it is, and whether it is refused by reading alone."""

    line: int
    what: str
    refused: bool


def find(sources: Sequence[tuple[str, bool]], name: str, clouds: dict[int, int]) -> tuple[Loop, ...]:
    r"""Find the loops of a function.

    Parameters
    ----------
    sources : sequence of tuple of (str, bool)
        The cells: see `remote.sources_of`.
    name : str
        The function.
    clouds : dict of int to int
        The arguments whose first axis is the particles, by position, with their number of axes.

    Returns
    -------
    tuple of Loop
        In the order of reading.

    Raises
    ------
    Unreadable
        If the text does not say what runs.

    Examples
    --------
    >>> cell = "def f(xs):\n    return [x + 1 for x in xs]"
    >>> find([(cell, False)], "f", {0: 1})
    (Loop(line=2, what='a comprehension over the particles', refused=True),)
    """
    reader = _Reader(Reading(sources))
    found = reader.reading.of(name)
    if not found:
        raise Unreadable(f"no cell defines {safe(name)}")
    for binding in found:
        if not isinstance(binding.node, ast.FunctionDef):
            raise Unreadable(f"{safe(name)} is not defined by a plain def")
        reader.function(binding.node, clouds)
    return tuple(dict.fromkeys(reader.loops))


class _Reader:
    """Reads a function and what it reaches, each once."""

    def __init__(self, reading: Reading) -> None:
        self.reading = reading
        self.loops: list[Loop] = []
        self.seen: set[int] = set()
        self.open: list[str] = []
        self.called: set[int] = set()  # names that stand where they are called

    def function(self, node: ast.AST, clouds: dict[int, int] | None = None) -> None:
        """Read a definition from a cell; arguments of helpers are of unknown length."""
        if id(node) in self.seen:
            return
        self.seen.add(id(node))
        name = getattr(node, "name", "")
        self.open.append(name)
        scope = _Scope(self, None)
        if isinstance(node, ast.FunctionDef) and clouds is not None:
            scope.define(node, clouds)
        else:
            scope.read(node)
        self.open.pop()

    def name(self, name: str, line: int) -> str:
        """Follow a global name; return its full name where it is imported, or a builtin."""
        if name in self.open:
            self.loops.append(Loop(line, f"{safe(name)} calls itself", refused=False))
            return ""
        found = self.reading.of(name)
        if not found:
            if name not in _HARMLESS:
                raise Unreadable(
                    f"the function uses {safe(name)}, and no cell before the test says what it is"
                )
            return f"builtins.{name}"
        for binding in found:
            if binding.node is not None:
                self.function(binding.node)
        return library(found)

    def add(self, node: ast.AST, what: str, length: Length, *, hidden: bool = False) -> None:
        """Note a loop over something of a length."""
        over = {Length.CLOUD: " over the particles", Length.SMALL: " over something else"}.get(length, "")
        refused = length is Length.CLOUD or (hidden and length is not Length.SMALL)
        if length is not Length.SMALL:
            self.loops.append(Loop(getattr(node, "lineno", 0), what + over, refused))


class _Scope(Scope):
    """One function's names, and the loops in it."""

    def __init__(self, reader: _Reader, outer: _Scope | None) -> None:
        super().__init__(outer)
        self.reader = reader

    def full(self, node: ast.AST) -> str:
        """Return the full name of a part of a library or a builtin; empty for anything else."""
        if isinstance(node, ast.Attribute):
            root = self.full(node.value)
            return f"{root}.{node.attr}" if root and not root.startswith("builtins.") else ""
        if not isinstance(node, ast.Name):
            return ""
        home = self.look_up(node.id)
        if home:
            return home.known.get(node.id, "")
        return self.reader.name(node.id, node.lineno)

    def define(self, node: ast.AST, clouds: dict[int, int]) -> None:
        """Read a function in a scope of its own."""
        inner = _Scope(self.reader, self)
        arguments = [*node.args.posonlyargs, *node.args.args]
        for place, argument in enumerate(arguments):
            inner.lengths[argument.arg] = Length.UNKNOWN if not clouds else Length.SMALL
            if place in clouds:
                inner.lengths[argument.arg] = Length.CLOUD
                inner.axes[argument.arg] = clouds[place]
        for argument in [node.args.vararg, *node.args.kwonlyargs, node.args.kwarg]:
            if argument:
                inner.lengths[argument.arg] = Length.UNKNOWN
        for part in [*node.args.defaults, *filter(None, node.args.kw_defaults)]:
            self.read(part)
        for part in getattr(node, "decorator_list", ()):
            self.read(part)
        body = node.body if isinstance(node.body, list) else [node.body]
        inner.bind(body)
        for part in body:
            inner.read(part)

    # loops

    def read(self, node: ast.AST) -> None:  # noqa: C901  (one branch for each kind of node)
        """Find the loops in a statement or expression."""
        if isinstance(node, FUNCTIONS):
            self.reader.open.append(getattr(node, "name", ""))
            self.define(node, {})
            self.reader.open.pop()
            return
        if isinstance(node, ast.ClassDef):
            _Scope(self.reader, self).read_class(node)
            return
        if isinstance(node, COMPREHENSIONS):
            inner = _Scope(self.reader, self)
            inner.bind(list(node.generators))
            for part in node.generators:
                self.reader.add(node, "a comprehension", inner.length(part.iter))
            for part in ast.iter_child_nodes(node):
                inner.read(part)
            return
        if isinstance(node, (ast.For, ast.AsyncFor)):
            self.reader.add(node, "a for loop", self.length(node.iter))
        elif isinstance(node, ast.While):
            self.reader.add(node, "a while loop", Length.UNKNOWN)
        elif isinstance(node, ast.Call):
            self.call(node)
        elif isinstance(node, ast.Constant) and node.value in ("O", "object"):
            self.reader.add(
                node, "an array of objects, whose arithmetic is a loop", Length.UNKNOWN, hidden=True
            )
        elif isinstance(node, (ast.Name, ast.Attribute)) and isinstance(node.ctx, ast.Load):
            self.mention(node)
            if isinstance(node, ast.Attribute) and not self.full(node):
                self.read(node.value)
            return
        for part in ast.iter_child_nodes(node):
            self.read(part)

    def read_class(self, node: ast.ClassDef) -> None:
        """Read all methods of a class: which of them runs, the text does not tell."""
        for part in ast.iter_child_nodes(node):
            self.read(part)

    def call(self, node: ast.Call) -> None:
        """Judge the call of a loop that shows no lines."""
        full = self.full(node.func) if isinstance(node.func, (ast.Name, ast.Attribute)) else ""
        name = full.rpartition(".")[2]
        if not _is_consuming(full):
            return
        self.reader.called.add(id(node.func))
        over = node.args[1:] if name in {"map", "filter", "reduce"} else node.args
        if name in {"min", "max"} and len(over) > 1:
            return
        for part in over:
            if not isinstance(part, COMPREHENSIONS):  # a comprehension is judged where it stands
                self.reader.add(
                    node, f"{name}, which goes from item to item in Python", self.length(part), hidden=True
                )

    def mention(self, node: ast.AST) -> None:
        """Judge a name of a library or a builtin, however it is used."""
        full = self.full(node)
        if _is_consuming(full) and id(node) not in self.reader.called:
            what = f"{full.rpartition('.')[2]} under another name"
            self.reader.add(node, what, Length.UNKNOWN, hidden=True)
        root, _, rest = full.partition(".")
        parts = rest.split(".") if rest else []
        if root in {"numpy", "scipy"} and _CLOSED & set(parts):
            raise Unreadable(f"the function uses {safe(parts[-1])}, which the grader does not read")
        if root == "itertools" or (parts and parts[-1] in _LOOPING):
            what = f"{safe(parts[-1]) if parts else root}, which is a loop in Python"
            self.reader.add(node, what, Length.UNKNOWN, hidden=True)
        if full in {"builtins.object", "numpy.object_"}:
            self.reader.add(
                node, "an array of objects, whose arithmetic is a loop", Length.UNKNOWN, hidden=True
            )


def _is_consuming(full: str) -> bool:
    root, _, name = full.rpartition(".")
    return (root == "builtins" and name in _CONSUMING) or full in _CONSUMING_FULL
