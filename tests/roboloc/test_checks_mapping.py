"""The public checks of a map that grows: what they accept, and how they say what is wrong."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from autograder.checks import STAGES as GRADED
from autograder.misconceptions import of_stage
from roboloc.checks import check, mapping

STAGES = {"line_in_world": mapping.LINE_IN_WORLD, "augment": mapping.AUGMENT, "recognize": mapping.RECOGNIZE}
ALTERNATIVES = Path(__file__).resolve().parents[1] / "autograder" / "alternatives"


def reference(stage):
    """Return the right version of a stage."""
    return GRADED[f"slam.{stage}"].reference


def alternative(name, stage):
    """Load another right way to write a stage."""
    spec = importlib.util.spec_from_file_location(f"public_{name}", next(ALTERNATIVES.glob(f"*/{name}.py")))
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return getattr(module, stage)


def alternatives(stage):
    """Load the other right ways."""
    kind = "recognize" if stage == "recognize" else "grow"
    return [alternative(f"{kind}_{name}", stage) for name in ("loops", "matrices")]


@pytest.mark.parametrize("stage", STAGES)
def test_correct_functions_pass(stage):
    """Every correct way passes: the reference, loops, matrices."""
    for function in (
        reference(stage),
        *alternatives(stage),
    ):
        report = check(function, stage=stage)
        assert report, str(report)


@pytest.mark.parametrize("stage", STAGES)
def test_wrong_functions_are_told_what_is_wrong(stage):
    """Every mistake in the catalogue fails a public check, which has a message."""
    for item in of_stage(f"slam.{stage}"):
        report = check(item.function, stage=stage)
        failed = [one.message for one in report.items if one.passed is False]
        assert failed, item.name
        assert all(failed), item.name


@pytest.mark.parametrize("stage", STAGES)
def test_each_check_can_fail(stage):
    """No line of the report is right by default."""

    def with_a_map_alone(*arguments):
        if len(arguments[0]) == 3 or 0 in np.shape(arguments[2]):
            raise ValueError
        return reference(stage)(*arguments)

    def writes(*arguments):
        returned = reference(stage)(*arguments)
        arguments[0][0] += 1.0
        return returned

    def negative(*arguments):
        returned = reference(stage)(*arguments)
        return (returned[0], -returned[1], *returned[2:]) if stage == "augment" else returned

    def elsewhere(*arguments):
        returned = reference(stage)(*arguments)
        return (returned[0] + 1.0, *returned[1:]) if stage == "line_in_world" else returned

    functions = [item.function for item in of_stage(f"slam.{stage}")]
    functions += [with_a_map_alone, writes, negative, elsewhere, lambda *_: (), lambda *_: 7]
    failed = set()
    for function in functions:
        report = check(function, stage=stage)
        failed |= {one.name for one in report.items if one.passed is False}
    assert failed == {one.name for one in STAGES[stage]}


def test_no_answer_is_stored():
    """The sines and cosines of the answer are not in the checks."""
    source = Path(mapping.__file__).read_text(encoding="utf-8")
    assert "cos(" not in source
    assert "sin(" not in source
