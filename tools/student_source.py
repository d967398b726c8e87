"""Write a wrong version of a stage as a student would: from the functions of the catalogue to the text of a cell."""

from __future__ import annotations

import ast
import functools
import inspect
from typing import TYPE_CHECKING, Any

from autograder.checks import STAGES

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import ModuleType

    from autograder.misconceptions.model import Misconception


@functools.cache
def student_source(item: Misconception) -> str:
    """Return the source of a wrong version as a student's cell.

    The wrong versions call the right one and spoil its result. In the cell that is the released notebook's own
    right answer, put before it under the name ``right_...``.
    """
    answer = STAGES[item.stage].function_name
    parts: dict[str, str] = {}
    _collect(item.function, answer, parts)
    body = "\n\n\n".join(parts.values())
    if f"right_{answer}" in body:
        body = f"@solution@\n\n\nright_{answer} = {answer}\n\n\n{body}"
    return f"import numpy as np\n\n{body}"


def _collect(function: Callable[..., Any], name: str, parts: dict[str, str]) -> None:
    """Add a function's source, after the source of what it uses, to the parts of a cell."""
    node = _definition(function)
    renamed = {}
    scope = inspect.getclosurevars(function)
    for used, value in {**scope.globals, **scope.nonlocals}.items():
        if not callable(value):
            if isinstance(value, (int, float)):
                parts[used] = f"{used} = {value!r}"
        elif value.__module__.startswith("roboloc_reference"):
            renamed[used] = f"right_{used}"
        elif used not in parts:
            _collect(value, used, parts)
    parts[name] = _written(node, name, renamed)


@functools.cache
def _tree(module: ModuleType) -> ast.Module:
    return ast.parse(inspect.getsource(module))


def _definition(function: Callable[..., Any]) -> ast.FunctionDef | ast.Lambda:
    """Find where a function is written."""
    code = function.__code__
    tree = _tree(inspect.getmodule(function))
    names = list(code.co_varnames[: code.co_argcount])
    for node in ast.walk(tree):
        if not isinstance(node, (ast.FunctionDef, ast.Lambda)) or node.lineno != code.co_firstlineno:
            continue
        if [argument.arg for argument in node.args.args] == names:
            return node
    raise ValueError(f"{function.__qualname__}: expected a function whose source is at hand")


class _Rename(ast.NodeTransformer):
    """Use other names, and take annotations away."""

    def __init__(self, names: dict[str, str]) -> None:
        self.names = names

    def visit_Name(self, node: ast.Name) -> ast.Name:
        node.id = self.names.get(node.id, node.id)
        return node

    def visit_arg(self, node: ast.arg) -> ast.arg:
        node.annotation = None
        return node


def _written(node: ast.FunctionDef | ast.Lambda, name: str, renamed: dict[str, str]) -> str:
    # Written and read again, not copied: trees share nodes such as `Load`, and IPython hangs whole trees on them.
    (copy,) = ast.parse(ast.unparse(node)).body
    if isinstance(node, ast.Lambda):
        return f"{name} = {ast.unparse(_Rename(renamed).visit(copy))}"
    node = _Rename(renamed).visit(copy)
    node.name, node.returns = name, None
    return ast.unparse(node)
