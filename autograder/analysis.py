"""Which names a cell binds, reads and deletes, found without running it."""

from __future__ import annotations

import ast
import builtins
import functools
import re
import symtable
from dataclasses import dataclass, field

from IPython.core.inputtransformer2 import TransformerManager

BUILTINS = frozenset(dir(builtins)) | {"get_ipython", "display", "__name__", "__file__"}


# Nobody writes a cell of that size, or of so many magics: what reads it takes seconds, or gigabytes.
MAX_CHARACTERS = 200_000
MAX_MAGICS = 50
# What reading a cell raises that is none; a `RuntimeError` comes from IPython, of cells that never become Python.
UNREADABLE = (SyntaxError, ValueError, RuntimeError, MemoryError)
_MAGIC = re.compile(r"^\s*[%!?]|\?\s*$|=\s*[%!]", re.MULTILINE)


def transformed(source: str) -> str:
    """Return a cell as Python.

    Parameters
    ----------
    source : str
        Python with IPython's magics.

    Returns
    -------
    str
        Without.

    Raises
    ------
    ValueError
        If it is larger than any cell is that a person writes.
    SyntaxError, RuntimeError
        If IPython cannot make Python of it.
    """
    if len(source) > MAX_CHARACTERS:
        raise ValueError(f"a cell of {len(source)} characters")
    if sum(1 for _ in _MAGIC.finditer(source)) > MAX_MAGICS:
        raise ValueError(f"a cell of more than {MAX_MAGICS} magics")
    return TransformerManager().transform_cell(source)


@dataclass(frozen=True)
class Names:
    """The global names of one cell.

    Attributes
    ----------
    loads, stores, deletes : frozenset of str
        Read, bound and deleted anywhere in the cell, functions included.
    imports : dict of str to tuple
        Names bound by an import at the top level: module, and the attribute or None.
    """

    loads: frozenset[str] = frozenset()
    stores: frozenset[str] = frozenset()
    deletes: frozenset[str] = frozenset()
    imports: dict[str, tuple[str, str | None]] = field(default_factory=dict)


@functools.lru_cache(maxsize=1024)  # a class shares all cells but its answers
def analyse(source: str) -> Names:
    r"""Return the global names of a cell.

    Parameters
    ----------
    source : str
        Python with IPython's magics. A cell that does not parse has no names.

    Returns
    -------
    Names
        What the cell reads, binds and deletes.

    Examples
    --------
    Local variables of a function are not names of the cell; what it reads from outside is:

    >>> names = analyse("import numpy as np\ndef f(x):\n    y = x + offset\n    return np.sin(y)")
    >>> sorted(names.loads), sorted(names.stores), names.imports
    (['np', 'offset'], ['f', 'np'], {'np': ('numpy', None)})
    """
    try:
        plain = transformed(source)
        tree = ast.parse(plain)
        table = symtable.symtable(plain, "<cell>", "exec")
    except UNREADABLE:
        return Names()
    loads: set[str] = set()
    stores: set[str] = set()
    _collect(table, loads, stores)
    deletes = {
        target.id
        for node in ast.walk(tree)
        if isinstance(node, ast.Delete)
        for target in node.targets
        if isinstance(target, ast.Name)
    }
    return Names(frozenset(loads), frozenset(stores), frozenset(deletes), _imports(tree))


def statements(source: str) -> list[str]:
    r"""Return the statements of a cell, each as it would be written in a cell of its own; itself if it does not parse.

    Parameters
    ----------
    source : str
        Python with IPython's magics.

    Returns
    -------
    list of str
        Python.

    Examples
    --------
    >>> statements("n = 2; m = 3\nif n:\n    m += n")
    ['n = 2', 'm = 3', 'if n:\n    m += n']
    """
    try:
        return [ast.unparse(node) for node in ast.parse(transformed(source)).body]
    except UNREADABLE:
        return [source]


def _collect(table: symtable.SymbolTable, loads: set[str], stores: set[str]) -> None:
    top = table.get_type() == "module"
    for symbol in table.get_symbols():
        if not (top or symbol.is_global()):
            continue
        if symbol.is_referenced():
            loads.add(symbol.get_name())
        if symbol.is_assigned() or symbol.is_imported():
            stores.add(symbol.get_name())
    for child in table.get_children():
        _collect(child, loads, stores)


def _imports(tree: ast.Module) -> dict[str, tuple[str, str | None]]:
    found: dict[str, tuple[str, str | None]] = {}
    for node in tree.body:
        if isinstance(node, ast.Import):
            for alias in node.names:
                if alias.asname:
                    found[alias.asname] = (alias.name, None)
                else:
                    root = alias.name.partition(".")[0]
                    found[root] = (root, None)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            for alias in node.names:
                if alias.name != "*":
                    found[alias.asname or alias.name] = (node.module, alias.name)
    return found
