r"""Four filters on one problem, and one table.

The same runs go through the extended, the unscented, the particle and the right-invariant Kalman filter
(:mod:`roboloc_reference.contenders`), and each gets one line: how far off it is, whether it knows that, and what it
costs. The costs are counted and not timed, so the table is the same on every machine.

Source: the four filters are those of Michigan ROB530, homework 5, problem 1.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from roboloc.metrics import pose_error
from roboloc.velocity_logs import VelocityLog
from roboloc_reference.contenders import Filter


@dataclass(frozen=True, eq=False)
class Track:
    """What a filter made of a run.

    Parameters
    ----------
    errors : (N, 3) ndarray
        Estimate minus truth after each step, the heading on the circle [m, m, rad].
    nees : (N,) ndarray
        Normalized squared errors.
    motions, sightings : int
        Poses moved and landmarks looked at.
    """

    errors: np.ndarray
    nees: np.ndarray
    motions: int
    sightings: int


@dataclass(frozen=True)
class Row:
    """One line of the table, over all runs and steps.

    Parameters
    ----------
    name : str
        The filter.
    position, heading : float
        Root mean square errors [m, rad].
    nees : float
        Mean normalized squared error; 3 if the filter is honest.
    motions, sightings : float
        Poses moved and landmarks looked at, per step.
    """

    name: str
    position: float
    heading: float
    nees: float
    motions: float
    sightings: float


def follow(scenario: VelocityLog, estimator: Filter) -> Track:
    """Take a filter through a run.

    Parameters
    ----------
    scenario : VelocityLog
        The run.
    estimator : Filter
        A filter at its start; it is changed.

    Returns
    -------
    Track
        What came out.
    """
    errors, squares = [], []
    for u, z, landmarks, truth in scenario.steps():
        estimator.predict(u)
        estimator.correct(z, landmarks)
        errors.append(pose_error(estimator.pose(), truth))
        squares.append(estimator.nees(truth))
    return Track(np.array(errors), np.array(squares), estimator.motions, estimator.sightings)


def compare(
    scenarios: Iterable[VelocityLog], filters: Mapping[str, Callable[[VelocityLog], Filter]]
) -> list[Row]:
    """Take filters through runs.

    Parameters
    ----------
    scenarios : iterable of VelocityLog
        The runs.
    filters : mapping of str to callable
        From names to what makes a filter for a run; see :func:`roboloc_reference.contenders.four_filters`.

    Returns
    -------
    list of Row
        One for each filter, in their order.

    Examples
    --------
    Where nothing goes wrong, a filter is exact.

    >>> from roboloc_reference.contenders import Extended
    >>> from roboloc_reference.scenarios import simulate
    >>> row = compare([simulate(None)], {"EKF": Extended})[0]
    >>> bool(row.position < 1e-12), row.motions, row.sightings
    (True, 1.0, 2.0)
    """
    scenarios = list(scenarios)
    rows = []
    for name, make in filters.items():
        tracks = [follow(scenario, make(scenario)) for scenario in scenarios]
        errors = np.concatenate([track.errors for track in tracks])
        rows.append(
            Row(
                name,
                position=float(np.sqrt(np.mean(np.sum(errors[:, :2] ** 2, axis=1)))),
                heading=float(np.sqrt(np.mean(errors[:, 2] ** 2))),
                nees=float(np.mean([track.nees for track in tracks])),
                motions=sum(track.motions for track in tracks) / len(errors),
                sightings=sum(track.sightings for track in tracks) / len(errors),
            )
        )
    return rows


def to_markdown(rows: Iterable[Row]) -> str:
    """Return the table as Markdown.

    Parameters
    ----------
    rows : iterable of Row
        See :func:`compare`.

    Returns
    -------
    str
        A header and one line for each filter.

    Examples
    --------
    >>> print(to_markdown([Row("EKF", 0.0521, 0.0213, 3.02, 1.0, 2.0)]))
    | filter | position [m] | heading [rad] | NEES (3 is honest) | motions a step | sightings a step |
    |---|---:|---:|---:|---:|---:|
    | EKF | 0.0521 | 0.0213 | 3.02 | 1 | 2 |
    """
    lines = [
        "| filter | position [m] | heading [rad] | NEES (3 is honest) | motions a step | sightings a step |",
        "|---|---:|---:|---:|---:|---:|",
    ]
    lines += [
        f"| {row.name} | {row.position:.4f} | {row.heading:.4f} | {row.nees:.2f} "
        f"| {row.motions:.0f} | {row.sightings:.0f} |"
        for row in rows
    ]
    return "\n".join(lines)
