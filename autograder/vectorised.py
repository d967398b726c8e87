"""Extra credit for loops removed: :func:`grade_vectorised`, which a test cell of 0 points calls.

It is earned, all or nothing, by a function that passes every check of its stage, in whose text no loop over particles
is found (`autograder.loops`), and of which ten times the particles run no more lines of Python (`worker.lines`). Both
judgements must agree: the text is read where no submission runs, but does not tell how long everything is; the count
tells that, but comes from where the submission runs. Time is never measured, and nothing is ever taken away.

The lines are counted with arguments that are no secret, and before the hidden checks run in this process: a count says
nothing about a hidden input. A loop over the lines of a map or over observations is no loop over particles.

In the gradebook a cell of 0 points carries the credit as nbgrader's own *extra credit*, which adds to the score of the
assignment and leaves its maximum as it is. nbgrader reads the printed result, 0, as the cell's score; the credit goes
along as display data of the type `EXTRA`, and `autograder.grades.SaveGrades` writes it into the gradebook.
"""

from __future__ import annotations

import contextlib
import math
from dataclasses import dataclass, field
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from autograder import loops, remote
from autograder.check import copied, describe_error
from autograder.checks import STAGES
from autograder.compare import compare
from autograder.grading import Score, outcome_of, run_id, show
from autograder.provenance import checks_version, environment_version
from autograder.reading import Unreadable
from autograder.roles import EXTRA

if TYPE_CHECKING:
    from collections.abc import Callable

    from autograder.check import Stage

FEW = 1000
MANY = 10 * FEW
# Lines that one more particle may cost: blocks of particles are no loop, every fourth particle is.
PER_PARTICLE = 0.25


@dataclass(frozen=True)
class ExtraReport:
    """What a student reads about loops: what was earned, why not, and what was found."""

    stage: str
    earned: float
    extra: float
    lines: tuple[str, ...] = ()
    run: str = field(default="")

    @property
    def title(self) -> str:
        """The first line."""
        return f"{self.stage} without loops over particles: {self.earned:g} of {self.extra:g} extra points"

    def __str__(self) -> str:
        """Return the report as plain text."""
        footer = f"Checks {checks_version(self.stage)}; {environment_version()}" + (
            f"; run {self.run}" if self.run else ""
        )
        return "\n".join([self.title, *(f"  {line}" for line in self.lines), footer])

    def bundle(self) -> dict[str, Any]:
        """Return the report as display data, with the credit for the gradebook."""
        *_, footer = str(self).splitlines()
        items = "".join(f"<li>{escape(line)}</li>" for line in self.lines)
        html = f"<h4>{escape(self.title)}</h4>\n<ul>{items}</ul>\n<p><code>{escape(footer)}</code></p>"
        return {
            "text/plain": str(self),
            "text/html": html,
            EXTRA: {"earned": self.earned, "of": self.extra},
        }


def grade_vectorised(stage: str, function: Callable[..., Any], extra: float) -> Score:
    """Give extra credit for a stage without a loop over particles, and show why, or why not.

    Parameters
    ----------
    stage : str
        Name of the stage, such as ``"mcl.transition_model"``.
    function : callable
        The student's function, or the proxy that stands for it.
    extra : float
        What it is worth.

    Returns
    -------
    Score
        0, the points of the cell; its report says what was earned.

    Raises
    ------
    ValueError
        If there is no such stage, if it is none on particles, or if extra is not a positive number.
    """
    if stage not in STAGES or STAGES[stage].many is None:
        known = ", ".join(name for name, one in STAGES.items() if one.many)
        raise ValueError(f"stage: expected one of {known}, got {stage!r}")
    if not (isinstance(extra, (int, float)) and math.isfinite(extra) and extra > 0):
        raise ValueError(f"extra: expected a positive number, got {extra!r}")
    found = STAGES[stage]
    reasons, remarks = judged(found, function)
    earned = float(extra) if not reasons else 0.0
    score = Score(0)
    lines = (*reasons, *remarks) if reasons else ("Both the text and the count of lines say so.", *remarks)
    score.report = ExtraReport(stage, earned, float(extra), lines, run_id())
    show(score.report.bundle())
    return score


def judged(stage: Stage, function: Callable[..., Any]) -> tuple[list[str], list[str]]:
    """Judge a function of a stage on particles.

    Returns
    -------
    reasons : list of str
        Why there is no credit; none where it is earned.
    remarks : list of str
        What else to say.
    """
    few, many = (stage.many(count) for count in (FEW, MANY))
    clouds = {
        place: np.ndim(one)
        for place, (one, other) in enumerate(zip(few, many, strict=True))
        if np.shape(one) != np.shape(other)
    }
    reasons, remarks = counted(stage, function, few, many)
    try:
        name = getattr(function, "__name__", "") or stage.function_name
        found = loops.find(remote.sources_of(function), name, clouds)
    except Unreadable as why:
        text = (
            f"The text of the function cannot be judged: {why}. That is no fault, but the credit needs text "
            "that can be read without running it."
        )
        reasons.append(text)
    else:
        for loop in found:
            text = f"Line {loop.line} of a cell: {loop.what}."
            if loop.refused:
                reasons.append(text)
            else:
                remarks.append(f"{text} Whether it goes over particles, the count of lines says.")
    if outcome_of(stage, function).failed:
        reasons.insert(0, "It is earned once the function passes every check of its stage.")
    if reasons:
        remarks.append("The points of the stage itself are not touched by this.")
    return reasons, remarks


def counted(
    stage: Stage, function: Callable[..., Any], few: tuple, many: tuple
) -> tuple[list[str], list[str]]:
    """Count the lines that run for few and for ten times as many particles; return reasons and remarks."""
    counts = []
    for again, args in ((True, few), (False, few), (False, many)):
        try:
            events, value = remote.line_events(function, copied(args), MANY)
        except (Exception, SystemExit) as error:  # noqa: BLE001  (see `check.Recorder`)
            return [f"With {len(args[0])} particles {describe_error(error)[1]}."], []
        if events is None:
            return [
                "While lines were counted, something else used Python's tracing, a thread or a process."
            ], []
        if again:
            continue  # a first call imports what it needs, and that runs lines, too
        if events < MANY:
            if type(value) is list:  # as good as an array, and too long to be read item by item
                with contextlib.suppress(ValueError, TypeError):
                    value = np.array(value, dtype=float)
            try:
                compare(lambda *_, value=value: value, [stage.case(*args)])
            except AssertionError:
                return [f"With {len(args[0])} particles the call gave another result than it should."], []
        counts.append(events)
    (M, now), (N, then) = zip((FEW, MANY), counts, strict=True)
    text = f"{M} particles took {_number(now)} of Python, {N} took {_number(then)}"
    if then >= MANY or then - now > PER_PARTICLE * (N - M):
        return [f"{text}: the function goes from particle to particle."], []
    return [], [f"{text}."]


def _number(count: int) -> str:
    return f"{count} lines" if count < MANY else f"{MANY} lines or more"
