"""Wrong versions of all stages: that there are enough, that each has words, and that it returns numbers."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest
from diagnosis import COURSE

import kill_matrix
from autograder.check import copied, run_stage
from autograder.checks import EXPRESSIONS, STAGES
from autograder.diagnose import diagnose
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


def test_a_wrong_version_is_run_once_for_a_class():
    """The second student with the same hidden inputs gets the same diagnosis, and no wrong version runs for it."""
    stage = STAGES["motion.compute_dynamics"]
    (known,) = (item for item in of_stage(stage.name) if item.name == "Gx transposed")
    ran = []

    def counted(*args):
        ran.append(args)
        return known.function(*args)

    catalogue = (replace(known, function=counted),)
    first, second = (
        diagnose(run_stage(stage, known.function, "a class of two"), catalogue) for _ in range(2)
    )
    assert [item.title for item in first] == ["Gx transposed"]
    assert second == first
    calls = run_stage(stage, stage.reference, "a class of two").calls
    assert 0 < len(ran) <= len(calls)
    assert len({pickle.dumps(args) for args in ran}) == len(ran)
