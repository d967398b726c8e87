r"""Hidden checks of the unscented filter in the notebook *ekf-and-ukf*: sigma points, prediction, correction.

The notebook fixes what textbooks leave open, since other choices are other filters: points in the order mean, mean
plus, mean minus; the lower root; control and pose drawn together in the prediction; bearings averaged by their wrapped
residuals; and with a negative kappa squares about the image of the centre. What it does not fix is left open: loops,
the order of sums, the direction from which residuals are taken, Sigma - K S K^T or a sum of squares.

Rounding is far below 1e-9 of the standard deviations. Inputs keep beliefs so wide that the tangent is off by percents,
and so narrow that all bearings of one landmark are within half a turn. The stages are fed right inputs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from autograder.check import Case, Check, Stage, remembered
from autograder.checks.association_inputs import covariance
from autograder.checks.kinds import each, repeatable, untouched
from autograder.checks.motion_model import heading
from autograder.checks.velocity_model import POSE
from roboloc.angles import wrap
from roboloc_reference import ukf

if TYPE_CHECKING:
    from numpy.random import Generator

_SHARE = 1e-8


def points_tolerance(mean: np.ndarray, cov: np.ndarray, kappa: float) -> tuple[np.ndarray, np.ndarray]:
    """Bound the error of points by the standard deviations, that of weights by the largest of them."""
    points, weights = ukf.sigma_points(mean, cov, kappa)
    size = np.sqrt(np.diag(cov)) + 1e-4 * np.abs(mean)
    return _SHARE * np.broadcast_to(size, points.shape), _SHARE * (np.abs(weights).max() + 0 * weights)


def predict_tolerance(*args: object) -> tuple[np.ndarray, np.ndarray]:
    """Bound the error of mean and covariance by the standard deviations."""
    mean, cov = ukf.predict(*args)
    size = np.sqrt(np.diag(cov))
    return _SHARE * (size + 1e-4 * np.abs(mean)), _SHARE * np.outer(size, size)


def correct_tolerance(*args: object) -> tuple[np.ndarray, np.ndarray]:
    """Bound the error of mean and covariance by the standard deviations before."""
    size = np.sqrt(np.diag(args[1]))
    return _SHARE * (size + 1e-4 * np.abs(args[0])), _SHARE * np.outer(size, size)


def _spread(rng: Generator, n: int, sizes: np.ndarray) -> np.ndarray:
    """Draw a covariance with correlations of some size and standard deviations near the given ones."""
    while True:
        cov = covariance(rng, n)
        d = np.sqrt(np.diag(cov))
        r = cov / np.outer(d, d)
        if n == 1 or (np.abs(r[~np.eye(n, dtype=bool)]).min() > 0.15 and np.linalg.cond(r) < 60):
            s = sizes * rng.uniform(0.8, 1.25, n)
            return r * np.outer(s, s)


def _sets(rng: Generator, kappas: tuple[float, ...]) -> list[Case]:
    """Make beliefs of 2 to 4 numbers, one for each kappa."""
    cases = []
    for i, kappa in enumerate(kappas):
        n = (3, 2, 4, 3)[i % 4]
        mean, sizes = rng.uniform(-3, 3, n), rng.uniform(0.3, 2.0, n)
        cases.append(POINTS.case(mean, _spread(rng, n, sizes), float(kappa + rng.uniform(-0.2, 0.2))))
    return cases


@remembered
def positive(rng: Generator) -> list[Case]:
    """Make sets with a positive kappa."""
    return _sets(rng, (2.0, 1.0, 0.5, 3.0))


@remembered
def zero(rng: Generator) -> list[Case]:
    """Make sets without weight in the centre."""
    cases = _sets(rng, (0.0, 0.0, 0.0))
    return [POINTS.case(*case.args[:2], 0.0) for case in cases]


@remembered
def negative(rng: Generator) -> list[Case]:
    """Make sets with a negative weight in the centre."""
    return _sets(rng, (-1.0, -0.6, -1.3))


def _near(rng: Generator, kappa: float, off: float) -> float:
    """Draw a number near kappa; 0 stays 0."""
    return float(kappa + rng.uniform(-off, off)) if kappa else 0.0


def _step(rng: Generator, kappa: float, *, turned: bool) -> Case:
    """Make a prediction from a belief that is wide in heading, or of a robot that looks almost straight back."""
    theta = np.pi + rng.uniform(-0.1, 0.1) if turned else heading(rng) * 0.4
    mean = np.array([*rng.uniform(-3, 3, 2), theta])
    cov = _spread(rng, 3, np.array([0.2, 0.2, 0.3]))
    u = rng.uniform([0.8, 0.4, 0.1], [1.5, 0.9, 0.3]) * rng.choice([-1, 1], 3)
    M = np.diag(rng.uniform([0.1, 0.15, 0.1], [0.2, 0.25, 0.2])) ** 2
    return PREDICT.case(mean, cov, u, M, float(rng.choice([0.4, 1.4]) * rng.uniform(0.9, 1.1)), kappa)


def _headings(case: Case) -> np.ndarray:
    """Return the headings at which the points of a prediction end."""
    mean, cov, u, M, dt, kappa = case.args
    joint = np.zeros((6, 6))
    joint[:3, :3], joint[3:, 3:] = cov, M
    points, _ = ukf.sigma_points(np.concatenate([mean, u]), joint, kappa)
    return points[:, 2] + dt * (points[:, 4] + points[:, 5])


def _steps(rng: Generator, kappas: tuple[float, ...], *, turned: bool = False) -> list[Case]:
    """Make predictions, one for each kappa; headings are all in one turn, or on both sides of the cut."""
    cases: list[Case] = []
    while len(cases) < len(kappas):
        case = _step(rng, _near(rng, kappas[len(cases)], 0.2), turned=turned)
        ends = _headings(case)
        if (ends.min() < 3.0 and 3.3 < ends.max() < 6.0) if turned else np.abs(ends).max() < 3.0:
            cases.append(case)
    return cases


@remembered
def moved(rng: Generator) -> list[Case]:
    """Make predictions with positive weights."""
    return _steps(rng, (2.0, 1.0, 0.0, 3.0, 2.0))


@remembered
def moved_negative(rng: Generator) -> list[Case]:
    """Make predictions with a negative weight in the centre."""
    return _steps(rng, (-3.0, -2.0, -1.0, -3.5))


@remembered
def moved_back(rng: Generator) -> list[Case]:
    """Make predictions of a robot that looks back, with headings beyond half a turn, and one of a straight drive."""
    mean, cov, (v, _, gamma), *rest = _steps(rng, (1.0,))[0].args
    straight = PREDICT.case(mean, cov, np.array([v, 0.0, gamma]), *rest)
    return [*_steps(rng, (2.0, 1.0, -2.0), turned=True), straight]


def _sightings(
    rng: Generator,
    kappas: tuple[float, ...],
    bearing: tuple[float, float],
    k: int = 2,
    *,
    west: bool = False,
) -> list[Case]:
    """Make corrections by landmarks whose bearings have sizes between two, one case for each kappa.

    A landmark to the `west` is in a direction next to the cut, whatever its bearing.
    """
    cases = []
    for kappa in kappas:
        bearings = rng.uniform(*bearing, k) * rng.choice([-1, 1], k)
        theta = wrap(np.pi + rng.uniform(-0.05, 0.05) - bearings[0]) if west else heading(rng)
        x = np.array([*rng.uniform(-2, 2, 2), theta])
        cov = _spread(rng, 3, np.array([0.3, 0.3, 0.15]))
        ranges = rng.uniform(1.6, 3.0, k)
        angle = x[2] + bearings
        landmarks = x[:2] + ranges[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        Q = _spread(rng, 2, np.array([0.08, 0.15]))
        off = rng.uniform(0.06, 0.15, (k, 2)) * rng.choice([-1, 1], (k, 2))
        z = np.stack([wrap(bearings + off[:, 0]), ranges + off[:, 1]], axis=1).ravel()
        cases.append(CORRECT.case(x, cov, z, landmarks, Q, _near(rng, kappa, 0.15)))
    return cases


def _needs_no_wrap(case: Case) -> bool:
    """Tell whether no bearing of a case, computed as direction less heading, leaves the turn."""
    mean, cov, z, landmarks, _, kappa = case.args
    points, _ = ukf.sigma_points(mean, cov, kappa)
    d = landmarks - points[:, None, :2]
    raw = np.arctan2(d[..., 1], d[..., 0])
    same = np.ptp(raw, axis=0).max() < 3 and np.abs(raw - points[:, 2:]).max() < 3
    return bool(same and np.abs(z[::2] - (raw - points[:, 2:])).max() < 3)


@remembered
def seen(rng: Generator) -> list[Case]:
    """Make corrections by two landmarks before the robot, with positive weights."""
    cases: list[Case] = []
    while len(cases) < 5:
        (case,) = _sightings(rng, ((2.0, 1.0, 0.0, 0.5, 2.0)[len(cases)],), (0.3, 1.0))
        cases += [case] if _needs_no_wrap(case) else []
    return cases


@remembered
def seen_behind(rng: Generator) -> list[Case]:
    """Make corrections by landmarks straight behind, or straight west: the points see them on both sides of a cut."""
    west = _sightings(rng, (2.0, 1.0, 0.5), (0.4, 1.2), west=True)
    return _sightings(rng, (2.0, 1.0, 0.5) * 4, (3.02, 3.12)) + west


@remembered
def seen_negative(rng: Generator) -> list[Case]:
    """Make corrections with a negative weight in the centre, before the robot and behind."""
    return _sightings(rng, (-1.0, -0.5), (0.3, 1.0)) + _sightings(rng, (-1.0, -0.7) * 8, (3.02, 3.12))


@remembered
def counts(rng: Generator) -> list[Case]:
    """Make corrections by one landmark and by three."""
    return [case for k in (1, 3) for case in _sightings(rng, (2.0, 1.0), (0.3, 1.0), k)]


@remembered
def nothing(rng: Generator) -> list[Case]:
    """Make corrections by nothing at all."""
    return [
        CORRECT.case(*case.args[:2], np.zeros(0), np.zeros((0, 2)), *case.args[4:])
        for case in _sightings(rng, (2.0, 1.0, 0.5), (0.3, 1.0))
    ]


_HINT_POINTS = "What are the mean and the covariance of your points, counted with your weights?"
_HINT_NEGATIVE = (
    "A weight may be negative. Which points have it, and what does a sum of squares become with it?"
)
_HINT_MOVED = "Each point is a pose and a control of its own. Where does each of them end?"
_HINT_BACK = "The motion does not wrap headings. Do you, before you average them?"
_HINT_SEEN = (
    "Three sums over the points: what is seen on average, its covariance, and its covariance with the pose."
)
_HINT_CUT = "Of two bearings on either side of the cut: what is their mean, and how far is each from it?"
_HINT_COPY = "Work on copies, or on new names."
_HINT_GLOBAL = "Use the arguments alone, nothing global."
_SET, _BELIEF = frozenset({"points", "weights"}), frozenset({"mean", "cov"})

POINTS = Stage(
    name="ukf.sigma_points",
    outputs=("points", "weights"),
    reference=ukf.sigma_points,
    tolerance=points_tolerance,
    checks=(
        Check("points", 6, each(positive, "points"), _HINT_POINTS),
        Check("weights", 6, each(positive, "weights"), _HINT_POINTS),
        Check("no weight in the centre", 2, each(zero), "With kappa = 0 nothing is special."),
        Check("negative weight in the centre", 3, each(negative), _HINT_NEGATIVE),
        Check("arguments untouched", 2, untouched(positive, ("mean", "cov", "kappa"), _SET), _HINT_COPY),
        Check("same call, same result", 1, repeatable(positive, _SET), _HINT_GLOBAL),
    ),
)
PREDICT = Stage(
    name="ukf.predict",
    outputs=("mean", "cov"),
    reference=ukf.predict,
    tolerance=predict_tolerance,
    rows={"mean": POSE, "cov": POSE},
    columns={"cov": POSE},
    checks=(
        Check("mean", 4, each(moved, "mean"), _HINT_MOVED),
        Check("cov", 6, each(moved, "cov"), _HINT_MOVED),
        Check("mean, negative kappa", 2, each(moved_negative, "mean"), _HINT_NEGATIVE),
        Check("cov, negative kappa", 3, each(moved_negative, "cov"), _HINT_NEGATIVE),
        Check("a robot that looks back, or is told to drive straight", 3, each(moved_back), _HINT_BACK),
        Check(
            "arguments untouched",
            1,
            untouched(moved, ("mean", "cov", "u", "M", "dt", "kappa"), _BELIEF),
            _HINT_COPY,
        ),
        Check("same call, same result", 1, repeatable(moved, _BELIEF), _HINT_GLOBAL),
    ),
)
CORRECT = Stage(
    name="ukf.correct",
    outputs=("mean", "cov"),
    reference=ukf.correct,
    tolerance=correct_tolerance,
    rows={"mean": POSE, "cov": POSE},
    columns={"cov": POSE},
    checks=(
        Check("mean, two landmarks before the robot", 4, each(seen, "mean"), _HINT_SEEN),
        Check("cov, two landmarks before the robot", 4, each(seen, "cov"), _HINT_SEEN),
        Check("landmarks straight behind, or west", 4, each(seen_behind), _HINT_CUT),
        Check("negative kappa", 3, each(seen_negative), _HINT_NEGATIVE),
        Check("one landmark, and three", 2, each(counts), "How long is z? Let nothing depend on it."),
        Check("no landmark", 1, each(nothing), "What is known if nothing is seen?"),
        Check(
            "arguments untouched",
            1,
            untouched(seen, ("mean", "cov", "z", "landmarks", "Q", "kappa"), _BELIEF),
            _HINT_COPY,
        ),
        Check("same call, same result", 1, repeatable(seen, _BELIEF), _HINT_GLOBAL),
    ),
)
STAGES = (POINTS, PREDICT, CORRECT)
