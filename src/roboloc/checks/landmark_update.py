"""Public checks of SLAM with points, second part: the correction, and how far the map is from the truth."""

from math import pi

import numpy as np

from roboloc.angles import wrap
from roboloc.checks.landmarks import (
    _STATE,
    _belief,
    _covariance,
    _off,
    _say_symmetric,
    _say_written,
    _turn_of,
    _turned_state,
)
from roboloc.checks.report import Caller, Check, Wrong, text

_UPDATE = ("x", "Sigma", "z", "Q")
# The looks that `_STATE` expects, and others a little off.
_EXPECTED = (-1.217206, 3.605551, -0.210979, 4.924429)
_OFF = np.array(_EXPECTED) + np.array((0.02, 0.1, -0.03, 0.05))
_NOISE = ((0.0004, 0.0003), (0.0003, 0.01))
# A robot at the origin, that knows its heading; the landmark is 2 m ahead, and known.
_ONE = ((0.0, 0.0, 0.0, 2.0, 0.0), (0.01, 0.0, 0.0, 0.0, 0.0), (0.0, 1.9), (0.01, 0.01))


def _update(caller: Caller, x, Sigma, z, Q=_NOISE) -> tuple[np.ndarray, ...]:  # noqa: ANN001 - plain numbers
    return _belief(caller, len(x), x, Sigma, z, Q)


def _sure(Sigma: np.ndarray) -> np.ndarray:
    """Return a covariance in which what is certain is nearly so: some right ways need its inverse."""
    return Sigma + 1e-8 * np.eye(len(Sigma))


def _worked(name: str, story: str, given: tuple, after: tuple, variances: tuple) -> Check:
    def check(caller: Caller) -> None:
        x, Sigma, z, Q = given
        got, spread = _update(caller, x, _sure(np.diag(Sigma)), z, np.diag(Q))
        if _off(got, np.array(after)) or _off(np.diag(spread), np.array(variances)):
            raise Wrong(
                f"{story}\nx = {text(x)}, Sigma = diag {text(Sigma)}, z = {text(z)}, Q = diag {text(Q)}\nexpected x = "
                f"{text(after)}, got {text(got)};\nexpected variances {text(variances)}, got {text(np.diag(spread))}"
            )

    return Check(name, check)


def _as_expected(caller: Caller) -> None:
    x, _ = _update(caller, _STATE, _covariance(7), _EXPECTED)
    if _off(x, np.array(_STATE), 1e-4):
        raise Wrong(
            f"With x = {text(_STATE)} both landmarks are expected at z = {text(_EXPECTED)}, and are seen just there,\n"
            f"but x changed to {text(x)}."
        )


def _useless(caller: Caller) -> None:
    z = np.array(_EXPECTED) + 0.1
    x, Sigma = _update(caller, _STATE, _covariance(7), z, 1e12 * np.eye(2))
    if _off(x, np.array(_STATE), 1e-6) or _off(Sigma, _covariance(7), 1e-6):
        raise Wrong("With Q = 1e12 times the identity the looks say nothing, but x or Sigma changed.")


def _behind(caller: Caller) -> None:
    for side in (1.0, -1.0):
        given = (
            (0.0, 0.0, 0.0, -2.0, side * 0.02),
            _sure(np.diag((0, 0, 1e-4, 0, 0))),
            (-side * 3.13, 2.0),
            np.diag((1e-4, 1)),
        )
        x, _ = _update(caller, *given)
        if abs(x[2]) > 0.02:
            raise Wrong(
                f"A landmark straight behind, expected just on the one side and seen 0.0216 rad beside that, on the "
                f"other,\nz = {text(given[2])}: the heading should change by about a hundredth, but x = {text(x)}."
            )


def _laps(caller: Caller) -> None:
    x, _ = _update(caller, _STATE, _covariance(7), _OFF)
    later = (*_STATE[:2], _STATE[2] + 4 * pi, *_STATE[3:])
    more, _ = _update(caller, later, _covariance(7), _OFF)
    more[2] = x[2] + wrap(more[2] - x[2])
    if _off(more, x):
        raise Wrong("After two more laps of the robot the same looks change the state in another way.")


def _in_any_order(caller: Caller) -> None:
    before, z = _covariance(7), _OFF
    swap = [0, 1, 2, 5, 6, 3, 4]
    x, Sigma = _update(caller, _STATE, before, z)
    other, swapped = _update(caller, np.array(_STATE)[swap], before[np.ix_(swap, swap)], z[[2, 3, 0, 1]])
    if _off(other, x[swap], 1e-7) or _off(swapped, Sigma[np.ix_(swap, swap)], 1e-7):
        raise Wrong(
            "With the two landmarks in the other order, in x, Sigma and z, the result is another one."
        )


def _update_turned(caller: Caller) -> None:
    before, z = _covariance(7), _OFF
    x, Sigma = _update(caller, _STATE, before, z)
    T = _turn_of(7, 0.7)
    other, turned = _update(caller, _turned_state(np.array(_STATE), 0.7), T @ before @ T.T, z)
    other[2] -= 2 * pi * round((other[2] - x[2] - 0.7) / (2 * pi))
    if _off(other, _turned_state(x, 0.7)) or _off(turned, T @ Sigma @ T.T):
        raise Wrong("Robot and landmarks, all turned by 0.7 rad about the origin, should be corrected alike.")


def _is_covariance(caller: Caller) -> None:
    for seed in range(3, 7):
        before = _covariance(7, seed)
        _, Sigma = _update(caller, _STATE, before, np.array(_EXPECTED) + 0.05)
        _say_symmetric(Sigma)
        if np.linalg.eigvalsh(Sigma)[0] < -1e-9 or np.linalg.eigvalsh(before - Sigma)[0] < -1e-9:
            raise Wrong(
                "In some direction the variance is negative, or larger than before: looking takes no knowledge away."
            )


def _not_seen(caller: Caller) -> None:
    """Two landmarks that err as one: what is learnt of the one holds for the other."""
    Sigma = np.zeros((7, 7))
    Sigma[np.ix_([3, 5], [3, 5])] = 1.0
    Q = np.diag((1e9, 1.0))
    x, after = _update(caller, (0, 0, 0, 2, 0, 0, 3), _sure(Sigma), (0.0, 3.0, pi / 2, 3.0), Q)
    if _off(x, np.array((0, 0, 0, 2.5, 0, 0.5, 3)), 1e-5) or abs(after[5, 5] - 0.5) > 1e-5:
        raise Wrong(
            "Two landmarks have one error along x in common, of variance 1. The first is seen 1 m further along x, "
            f"with variance 1; the look at the second cannot tell its x.\nBoth should move by 0.5 m, but x = {text(x)}."
        )


def _update_untouched(caller: Caller) -> None:
    _update(caller, _STATE, _covariance(7), _EXPECTED)
    _say_written(caller, _UPDATE)


UPDATE = (
    Check(
        "returns x (n,), Sigma (n, n)", lambda caller: _update(caller, _STATE, np.eye(7), _EXPECTED) and None
    ),
    _worked(
        "half and half",
        "Both sides err alike, and meet in the middle:",
        _ONE,
        (0.05, 0, 0, 2, 0),
        (0.005, 0, 0, 0, 0),
    ),
    _worked(
        "the map learns too",
        "A robot that knows its pose sees a doubtful landmark:",
        ((0.0, 0.0, 0.0, 2.0, 0.0), (0, 0, 0, 0.03, 0), (0.0, 2.2), (0.01, 0.01)),
        (0, 0, 0, 2.15, 0),
        (0, 0, 0, 0.0075, 0),
    ),
    Check("seen as expected, nothing moves", _as_expected),
    Check("looks that say nothing change nothing", _useless),
    Check("a landmark straight behind", _behind),
    Check("laps make no difference", _laps),
    Check("what two landmarks share is learnt of both", _not_seen),
    Check("the order of the landmarks makes no difference", _in_any_order),
    Check("a turned world gives a turned result", _update_turned),
    Check("Sigma is symmetric and grows in no direction", _is_covariance),
    Check("leaves its arguments as they were", _update_untouched),
)
"""Checks of ``update(x, Sigma, z, Q) -> x, Sigma``."""


def _evaluate(caller: Caller, x, Sigma, truth) -> tuple[np.ndarray, ...]:  # noqa: ANN001 - plain numbers
    k = len(truth) // 2
    arguments = tuple(np.array(value, dtype=float) for value in (x, Sigma, truth))
    return caller(arguments, {"euclidean": (k,), "mahalanobis": (k,)})


def _far(caller: Caller) -> None:
    euclidean, _ = _evaluate(caller, (0, 0, 0, 3, 4, 1, 1), np.eye(7), (0, 0, 1, 3))
    if _off(euclidean, np.array((5, 2))):
        raise Wrong(
            f"Landmarks believed at (3, 4) and (1, 1), really at (0, 0) and (1, 3): got {text(euclidean)}"
        )


def _counted(caller: Caller) -> None:
    Sigma = np.diag((9, 9, 9, 0.01, 0.04))
    for off, wanted in (((0.2, 0), 2), ((0, 0.2), 1), ((0.3, 0.8), 5)):
        _, got = _evaluate(caller, (0, 0, 0, 1, 1), Sigma, np.subtract((1, 1), off))
        if _off(got, np.array([wanted])):
            raise Wrong(
                f"A landmark known to 0.1 m along x and 0.2 m along y is off by {text(off)}:\nexpected {wanted} "
                f"standard deviations, got {text(got)}"
            )


def _leaning(caller: Caller) -> None:
    for angle in (0.5, 2.0):
        T = _turn_of(5, angle)
        Sigma = T @ np.diag((9, 9, 9, 0.01, 0.04)) @ T.T
        x, truth = (_turned_state(np.array((0, 0, 0, *place)), angle) for place in ((1, 1), (0.7, 0.2)))
        _, got = _evaluate(caller, x, Sigma, truth[3:])
        if _off(got, np.array([5])):
            raise Wrong(
                f"An ellipse and an error in it, turned together by {text(angle)} rad, have the distance they had: 5.\n"
                f"Got {text(got)} with the covariance {text(Sigma[3:, 3:])}"
            )


def _each_its_own(caller: Caller) -> None:
    x, truth = (0, 0, 0, 1, 1, 2, 2), (0.5, 1, 2.5, 2)
    one = _evaluate(caller, x[:5], _covariance(7)[:5, :5], truth[:2])
    keep = [0, 1, 2, 5, 6]
    two = _evaluate(caller, np.array(x)[keep], _covariance(7)[np.ix_(keep, keep)], truth[2:])
    both = _evaluate(caller, x, _covariance(7), truth)
    if any(
        _off(got, np.concatenate(apart)) for got, apart in zip(both, zip(one, two, strict=True), strict=True)
    ):
        raise Wrong(
            "Two landmarks together have other distances than each of them alone, with its own part of Sigma."
        )


def _evaluate_untouched(caller: Caller) -> None:
    _evaluate(caller, (0, 0, 0, 1, 1, 2, 2), _covariance(7), (0.5, 1, 2.5, 2))
    _say_written(caller, ("x", "Sigma", "truth"))


EVALUATE = (
    Check(
        "returns euclidean (k,), mahalanobis (k,)",
        lambda caller: _evaluate(caller, (0, 0, 0, 3, 4, 1, 1), np.eye(7), (0, 0, 1, 3)) and None,
    ),
    Check("distances in metres", _far),
    Check("distances in standard deviations", _counted),
    Check("an ellipse that leans", _leaning),
    Check("each landmark has its own part of Sigma", _each_its_own),
    Check("leaves its arguments as they were", _evaluate_untouched),
)
"""Checks of ``evaluate(x, Sigma, truth) -> euclidean, mahalanobis``."""
