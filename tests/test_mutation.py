"""Mutation testing in small: what is mutated, what kills, and what a weak check lets live."""

import dataclasses
import time

import pytest

import mutants
import mutation
from autograder.checks import STAGES

NAME = "gaussian.transition_update"
SECRETS = ["mutation-0"]
pytestmark = pytest.mark.filterwarnings(
    "ignore:This process:DeprecationWarning"
)  # of forks, from Python 3.12 on


def of(stage):
    """Return the places behind a stage, and its mutants."""
    found = mutants.places(STAGES[stage], STAGES.values())
    return {place.name for place in found}, [mutant for place in found for mutant in mutants.mutants(place)]


@pytest.fixture(scope="module")
def verdicts():
    """Judge the mutants of the prediction step."""
    return list(mutation.judge(STAGES[NAME], SECRETS, 2))


def test_the_checks_kill_what_they_can(verdicts):
    """Of the mutants of a stage none lives but those that are listed with a reason, and no other is listed."""
    assert len(verdicts) > 20
    assert mutation.faults(verdicts, mutation.listed()) == []
    assert mutation.share(verdicts, mutation.listed()) >= mutation.WANTED


def test_a_weak_check_lets_mutants_live(verdicts):
    """With the check of the mean alone the run fails, and names what lives: noise subtracted, a transpose lost."""
    stage = STAGES[NAME]
    kept = tuple(check for check in stage.checks if check.name == "mean")
    found = list(mutation.judge(dataclasses.replace(stage, checks=kept), SECRETS, 2))
    assert len(found) == len(verdicts)
    wrong = mutation.faults(found, mutation.listed())
    assert any("lives and is not listed" in fault and "@ Gx.T - dt *" in fault for fault in wrong)
    assert any("lives and is not listed" in fault and "Gx @ Sigma @ Gx +" in fault for fault in wrong)
    assert mutation.share(found, mutation.listed()) < 0.5


def test_the_list_is_held_against_the_run(verdicts):
    """What is listed and is killed, or is in no stage's code any more, is a fault."""
    killed = next(verdict.key for verdict in verdicts if verdict.killed)
    gone = (NAME, "gaussian.transition_update", "return nothing", "return all")
    known = mutation.listed() | dict.fromkeys((killed, gone), mutation.Known("no reason", counts=True))
    wrong = mutation.faults(verdicts, known)
    assert len(wrong) == 2
    assert sum("is listed and is killed" in fault for fault in wrong) == 1
    assert sum("is listed and is gone" in fault for fault in wrong) == 1


def test_every_survivor_has_a_reason():
    """Each listed mutant is one of a stage that there is, and is explained in a sentence."""
    for (stage, place, before, after), known in mutation.listed().items():
        assert stage in STAGES
        assert place
        assert before != after
        assert len(known.reason) > 30
        assert known.reason.endswith(".")


def test_what_is_mutated_is_the_code_behind_a_stage():
    """The reference, its helpers and its numbers; not the functions of other stages, nor what checks arguments."""
    names, found = of("motion.compute_dynamics")
    assert names == {"motion._SERIES_H2", "motion.arc", "motion.compute_dynamics"}
    assert {mutant.place for mutant in found} == names
    names, _ = of("extraction.line_parameters")
    assert names == {"fit_a_line.line_parameters"}
    names, _ = of("ballistic.correct")
    assert names == {"ballistic.correct"}
    every = [mutant for name in STAGES for mutant in of(name)[1]]
    assert not any(mutant.before.startswith("raise ") for mutant in every)
    checked = [one for one in every if one.place in {"motion.compute_dynamics", NAME}]
    assert checked
    assert not any("= as_" in mutant.before for mutant in checked)


def test_one_change_each():
    """A mutant differs from the stage, and no two of a stage are the same."""
    _, found = of(NAME)
    changes = {mutant.change for mutant in found}
    assert ("gaussian.symmetric", "return 0.5 * (matrix + matrix.T.copy())", "return 0.5 * matrix") in changes
    assert len(changes) == len(found)
    # A sum of squares, whose sides swapped are the same.
    _, squares = of("particle.effective_sample_size")
    assert all(mutant.before != mutant.after for mutant in found + squares)


def test_a_mutant_that_never_ends_is_killed():
    """Work that uses up its time, or that waits, is ended, and the rest goes on."""

    def forever():
        while True:
            pass

    tasks = [("loops", forever, 1), ("waits", lambda: time.sleep(60), 1), ("works", lambda: "done", 1)]
    assert dict(mutation.apart(3, iter(tasks))) == {"loops": "time", "waits": "time", "works": "done"}
