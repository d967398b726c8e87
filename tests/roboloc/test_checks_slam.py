"""The public checks of SLAM with lines: what they accept, and how they say what is wrong."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from autograder.misconceptions import of_stage
from roboloc.checks import check, slam
from roboloc_reference import slam as reference

STAGES = {"transition_model": slam.TRANSITION, "compute_predicted_measurements": slam.PREDICTED}
ALTERNATIVES = Path(__file__).resolve().parents[1] / "autograder" / "alternatives" / "line_slam"


def alternative(name, stage):
    """Load another right way to write a stage."""
    spec = importlib.util.spec_from_file_location(f"public_{name}", ALTERNATIVES / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return getattr(module, stage)


@pytest.mark.parametrize("stage", STAGES)
def test_correct_functions_pass(stage):
    """Every correct way passes: the reference, loops, complex numbers, matrices."""
    functions = [getattr(reference, stage)]
    functions += [alternative(f"slam_{name}", stage) for name in ("complex", "loops", "matrices")]
    for function in functions:
        report = check(function, stage=f"slam.{stage}")
        assert report, str(report)


# What each mistake must be told by, at least: the name of one check.
FINDINGS = {
    "lines turned with the robot": "the walls stand still",
    "derivative of the lines 0": "Gx agrees with small changes of the state",
    "identity of the lines times dt": "Gx agrees with small changes of the state",
    "identity for the pose too": "Gx agrees with small changes of the state",
    "heading looked for at the end": "Gx agrees with small changes of the state",
    "lines turned by the control": "Gu agrees with small changes of the control",
    "pose taken from the end of the state": "the walls stand still",
    "lines wrapped": "the walls stand still",
    "the caller's state overwritten": "leaves its arguments as they were",
    "map taken for certain": "Hs agrees with small changes of the lines",
    "distance taken not to follow alpha": "Hs agrees with small changes of the lines",
    "sign of the derivative by alpha": "Hs agrees with small changes of the lines",
    "lever of the robot's centre": "Hs agrees with small changes of the lines",
    "block of the line not normalised": "Hs agrees with small changes of the lines",
    "all blocks in one place": "Hs agrees with small changes of the lines",
    "numbers fixed, not lines": "the first lines are fixed, and no others",
    "nothing fixed": "the first lines are fixed, and no others",
    "last lines fixed": "the first lines are fixed, and no others",
    "fixed lines teach nothing": "fixed lines are seen like others",
    "the caller's lines overwritten": "leaves its arguments as they were",
}


@pytest.mark.parametrize("stage", STAGES)
def test_wrong_functions_are_told_what_is_wrong(stage):
    """Every mistake in the catalogue fails the public check that is about it, which has a message."""
    for item in of_stage(f"slam.{stage}"):
        report = check(item.function, stage=f"slam.{stage}")
        failed = {one.name: one.message for one in report.items if one.passed is False}
        assert FINDINGS[item.name] in failed, item.name
        assert all(failed.values()), item.name


def test_every_finding_is_about_a_known_mistake():
    """The table above names no mistake that does not exist."""
    assert set(FINDINGS) == {item.name for stage in STAGES for item in of_stage(f"slam.{stage}")}


@pytest.mark.parametrize("stage", STAGES)
def test_each_check_can_fail(stage):
    """No line of the report is right by default."""

    def eight_numbers_at_least(x, *others):
        if len(x) < 8:
            raise ValueError
        return getattr(reference, stage)(x, *others)

    def closed_form(x, u, dt):
        g, Gx, Gu = reference.transition_model(x, u, dt)
        return g + (abs(u[1]) < 1e-5) * (u[1] != 0), Gx, Gu

    def elsewhere(x, *others):
        first, *rest = getattr(reference, stage)(x, *others)
        return first + 1.0, *rest

    def negative(x, *others):
        first, *rest = getattr(reference, stage)(x, *others)
        return np.array(first) * np.reshape([1, -1], (2, *[1] * (np.ndim(first) - 1))), *rest

    functions = [item.function for item in of_stage(f"slam.{stage}")]
    functions += [lambda *_: (), eight_numbers_at_least, elsewhere]
    functions += [closed_form] if stage == "transition_model" else [negative]
    failed = set()
    for function in functions:
        report = check(function, stage=f"slam.{stage}")
        failed |= {one.name for one in report.items if one.passed is False}
    assert failed == {one.name for one in STAGES[stage]}


def test_the_name_alone_means_the_older_stage():
    """Two stages are called compute_predicted_measurements: without a stage, the check is that of line-measurements."""
    report = check(reference.compute_predicted_measurements)
    assert report.items[0].name == "returns hs (2, J), Hs (J, 2, 3)"
    assert not report


def test_no_answer_is_stored():
    """The sines and cosines of the answer are not in the checks."""
    source = Path(slam.__file__).read_text(encoding="utf-8")
    assert "cos(" not in source
    assert "sin(" not in source
