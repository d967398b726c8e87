"""Public checks of the prediction of a Gaussian belief: worked numbers and laws."""

import numpy as np

from roboloc.checks.report import Caller, Check, Wrong, text

_NAMES = ("g", "Gx", "Gu", "Sigma", "R", "dt")


def _call(caller: Caller, g, Gx, Gu, Sigma, R, dt) -> tuple[np.ndarray, ...]:  # noqa: ANN001 - plain numbers
    arrays = tuple(np.array(a, dtype=float) for a in (g, Gx, Gu, Sigma, R))
    n = len(g)
    return caller((*arrays, float(dt)), {"x": (n,), "Sigma": (n, n)})


def _random(n: int, seed: int) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(seed)
    A, B = rng.normal(size=(n, n)), rng.normal(size=(2, 2))
    return rng.normal(size=n), rng.normal(size=(n, n)), rng.normal(size=(n, 2)), A @ A.T, B @ B.T


def _returns(caller: Caller) -> None:
    Gu = ((0.1, 0.0), (0.0, 0.0), (0.0, 0.1))
    _call(caller, (1.0, 2.0, 0.3), np.eye(3), Gu, np.eye(3), np.eye(2), 0.1)


def _mean(caller: Caller) -> None:
    for seed in (1, 2):
        g, Gx, Gu, Sigma, R = _random(3, seed)
        x, _ = _call(caller, g, Gx, Gu, Sigma, R, 0.1)
        if np.max(np.abs(x - g)) > 1e-12:
            raise Wrong(f"g = {text(g)} is the mean after the motion already, but x is {text(x)}.")


def _worked(name: str, story: str, expected: tuple, **arguments: tuple) -> Check:
    def check(caller: Caller) -> None:
        n = len(arguments["Gx"])
        _, Sigma = _call(caller, np.zeros(n), **arguments)
        if np.max(np.abs(Sigma - np.array(expected))) > 1e-9:
            given = "\n".join(f"{key} = {text(value)}" for key, value in arguments.items())
            raise Wrong(
                f"{story}\n{given}\nexpected Sigma = {text(expected)}\ngot      Sigma = {text(Sigma)}"
            )

    return Check(name, check)


def _duration(caller: Caller) -> None:
    g, Gx, Gu, Sigma, R = _random(3, 3)
    _, at_0 = _call(caller, g, Gx, Gu, Sigma, R, 0.0)
    _, at_1 = _call(caller, g, Gx, Gu, Sigma, R, 0.2)
    _, at_2 = _call(caller, g, Gx, Gu, Sigma, R, 0.4)
    if np.max(np.abs(at_1 - at_0)) < 1e-12:
        raise Wrong("Sigma is the same for dt = 0 and dt = 0.2. The noise of the control grows with time.")
    if np.max(np.abs((at_2 - at_0) - 2.0 * (at_1 - at_0))) > 1e-9:
        raise Wrong(
            "With the same Gu, twice the time dt should add twice the noise; yours adds another multiple."
        )


def _covariance(caller: Caller) -> None:
    for seed in range(4, 9):
        _, Sigma = _call(caller, *_random(3, seed), 0.1)
        if np.max(np.abs(Sigma - Sigma.T)) > 1e-9:
            raise Wrong(f"Sigma should equal its transpose, got {text(Sigma)}")
        smallest = np.linalg.eigvalsh(Sigma)[0]
        if smallest < -1e-9:
            raise Wrong(f"A variance is negative in some direction: {text(smallest)}, in {text(Sigma)}")


def _sizes(caller: Caller) -> None:
    for n in (2, 5):
        _call(caller, *_random(n, n), 0.1)


def _untouched(caller: Caller) -> None:
    _call(caller, *_random(3, 9), 0.1)
    for i in caller.written_to:
        raise Wrong(f"The function writes to its argument {_NAMES[i]}. Make a new array instead (no +=).")


TRANSITION_UPDATE = (
    Check("returns x (n,), Sigma (n, n)", _returns),
    Check("the new mean is g", _mean),
    _worked(
        "a doubtful heading makes the position doubtful",
        "Only the heading is in doubt, by 0.1 rad, and the robot has driven by 2 in x and 1 in y:",
        Gx=((1.0, 0.0, -1.0), (0.0, 1.0, 2.0), (0.0, 0.0, 1.0)),
        Gu=((0.0, 0.0), (0.0, 0.0), (0.0, 0.0)),
        Sigma=((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.01)),
        R=((0.1, 0.0), (0.0, 0.1)),
        dt=1.0,
        expected=((0.01, -0.02, -0.01), (-0.02, 0.04, 0.02), (-0.01, 0.02, 0.01)),
    ),
    _worked(
        "a doubtful control makes the pose doubtful",
        "The pose was certain; the speed is not, and neither is the turning rate:",
        Gx=((1.0, 0.0, 0.0), (0.0, 1.0, 2.0), (0.0, 0.0, 1.0)),
        Gu=((1.0, 0.0), (0.0, 0.5), (0.0, 1.0)),
        Sigma=((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        R=((0.04, 0.0), (0.0, 0.16)),
        dt=1.0,
        expected=((0.04, 0.0, 0.0), (0.0, 0.04, 0.08), (0.0, 0.08, 0.16)),
    ),
    _worked(
        "everything at once, correlations included",
        "By hand, with whole numbers and half a second:",
        Gx=((1.0, 0.0, -1.0), (0.0, 1.0, 2.0), (0.0, 0.0, 1.0)),
        Gu=((1.0, 0.0), (2.0, 1.0), (0.0, 1.0)),
        Sigma=((4.0, 1.0, 0.0), (1.0, 2.0, 1.0), (0.0, 1.0, 3.0)),
        R=((2.0, 1.0), (1.0, 3.0)),
        dt=0.5,
        expected=((8.0, -3.5, -2.5), (-3.5, 25.5, 9.5), (-2.5, 9.5, 4.5)),
    ),
    Check("the noise grows with dt", _duration),
    Check("Sigma is symmetric and no variance is negative", _covariance),
    Check("works for states of any size", _sizes),
    Check("leaves its arguments as they were", _untouched),
)
"""Checks of ``transition_update(g, Gx, Gu, Sigma, R, dt) -> x, Sigma``."""
