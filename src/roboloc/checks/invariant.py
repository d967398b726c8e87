"""Public checks of the right-invariant filter: motions and landmarks that one can work out by hand."""

from math import pi

import numpy as np

from roboloc.checks.report import Caller, Check, Wrong, text
from roboloc.checks.velocity import _floats, _say_written

_BELIEF = {"X": (3, 3), "P": (3, 3)}
_ORIGIN = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
_FACING_LEFT = ((0, -1, 2), (1, 0, 1), (0, 0, 1))
_NONE = ((0, 0, 0), (0, 0, 0), (0, 0, 0))


def _predicted(caller: Caller, X, P, twist, W, dt) -> tuple[np.ndarray, np.ndarray]:  # noqa: ANN001
    return caller(_floats(X, P, twist, W, dt), _BELIEF)


def _hold(what: str, name: str, got: np.ndarray, wanted: np.ndarray, slack: float = 1e-9) -> None:
    if np.max(np.abs(got - wanted)) > slack:
        raise Wrong(f"{what}\nexpected {name} = {text(np.array(wanted, dtype=float))}, got {text(got)}")


def _straight(caller: Caller) -> None:
    X, _ = _predicted(caller, _FACING_LEFT, np.eye(3), (1.5, 0, 0), _NONE, 2)
    _hold(
        "A robot at (2, 1) that faces up the page drives 3 m ahead in 2 s:", "position", X[:2, 2], (2.0, 4.0)
    )


def _quarter(caller: Caller) -> None:
    X, _ = _predicted(caller, _ORIGIN, np.eye(3), (pi / 4, 0, pi / 4), _NONE, 2)
    _hold(
        "A quarter circle of radius 1 m to the left in 2 s:",
        "X",
        X,
        np.array(((0, -1, 1), (1, 0, 1), (0, 0, 1))),
    )


def _slow(caller: Caller) -> None:
    X, _ = _predicted(caller, _ORIGIN, np.eye(3), (1, 0, 1e-9), _NONE, 1)
    _hold("A robot that drives 1 m and turns by 1e-9 rad:", "position", X[:2, 2], (1.0, 5e-10), 1e-10)


def _silent(caller: Caller) -> None:
    P = np.diag((1.0, 2.0, 0.5))
    _, after = _predicted(caller, _FACING_LEFT, P, (1, 0, 0.7), _NONE, 1)
    _hold(
        "A motion without noise carries the robot and its truth alike. The error of the whole world:",
        "P",
        after,
        P,
    )


def _spin(caller: Caller) -> None:
    X = ((1, 0, 2), (0, 1, 0), (0, 0, 1))
    _, P = _predicted(caller, X, _NONE, (0, 0, 0), np.diag((0, 0, 0.01)), 2)
    wanted = np.array(((0, 0, 0), (0, 0.04, -0.02), (0, -0.02, 0.01)))
    _hold("A robot at (2, 0), sure of all, has then turned by an error of variance 0.01:", "P", P, wanted)


def _from_the_start(caller: Caller) -> None:
    W = np.diag((0.0, 0.0, 0.01))
    _, P = _predicted(caller, _ORIGIN, _NONE, (1, 0, 0), W, 2)
    _hold("A robot at the origin errs in heading at the start of a step of 2 m:", "P", P, W)


def _predict_untouched(caller: Caller) -> None:
    _predicted(caller, _FACING_LEFT, np.eye(3), (1, 0.2, 0.7), np.eye(3), 0.5)
    _say_written(caller, ("X", "P", "twist", "W", "dt"))


PREDICT = (
    Check(
        "returns X (3, 3), P (3, 3)",
        lambda caller: _predicted(caller, _ORIGIN, np.eye(3), (1, 0, 0.5), np.eye(3), 1) is None,
    ),
    Check("drives ahead, whichever way it faces", _straight),
    Check("a quarter circle", _quarter),
    Check("a turn of nearly nothing", _slow),
    Check("without noise the error stays as it is", _silent),
    Check("a turn of the robot is one of the world, worked by hand", _spin),
    Check("an error at the start of the step", _from_the_start),
    Check("leaves its arguments as they were", _predict_untouched),
)
"""Checks of ``predict(X, P, twist, W, dt) -> X, P``."""


def _corrected(caller: Caller, X, P, Y, landmarks, N) -> tuple[np.ndarray, np.ndarray]:  # noqa: ANN001
    sights, places = np.reshape(Y, (-1, 3)), np.reshape(landmarks, (-1, 2))
    return caller(_floats(X, P, sights, places, N), _BELIEF)


def _nearer(k: int, x: float) -> Check:
    def check(caller: Caller) -> None:
        P = np.diag((1.0, 1.0, 1e-12))
        X, after = _corrected(caller, _ORIGIN, P, [[1, 0, 1]] * k, [[2, 0]] * k, np.eye(2))
        if abs(X[0, 2] - x) > 1e-6 or abs(after[0, 0] - (1 - x)) > 1e-6:
            raise Wrong(
                f"{('A landmark', 'Two landmarks')[k - 1]} expected 2 m ahead, seen at 1 m; belief and observation "
                f"are known to 1 m each:\nexpected x = {text(x)} of variance {text(1 - x)}, got {text(X[0, 2])} of "
                f"variance {text(after[0, 0])}"
            )

    return Check(f"{('a landmark', 'two landmarks')[k - 1]} nearer than expected", check)


def _no_news(caller: Caller) -> None:
    X, _ = _corrected(caller, _FACING_LEFT, np.diag((1.0, 2.0, 0.5)), (1, 0, 1), (2, 2), np.eye(2))
    _hold(
        "A robot at (2, 1) that faces up the page sees a landmark 1 m ahead, and it is at (2, 2). No news:",
        "X",
        X,
        np.array(_FACING_LEFT),
    )


def _along(caller: Caller) -> None:
    h = np.sqrt(0.5)
    X = ((h, -h, 2), (h, h, 1), (0, 0, 1))
    P, N = np.diag((1.0, 1.0, 1e-12)), np.diag((1e-12, 1.0))
    _, after = _corrected(caller, X, P, (1, 0, 1), (2 + h, 1 + h), N)
    _hold(
        "A robot that faces the upper right corner sees exactly how far ahead a landmark is, and to 1 m how far aside:",
        "covariance of v1 and v2",
        after[:2, :2],
        np.array(((0.25, -0.25), (-0.25, 0.25))),
        1e-6,
    )


def _sure_of_its_heading(caller: Caller) -> None:
    P = np.diag((1e-12, 1e-12, 1.0))
    X, _ = _corrected(caller, _ORIGIN, P, (2, -0.002, 1), (2, 0), 1e-9 * np.eye(2))
    heading = np.arctan2(X[1, 0], X[0, 0])
    if abs(heading - 0.001) > 1e-5:
        raise Wrong(
            "A robot at the origin, unsure of its heading alone, sees a landmark at (2, 0) by 2 mm too far right:\n"
            f"it is turned to the left by 0.001 rad, got {text(heading)}"
        )


def _turned_world(caller: Caller) -> None:
    c, s = np.cos(0.001), np.sin(0.001)
    X = np.array(((c, -s, 0), (s, c, 0), (0, 0, 1))) @ _FACING_LEFT
    X, _ = _corrected(caller, X, np.diag((1e-12, 1e-12, 1)), (1, 0, 1), (2, 2), 1e-9 * np.eye(2))
    _hold(
        "A robot at (2, 1) that faces up the page believes in a world that is turned by 0.001 rad about its origin, "
        "the robot with it, and doubts nothing but that turn. It sees the landmark at (2, 2) 1 m ahead. Turned back:",
        "X",
        X,
        np.array(_FACING_LEFT),
        1e-5,
    )


def _blind(caller: Caller) -> None:
    P = np.diag((1.0, 2.0, 0.5))
    X, after = _corrected(caller, _FACING_LEFT, P, (), (), np.eye(2))
    if np.max(np.abs(X - _FACING_LEFT)) > 1e-12 or np.max(np.abs(after - P)) > 1e-12:
        raise Wrong("Where no landmark is seen, X and P stay as they are.")


def _correct_untouched(caller: Caller) -> None:
    _corrected(caller, _FACING_LEFT, np.eye(3), (1.1, 0, 1), (2, 2), np.eye(2))
    _say_written(caller, ("X", "P", "Y", "landmarks", "N"))


CORRECT = (
    Check(
        "returns X (3, 3), P (3, 3)",
        lambda caller: _corrected(caller, _ORIGIN, np.eye(3), (1, 0, 1), (2, 0), np.eye(2)) is None,
    ),
    _nearer(1, 0.5),
    _nearer(2, 2 / 3),
    Check("what is expected is no news", _no_news),
    Check("noise along the robot's axes", _along),
    Check("a heading that is put right", _sure_of_its_heading),
    Check("a world that is turned back, the robot with it", _turned_world),
    Check("no landmark", _blind),
    Check("leaves its arguments as they were", _correct_untouched),
)
"""Checks of ``correct(X, P, Y, landmarks, N) -> X, P``."""
