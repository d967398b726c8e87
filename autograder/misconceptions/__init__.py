"""Wrong versions of the graded stages, each one real mistake with a name: one module per subject.

They are used twice. Every one must fail its stage's checks; and when a submission fails, its results are
compared with theirs, so that feedback can say what the mistake is.
"""

from __future__ import annotations

from autograder.misconceptions import (
    association_and_update,
    correction,
    line_measurements,
    line_normalization,
    line_transform,
    motion_model,
    prediction,
    single_wall,
    upside_down,
    wheel_speeds,
)

MISCONCEPTIONS = motion_model.MISCONCEPTIONS + prediction.MISCONCEPTIONS + wheel_speeds.MISCONCEPTIONS
MISCONCEPTIONS += line_transform.MISCONCEPTIONS + line_normalization.MISCONCEPTIONS
MISCONCEPTIONS += line_measurements.MISCONCEPTIONS + upside_down.MISCONCEPTIONS
MISCONCEPTIONS += association_and_update.MISCONCEPTIONS + correction.MISCONCEPTIONS
MISCONCEPTIONS += single_wall.MISCONCEPTIONS


def of_stage(stage: str) -> tuple:
    """Return the wrong versions of a stage, in the order in which they are tried."""
    return tuple(item for item in MISCONCEPTIONS if item.stage == stage)


__all__ = ["MISCONCEPTIONS", "of_stage"]
