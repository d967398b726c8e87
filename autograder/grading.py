"""What a hidden test cell calls: :func:`grade` for a stage, :func:`grade_expression` for a symbolic answer.

Both run the hidden checks, show a report as display data and return a :class:`Score`, which prints as the
points that were earned: nbgrader reads the printed result of a test cell as its score.
"""

from __future__ import annotations

import math
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING, Any, Self

from IPython.display import display

from autograder.check import run_stage
from autograder.checks import EXPRESSIONS, STAGES
from autograder.diagnose import diagnose
from autograder.misconceptions import of_stage
from autograder.report import Report
from autograder.secret import course_secret
from autograder.symbolic import evaluated

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from autograder.check import Outcome, Stage

_DIGITS = 4
_ROUNDING = 1e-6
_settings: ContextVar[dict[str, Any]] = ContextVar("settings", default={})  # noqa: B039 (never written to)


class Score(float):
    """Points earned: a float that prints with at most four decimals, and keeps its report.

    Examples
    --------
    >>> Score(10 / 3)
    3.3333
    """

    report: Report | None

    def __new__(cls, value: float) -> Self:
        """Cut to what is printed: the number and its text are one, and never above the points."""
        score = super().__new__(cls, math.floor(value * 10**_DIGITS + _ROUNDING) / 10**_DIGITS)
        score.report = None
        return score

    def __repr__(self) -> str:
        """Return the points as a decimal number."""
        return f"{float(self):.{_DIGITS}f}".rstrip("0").rstrip(".")

    __str__ = __repr__


@contextmanager
def grading_run(
    *,
    secret: str | None = None,
    run_id: str | None = None,
    publish: Callable[[dict[str, str]], None] | None = None,
    explain: bool | None = None,
    root: Path | None = None,
) -> Iterator[None]:
    """Set, for the calls within, what a test cell cannot say itself.

    Parameters
    ----------
    secret : str, optional
        The course's secret; looked up with :func:`autograder.secret.course_secret` if not given.
    run_id : str, optional
        What the reports of this run are filed under.
    publish : callable, optional
        Takes a report as display data (media type to text); IPython shows it if not given.
    explain : bool, optional
        Whether reports say, under a media type of their own, what the checks asked: see `autograder.explain`.
    root : pathlib.Path, optional
        The course's folder; found from the working directory if not given.
    """
    given = {"secret": secret, "run_id": run_id, "publish": publish, "explain": explain, "root": root}
    given = {name: value for name, value in given.items() if value is not None}
    token = _settings.set(_settings.get() | given)
    try:
        yield
    finally:
        _settings.reset(token)


def grade(stage: str, function: Callable[..., Any], points: float) -> Score:
    """Run a stage's hidden checks on a function, show the report, and return the points.

    Parameters
    ----------
    stage : str
        Name of the stage, such as ``"motion.compute_dynamics"``.
    function : callable
        The student's function, or the proxy that stands for it.
    points : float
        What a full pass is worth.

    Returns
    -------
    Score
        points times the share of passed weight; 0 <= score <= points.

    Raises
    ------
    ValueError
        If there is no such stage, or if points is not a positive number.
    """
    if stage not in STAGES:
        raise ValueError(f"stage: expected one of {', '.join(STAGES)}, got {stage!r}")
    return _grade(STAGES[stage], function, points)


def grade_expression(name: str, target: Any, points: float) -> Score:
    """Compare a symbolic answer with the right one at random points, show the report, and return the points.

    Parameters
    ----------
    name : str
        Name of the answer, such as ``"differential_drive.g"``.
    target : sympy object
        The student's expression, or the proxy that stands for it.
    points : float
        What it is worth if it is equal.

    Returns
    -------
    Score
        points or 0.

    Raises
    ------
    ValueError
        If there is no such answer, or if points is not a positive number.
    """
    if name not in EXPRESSIONS:
        raise ValueError(f"name: expected one of {', '.join(EXPRESSIONS)}, got {name!r}")
    from autograder import remote  # noqa: PLC0415 (only symbolic answers need the wire)

    return _grade(EXPRESSIONS[name].stage(), evaluated(remote.evaluate, target), points)


def _grade(stage: Stage, function: Callable[..., Any], points: float) -> Score:
    if not (isinstance(points, (int, float)) and math.isfinite(points) and points > 0):
        raise ValueError(f"points: expected a positive number, got {points!r}")
    outcome = outcome_of(stage, function)
    score = Score(points * outcome.share)
    diagnoses = diagnose(outcome, of_stage(stage.name))
    score.report = Report(outcome, diagnoses, float(points), float(score), run_id())
    show(score.report.bundle(explained=_settings.get().get("explain", False)))
    return score


def outcome_of(stage: Stage, function: Callable[..., Any]) -> Outcome:
    """Run a stage's hidden checks with this run's secret."""
    settings = _settings.get()
    return run_stage(stage, function, settings.get("secret") or course_secret(settings.get("root")))


def run_id() -> str:
    """Return what the reports of this run are filed under."""
    return _settings.get().get("run_id", "")


def show(bundle: dict[str, Any]) -> None:
    """Show a report, as display data or as this run has it."""
    publish = _settings.get().get("publish")
    if publish:
        publish(bundle)
    else:
        display(bundle, raw=True)
