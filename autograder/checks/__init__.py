"""Hidden checks, one module per notebook or subject, and the table of all graded stages.

A module here that has ``STAGES`` or ``EXPRESSIONS`` is part of the table; nothing else needs to name it.
``python tools/kill_matrix.py`` prints which wrong and which correct versions the checks tell apart.
"""

from importlib import import_module
from pkgutil import iter_modules

_modules = {entry.name: import_module(f"{__name__}.{entry.name}") for entry in iter_modules(__path__)}

STAGES = {stage.name: stage for module in _modules.values() for stage in getattr(module, "STAGES", ())}
EXPRESSIONS = {
    expression.name: expression
    for module in _modules.values()
    for expression in getattr(module, "EXPRESSIONS", ())
}
SUBJECTS = {
    part.name: name
    for name, module in _modules.items()
    for part in (*getattr(module, "STAGES", ()), *getattr(module, "EXPRESSIONS", ()))
}
"""The module in which each stage is checked."""

__all__ = ["EXPRESSIONS", "STAGES", "SUBJECTS"]
