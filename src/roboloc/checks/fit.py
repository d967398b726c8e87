"""Public checks of the line fit: worked numbers, the cost of lines nearby, laws of the derivatives, differences.

The derivatives of a line by its beams obey laws that need no formula: a scan that is turned turns its line, one that
is enlarged enlarges it, and a scanner that is moved sees it nearer or farther.
"""

from functools import cache
from math import pi

import numpy as np

from roboloc.angles import wrap
from roboloc.checks.report import Caller, Check, Wrong, text
from roboloc.se2 import compose

# Points about the scanner, no two walls alike: ahead, to the left, behind, and one of two beams.
_LEANING = ((1.9, -1.0), (2.0, 0.0), (2.1, 1.0))
_WALLS = (
    ((2.0, -0.4), (2.1, 0.3), (1.95, 0.9), (2.2, 1.7), (2.15, 2.2)),
    ((-0.5, 1.4), (0.2, 1.55), (0.9, 1.4), (1.6, 1.7), (2.3, 1.65)),
    ((-1.0, -2.2), (-1.4, -1.3), (-1.7, -0.8), (-2.3, 0.4), (-2.4, 0.8)),
    ((1.0, -0.7), (0.4, -1.6)),
)
_AXES = (
    ("a wall straight ahead", ((2.0, -1.0), (2.0, 0.0), (2.0, 1.0)), (0.0, 2.0)),
    ("a wall to the left", ((-1.0, 2.0), (0.5, 2.0), (1.0, 2.0)), (pi / 2, 2.0)),
    ("a wall to the right", ((-1.0, -2.0), (0.5, -2.0), (1.0, -2.0)), (-pi / 2, 2.0)),
)
_BEHIND = ((-2.0, -1.5), (-1.5, -2.0), (-1.0, -2.5))


def _unit(alpha: float) -> np.ndarray:
    """Return where a robot ends that turns by alpha and drives 1 m."""
    return compose((0.0, 0.0, alpha), (1.0, 0.0, 0.0))[:2]


def _beams(points: tuple) -> tuple[np.ndarray, np.ndarray]:
    x, y = np.array(points).T
    return np.arctan2(y, x), np.hypot(x, y)


def _off(line: tuple, points: tuple) -> np.ndarray:
    """Return the distances of points from a line."""
    return np.array(points) @ _unit(float(line[0])) - line[1]


def _parameters(caller: Caller, points: tuple) -> tuple[float, float]:
    return tuple(map(float, caller(_beams(points), {"alpha": (), "r": ()})))


def _fit(caller: Caller, beams: tuple, variances: tuple[float, float]) -> tuple[np.ndarray, ...]:
    return caller((*beams, *variances), {"alpha": (), "r": (), "C": (2, 2)})


def _any_name(line: tuple) -> tuple[float, float]:
    """Return a line with r >= 0 and alpha in one turn."""
    alpha, r = line
    return float(wrap(alpha + pi * (r < 0))), abs(r)


def _near(line: tuple, expected: tuple, allowed: float = 1e-4) -> bool:
    return abs(wrap(line[0] - expected[0])) < allowed and abs(line[1] - expected[1]) < allowed


def _worked(caller: Caller) -> None:
    for story, points, expected in _AXES:
        line = _parameters(caller, points)
        if not _near(_any_name(line), expected):
            raise Wrong(f"For {story}, points {text(points)}:\nexpected {text(expected)}, got {text(line)}")


def _by_hand(caller: Caller) -> None:
    line = _parameters(caller, _LEANING)
    if not _near(_any_name(line), (-0.09967, 1.99007)):
        raise Wrong(
            f"For the points {text(_LEANING)}, worked in the book:\nexpected [-0.0997, 1.99], got {text(line)}"
        )


def _least(caller: Caller) -> None:
    for points in _WALLS:
        line = np.array(_parameters(caller, points))
        cost = np.sum(_off(line, points) ** 2)
        for step in ((1e-3, 0.0), (-1e-3, 0.0), (0.0, 1e-3), (0.0, -1e-3), (1e-3, 2e-3), (-1e-3, -2e-3)):
            other = np.sum(_off(line + step, points) ** 2)
            if other < cost - 1e-12:
                raise Wrong(
                    f"For the points {text(points)} your line is {text(line)},\nbut {text(line + step)} is nearer to "
                    f"them: the squared distances add up to {text(other)} m^2, and to {text(cost)} m^2 for yours."
                )


def _say_written(caller: Caller, names: tuple) -> None:
    for i in caller.written_to:
        raise Wrong(f"The function writes to its argument {names[i]}. Work on a copy: np.array({names[i]}).")


def _parameters_untouched(caller: Caller) -> None:
    _parameters(caller, _WALLS[0])
    _say_written(caller, ("theta", "rho"))


PARAMETERS = (
    Check("returns alpha, r", lambda caller: _parameters(caller, _LEANING) and None),
    Check("walls along the axes", _worked),
    Check("a wall that leans, worked by hand", _by_hand),
    Check("no line nearby is nearer to the points", _least),
    Check("leaves its arguments as they were", _parameters_untouched),
)
"""Checks of ``line_parameters(theta, rho) -> alpha, r``."""

_STRAIGHT = ((2.0, -1.0), (2.0, 0.0), (2.0, 1.0))


def _jacobians(caller: Caller, beams: tuple, line: tuple) -> tuple[np.ndarray, np.ndarray]:
    shape = (2, len(beams[0]))
    return caller((*beams, *map(float, line)), {"J_theta": shape, "J_rho": shape})


def _best(points: tuple) -> tuple[float, float]:
    """Search for the best line by halving a step: no formula."""
    middle = np.mean(points, axis=0)

    def line(alpha: float) -> tuple[float, float]:
        return alpha, float(_unit(alpha) @ middle)

    def cost(alpha: float) -> float:
        return float(np.sum(_off(line(alpha), points) ** 2))

    alpha = min(np.linspace(-pi, pi, 97), key=lambda angle: cost(angle) + 9.0 * (line(angle)[1] < 0))
    step = 0.05
    while step > 1e-12:
        better = min((alpha - step, alpha + step), key=cost)
        alpha, step = (better, step) if cost(better) < cost(alpha) else (alpha, step / 2)
    return line(alpha)


@cache
def _lines() -> tuple:
    """Return beams and best line of each of the walls."""
    return tuple((_beams(points), _best(points)) for points in _WALLS)


def _nudged(caller: Caller) -> None:
    _, J_rho = _jacobians(caller, _beams(_STRAIGHT), (0.0, 2.0))
    expected = np.array(((0.44721, 0.0, -0.44721), (0.29814, 0.33333, 0.29814)))
    if np.max(np.abs(J_rho - expected)) > 1e-4:
        raise Wrong(
            f"For the wall with the points {text(_STRAIGHT)}, worked in the book:\nexpected J_rho = {text(expected)},\n"
            f"got      J_rho = {text(J_rho)}"
        )


def _law(story: str, change: np.ndarray, expected: np.ndarray) -> None:
    if np.max(np.abs(change - expected)) > 1e-5:
        raise Wrong(
            f"{story}\nthe line changes by {text(expected)}, but by your derivatives by {text(change)}."
        )


def _turned(caller: Caller) -> None:
    for beams, line in _lines():
        J_theta, _ = _jacobians(caller, beams, line)
        _law("When all bearings grow alike, per rad,", J_theta.sum(axis=1), np.array((1.0, 0.0)))


def _enlarged(caller: Caller) -> None:
    for beams, line in _lines():
        _, J_rho = _jacobians(caller, beams, line)
        _law("When all ranges grow by the same share,", J_rho @ beams[1], np.array((0.0, line[1])))


def _moved(caller: Caller) -> None:
    for (theta, rho), line in _lines():
        J_theta, J_rho = _jacobians(caller, (theta, rho), line)
        rays = np.array([_unit(angle) for angle in theta])
        left = np.array([_unit(angle + pi / 2) for angle in theta])
        for i, way in enumerate(("ahead", "to the left")):
            change = -J_rho @ rays[:, i] - J_theta @ (left[:, i] / rho)
            _law(f"When the scanner moves {way}, per m,", change, np.array((0.0, -_unit(line[0])[i])))


def _other_side(caller: Caller) -> None:
    for beams, (alpha, r) in _lines()[:2]:
        J_theta, J_rho = _jacobians(caller, beams, (alpha - pi, -r))
        _law(
            "For the name with r < 0, when all ranges grow by the same share,",
            J_rho @ beams[1],
            np.array((0, -r)),
        )
        _law(
            "For the name with r < 0, when all bearings grow alike,",
            J_theta.sum(axis=1),
            np.array((1.0, 0.0)),
        )


@cache
def _tried() -> tuple[np.ndarray, np.ndarray]:
    """Search the best line of the first wall again, each beam changed a little to either side."""
    found = []
    for which in range(2):
        columns = []
        for i in range(len(_WALLS[0])):
            ends = []
            for step in (1e-3, -1e-3):
                beams = [np.array(part) for part in _beams(_WALLS[0])]
                beams[which][i] += step
                points = np.array([beams[1][k] * _unit(beams[0][k]) for k in range(len(beams[0]))])
                ends.append(np.array(_best(points)))
            columns.append((ends[0] - ends[1]) / 2e-3)
        found.append(np.transpose(columns))
    return tuple(found)


def _searched(caller: Caller) -> None:
    beams, line = _lines()[0]
    pairs = zip(("J_theta", "J_rho"), _jacobians(caller, beams, line), _tried(), strict=True)
    for name, J, tried in pairs:
        if np.max(np.abs(J - tried) / np.abs(tried).max(axis=1, keepdims=True)) > 2e-3:
            raise Wrong(
                f"For the points {text(_WALLS[0])}, whose best line is {text(line)}:\nwith one beam changed after the "
                f"other, and the best line found by trying, {name} is about\n{text(tried.round(4))}, but yours is\n"
                f"{text(J)}"
            )


def _jacobians_untouched(caller: Caller) -> None:
    _jacobians(caller, *_lines()[0])
    _say_written(caller, ("theta", "rho", "alpha", "r"))


JACOBIANS = (
    Check(
        "returns J_theta (2, N), J_rho (2, N)",
        lambda caller: _jacobians(caller, _beams(_STRAIGHT), (0, 2)) and None,
    ),
    Check("three ranges of a wall ahead, worked by hand", _nudged),
    Check("a scan that is turned turns its line", _turned),
    Check("a scan that is enlarged enlarges r", _enlarged),
    Check("a scanner that is moved sees the same line", _moved),
    Check("agrees with lines found by trying", _searched),
    Check("the line may be given with r < 0", _other_side),
    Check("leaves its arguments as they were", _jacobians_untouched),
)
"""Checks of ``line_jacobians(theta, rho, alpha, r) -> J_theta, J_rho``."""

_VARIANCES = (0.004**2, 0.02**2)


def _same_line(caller: Caller) -> None:
    for points in (*(points for _, points, _ in _AXES), _LEANING, *_WALLS, _BEHIND):
        alpha, r, _ = _fit(caller, _beams(points), _VARIANCES)
        wanted = _best(points)
        if not _near((alpha, r), wanted):
            hint = "the other name of" if _near(_any_name((alpha, r)), wanted) else "not"
            raise Wrong(
                f"For the points {text(points)} your line is {text((alpha, r))}: {hint} the best line with r >= 0."
            )


def _one_turn(caller: Caller) -> None:
    for points in (*_WALLS, _BEHIND):
        alpha, _, _ = _fit(caller, _beams(points), _VARIANCES)
        if abs(alpha) > pi + 1e-9:
            raise Wrong(f"For the points {text(points)} alpha is {text(alpha)}, outside [-pi, pi).")


def _covariance(caller: Caller) -> None:
    for points in (*_WALLS, _BEHIND):
        beams = _beams(points)
        _, _, C = _fit(caller, beams, _VARIANCES)
        differences = _differences(caller, beams)
        spread = np.sqrt(np.diag(differences))
        if np.max(np.abs(C - differences) / np.outer(spread, spread)) > 1e-4:
            raise Wrong(
                f"For the points {text(points)}: small changes of each beam, one after the other, move your own alpha "
                f"and r.\nWith the variances of the beams that makes C = {text(differences)},\nbut yours is {text(C)}"
            )


def _differences(caller: Caller, beams: tuple) -> np.ndarray:
    """Return the covariance that the student's own line has, by central differences."""
    C, step = np.zeros((2, 2)), 1e-5
    for which, variance in enumerate(_VARIANCES):
        for i in range(len(beams[0])):
            ends = []
            for sign in (1.0, -1.0):
                moved = [np.array(part) for part in beams]
                moved[which][i] += sign * step
                ends.append(np.array(_fit(caller, tuple(moved), _VARIANCES)[:2]))
            column = (ends[0] - ends[1]) / (2.0 * step)
            column[0] = wrap(ends[0][0] - ends[1][0]) / (2.0 * step)
            C += variance * np.outer(column, column)
    return C


def _fit_untouched(caller: Caller) -> None:
    _fit(caller, _beams(_WALLS[2]), _VARIANCES)
    _say_written(caller, ("theta", "rho", "var_theta", "var_rho"))


FIT = (
    Check("returns alpha, r, C (2, 2)", lambda caller: _fit(caller, _beams(_LEANING), _VARIANCES) and None),
    Check("alpha is in one turn", _one_turn),
    Check("the best line, with r >= 0", _same_line),
    Check("C agrees with small changes of the beams", _covariance),
    Check("leaves its arguments as they were", _fit_untouched),
)
"""Checks of ``fit_line(theta, rho, var_theta, var_rho) -> alpha, r, C``."""
