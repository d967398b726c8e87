"""What feedback says of a function, for the tests of wrong versions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import kill_matrix
from autograder.check import run_stage
from autograder.diagnose import diagnose
from autograder.misconceptions import of_stage

if TYPE_CHECKING:
    from collections.abc import Callable

COURSE = "a course"


def found(stage: str, function: Callable[..., Any]) -> list[tuple[str, tuple[str, ...]]]:
    """Diagnose a function: pairs of title and outputs."""
    outcome = run_stage(kill_matrix.stages()[stage], function, COURSE)
    return [(item.title, item.outputs) for item in diagnose(outcome, of_stage(stage))]


def observed(stage: str, function: Callable[..., Any]) -> list[str]:
    """Diagnose a function that no wrong version is like: the sentences."""
    items = diagnose(run_stage(kill_matrix.stages()[stage], function, COURSE), of_stage(stage))
    assert not any(item.known for item in items)
    return [item.explanation for item in items]
