"""Grading: hidden checks, misconceptions with diagnosis, the sandbox and the nbgrader plugin.

The package itself imports nothing, so that the worker inside the sandbox can use its modules where neither
the checks nor the reference are.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from autograder.grading import grade, grade_expression
    from autograder.vectorised import grade_vectorised

__all__ = ["grade", "grade_expression", "grade_vectorised"]


def __getattr__(name: str) -> Any:
    """Import what a hidden test cell asks for when it is asked for."""
    if name in __all__:
        from autograder import grading, vectorised  # noqa: PLC0415 (see the docstring of the module)

        return getattr(vectorised if name == "grade_vectorised" else grading, name)
    raise AttributeError(f"module 'autograder' has no attribute {name!r}")
