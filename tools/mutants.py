"""Make mutants: copies of the code behind a graded stage, each with one change to its arithmetic.

The changes are mutmut's operators for numbers, signs, comparisons and branches, and a few of the same form for what a
filter is written with: one side of an operation dropped, the other order of a product of matrices, a transpose, a wrap,
a root or a size left out, sine for cosine, greatest for least. Left alone is what is no arithmetic: text, annotations,
default values, and validation, which are functions that check an argument, `raise`, and an `if` that leads to nothing
else.

The code behind a stage is its reference, wherever it stands, and every function, method and number that it uses in
`roboloc_reference` or in the hidden checks; the functions of other stages are mutated there.
"""

from __future__ import annotations

import functools
import inspect
import re
import sys
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import TYPE_CHECKING, Any, NamedTuple

import libcst as cst
from libcst.metadata import MetadataWrapper, PositionProvider, WhitespaceInclusivePositionProvider
from mutmut.mutation import mutators

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from autograder.check import Stage

_OF_MUTMUT = {
    "operator_number",
    "operator_swap_op",
    "operator_remove_unary_ops",
    "operator_augmented_assignment",
    "operator_keywords",
    "operator_if_exp",
}
_PAIRS = (("sin", "cos"), ("min", "max"), ("argmin", "argmax"), ("minimum", "maximum"))
_PARTNERS = {old: new for pair in _PAIRS for old, new in (pair, pair[::-1])}
_LEFT_OUT = {"wrap", "wrap_float", "abs", "sqrt", "exp", "log", "log1p", "expm1", "square", "rint"}
_VALIDATION = re.compile(r"_?as_[a-z]+|isinstance|warn")
_NO_ARITHMETIC = (cst.Annotation, cst.Decorator, cst.Parameters, cst.Raise, cst.Import, cst.ImportFrom)
PACKAGES = ("roboloc_reference.", "autograder.checks.")


def _partner(node: cst.Name) -> Iterator[cst.Name]:
    if node.value in _PARTNERS:
        yield node.with_changes(value=_PARTNERS[node.value])


def _not_transposed(node: cst.Attribute) -> Iterator[cst.BaseExpression]:
    if node.attr.value == "T":
        yield node.value


def _left_out(node: cst.Call) -> Iterator[cst.BaseExpression]:
    name = node.func.attr if isinstance(node.func, cst.Attribute) else node.func
    if (
        isinstance(name, cst.Name)
        and name.value in _LEFT_OUT
        and len(node.args) == 1
        and not node.args[0].star
    ):
        yield _bracketed(node.args[0].value)


def _one_side(node: cst.BinaryOperation) -> Iterator[cst.BaseExpression]:
    yield _bracketed(node.left)
    yield _bracketed(node.right)


def _other_order(node: cst.BinaryOperation) -> Iterator[cst.BinaryOperation]:
    if isinstance(node.operator, cst.MatrixMultiply):
        yield node.with_changes(left=_bracketed(node.right), right=_bracketed(node.left))


def _bracketed(node: cst.BaseExpression) -> cst.BaseExpression:
    if node.lpar or isinstance(node, (cst.Name, cst.BaseNumber, cst.Call, cst.Attribute, cst.Subscript)):
        return node
    return node.with_changes(lpar=[cst.LeftParen()], rpar=[cst.RightParen()])


OPERATORS = (
    *((kind, make) for kind, make in mutators.mutation_operators if make.__name__ in _OF_MUTMUT),
    (cst.Name, _partner),
    (cst.Attribute, _not_transposed),
    (cst.Call, _left_out),
    (cst.BinaryOperation, _one_side),
    (cst.BinaryOperation, _other_order),
)


class Place(NamedTuple):
    """A piece of code behind a stage: its name, its module and its lines, first and last."""

    name: str
    module: str
    first: int
    last: int


class Mutant(NamedTuple):
    """One change: where, the line before and after it, and the whole text of the changed module."""

    place: str
    module: str
    before: str
    after: str
    source: str

    @property
    def change(self) -> tuple[str, str, str]:
        """What names the change, wherever in the module its line stands."""
        return self.place, self.before, self.after


def places(stage: Stage, stages: Iterable[Stage]) -> list[Place]:
    """Return the code behind a stage."""
    others = {_plain(other.reference) for other in stages} - {_plain(stage.reference)}
    found: dict[CodeType, Place] = {}
    names: set[str] = set()
    waiting = [_plain(stage.reference)]
    methods: dict[str, list[FunctionType]] = {}
    while waiting:
        function = waiting.pop()
        code = function.__code__
        known = code in found or function in others or _VALIDATION.fullmatch(function.__name__)
        if known or not function.__module__.startswith(PACKAGES):
            continue
        name = f"{function.__module__.rpartition('.')[2]}.{function.__qualname__}"
        found[code] = Place(name, function.__module__, code.co_firstlineno, max(_lines(code)))
        used = set(_names(code))
        names |= used
        values = [function.__globals__[name] for name in used if name in function.__globals__]
        for value in values:
            if isinstance(value, ModuleType):
                values += [getattr(value, name) for name in used if hasattr(value, name)]
            elif isinstance(value, type) and value.__module__.startswith(PACKAGES):
                for method, body in inspect.getmembers(value, _has_code):
                    methods.setdefault(method, []).append(_plain(body))
                special = [body for key, body in vars(value).items() if key.startswith("__")]
                waiting += [_plain(body) for body in special if _has_code(body)]
            elif _has_code(value):
                waiting.append(_plain(value))
        waiting += [body for name in names for body in methods.get(name, ())]
    modules = {place.module for place in found.values()}
    return sorted({*found.values(), *(place for name in modules for place in _numbers(name, names))})


def _plain(function: Any) -> Any:
    """Return the function that was wrapped."""
    while isinstance(function, (functools.partial, property, functools.cached_property)):
        function = getattr(function, "func", None) or function.fget
    return inspect.unwrap(function)


def _has_code(value: Any) -> bool:
    if isinstance(value, (functools.partial, property, functools.cached_property)):
        return True
    return callable(value) and isinstance(inspect.unwrap(value), FunctionType)


def _codes(code: CodeType) -> Iterator[CodeType]:
    yield code
    for part in code.co_consts:
        if isinstance(part, CodeType):
            yield from _codes(part)


def _names(code: CodeType) -> Iterator[str]:
    return (name for part in _codes(code) for name in part.co_names)


def _lines(code: CodeType) -> Iterator[int]:
    return (line for part in _codes(code) for *_, line in part.co_lines() if line)


@functools.cache
def _parsed(name: str) -> tuple[str, MetadataWrapper]:
    """Return the text of a module and its tree."""
    source = Path(sys.modules[name].__file__).read_text(encoding="utf-8")
    return source, MetadataWrapper(cst.parse_module(source), unsafe_skip_copy=True)


def _numbers(name: str, used: set[str]) -> Iterator[Place]:
    """Yield the numbers of a module that are used by name."""
    _, tree = _parsed(name)
    lines = tree.resolve(PositionProvider)
    for statement in tree.module.body:
        for part in getattr(statement, "body", ()) if isinstance(statement, cst.SimpleStatementLine) else ():
            for target in part.targets if isinstance(part, cst.Assign) else ():
                known = getattr(target.target, "value", "")
                if known in used and isinstance(getattr(sys.modules[name], known), (int, float)):
                    where = lines[part]
                    yield Place(f"{name.rpartition('.')[2]}.{known}", name, where.start.line, where.end.line)


def mutants(place: Place) -> list[Mutant]:
    """Return all mutants of a piece of code."""
    source, _ = _parsed(place.module)
    found = []
    for line, start, end, text in _changes(place.module):
        if place.first <= line <= place.last:
            changed = source[:start] + text + source[end:]
            if changed == source:  # two equal things swapped
                continue
            head, tail = source.rfind("\n", 0, start) + 1, (source + "\n").index("\n", end)
            before = _joined(source[head:tail])
            after = _joined(changed[head : tail + len(changed) - len(source)])
            found.append(Mutant(place.name, place.module, before, after, changed))
    return found


def _joined(lines: str) -> str:
    """Write lines as one, without comments."""
    return " ".join(line.partition("  # ")[0].strip() for line in lines.splitlines())


@functools.cache
def _changes(name: str) -> list[tuple[int, int, int, str]]:
    """Return the changes of a module: line, first and last place in the text, and what to write there."""
    source, tree = _parsed(name)
    starts = [0, *(match.end() for match in re.finditer("\n", source))]
    where = tree.resolve(WhitespaceInclusivePositionProvider)
    collector = _Collector()
    tree.module.visit(collector)
    found = []
    for node, changed in collector.found:
        first, last = where[node].start, where[node].end
        start, end = starts[first.line - 1] + first.column, starts[last.line - 1] + last.column
        # Inside brackets a node on its own is indented less, which means nothing there.
        if source[start:end].split() != tree.module.code_for_node(node).split():
            raise RuntimeError(f"{name}, line {first.line}: the tree does not say what stands there")
        found.append((first.line, start, end, tree.module.code_for_node(changed)))
    return found


class _Collector(cst.CSTVisitor):
    """Collect the nodes of a module with what each may be changed to, but for what is no arithmetic."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[tuple[cst.CSTNode, cst.CSTNode]] = []

    def on_visit(self, node: cst.CSTNode) -> bool:
        """Collect one node, and say whether to look at its parts."""
        if isinstance(node, _NO_ARITHMETIC) or (isinstance(node, cst.Call) and _validates(node)):
            return False
        if isinstance(node, cst.If) and _raises(node):
            if node.orelse:
                node.orelse.visit(self)
            return False
        for kind, operator in OPERATORS:
            if isinstance(node, kind):
                self.found += [(node, changed) for changed in operator(node)]
        return True


def _validates(call: cst.Call) -> bool:
    name = call.func.attr if isinstance(call.func, cst.Attribute) else call.func
    return isinstance(name, cst.Name) and bool(_VALIDATION.fullmatch(name.value))


def _raises(node: cst.If) -> bool:
    last = node.body.body[-1]
    return isinstance(last, cst.SimpleStatementLine) and isinstance(last.body[-1], cst.Raise)
