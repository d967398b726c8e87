"""Public checks of lines seen by a scanner: worked numbers, points of a wall, differences of the student's own h."""

from math import pi

import numpy as np

from roboloc.angles import wrap
from roboloc.checks.report import Caller, Check, Wrong, text
from roboloc.se2 import compose, inverse

_LINE = {"h": (2,), "Hx": (2, 3)}
_POSE = ("x", "y", "theta")
_NAMES = ("alpha", "r")
_CENTRE = (0.0, 0.0, 0.0)

# Lines, poses and mountings: all signs, the scanner at the centre and off it, the line on either side of it.
_SAMPLES = (
    ((0.4, 2.0), (0.3, -0.5, 0.7), _CENTRE),
    ((-2.1, 1.5), (1.2, 0.8, -1.1), (0.2, -0.1, 0.0)),
    ((2.6, 3.0), (-0.7, 2.2, 2.4), (-0.3, 0.4, 0.9)),
    ((1.2, 0.5), (1.5, 2.5, -0.4), (0.1, 0.3, -2.0)),
)


def _transform(caller: Caller, line, x, tf) -> tuple[np.ndarray, np.ndarray]:  # noqa: ANN001 - plain numbers
    return caller(tuple(np.array(a, dtype=float) for a in (line, x, tf)), _LINE)


def _normalize(caller: Caller, h, Hx) -> tuple[np.ndarray, np.ndarray]:  # noqa: ANN001 - plain numbers
    h, Hx = np.array(h, dtype=float), np.array(Hx, dtype=float)
    return caller((h, Hx), {"h": (2,), "Hx": Hx.shape})


def _predict(caller: Caller, x, map_lines, tf) -> tuple[np.ndarray, np.ndarray]:  # noqa: ANN001 - plain numbers
    arguments = tuple(np.array(a, dtype=float) for a in (x, map_lines, tf))
    count = arguments[1].shape[1]
    return caller(arguments, {"hs": (2, count), "Hs": (count, 2, 3)})


def _minus(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return a - b of two lines, or of two rows of lines, the angle on the circle."""
    d = np.array(a - b)
    d[0] = wrap(d[0])
    return d


def _unit(alpha: float) -> np.ndarray:
    """Return where a robot ends that turns by alpha and drives 1 m."""
    return compose((0.0, 0.0, alpha), (1.0, 0.0, 0.0))[:2]


def _points(line: tuple) -> list[np.ndarray]:
    """Return three points of a line: its foot, and 1 m to either side."""
    normal = _unit(line[0])
    along = np.array([-normal[1], normal[0]])
    return [line[1] * normal + s * along for s in (-1.0, 0.0, 1.0)]


def _off_the_line(line: np.ndarray, points: list[np.ndarray]) -> float:
    """Return the largest distance of points from a line."""
    return max(abs(float(_unit(line[0]) @ point) - line[1]) for point in points)


def _where(line: tuple, x: tuple, tf: tuple) -> str:
    return f"For the line {text(line)}, the pose {text(x)} and the mounting {text(tf)}:"


def _worked(story: str, line: tuple, x: tuple, tf: tuple, expected: tuple) -> Check:
    def check(caller: Caller) -> None:
        h, _ = _transform(caller, line, x, tf)
        if np.max(np.abs(_minus(h, np.array(expected)))) > 1e-6:
            raise Wrong(f"{_where(line, x, tf)}\nexpected h = {text(expected)}, got {text(h)}")

    return Check(story, check)


def _on_the_wall(caller: Caller) -> None:
    for line, x, tf in _SAMPLES:
        h, _ = _transform(caller, line, x, tf)
        into = inverse(compose(x, tf))
        seen = [compose(into, (*point, 0.0))[:2] for point in _points(line)]
        off = _off_the_line(h, seen)
        if off > 1e-6:
            raise Wrong(
                f"{_where(line, x, tf)}\nthree points of the wall, put into the scanner's frame, "
                f"are up to {off:.3g} m away from your h = {text(h)}."
            )


def _slopes(caller: Caller, line: tuple, x: tuple, tf: tuple) -> np.ndarray:
    """Differentiate the student's own h by the pose: central differences, one extrapolation."""
    columns = []
    for i in range(3):

        def slope(size: float, i: int = i) -> np.ndarray:
            sides = []
            for sign in (1.0, -1.0):
                moved = np.array(x, dtype=float)
                moved[i] += sign * size
                sides.append(_transform(caller, line, moved, tf)[0])
            return _minus(*sides) / (2.0 * size)

        columns.append((4.0 * slope(1e-3) - slope(2e-3)) / 3.0)
    return np.stack(columns, axis=1)


def _hx(caller: Caller) -> None:
    for line, x, tf in _SAMPLES:
        _, Hx = _transform(caller, line, x, tf)
        slopes = _slopes(caller, line, x, tf)
        off = np.abs(Hx - slopes)
        if np.max(off) > 1e-6:
            i, j = np.unravel_index(np.argmax(off), off.shape)
            raise Wrong(
                f"{_where(line, x, tf)}\nHx[{i}, {j}] says that {_NAMES[i]} changes with {_POSE[j]} at the rate "
                f"{text(Hx[i, j])}, but a small change of {_POSE[j]}\nchanges your own h[{i}] at the rate "
                f"{text(slopes[i, j])}."
            )


def _transform_untouched(caller: Caller) -> None:
    _transform(caller, *_SAMPLES[2])
    _say_written(caller, ("line", "x", "tf_base_to_camera"))


def _say_written(caller: Caller, names: tuple) -> None:
    for i in caller.written_to:
        raise Wrong(f"The function writes to its argument {names[i]}. Work on a copy: np.array({names[i]}).")


TRANSFORM = (
    Check("returns h (2,), Hx (2, 3)", lambda caller: _transform(caller, *_SAMPLES[0]) and None),
    _worked("a wall ahead comes nearer", (0.0, 3.0), (1.0, 0.0, 0.0), _CENTRE, (0.0, 2.0)),
    _worked(
        "after a turn to the left the wall is on the right", (0.0, 3.0), (0, 0, pi / 2), _CENTRE, (-pi / 2, 3)
    ),
    _worked(
        "a scanner in front is nearer to what is ahead", (0.0, 3.0), _CENTRE, (0.5, 0.0, 0.0), (0.0, 2.5)
    ),
    _worked("the scanner turns with the robot", (pi / 2, 3.0), (0, 0, pi / 2), (0.5, 0.2, 0.0), (0.0, 2.5)),
    _worked("a scanner that looks back sees it behind", (0.0, 3.0), _CENTRE, (0.0, 0.0, pi), (-pi, 3.0)),
    _worked("beyond the wall r is negative", (0.0, 1.0), (3.0, 0.0, 0.0), _CENTRE, (0.0, -2.0)),
    Check("points of the wall are on the line h", _on_the_wall),
    Check("Hx agrees with small changes of the pose", _hx),
    Check("leaves its arguments as they were", _transform_untouched),
)
"""Checks of ``transform_line_to_scanner_frame(line, x, tf_base_to_camera) -> h, Hx``."""

_HX = ((0.0, 0.0, -1.0), (-0.6, -0.8, 0.3))
_WIDE = ((0.1, 0.2, -1.0, 0.4, 0.5), (-0.6, -0.8, 0.3, 0.7, -0.9))


def _keeps(caller: Caller) -> None:
    for h in ((0.5, 2.0), (-3.0, 0.1), (3.0, 1.0)):
        line, Hx = _normalize(caller, h, _HX)
        if np.max(np.abs(line - h)) > 1e-9 or np.max(np.abs(Hx - _HX)) > 1e-9:
            raise Wrong(
                f"h = {text(h)} is normalised already, but h or Hx has changed:\n{text(line)}, {text(Hx)}"
            )


def _not_negative(caller: Caller) -> None:
    for h in ((0.5, -2.0), (-2.0, -0.1), (3.0, -1.0)):
        line, _ = _normalize(caller, h, _HX)
        if line[1] < 0:
            raise Wrong(f"For h = {text(h)} your r is {text(line[1])}. A scan reports no negative distance.")


def _same_line(caller: Caller) -> None:
    for h in ((0.5, -2.0), (-2.0, -0.1), (3.0, -1.0), (9.0, 1.0), (-8.0, -1.5)):
        line, _ = _normalize(caller, h, _HX)
        off = _off_the_line(line, _points(h))
        if off > 1e-6:
            raise Wrong(
                f"Points of the line h = {text(h)} are up to {off:.3g} m away from your {text(line)}:\n"
                "that is another line."
            )


def _one_turn(caller: Caller) -> None:
    for h in ((3.5, 1.0), (-3.5, 1.0), (13.0, 2.0), (-16.0, 1.0), (2.0, -1.0), (6.0, -1.0)):
        line, _ = _normalize(caller, h, _HX)
        if abs(line[0]) > pi + 1e-9:
            raise Wrong(f"For h = {text(h)} your alpha is {text(line[0])}, outside [-pi, pi).")


def _follows(caller: Caller) -> None:
    for h in ((0.5, 2.0), (0.5, -2.0), (-2.0, -0.3)):
        line, Hx = _normalize(caller, h, _HX)
        step = 1e-6
        for j, column in enumerate(np.transpose(_HX)):
            there, _ = _normalize(caller, np.array(h) + step * column, _HX)
            back, _ = _normalize(caller, np.array(h) - step * column, _HX)
            slope = _minus(there, back) / (2.0 * step)
            if np.max(np.abs(Hx[:, j] - slope)) > 1e-6:
                raise Wrong(
                    f"For h = {text(h)} the pose moves h by {text(column)} in column {j}.\nYour own normalised line "
                    f"{text(line)} then moves by {text(slope)},\nbut column {j} of your Hx is {text(Hx[:, j])}."
                )


def _any_size(caller: Caller) -> None:
    _normalize(caller, (0.5, 2.0), _WIDE)


def _through_the_scanner(caller: Caller) -> None:
    _, Hx = _normalize(caller, (0.5, 0.0), _HX)
    if np.max(np.abs(np.abs(Hx) - np.abs(_HX))) > 1e-9:
        raise Wrong(f"For h = [0.5, 0] nothing of Hx may be lost, but it is {text(Hx)}.")


def _normalize_untouched(caller: Caller) -> None:
    for h in ((0.5, 2.0), (4.0, -2.0)):
        _normalize(caller, h, _HX)
        _say_written(caller, ("h", "Hx"))


NORMALIZE = (
    Check("returns h (2,), Hx (2, n)", lambda caller: _normalize(caller, (0.5, 2.0), _HX) and None),
    Check("keeps a line that is normalised", _keeps),
    Check("r is not negative", _not_negative),
    Check("the line is the same line", _same_line),
    Check("alpha is in one turn", _one_turn),
    Check("Hx follows the line that is returned", _follows),
    Check("a line through the scanner keeps its Hx", _through_the_scanner),
    Check("Hx may have any number of columns", _any_size),
    Check("leaves its arguments as they were", _normalize_untouched),
)
"""Checks of ``normalize_line_parameters(h, Hx) -> h, Hx``."""

_ROOM = ((0.0, pi / 2, -pi, -pi / 2), (4.0, 3.0, 1.0, 2.0))
_CORRIDOR = ((pi / 2, -pi / 2), (1.0, 1.0))


def _room(caller: Caller) -> None:
    hs, _ = _predict(caller, (1.0, 1.0, 0.0), _ROOM, _CENTRE)
    expected = np.array((_ROOM[0], (3.0, 2.0, 2.0, 3.0)))
    if np.max(np.abs(_minus(hs, expected))) > 1e-6:
        raise Wrong(
            f"In a room with walls {text(_ROOM)}, from (1, 1) and facing along x,\n"
            f"expected hs = {text(expected)},\ngot      hs = {text(hs)}"
        )


def _mounted(caller: Caller) -> None:
    hs, _ = _predict(caller, _CENTRE, _ROOM, (0.5, -0.2, pi / 2))
    expected = np.array(((-pi / 2, 0.0, pi / 2, -pi), (3.5, 3.2, 1.5, 1.8)))
    if np.max(np.abs(_minus(hs, expected))) > 1e-6:
        raise Wrong(
            f"In a room with walls {text(_ROOM)}, a scanner 0.5 m in front of the origin and 0.2 m to the right,\n"
            f"looking to the left: expected hs = {text(expected)},\ngot      hs = {text(hs)}"
        )


def _outside(caller: Caller) -> None:
    hs, _ = _predict(caller, (0.0, 3.0, 0.0), _CORRIDOR, _CENTRE)
    expected = np.array(((-pi / 2, -pi / 2), (2.0, 4.0)))
    if np.max(np.abs(_minus(hs, expected))) > 1e-6:
        raise Wrong(
            "Two walls 1 m to the left and to the right of the x axis, from 3 m to the left of it:\n"
            f"both are on the right, expected hs = {text(expected)}, got {text(hs)}"
        )


def _reordered(caller: Caller) -> None:
    x, tf = (1.3, -0.7, 0.6), (0.2, 0.1, -0.5)
    order = [2, 0, 3, 1]
    hs, Hs = _predict(caller, x, _ROOM, tf)
    mixed_hs, mixed_Hs = _predict(caller, x, np.array(_ROOM)[:, order], tf)
    if np.max(np.abs(_minus(mixed_hs, hs[:, order]))) > 1e-9 or np.max(np.abs(mixed_Hs - Hs[order])) > 1e-9:
        raise Wrong(
            "The map with its columns in another order should give the same predictions in that order; yours are not."
        )


def _differences(caller: Caller) -> None:
    x, tf, step = np.array((1.3, -0.7, 0.6)), (0.2, 0.1, -0.5), 1e-6
    crossed = np.hstack([_ROOM, [[0.4], [0.3]]])
    _, Hs = _predict(caller, x, crossed, tf)
    for i in range(3):
        nudge = step * np.eye(3)[i]
        there, _ = _predict(caller, x + nudge, crossed, tf)
        back, _ = _predict(caller, x - nudge, crossed, tf)
        slopes = _minus(there, back) / (2.0 * step)
        off = np.abs(Hs[:, :, i].T - slopes)
        if np.max(off) > 1e-6:
            row, j = np.unravel_index(np.argmax(off), off.shape)
            raise Wrong(
                f"Hs[{j}, {row}, {i}] says that {_NAMES[row]} of line {j} changes with {_POSE[i]} at the rate "
                f"{text(Hs[j, row, i])},\nbut a small change of {_POSE[i]} changes your own hs[{row}, {j}] at the rate "
                f"{text(slopes[row, j])}."
            )


def _normal_form(caller: Caller) -> None:
    for x in ((0.0, 3.0, 2.9), (5.0, -4.0, -3.0), (-2.0, 1.0, 9.0)):
        hs, _ = _predict(caller, x, _ROOM, _CENTRE)
        if np.any(hs[1] < 0) or np.any(np.abs(hs[0]) > pi + 1e-9):
            raise Wrong(f"From {text(x)} some r is negative or some alpha outside [-pi, pi): hs = {text(hs)}")


def _single(caller: Caller) -> None:
    _predict(caller, _CENTRE, ((0.3,), (2.0,)), _CENTRE)


def _predict_untouched(caller: Caller) -> None:
    _predict(caller, (5.0, -4.0, -3.0), _ROOM, (0.2, 0.1, -0.5))
    _say_written(caller, ("x", "map_lines", "tf_base_to_camera"))


PREDICTED = (
    Check(
        "returns hs (2, J), Hs (J, 2, 3)", lambda caller: _predict(caller, _CENTRE, _ROOM, _CENTRE) and None
    ),
    Check("four walls of a room", _room),
    Check("four walls of a room, scanner mounted elsewhere", _mounted),
    Check("walls that were crossed are on the other side", _outside),
    Check("each prediction belongs to its own line", _reordered),
    Check("Hs agrees with small changes of the pose", _differences),
    Check("every line is normalised", _normal_form),
    Check("a map may have one line", _single),
    Check("leaves its arguments as they were", _predict_untouched),
)
"""Checks of ``compute_predicted_measurements(x, map_lines, tf_base_to_camera) -> hs, Hs``."""
