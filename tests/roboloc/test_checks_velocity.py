"""The public checks of the velocity model and the unscented filter: what they accept, what they find wrong."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from autograder.checks import STAGES
from autograder.misconceptions import of_stage
from roboloc.checks import STAGES as PUBLIC
from roboloc.checks import check, unscented, velocity

NAMES = (
    *(f"velocity.{name}" for name in ("motion", "jacobians", "noise", "range_bearing")),
    *(f"ukf.{name}" for name in ("sigma_points", "predict", "correct")),
)
ALTERNATIVES = Path(__file__).resolve().parents[1] / "autograder" / "alternatives"
OTHERS = {
    "velocity": ("velocity_model", ("velocity_complex", "velocity_matrices")),
    "ukf": ("unscented", ("unscented_loops", "unscented_tensors")),
}


def right_ways(stage):
    """Return the reference and the other right ways to write a stage."""
    subject, function = stage.split(".")
    yield STAGES[stage].reference
    folder, names = OTHERS[subject]
    for name in names:
        spec = importlib.util.spec_from_file_location(f"public_{name}", ALTERNATIVES / folder / f"{name}.py")
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        yield getattr(module, function)


@pytest.mark.parametrize("stage", NAMES)
def test_correct_functions_pass(stage):
    """Every correct way passes."""
    for function in right_ways(stage):
        report = check(function, stage=stage)
        assert report, str(report)


@pytest.mark.parametrize("stage", NAMES)
def test_wrong_functions_are_told_and_each_check_can_fail(stage):
    """Every mistake in the catalogue fails a public check with a message, and no line is right by default."""
    reference = STAGES[stage].reference

    def overwrites(*args):
        result = reference(*args)
        args[0][...] = 7.0
        return result

    failed = set()
    for function in (*(item.function for item in of_stage(stage)), overwrites, lambda *_: ()):
        report = check(function, stage=stage)
        wrong = {one.name: one.message for one in report.items if one.passed is False}
        assert wrong, function
        assert all(wrong.values())
        failed |= set(wrong)
    wanted = {one.name for one in PUBLIC[stage]}
    if stage == "velocity.jacobians":
        few_digits = check(
            lambda x, u, dt: reference(x, np.add(u, [0, 1e-3 * (u[1] != 0), 0]), dt), stage=stage
        )
        failed |= {one.name for one in few_digits.items if one.passed is False}
    if stage == "ukf.correct":  # nobody has been seen who changes a belief by nothing
        report = check(lambda mean, cov, *_: (mean + 1, cov), stage=stage)
        failed |= {one.name for one in report.items if one.passed is False}
    assert failed == wanted


def test_numbers_worked_by_hand_are_right():
    """The average of the points' views in the correction's example is that of three views, by hand."""
    y = np.array([0.0, 0.5 * np.sqrt(3), -0.5 * np.sqrt(3)])
    bearings, ranges = np.arctan2(2 - y, 2), np.hypot(2, 2 - y)
    weights = np.array([4, 1, 1]) / 6
    np.testing.assert_allclose([weights @ bearings, weights @ ranges], (0.769819, 2.851281), atol=1e-6)


def test_no_answer_is_stored():
    """No sine, cosine, arctangent or root of a matrix stands in the checks."""
    for module in (velocity, unscented):
        source = Path(module.__file__).read_text(encoding="utf-8")
        assert not [
            word for word in ("sin(", "cos(", "arctan", "atan", "cholesky", "hypot") if word in source
        ]
