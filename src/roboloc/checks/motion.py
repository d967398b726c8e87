"""Public checks of the motion model: worked numbers, laws, and differences of the student's own g."""

from math import pi

import numpy as np

from roboloc.angles import wrap
from roboloc.checks.report import Caller, Check, Wrong, text

_RESULTS = {"g": (3,), "Gx": (3, 3), "Gu": (3, 2)}
_POSE = ("x", "y", "theta")
_CONTROL = ("V", "omega")

# Poses, controls and durations at which derivatives are compared: away from omega = 0, all signs and sizes.
_SAMPLES = (
    ((0.0, 0.0, 0.0), (1.0, 0.5), 1.0),
    ((1.0, -2.0, 0.8), (0.7, -0.4), 0.1),
    ((-3.0, 0.5, 2.5), (-1.2, 1.1), 2.0),
    ((0.2, 4.0, -1.9), (0.3, -1.6), 0.05),
)
# The same for omega = 0; the second number of the control is replaced.
_STRAIGHT = (((0.0, 0.0, 0.0), 1.0, 1.0), ((2.0, 1.0, 0.9), -0.8, 0.1), ((-1.0, 3.0, -2.2), 1.5, 2.0))
_NEAR_ZERO = (1e-3, 1e-4, 1e-6, 1e-8, 1e-12, 1e-300)


def _call(caller: Caller, xvec, u, dt) -> tuple[np.ndarray, ...]:  # noqa: ANN001 - plain numbers
    return caller((np.array(xvec, dtype=float), np.array(u, dtype=float), float(dt)), _RESULTS)


def _minus(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return a - b of two poses, the heading on the circle."""
    d = a - b
    d[2] = wrap(d[2])
    return d


def _returns(caller: Caller) -> None:
    _call(caller, (1.0, 2.0, 0.3), (0.5, 0.4), 0.1)


def _worked(story: str, xvec: tuple, u: tuple, dt: float, expected: tuple) -> Check:
    def check(caller: Caller) -> None:
        g, _, _ = _call(caller, xvec, u, dt)
        if np.max(np.abs(_minus(g, np.array(expected)))) > 1e-6:
            raise Wrong(
                f"From x, y, theta = {text(xvec)} with V, omega = {text(u)} for dt = {text(dt)} s\n"
                f"expected g = {text(expected)}, got {text(g)}"
            )

    return Check(story, check)


def _two_halves(caller: Caller) -> None:
    for xvec, u, dt in _SAMPLES:
        whole, _, _ = _call(caller, xvec, u, dt)
        half, _, _ = _call(caller, xvec, u, dt / 2)
        both, _, _ = _call(caller, half, u, dt / 2)
        if np.max(np.abs(_minus(whole, both))) > 1e-6:
            raise Wrong(
                f"V, omega = {text(u)} for dt = {text(dt)} s leads from {text(xvec)} to {text(whole)},\n"
                f"but dt = {text(dt / 2)} s twice leads to {text(both)}.\n"
                "The exact motion does not depend on how the time is cut."
            )


def _untouched(caller: Caller) -> None:
    for u in ((0.5, 0.4), (0.5, 0.0)):
        _call(caller, (1.0, 2.0, 0.3), u, 0.1)
        for i in caller.written_to:
            name = ("xvec", "u", "dt")[i]
            raise Wrong(f"The function writes to its argument {name}. Work on a copy: np.array({name}).")


def _slopes(caller: Caller, xvec: tuple, u: tuple, dt: float, wrt: str, steps: tuple) -> np.ndarray:
    """Differentiate the student's own g: central differences, one extrapolation."""
    columns = []
    for i, step in enumerate(steps):

        def slope(size: float, i: int = i) -> np.ndarray:
            sides = []
            for sign in (1.0, -1.0):
                pose, control = np.array(xvec), np.array(u)
                (pose if wrt == "pose" else control)[i] += sign * size
                sides.append(_call(caller, pose, control, dt)[0])
            return _minus(*sides) / (2.0 * size)

        columns.append((4.0 * slope(step) - slope(2.0 * step)) / 3.0)
    return np.stack(columns, axis=1)


def _compare(name: str, by: tuple, got: np.ndarray, slopes: np.ndarray, tolerance: float, where: str) -> None:
    off = np.abs(got - slopes) / np.maximum(1.0, np.abs(slopes))
    if np.max(off) > tolerance:
        i, j = np.unravel_index(np.argmax(off), off.shape)
        raise Wrong(
            f"{where}\n{name}[{i}, {j}] says that {_POSE[i]} changes with {by[j]} at the rate "
            f"{text(got[i, j])}, but a small change of {by[j]}\nchanges your own g[{i}] at the rate "
            f"{text(slopes[i, j])}."
        )


def _where(xvec: tuple, u: tuple, dt: float) -> str:
    return f"At x, y, theta = {text(xvec)}, V, omega = {text(u)}, dt = {text(dt)} s:"


def _gx(caller: Caller) -> None:
    straight = tuple((xvec, (V, 0.0), dt) for xvec, V, dt in _STRAIGHT)
    for xvec, u, dt in _SAMPLES + straight:
        _, Gx, _ = _call(caller, xvec, u, dt)
        slopes = _slopes(caller, xvec, u, dt, "pose", (1e-3, 1e-3, 1e-3))
        _compare("Gx", _POSE, Gx, slopes, 1e-6, _where(xvec, u, dt))


def _gu(caller: Caller) -> None:
    for xvec, u, dt in _SAMPLES:
        _, _, Gu = _call(caller, xvec, u, dt)
        slopes = _slopes(caller, xvec, u, dt, "control", (1e-3, 1e-3))
        _compare("Gu", _CONTROL, Gu, slopes, 1e-6, _where(xvec, u, dt))


def _gu_straight(caller: Caller) -> None:
    # The steps in omega reach well beyond any threshold below which a function may use its limits.
    for xvec, V, dt in _STRAIGHT:
        _, _, Gu = _call(caller, xvec, (V, 0.0), dt)
        slopes = _slopes(caller, xvec, (V, 0.0), dt, "control", (1e-3, 0.02))
        _compare("Gu", _CONTROL, Gu, slopes, 1e-5, _where(xvec, (V, 0.0), dt))


def _near_zero(which: int) -> Check:
    name = tuple(_RESULTS)[which]

    def check(caller: Caller) -> None:
        for xvec, V, dt in _STRAIGHT:
            limit = _call(caller, xvec, (V, 0.0), dt)[which]
            scale = max(1.0, abs(V)) * max(dt, dt**3)
            for size in _NEAR_ZERO:
                for omega in (size, -size):
                    value = _call(caller, xvec, (V, omega), dt)[which]
                    jump = np.max(np.abs(_minus(value, limit) if which == 0 else value - limit))
                    if jump > (2.0 * size + 1e-6) * scale:
                        raise Wrong(
                            f"{_where(xvec, (V, omega), dt)}\n"
                            f"{name} differs by {jump:.2g} from its value at omega = 0.\n"
                            "Either the limit is another, or small differences divided by omega lose digits."
                        )

    return Check(f"{name} approaches its value at omega = 0 from both sides", check)


def _keeps_turning(caller: Caller) -> None:
    for omega in (8e-4, -8e-4, 1e-5):
        g, _, _ = _call(caller, (0.0, 0.0, 0.5), (1.0, omega), 2.0)
        if abs(wrap(g[2] - 0.5 - 2.0 * omega)) > 1e-7:
            raise Wrong(
                f"From theta = 0.5 with omega = {omega:g} for dt = 2 s\n"
                f"expected theta = {0.5 + 2.0 * omega:.6f}, got {g[2]:.6f}. A slow turn is a turn too."
            )


COMPUTE_DYNAMICS = (
    Check("returns g (3,), Gx (3, 3), Gu (3, 2)", _returns),
    _worked("drives straight ahead", (1.0, 2.0, 0.0), (1.5, 0.0), 2.0, (4.0, 2.0, 0.0)),
    _worked("drives where it faces", (1.0, 2.0, pi / 2), (0.5, 0.0), 0.5, (1.0, 2.25, pi / 2)),
    _worked("drives a quarter circle to the left", (0.0,) * 3, (pi / 2, pi / 2), 1.0, (1.0, 1.0, pi / 2)),
    _worked("drives half a circle to the right", (0.0,) * 3, (pi / 4, -pi / 4), 4.0, (0.0, -2.0, -pi)),
    _worked("backs up around a quarter circle", (0.0,) * 3, (-pi, pi), 0.5, (-1.0, -1.0, pi / 2)),
    _worked("turns on the spot", (1.0, 2.0, 0.3), (0.0, 1.0), 0.5, (1.0, 2.0, 0.8)),
    Check("two half steps make one step", _two_halves),
    Check("Gx agrees with small changes of the pose", _gx),
    Check("Gu agrees with small changes of the control", _gu),
    Check("Gu agrees with small changes of the control at omega = 0", _gu_straight),
    _near_zero(0),
    _near_zero(1),
    _near_zero(2),
    Check("the heading turns however small omega is", _keeps_turning),
    Check("leaves its arguments as they were", _untouched),
)
"""Checks of ``compute_dynamics(xvec, u, dt) -> g, Gx, Gu``."""
