"""nbgrader's own tests with our plug-in, a few of them; `make drop-in` runs all."""

import drop_in

# Between them: releasing, grading, a changed test cell, the score of a cheat; a listed deviation.
FEW = (
    "test_grade_hashed_autotest",
    "test_grade_with_validating_envvar",
    "test_showtraceback_exploit",
    "test_grade_overwrite_files_subdirs",
    "test_side_effects",
)


def test_tests_of_nbgrader_pass_with_the_plug_in():
    """A few of nbgrader's own tests pass, and what deviates on purpose does."""
    passed = drop_in.run(FEW)
    assert set(passed) == set(FEW)
    assert drop_in.faults(passed) == []


def test_results_are_held_against_the_list():
    """A failure that is not listed is a fault, and so is a listed one that passes."""
    (listed, *_) = drop_in.DEVIATIONS
    assert drop_in.faults({"test_a": True, listed: False}) == []
    assert drop_in.faults({"test_a": False}) == ["test_a: fails, and is no known deviation"]
    assert drop_in.faults({listed: True}) == [f"{listed}: is listed as a deviation, and passes"]


def test_every_deviation_has_a_reason():
    """Each is told in a sentence."""
    assert all(len(reason) > 40 and reason.endswith(".") for reason in drop_in.DEVIATIONS.values())
