"""What a submission's cells bind, as they are written: read, never run.

:class:`Reading` answers what a name stands for at the end of some cells: functions, classes and values with their
syntax trees, imports with their full names. Where the text does not say it, :class:`Unreadable` says why; so it does
for cells that reach for the tools with which one could rewrite what the reader, or the tracer, relies on.
"""

from __future__ import annotations

import ast
from dataclasses import dataclass
from typing import TYPE_CHECKING

from .analysis import transformed

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

TOOLS = frozenset(
    {
        "exec", "eval", "__import__", "getattr", "setattr", "delattr", "globals", "locals", "vars", "open", "input",
        "breakpoint", "In", "Out",
    }
)  # fmt: skip
_ATTRIBUTES = frozenset(
    {
        "settrace", "setprofile", "gettrace", "getprofile", "addaudithook", "monitoring", "modules", "f_trace",
        "run_cell", "run_code", "ex", "ev", "user_ns", "user_global_ns", "push", "safe_execfile",
        "settrace_all_threads", "setitem", "attrgetter", "methodcaller", "runstring", "rundocs", "measure", "load",
        "lib", "_core", "core", "f2py", "ctypeslib", "LowLevelCallable", "switch_backend", "rc_file",
        "get_type_hints", "ForwardRef", "_getframe", "_current_frames", "meta_path", "path_hooks",
    }
)  # fmt: skip
# What cells of a submission may import: in no other module does anyone know what can change other code. SymPy evaluates
# text; a file beside the notebook is not read.
_MODULES = tuple(
    f"{name}."
    for name in (
        "numpy", "scipy", "math", "cmath", "matplotlib", "mpl_toolkits", "roboloc", "ipywidgets", "IPython.display",
        "itertools", "functools", "operator", "collections", "dataclasses", "typing", "enum", "copy", "random",
        "statistics", "time", "datetime", "string", "re", "warnings", "fractions", "heapq", "bisect", "abc", "numbers",
        "textwrap", "pprint", "contextlib", "os", "sys", "__future__", "autograder",
    )
)  # fmt: skip
_MAGICS = frozenset(
    {
        "matplotlib", "time", "timeit", "prun", "config", "load_ext", "autoreload", "capture", "precision", "who",
        "whos",
    }
)  # fmt: skip


# What IPython writes for a magic and for a command of the system; `_trees` looks at those.
_OF_MAGICS = frozenset({"run_line_magic", "run_cell_magic", "system", "getoutput"})


class Unreadable(Exception):  # noqa: N818  (a state of the text, not a fault of the program)
    """The text does not say what runs; the message is for the student."""


@dataclass(frozen=True)
class Binding:
    """What a name stands for: a syntax tree, or the full name of what was imported; both None where it is not said."""

    node: ast.AST | None = None
    imported: str = ""


class Reading:
    """The names of some cells.

    Parameters
    ----------
    sources : sequence of tuple of (str, bool)
        The cells in order, each with whether it is the instructor's: see `remote.sources_of`.

    Raises
    ------
    Unreadable
        If a cell of the student's reaches for what can change other code.
    """

    def __init__(self, sources: Sequence[tuple[str, bool]]) -> None:
        self.bindings: dict[str, list[Binding]] = {}
        self.starred = False
        for source, given in sources:
            for tree in _trees(source):
                if not given:
                    _mark_magics(tree)
                    for node in ast.walk(tree):
                        _hold_harmless(node)
                self._collect(tree.body, sure=True)
                for node in ast.walk(tree):
                    if isinstance(node, ast.Global):
                        for name in node.names:
                            self._bind(name, Binding(), sure=False)

    def _bind(self, name: str, binding: Binding, *, sure: bool) -> None:
        if sure:
            self.bindings[name] = []
        self.bindings.setdefault(name, []).append(binding)

    def _collect(self, body: list[ast.stmt], *, sure: bool) -> None:  # noqa: C901, PLR0912  (by kind of statement)
        """Go through statements in their order; those that may not run add to what was bound before."""
        for node in body:
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
                self._bind(node.name, Binding(node), sure=sure)
            elif isinstance(node, (ast.Import, ast.ImportFrom)):
                self.starred = self.starred or any(alias.name == "*" for alias in node.names)
                for name, full in imports(node):
                    self._bind(name, Binding(imported=full), sure=sure)
            elif isinstance(node, ast.Assign):
                for target in node.targets:
                    plain = isinstance(target, ast.Name)
                    for name in stored(target):
                        self._bind(name, Binding(node.value), sure=sure and plain)
            elif isinstance(node, (ast.AnnAssign, ast.AugAssign)):
                for name in stored(node.target):
                    self._bind(name, Binding(node.value), sure=False)
            else:
                inner = [part for part in ast.iter_child_nodes(node) if not isinstance(part, ast.stmt)]
                for name in {name for part in inner for name in stored(part)}:
                    self._bind(name, Binding(), sure=False)
                for _, part in ast.iter_fields(node):
                    for block in part if isinstance(part, list) else []:
                        if isinstance(block, ast.stmt):
                            self._collect([block], sure=False)
                        elif isinstance(block, (ast.ExceptHandler, ast.match_case)):
                            self._collect(block.body, sure=False)

    def of(self, name: str) -> list[Binding]:
        """Return what a global name may stand for; nothing for a builtin.

        Raises
        ------
        Unreadable
            If the cells do not say.
        """
        found = self.bindings.get(name, [])
        if any(binding.node is None and not binding.imported for binding in found):
            raise Unreadable(f"what {safe(name)} stands for depends on how the cells ran")
        if not found and self.starred:
            raise Unreadable(
                "with `from ... import *` nobody who reads the code knows where a name comes from"
            )
        return found


def safe(name: str) -> str:
    """Return a name of the student's as a message may repeat it."""
    return name[:40] if name.isidentifier() and name.isascii() else "a name"


def stored(node: ast.AST) -> Iterator[str]:
    """Yield the names that a part of a statement binds; what a function binds inside is its own."""
    if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda, ast.ClassDef)):
        return
    if isinstance(node, ast.Name) and not isinstance(node.ctx, ast.Load):
        yield node.id
    if isinstance(node, ast.ExceptHandler) and node.name:
        yield node.name
    if isinstance(node, (ast.MatchAs, ast.MatchStar)) and node.name:
        yield node.name
    if isinstance(node, ast.stmt) and not isinstance(node, ast.Assign):
        return
    for part in ast.iter_child_nodes(node):
        yield from stored(part)


def imports(node: ast.Import | ast.ImportFrom) -> Iterator[tuple[str, str]]:
    """Yield the names that an import binds, each with its full name."""
    for alias in node.names:
        if isinstance(node, ast.ImportFrom):
            if alias.name != "*":
                yield alias.asname or alias.name, f"{node.module}.{alias.name}"
        elif alias.asname:
            yield alias.asname, alias.name
        else:
            root = alias.name.partition(".")[0]
            yield root, root


def _trees(source: str) -> Iterator[ast.Module]:
    """Yield the trees of a cell, and of the code that a magic of it runs."""
    try:
        tree = ast.parse(transformed(source))
    except (SyntaxError, RecursionError, MemoryError):
        return  # it did not run either
    except (ValueError, RuntimeError):
        raise Unreadable("a cell is too long, or has too many magics") from None
    yield tree
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
            if node.func.attr in {"run_line_magic", "run_cell_magic"}:
                if not all(isinstance(one, ast.Constant) for one in node.args):
                    raise Unreadable("a cell uses a magic command on what the text does not say")
                yield from _magic([one.value for one in node.args])
            elif node.func.attr in {"system", "getoutput"}:
                raise Unreadable("a cell runs a command of the system")


def _mark_magics(tree: ast.AST) -> None:
    """Mark what IPython wrote for a magic."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and node.attr in _OF_MAGICS:
            for part in ast.walk(node.value):
                part.of_a_magic = True


def _magic(words: list) -> Iterator[ast.Module]:
    if not words or words[0] not in _MAGICS:
        raise Unreadable("a cell uses a magic command that can run other code")
    if words[0] in {"time", "timeit", "prun", "capture"}:
        for text in words[1:]:
            yield from _trees(str(text))


def _hold_harmless(node: ast.AST) -> None:
    """Refuse what can change code that is not its own."""
    word = ""
    if isinstance(node, ast.Name):
        hidden = node.id.startswith("__") and node.id != "__name__"
        if node.id in TOOLS or hidden or (node.id == "get_ipython" and not hasattr(node, "of_a_magic")):
            word = node.id
    elif isinstance(node, ast.Attribute):
        hidden = node.attr.startswith("__") or node.attr in TOOLS
        if node.attr in _ATTRIBUTES or hidden:
            word = node.attr
        elif not isinstance(node.ctx, ast.Load) and isinstance(node.value, (ast.Name, ast.Attribute)):
            root = node.value
            while isinstance(root, ast.Attribute):
                root = root.value
            if isinstance(root, ast.Name) and root.id in {"np", "numpy", "scipy", "sys", "math", "builtins"}:
                raise Unreadable("a cell assigns to a part of a library, which then does something else")
    elif isinstance(node, (ast.Import, ast.ImportFrom)):
        names = [node.module or ""] if isinstance(node, ast.ImportFrom) else [one.name for one in node.names]
        word = next((name for name in names if not f"{name}.".startswith(_MODULES)), "").partition(".")[0]
        parts = {part for alias in node.names for part in alias.name.split(".")}
        word = word or next(iter(sorted(parts & (_ATTRIBUTES | TOOLS))), "")
    if word:
        raise Unreadable(
            f"a cell uses {safe(word)}, after which the text of a function no longer says what runs"
        )
