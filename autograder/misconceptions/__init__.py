"""Wrong versions of the graded stages, each one real mistake with a name: one module per subject.

They are used twice. Every one must fail its stage's checks; and when a submission fails, its results are
compared with theirs, so that feedback can say what the mistake is. A module here that has ``MISCONCEPTIONS`` is part of
the list; nothing else needs to name it.
"""

from __future__ import annotations

from importlib import import_module
from pkgutil import iter_modules

MISCONCEPTIONS = tuple(
    item
    for entry in iter_modules(__path__)
    for item in getattr(import_module(f"{__name__}.{entry.name}"), "MISCONCEPTIONS", ())
)


def of_stage(stage: str) -> tuple:
    """Return the wrong versions of a stage, in the order in which they are tried."""
    return tuple(item for item in MISCONCEPTIONS if item.stage == stage)


__all__ = ["MISCONCEPTIONS", "of_stage"]
