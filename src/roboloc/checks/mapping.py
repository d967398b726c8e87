"""Public checks of a map that grows: worked numbers, points of a wall, differences of the student's own line."""

from math import pi

import numpy as np

from roboloc.angles import wrap
from roboloc.checks.report import Caller, Check, Wrong, text
from roboloc.se2 import compose, inverse

_CENTRE = (0.0, 0.0, 0.0)
_LINE, _POSE = ("alpha", "r"), ("x", "y", "theta")
# Observations, poses and mountings: the origin of the world on either side of the wall.
_SAMPLES = (
    ((0.4, 2.0), (0.3, -0.5, 0.7), _CENTRE),
    ((-2.1, 1.5), (0.2, 0.8, -1.1), (0.2, -0.1, 0.0)),
    ((1.6, 1.0), (-1.7, 2.2, 2.4), (-0.3, 0.4, 0.9)),
    ((0.3, 0.6), (-2.0, -1.5, 0.4), (0.1, 0.3, -0.2)),
)


def _place(caller: Caller, z, x, tf=_CENTRE) -> tuple[np.ndarray, ...]:  # noqa: ANN001 - plain numbers
    arguments = tuple(np.array(a, dtype=float) for a in (z, x, tf))
    return caller(arguments, {"line": (2,), "by_pose": (2, 3), "by_z": (2, 2)})


def _grow(caller: Caller, x, Sigma, z, Q, tf=_CENTRE) -> tuple[np.ndarray, ...]:  # noqa: ANN001 - plain numbers
    arguments = tuple(np.array(a, dtype=float) for a in (x, Sigma, z, Q, tf))
    n = arguments[0].size
    return caller(arguments, {"x": (n + 2,), "Sigma": (n + 2, n + 2)})


def _minus(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.array([wrap(a[0] - b[0]), a[1] - b[1]])


def _say_written(caller: Caller, names: tuple) -> None:
    for i in caller.written_to:
        raise Wrong(f"The function writes to its argument {names[i]}. Work on a copy: np.array({names[i]}).")


def _where(z: tuple, x: tuple, tf: tuple) -> str:
    return f"For z = {text(z)}, the pose {text(x)} and the mounting {text(tf)}:"


def _worked(story: str, z: tuple, x: tuple, tf: tuple, expected: tuple) -> Check:
    def check(caller: Caller) -> None:
        line, _, _ = _place(caller, z, x, tf)
        if np.max(np.abs(_minus(line, np.array(expected)))) > 1e-6:
            raise Wrong(f"{_where(z, x, tf)}\nexpected the line {text(expected)}, got {text(line)}")

    return Check(story, check)


def _point(alpha: float, r: float, along: float) -> np.ndarray:
    """Return a point of a line: where a robot ends that turns by alpha, and drives r ahead and some way to the left."""
    return compose((0.0, 0.0, alpha), (r, along, 0.0))[:2]


def _same_wall(caller: Caller) -> None:
    for z, x, tf in _SAMPLES:
        line, _, _ = _place(caller, z, x, tf)
        back = inverse((0.0, 0.0, line[0]))
        for along in (-1.0, 0.0, 1.0):
            there = compose(compose(x, tf), (*_point(*z, along), 0.0))[:2]
            off = abs(compose(back, (*there, 0.0))[0] - line[1])
            if off > 1e-6:
                raise Wrong(
                    f"{_where(z, x, tf)}\na point of the wall that is seen is {off:.3g} m away from your {text(line)}."
                )


def _normal_form(caller: Caller) -> None:
    for z, x in (
        ((3.0, 1.0), (0.5, 0.2, 3.0)),
        ((0.0, 1.0), (-3.0, 0.0, 0.1)),
        ((-3.0, 1.0), (0.1, 0.2, -2.0)),
    ):
        line, _, _ = _place(caller, z, x)
        if line[1] < 0 or abs(line[0]) > pi + 1e-9:
            raise Wrong(f"{_where(z, x, _CENTRE)}\nr is negative or alpha outside [-pi, pi): {text(line)}")


def _slopes(caller: Caller, sample: tuple, which: int) -> np.ndarray:
    """Differentiate the student's own line by central differences, with one extrapolation."""
    columns = []
    for i in range(len(sample[which])):

        def slope(size: float, i: int = i) -> np.ndarray:
            ends = []
            for sign in (1.0, -1.0):
                moved = [np.array(part, dtype=float) for part in sample]
                moved[which][i] += sign * size
                ends.append(_place(caller, *moved)[0])
            return _minus(*ends) / (2.0 * size)

        columns.append((4.0 * slope(1e-3) - slope(2e-3)) / 3.0)
    return np.stack(columns, axis=1)


def _derivative(name: str, which: int, by: tuple) -> Check:
    def check(caller: Caller) -> None:
        for sample in _SAMPLES:
            got, slopes = _place(caller, *sample)[2 - which], _slopes(caller, sample, which)
            off = np.abs(got - slopes)
            if np.max(off) > 1e-6:
                i, j = (int(k) for k in np.unravel_index(np.argmax(off), off.shape))
                raise Wrong(
                    f"{_where(*sample)}\n{name}[{i}, {j}] says that {_LINE[i]} changes with {by[j]} at the rate "
                    f"{text(got[i, j])},\nbut a small change of {by[j]} changes your own line at the rate "
                    f"{text(slopes[i, j])}."
                )

    return Check(f"{name} agrees with small changes", check)


def _place_untouched(caller: Caller) -> None:
    for sample in _SAMPLES:
        _place(caller, *sample)
        _say_written(caller, ("z", "x", "tf_base_to_camera"))


LINE_IN_WORLD = (
    Check(
        "returns line (2,), by_pose (2, 3), by_z (2, 2)", lambda caller: _place(caller, *_SAMPLES[0]) and None
    ),
    _worked("a wall ahead", (0.0, 2.0), (1.0, 0.0, 0.0), _CENTRE, (0.0, 3.0)),
    _worked(
        "a wall ahead of a robot that has turned left", (0.0, 2.0), (0.0, 1.0, pi / 2), _CENTRE, (pi / 2, 3.0)
    ),
    _worked("a scanner in front", (0.0, 2.0), (0.0, 0.0, pi / 2), (0.5, 0.2, 0.0), (pi / 2, 2.5)),
    _worked("a wall between the robot and the origin", (0.0, 1.0), (-3.0, 0.0, 0.0), _CENTRE, (-pi, 2.0)),
    Check("points of the wall are on the line", _same_wall),
    Check("every line is normalised", _normal_form),
    _derivative("by_pose", 1, _POSE),
    _derivative("by_z", 0, ("alpha of z", "r of z")),
    Check("leaves its arguments as they were", _place_untouched),
)
"""Checks of ``line_in_world(z, x, tf_base_to_camera) -> line, by_pose, by_z``."""

_X = (0.3, -0.5, 0.7, 0.4, 2.0, -2.1, 1.5)
_ROOT = np.array(
    [
        [0.3, 0.0, 0.1, 0.0, 0.1, 0.0, 0.2],
        [0.1, 0.2, 0.0, 0.1, 0.0, 0.1, 0.0],
        [0.0, 0.1, 0.2, 0.0, 0.1, 0.0, 0.1],
        [0.1, 0.0, 0.1, 0.3, 0.0, 0.1, 0.0],
        [0.0, 0.2, 0.0, 0.1, 0.3, 0.0, 0.1],
        [0.2, 0.0, 0.1, 0.0, 0.1, 0.2, 0.0],
        [0.0, 0.1, 0.0, 0.2, 0.0, 0.1, 0.3],
    ]
)
_SIGMA, _Z, _Q = _ROOT @ _ROOT.T, (0.5, 1.2), ((0.02, 0.01), (0.01, 0.04))


def _state(caller: Caller) -> None:
    x, Sigma = _grow(caller, _X, _SIGMA, _Z, _Q)
    if np.max(np.abs(x[:-2] - _X)) > 1e-12 or np.max(np.abs(Sigma[:-2, :-2] - _SIGMA)) > 1e-12:
        raise Wrong(
            "What was in x and Sigma before should stay as it is and where it is, in front of the new line."
        )


def _symmetric(caller: Caller) -> None:
    _, Sigma = _grow(caller, _X, _SIGMA, _Z, _Q)
    if np.max(np.abs(Sigma - Sigma.T)) > 1e-12:
        raise Wrong("Sigma is not symmetric.")
    if np.linalg.eigvalsh(Sigma).min() < 0:
        raise Wrong("Sigma has a negative eigenvalue: no errors have such covariances.")


def _by_hand(caller: Caller) -> None:
    x, Sigma = _grow(caller, (1.0, 0.0, 0.0), np.diag([0.01, 0.0, 0.0]), (0.0, 2.0), np.diag([0.0, 0.0001]))
    if np.max(np.abs(x - [1.0, 0.0, 0.0, 0.0, 3.0])) > 1e-9:
        raise Wrong(f"A robot at (1, 0) sees a wall 2 m ahead: expected x = [1, 0, 0, 0, 3], got {text(x)}")
    if abs(Sigma[4, 4] - 0.0101) > 1e-9 or abs(Sigma[0, 4] - 0.01) > 1e-9:
        raise Wrong(
            "A robot that knows x to 0.1 m sees a wall ahead to 0.01 m. The wall is as uncertain as both together,\n"
            f"0.0101 m^2, and off whenever x is, 0.01 m^2: your Sigma has {text(Sigma[4, 4])} and {text(Sigma[0, 4])}."
        )


def _certain(caller: Caller) -> None:
    _, Sigma = _grow(caller, (1.0, 0.5, 0.3), np.zeros((3, 3)), _Z, _Q)
    if np.any(Sigma[:3]) or np.any(Sigma[:, :3]):
        raise Wrong(
            "The pose is certain, so that nothing can be off together with it: these covariances are 0."
        )


def _like_samples(caller: Caller) -> None:
    """Move the pose, the map and the observation a little, and see where the student's own line goes."""
    _, Sigma = _grow(caller, _X, _SIGMA, _Z, _Q, (0.2, 0.1, -0.3))
    n, columns = len(_X), []
    for i in range(n + 2):
        ends = []
        for sign in (1.0, -1.0):
            both = np.array((*_X, *_Z))
            both[i] += sign * 1e-5
            ends.append(_grow(caller, both[:n], _SIGMA, both[n:], _Q, (0.2, 0.1, -0.3))[0])
        columns.append((ends[0] - ends[1]) / 2e-5)
    J = np.stack(columns, axis=1)
    before = np.zeros((n + 2, n + 2))
    before[:n, :n], before[n:, n:] = _SIGMA, _Q
    off = np.abs(Sigma - J @ before @ J.T)
    if np.max(off) > 1e-6:
        i, j = sorted(int(k) for k in np.unravel_index(np.argmax(off), off.shape))
        names = [*_POSE, *(f"{name} of line {k}" for k in range((n - 1) // 2) for name in _LINE)]
        raise Wrong(
            f"Small changes of what goes in move your own x so that {names[i]} and {names[j]} have the covariance\n"
            f"{text((J @ before @ J.T)[i, j])}, but your Sigma[{i}, {j}] is {text(Sigma[i, j])}."
        )


def _grow_untouched(caller: Caller) -> None:
    _grow(caller, _X, _SIGMA, _Z, _Q)
    _say_written(caller, ("x", "Sigma", "z", "Q", "tf_base_to_camera"))


def _empty_map(caller: Caller) -> None:
    _grow(caller, _X[:3], _SIGMA[:3, :3], _Z, _Q)


AUGMENT = (
    Check(
        "returns x (n + 2,), Sigma (n + 2, n + 2)", lambda caller: _grow(caller, _X, _SIGMA, _Z, _Q) and None
    ),
    Check("a wall ahead, worked by hand", _by_hand),
    Check("what was known stays", _state),
    Check("Sigma is a covariance", _symmetric),
    Check("seen from a certain pose", _certain),
    Check("Sigma agrees with small changes", _like_samples),
    Check("the first line of an empty map", _empty_map),
    Check("leaves its arguments as they were", _grow_untouched),
)
"""Checks of ``augment(x, Sigma, z, Q, tf_base_to_camera) -> x, Sigma``."""

# Two predicted lines, a belief known to 0.1 rad and 0.1 m, and a scan that is as good.
_HS = ((0.0, 3.1), (2.0, 3.0))
_HALF = 0.01 * np.eye(2)


def _ask(caller: Caller, z, Q=_HALF, hs=_HS) -> int:  # noqa: ANN001 - plain numbers
    hs = np.array(hs, dtype=float).reshape(2, -1)
    J = hs.shape[1]
    Hs = np.zeros((J, 2, 3 + 2 * J))
    for j in range(J):
        Hs[j, :, 3 + 2 * j : 5 + 2 * j] = np.eye(2)
    arguments = (
        np.array(z, dtype=float),
        np.array(Q, dtype=float),
        hs,
        Hs,
        0.01 * np.eye(3 + 2 * J),
        2.0,
        5.0,
    )
    (j,) = caller(arguments, {"j": ()})
    return int(j)


def _seen(story: str, *examples: tuple) -> Check:
    def check(caller: Caller) -> None:
        for z, Q, expected, why in examples:
            j = _ask(caller, z, Q)
            if j != expected:
                raise Wrong(
                    f"The lines {text(np.transpose(_HS))} are expected, belief and scan are known to 0.1 rad and 0.1 m"
                    f"\nunless said otherwise, and the gates are 2 and 5. {text(z)} is seen: {why}.\n"
                    f"Expected {expected}, got {j}"
                )

    return Check(story, check)


def _none_known(caller: Caller) -> None:
    j = _ask(caller, (0.1, 2.0), _HALF, np.zeros((2, 0)))
    if j != -1:
        raise Wrong(f"With no line in the map everything is new: expected -1, got {j}")


def _two_near(caller: Caller) -> None:
    j = _ask(caller, (0.0, 2.15), _HALF, ((0.0, 0.0), (2.0, 2.2)))
    if j != 1:
        raise Wrong(
            f"(0, 2.15) is seen, (0, 2) and (0, 2.2) are expected: the second is nearer, expected 1, got {j}"
        )


def _ask_untouched(caller: Caller) -> None:
    for z in ((0.1, 2.1), (-3.1, -2.0)):
        _ask(caller, z)
        _say_written(caller, ("z", "Q", "hs", "Hs", "Sigma", "g", "newness"))


_ROOT2 = 2**0.5 / 10  # one standard deviation of a difference
RECOGNIZE = (
    Check("returns one number", lambda caller: _ask(caller, (0.1, 2.1)) and None),
    _seen(
        "lines of the map",
        ((0.1, 2.1), _HALF, 0, "the first line, 1 standard deviation off"),
        ((3.0, 3.1), _HALF, 1, "the second line, 1 standard deviation off"),
        ((0.0, 2 + 1.8 * _ROOT2), _HALF, 0, "the first line, 1.8 standard deviations off"),
    ),
    _seen(
        "a new line",
        ((1.5, 2.0), _HALF, -1, "far from both"),
        ((0.0, 2 - 5.4 * _ROOT2), _HALF, -1, "5.4 standard deviations from the first"),
    ),
    _seen(
        "between the gates",
        (
            (0.0, 2 + 2.4 * _ROOT2),
            _HALF,
            -2,
            "2.4 standard deviations from the first line, which proves nothing",
        ),
        (
            (0.0, 2 - 4.5 * _ROOT2),
            _HALF,
            -2,
            "4.5 standard deviations from the first line, which proves nothing",
        ),
    ),
    _seen(
        "a scan that is worse",
        ((0.0, 2.9), np.diag([0.01, 0.24]), 0, "the scan knows r to 0.49 m only: 1.8 standard deviations"),
    ),
    _seen("across the cut", ((-3.1, 3.0), _HALF, 1, "-3.1 and 3.1 are 0.08 rad apart")),
    _seen("the other name", ((3.1, -2.0), _HALF, 0, "this is the line (-0.04, 2)")),
    Check("the nearer of two lines", _two_near),
    Check("an empty map", _none_known),
    Check("leaves its arguments as they were", _ask_untouched),
)
"""Checks of ``recognize(z, Q, hs, Hs, Sigma, g, newness) -> j``."""
