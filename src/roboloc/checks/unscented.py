"""Public checks of the unscented filter: what points and weights must add up to, and beliefs worked by hand."""

from math import pi

import numpy as np

from roboloc.checks.report import Caller, Check, Wrong, text
from roboloc.checks.velocity import _floats, _say_written

_TINY = 1e-10
_SETS = (
    ((1.0, -2.0), ((4.0, 1.0), (1.0, 1.0)), 1.0),
    ((0.5, 2.0, 0.3), ((1.0, 0.3, -0.2), (0.3, 0.5, 0.1), (-0.2, 0.1, 0.8)), 0.0),
    ((0.5, 2.0, 0.3), ((1.0, 0.3, -0.2), (0.3, 0.5, 0.1), (-0.2, 0.1, 0.8)), -1.0),
)


def _points(caller: Caller, mean: tuple, cov: tuple, kappa: float) -> tuple[np.ndarray, np.ndarray]:
    n = len(mean)
    return caller(_floats(mean, cov, kappa), {"points": (2 * n + 1, n), "weights": (2 * n + 1,)})


def _one_number(caller: Caller) -> None:
    points, weights = _points(caller, (10.0,), ((4.0,),), 3.0)
    if (
        np.max(np.abs(points.ravel() - (10, 14, 6))) > 1e-9
        or np.max(np.abs(weights - (0.75, 0.125, 0.125))) > 1e-9
    ):
        raise Wrong(
            "For one number of mean 10 and variance 4, with kappa = 3:\nexpected the points 10, 14, 6 of weights "
            f"0.75, 0.125, 0.125,\ngot {text(points.ravel())} of weights {text(weights)}"
        )


def _moments(caller: Caller) -> None:
    for mean, cov, kappa in _SETS:
        points, weights = _points(caller, mean, cov, kappa)
        d = points - mean
        for what, got, wanted in (
            ("sum of the weights", weights.sum(), 1.0),
            ("weighted mean of the points", weights @ points, np.array(mean)),
            ("weighted covariance of the points", (d.T * weights) @ d, np.array(cov)),
        ):
            if np.max(np.abs(got - wanted)) > 1e-9:
                raise Wrong(
                    f"For the mean {text(mean)} and the covariance {text(cov)}, with kappa = {text(kappa)}:\n"
                    f"the {what} must be {text(wanted)}, but is {text(got)}"
                )


def _order(caller: Caller) -> None:
    for mean, cov, kappa in _SETS:
        points, _ = _points(caller, mean, cov, kappa)
        n = len(mean)
        if (
            np.max(np.abs(points[0] - mean)) > 1e-9
            or np.max(np.abs(points[1 : n + 1] + points[n + 1 :] - 2 * np.array(mean))) > 1e-9
        ):
            raise Wrong(
                "The points come as the mean, then mean + l_1 ... mean + l_n, then mean - l_1 ... mean - l_n."
            )
        for j in range(1, n):
            if np.max(np.abs(points[j + 1, :j] - np.array(mean)[:j])) > 1e-9:
                raise Wrong(
                    f"Of a lower triangular root column {j + 1} begins with {j} zero{'s' * (j > 1)}. Point {j + 2} "
                    f"less the mean is {text(points[j + 1] - mean)}"
                )


def _points_untouched(caller: Caller) -> None:
    _points(caller, *_SETS[1])
    _say_written(caller, ("mean", "cov", "kappa"))


SIGMA_POINTS = (
    Check("returns points (2n+1, n), weights (2n+1,)", lambda caller: _points(caller, *_SETS[0]) is None),
    Check("one number, worked by hand", _one_number),
    Check("mean and covariance come back", _moments),
    Check("the points' order, and a lower root", _order),
    Check("leaves its arguments as they were", _points_untouched),
)
"""Checks of ``sigma_points(mean, cov, kappa) -> points, weights``."""

_BELIEF = {"mean": (3,), "cov": (3, 3)}


def _predicted(caller: Caller, mean, stds, u, stds_u, dt, kappa) -> tuple[np.ndarray, np.ndarray]:  # noqa: ANN001
    cov, M = (np.diag(np.maximum(s, _TINY)) ** 2 for s in (stds, stds_u))
    return caller(_floats(mean, cov, u, M, dt, kappa), _BELIEF)


def _sure(caller: Caller) -> None:
    mean, _ = _predicted(caller, (0, 0, 0), (0, 0, 0), (pi / 2, pi / 2, -0.5), (0, 0, 0), 1, 2)
    if np.max(np.abs(mean - (1, 1, pi / 2 - 0.5))) > 1e-6:
        raise Wrong(
            "A robot sure of its pose and of its control drives a quarter circle and turns back by 0.5 rad:"
            f"\nexpected {text((1, 1, pi / 2 - 0.5))}, got {text(mean)}"
        )


def _by_hand(kappa: float, x: float, variance: float) -> Check:
    def check(caller: Caller) -> None:
        mean, cov = _predicted(caller, (0, 0, 0), (0, 0, 0.5), (1, 0, 0), (0, 0, 0), 1, kappa)
        if abs(mean[0] - x) > 1e-5 or abs(cov[0, 0] - variance) > 1e-5:
            raise Wrong(
                f"A robot whose heading is known to 0.5 rad drives 1 m, kappa = {text(kappa)}. Worked in the book:\n"
                f"mean x = {text(x)} with the variance {text(variance)}, got {text(mean[0])} with {text(cov[0, 0])}"
            )

    return Check(f"an unknown heading, kappa = {kappa:g}, worked by hand", check)


def _speed(caller: Caller) -> None:
    for i, name, wanted in ((0, "speed", (0.04, 0, 0)), (2, "gamma", (0, 0, 0.04))):
        stds = 0.1 * np.eye(3)[i]
        _, cov = _predicted(caller, (0, 0, 0), (0, 0, 0), (1, 0, 0), stds, 2, 2)
        if np.max(np.abs(np.diag(cov) - wanted)) > 1e-6:
            raise Wrong(
                f"A robot sure of its pose drives straight for 2 s, its {name} known to 0.1 a second:\nafterwards its "
                f"pose has the variances {text(wanted)}, got {text(np.diag(cov))}"
            )


def _turned(caller: Caller) -> None:
    args = (0.2, 0.1, 0.4), (1.0, 0.3, 0.1), (0.1, 0.1, 0.1), 0.5, 1.0
    mean, cov = _predicted(caller, (0, 0, 0), *args)
    back, other = _predicted(caller, (0, 0, pi), *args)
    heading, spread = mean[2] + pi, cov[2, 2]
    if abs(back[2] - heading) > 1e-6 or abs(other[2, 2] - spread) > 1e-6:
        raise Wrong(
            f"With the robot turned by pi, the predicted heading must be {text(heading)} of variance {text(spread)}, "
            f"not {text(back[2])} of variance {text(other[2, 2])}"
        )


def _predict_untouched(caller: Caller) -> None:
    _predicted(caller, (1, 2, 0.3), (0.2, 0.1, 0.4), (1.0, 0.3, 0.1), (0.1, 0.1, 0.1), 0.5, 1.0)
    _say_written(caller, ("mean", "cov", "u", "M", "dt", "kappa"))


PREDICT = (
    Check(
        "returns mean (3,), cov (3, 3)",
        lambda caller: _predicted(caller, (0, 0, 0), (1, 1, 1), (1, 0, 0), (1, 1, 1), 1, 2) is None,
    ),
    Check("nothing uncertain", _sure),
    _by_hand(2.0, 0.894493, 0.077923),
    _by_hand(-3.0, 0.882620, 0.041334),
    Check("an unknown control, worked by hand", _speed),
    Check("a robot that looks back", _turned),
    Check("leaves its arguments as they were", _predict_untouched),
)
"""Checks of ``predict(mean, cov, u, M, dt, kappa) -> mean, cov``."""


def _corrected(caller: Caller, stds, z, landmarks, Q, kappa) -> tuple[np.ndarray, np.ndarray]:  # noqa: ANN001
    cov, seen = np.diag(np.maximum(stds, 1e-4)) ** 2, np.reshape(landmarks, (-1, 2))
    return caller(_floats((0, 0, 0), cov, np.ravel(z), seen, np.diag(Q), kappa), _BELIEF)


def _nearer(k: int, x: float, variance: float) -> Check:
    def check(caller: Caller) -> None:
        mean, cov = _corrected(caller, (1, 0, 0), [0, 19] * k, [[20, 0]] * k, (1, 1), 2)
        if abs(mean[0] - x) > 1e-4 or abs(cov[0, 0] - variance) > 1e-4:
            raise Wrong(
                f"{('A landmark', 'Two landmarks')[k - 1]} expected 20 m ahead, seen at 19 m; along x, prior and "
                f"observation are known to 1 m each:\nexpected x = {text(x)} of variance {text(variance)}, "
                f"got {text(mean[0])} of variance {text(cov[0, 0])}"
            )

    return Check(f"{('a landmark', 'two landmarks')[k - 1]} nearer than expected", check)


def _no_news(caller: Caller) -> None:
    z = (0.769819, 2.851281)
    mean, _ = _corrected(caller, (0, 0.5, 0), z, (2, 2), (1e-4, 1e-4), 0)
    if np.max(np.abs(mean)) > 1e-4:
        raise Wrong(
            "A robot at the origin knows y to 0.5 m and all else exactly; with kappa = 0 a landmark at (2, 2) is seen "
            f"by the points at {text(z)} on the average, worked in the book.\nIt corrects nothing then. Got the mean "
            f"{text(mean)}"
        )


def _negative(caller: Caller) -> None:
    _, cov = _corrected(caller, (0, 0.5, 0), (0.77, 2.85), (2, 2), (0.01, 0.01), -1)
    if abs(cov[1, 1] - 0.0176863) > 1e-4:
        raise Wrong(
            "A robot at the origin knows y to 0.5 m and all else exactly, and sees a landmark at (2, 2) to 0.1 rad and "
            f"0.1 m.\nWith kappa = -1 the variance of y is then {text(0.0176863)}. Got {text(cov[1, 1])}"
        )


def _behind(caller: Caller) -> None:
    stds, Q = (0.3, 0.3, 0.2), (0.01, 0.01)
    _, ahead = _corrected(caller, stds, (0, 2), (2, 0), Q, 1)
    for bearing in (3.1, -3.1):
        mean, cov = _corrected(caller, stds, (bearing, 2), (-2, 0), Q, 1)
        if np.max(np.abs(np.diag(cov) - np.diag(ahead))) > 1e-6:
            raise Wrong(
                "A landmark 2 m straight behind says as much as one 2 m ahead: the variances are then "
                f"{text(np.diag(ahead))}, but yours are {text(np.diag(cov))}"
            )
        off = bearing - np.sign(bearing) * pi
        if not 0 < -mean[2] * np.sign(off) < abs(off):
            raise Wrong(
                f"A landmark straight behind is seen at {text(bearing)}, {text(off)} beside what is expected: the "
                f"heading must change by less than that, to the other side. Yours changes by {text(mean[2])}"
            )


def _blind(caller: Caller) -> None:
    mean, cov = _corrected(caller, (0.3, 0.2, 0.1), (), (), (1, 1), 1)
    if mean.any() or np.max(np.abs(np.diag(cov) - (0.09, 0.04, 0.01))) > 1e-12:
        raise Wrong("Where no landmark is seen, mean and covariance stay as they are.")


def _correct_untouched(caller: Caller) -> None:
    _corrected(caller, (0.3, 0.2, 0.1), (0.8, 2.9), (2, 2), (0.01, 0.01), 1)
    _say_written(caller, ("mean", "cov", "z", "landmarks", "Q", "kappa"))


CORRECT = (
    Check(
        "returns mean (3,), cov (3, 3)",
        lambda caller: _corrected(caller, (1, 1, 1), (0, 19), (20, 0), (1, 1), 2) is None,
    ),
    _nearer(1, 0.5, 0.5),
    _nearer(2, 2 / 3, 1 / 3),
    Check("what the points see on the average is no news", _no_news),
    Check("negative kappa", _negative),
    Check("a landmark straight behind", _behind),
    Check("no landmark", _blind),
    Check("leaves its arguments as they were", _correct_untouched),
)
"""Checks of ``correct(mean, cov, z, landmarks, Q, kappa) -> mean, cov``."""
