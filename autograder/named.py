"""Library functions by their names: what a test may hand to a submission besides data, ``np.sin`` for example."""

from __future__ import annotations

import importlib
import sys
from typing import Any

import numpy as np

# Roots of modules whose functions and classes may be named across the border (``np.sin`` handed to a student's solver).
NAMED_ROOTS = frozenset({"builtins", "math", "cmath", "operator", "numpy", "scipy", "sympy"})
# Builtins that are no business of a value: naming them would hand the reader a tool, not data.
_UNNAMEABLE = frozenset(
    {"eval", "exec", "compile", "open", "__import__", "input", "breakpoint", "globals", "vars"}
)


class WireError(ValueError):
    """A value that cannot cross, or a frame that is not one."""


def name_of(value: object) -> tuple[str, str] | None:
    """Return module and name of a library function or class, None for anything else."""
    if not callable(value):
        return None
    name = getattr(value, "__name__", None)
    module = getattr(value, "__module__", None) or ("numpy" if type(value) is np.ufunc else None)
    if type(name) is not str or type(module) is not str or module.partition(".")[0] not in NAMED_ROOTS:
        return None
    try:
        found = resolve_named(module, name)
    except WireError:
        return None
    return (module, name) if found is value else None


def resolve_named(module: str, name: str, *, loaded_only: bool = False) -> Any:
    """Return the library function or class of that name.

    Parameters
    ----------
    module, name : str
        Where it is defined, for example ``"math"`` and ``"sin"``.
    loaded_only : bool, optional
        Whether only modules that are imported already are looked into: a submission must not choose what is imported.

    Returns
    -------
    callable
        The object itself.

    Raises
    ------
    WireError
        If the module is not one of the known libraries, or has no such function.

    Examples
    --------
    >>> resolve_named("math", "hypot")(3.0, 4.0)
    5.0
    """
    if type(module) is not str or type(name) is not str or module.partition(".")[0] not in NAMED_ROOTS:
        raise WireError("a name outside the known libraries")
    if (module == "builtins" and name in _UNNAMEABLE) or name.startswith("_"):
        raise WireError(f"{name} may not be named")
    try:
        found = getattr(sys.modules[module] if loaded_only else importlib.import_module(module), name)
    except (ImportError, AttributeError, ValueError, KeyError) as error:
        raise WireError(f"no {name} in {module}") from error
    if not callable(found):
        raise WireError(f"{module}.{name} is not a function")
    return found
