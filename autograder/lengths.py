"""How long things are in a function's text: as many as the particles, certainly not, or not known.

Each name of a function is followed from its arguments through its assignments, without their order: a name that stands
for two things of unlike length is of unknown length. Nothing is run.
"""

from __future__ import annotations

import ast
from enum import IntEnum
from typing import TYPE_CHECKING

from .reading import Binding, Unreadable, imports, safe, stored

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

_LIBRARIES = frozenset(
    {
        "numpy", "scipy", "math", "cmath", "roboloc", "functools", "operator", "warnings", "typing", "collections",
        "dataclasses", "numbers", "itertools", "__future__",
    }
)  # fmt: skip
_SAME_LENGTH = frozenset(
    ["range", "enumerate", "reversed", "list", "tuple", "iter", "arange", "array", "asarray"]
)
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)
COMPREHENSIONS = (ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)


class Length(IntEnum):
    """How often one who goes over a value goes round."""

    SMALL = 0
    UNKNOWN = 1
    CLOUD = 2


def library(found: Iterable[Binding]) -> str:
    """Return the full name of what is imported; empty where it is none, or several.

    Raises
    ------
    Unreadable
        If it is of a library that is not read.
    """
    found = list(found)
    names = {binding.imported for binding in found if binding.imported}
    for name in names:
        if name.partition(".")[0] not in _LIBRARIES:
            raise Unreadable(
                f"the function uses {safe(name.partition('.')[0])}, which the grader does not read"
            )
    return next(iter(names)) if len(names) == 1 == len(found) else ""


class Scope:
    """The names of one function: which are its own, and how long each is.

    Parameters
    ----------
    outer : Scope or None
        The function around it.
    """

    def __init__(self, outer: Scope | None) -> None:
        self.outer = outer
        self.lengths: dict[str, Length] = {}
        self.axes: dict[str, int] = {}  # number of axes of the arguments that are clouds
        self.known: dict[str, str] = {}  # full names of what is imported here

    def look_up(self, name: str) -> Scope | None:
        """Return the scope that a name belongs to; None for a global one."""
        if name in self.lengths:
            return self
        return self.outer.look_up(name) if self.outer else None

    def bind(self, body: list[ast.AST]) -> None:
        """Find the names that statements bind, and their lengths, until nothing changes."""
        statements = [node for part in body for node in _own(part)]
        for node in statements:
            if isinstance(node, (*FUNCTIONS, ast.ClassDef)) and hasattr(node, "name"):
                self.lengths[node.name] = Length.UNKNOWN
            elif isinstance(node, (ast.Import, ast.ImportFrom)):
                for name, full in imports(node):
                    self.lengths[name] = Length.SMALL
                    self.known[name] = full
                    library([Binding(imported=full)])
        self.settle([pair for node in statements for pair in self.targets(node)])

    def settle(self, targets: list[tuple[str, Callable[[], Length]]]) -> None:
        """Find lengths that agree with all assignments; from turn to turn they only grow."""
        first = set(self.lengths)
        for name in {name for name, _ in targets} - first:
            self.lengths[name] = Length.SMALL
        given = dict(self.lengths)
        new = set(given) - first
        for turn in range(len(targets) + 2):
            before = dict(self.lengths)
            for name in {name for name, _ in targets}:
                lengths = {find() for other, find in targets if other == name}
                if name not in new:
                    lengths.add(given[name])
                self.lengths[name] = lengths.pop() if len(lengths) == 1 else Length.UNKNOWN
                if turn and before[name] > self.lengths[name]:
                    self.lengths[name] = before[name]
            if turn and before == self.lengths:
                break
        for name in list(self.axes):
            if self.lengths[name] is not Length.CLOUD or any(name == other for other, _ in targets):
                del self.axes[name]

    def targets(self, node: ast.AST) -> list[tuple[str, Callable[[], Length]]]:
        """Return the names that a statement binds, each with a way to find its length."""
        if isinstance(node, ast.Assign):
            return [pair for target in node.targets for pair in self.assigned(target, node.value)]
        if isinstance(node, (ast.AugAssign, ast.AnnAssign, ast.NamedExpr)) and node.value:
            parts = [node.target, node.value] if isinstance(node, ast.AugAssign) else [node.value]
            return [(name, lambda: self.of_parts(parts)) for name in stored(node.target)]
        if isinstance(node, (ast.For, ast.AsyncFor, ast.comprehension)):
            return [(name, lambda: self.of_parts([node.iter])) for name in stored(node.target)]
        if isinstance(node, (ast.With, ast.AsyncWith, ast.Try, ast.Match, ast.Delete)):
            return [
                (name, lambda: Length.UNKNOWN) for part in ast.iter_child_nodes(node) for name in stored(part)
            ]
        return []

    def assigned(self, target: ast.AST, value: ast.AST) -> list[tuple[str, Callable[[], Length]]]:
        """Pair the names of a target with the parts of a value."""
        if isinstance(target, ast.Name):
            return [(target.id, lambda: self.length(value))]
        if isinstance(target, (ast.Tuple, ast.List)):
            parts = target.elts
            starred = any(isinstance(part, ast.Starred) for part in parts)
            if isinstance(value, (ast.Tuple, ast.List)) and len(value.elts) == len(parts) and not starred:
                pairs = zip(parts, value.elts, strict=True)
                return [pair for one, other in pairs for pair in self.assigned(one, other)]
            if _is_shape(value) and not starred and all(isinstance(part, ast.Name) for part in parts):
                return [
                    (part.id, lambda place=place: self.of_axis(value.value, place))
                    for place, part in enumerate(parts)
                ]
            return [(name, lambda: self.of_parts([value])) for part in parts for name in stored(part)]
        return []

    def of_parts(self, nodes: list[ast.AST]) -> Length:
        """Return how much is known of something made of these: what holds no cloud is small."""
        for node in nodes:
            for part in ast.walk(node):
                if isinstance(part, ast.Name):
                    home = self.look_up(part.id)
                    if home and home.lengths[part.id] is not Length.SMALL:
                        return self.length(node) if len(nodes) == 1 and _is_count(node) else Length.UNKNOWN
        return Length.SMALL

    def of_axis(self, array: ast.AST, place: int) -> Length:
        """Return what one number of a shape is."""
        if isinstance(array, ast.Name) and (home := self.look_up(array.id)) and array.id in home.axes:
            place += home.axes[array.id] if place < 0 else 0
            return Length.CLOUD if place == 0 else Length.SMALL
        return self.of_parts([array])

    def length(self, node: ast.AST) -> Length:  # noqa: C901, PLR0911  (one for each kind of node)
        """Return how often one who goes over a value goes round, as far as the text tells."""
        if isinstance(node, ast.Name):
            home = self.look_up(node.id)
            return home.lengths[node.id] if home else Length.SMALL
        if isinstance(node, (ast.Tuple, ast.List, ast.Set)):
            starred = [part.value for part in node.elts if isinstance(part, ast.Starred)]
            return max(map(self.length, starred), default=Length.SMALL)
        if isinstance(node, COMPREHENSIONS):
            return max(self.length(part.iter) for part in node.generators)
        if isinstance(node, ast.Attribute) and node.attr in {"shape", "ndim", "dtype"}:
            return Length.SMALL
        if isinstance(node, ast.Subscript) and _is_shape(node.value):
            place = _whole(node.slice)
            return (
                self.of_parts([node.value.value]) if place is None else self.of_axis(node.value.value, place)
            )
        if isinstance(node, ast.Call):
            called = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            arguments = [part.value if isinstance(part, ast.Starred) else part for part in node.args]
            if isinstance(node.func, ast.Attribute) and called in {"tolist", "copy", "astype"}:
                return self.length(node.func.value)
            if arguments and called == "zip":
                return min(map(self.length, arguments))
            if arguments and called in _SAME_LENGTH | {"len", "int"}:
                return max(map(self.length, arguments))
        if isinstance(node, ast.IfExp):
            return max(self.length(node.body), self.length(node.orelse))
        return self.of_parts([node])


def _is_shape(node: ast.AST) -> bool:
    return isinstance(node, ast.Attribute) and node.attr == "shape"


def _is_count(node: ast.AST) -> bool:
    return isinstance(node, ast.Subscript) and _is_shape(node.value)


def _whole(node: ast.AST) -> int | None:
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        inner = _whole(node.operand)
        return None if inner is None else -inner
    return node.value if isinstance(node, ast.Constant) and type(node.value) is int else None


def _own(node: ast.AST) -> list[ast.AST]:
    """Return a statement and what is in it, without the insides of functions and comprehensions."""
    found = [node]
    if isinstance(node, (*FUNCTIONS, ast.ClassDef)):
        return found
    for part in ast.iter_child_nodes(node):
        if isinstance(part, COMPREHENSIONS):
            found += [one for one in ast.walk(part) if isinstance(one, ast.NamedExpr)]
        else:
            found += _own(part)
    return found
