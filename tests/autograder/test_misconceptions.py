"""Wrong versions of all stages: that there are enough, that each has words, and that it returns numbers."""

from __future__ import annotations

import numpy as np
import pytest
from diagnosis import COURSE

import kill_matrix
from autograder.check import copied, run_stage
from autograder.checks import EXPRESSIONS, STAGES
from autograder.misconceptions import MISCONCEPTIONS, of_stage

# The only ones whose fault is that they return no number, and the arguments for which they do not.
NOT_FINITE = {
    "division by zero": lambda _xvec, u, _dt: u[1] == 0,
    "time to a level ground": lambda values: values["py"] <= 0,
}
# Stages of which a wrong version may return another number of rows, of the right width.
OTHER_COUNT = {
    "association.compute_innovations",
    *(f"extraction.{name}" for name in ("split", "merge", "segments", "extract_lines")),
}
# The only ones whose fault is in the shape.
OTHER_SHAPE = {"block diagonal of nothing"}


@pytest.mark.parametrize("item", MISCONCEPTIONS, ids=lambda item: f"{item.stage}-{item.name}")
def test_wrong_versions_return_numbers_of_the_right_shape(item):
    """A wrong version differs by its fault alone: right shapes, finite numbers unless that is the fault."""
    stage = kill_matrix.stages()[item.stage]
    for call in run_stage(stage, stage.reference, COURSE).calls:
        returned = stage.each(item.function(*copied(call.args)))
        right = stage.each(stage.reference(*copied(call.args)))
        skip = 1 if item.stage in OTHER_COUNT else 0
        if item.name not in OTHER_SHAPE:
            assert [np.shape(value)[skip:] for value in returned] == [np.shape(part)[skip:] for part in right]
        if not NOT_FINITE.get(item.name, lambda *_: False)(*call.args):
            assert all(np.isfinite(value).all() for value in returned)


def test_every_stage_has_enough_wrong_versions():
    """At least four of each stage and one of each symbolic answer, all with words, no name twice in a stage."""
    assert all(len(of_stage(name)) >= 4 for name in STAGES)
    assert all(of_stage(name) for name in EXPRESSIONS)
    assert {item.stage for item in MISCONCEPTIONS} == {*STAGES, *EXPRESSIONS}
    assert len({(item.stage, item.name) for item in MISCONCEPTIONS}) == len(MISCONCEPTIONS)
    assert all(len(item.explanation) > 60 and len(item.hint) > 20 for item in MISCONCEPTIONS)
