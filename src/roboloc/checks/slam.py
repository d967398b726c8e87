"""Public checks of SLAM with lines: worked numbers, walls that stand, differences of the student's own g and hs."""

from math import pi

import numpy as np

from roboloc.angles import wrap
from roboloc.checks.report import Caller, Check, Wrong, text

_CENTRE = (0.0, 0.0, 0.0)
_NUMBERS = ("x", "y", "theta")
_WALLS = (0.4, 2.0, -2.1, 1.5, 2.9, 3.0)
# Poses, controls and durations: both turns, forwards and backwards; the lines above come behind.
_MOTIONS = (
    ((0.3, -0.5, 0.7), (1.0, 0.5), 0.8),
    ((1.2, 0.8, -1.1), (-0.7, -0.9), 0.1),
    ((-0.7, 2.2, 2.4), (0.6, 0.0), 2.0),
)


def _name(i: int) -> str:
    """Name a number of the state."""
    return _NUMBERS[i] if i < 3 else f"{('alpha', 'r')[(i - 3) % 2]} of line {(i - 3) // 2}"


def _move(caller: Caller, x, u, dt) -> tuple[np.ndarray, ...]:  # noqa: ANN001 - plain numbers
    x = np.array(x, dtype=float)
    n = x.size
    return caller((x, np.array(u, dtype=float), float(dt)), {"g": (n,), "Gx": (n, n), "Gu": (n, 2)})


def _predict(caller: Caller, x, tf=_CENTRE, *fixed: int) -> tuple[np.ndarray, ...]:  # noqa: ANN001
    x = np.array(x, dtype=float)
    J = (x.size - 3) // 2
    return caller((x, np.array(tf, dtype=float), *fixed), {"hs": (2, J), "Hs": (J, 2, x.size)})


def _say_written(caller: Caller, names: tuple) -> None:
    for i in caller.written_to:
        raise Wrong(f"The function writes to its argument {names[i]}. Work on a copy: np.array({names[i]}).")


def _drive(story: str, x: tuple, u: tuple, dt: float, expected: tuple) -> Check:
    def check(caller: Caller) -> None:
        g, _, _ = _move(caller, (*x, *_WALLS), u, dt)
        off = g[:3] - expected
        off[2] = wrap(off[2])
        if np.max(np.abs(off)) > 1e-6:
            raise Wrong(
                f"From x, y, theta = {text(x)} with V, omega = {text(u)} for dt = {text(dt)} s\n"
                f"expected {text(expected)} at the front of g, got {text(g[:3])}"
            )

    return Check(story, check)


def _walls_stand(caller: Caller) -> None:
    for x, u, dt in _MOTIONS:
        for walls in (_WALLS, (9.0, 2.0, -7.0, 1.0)):
            g, _, _ = _move(caller, (*x, *walls), u, dt)
            if np.max(np.abs(g[3:] - walls)) > 1e-12:
                raise Wrong(
                    f"The lines {text(walls)} are {text(g[3:])} after a motion with V, omega = {text(u)}.\n"
                    "The walls have not moved, and neither has the frame of the world."
                )


def _compare(what: str, got: np.ndarray, slopes: np.ndarray, names: tuple) -> None:
    """Compare a matrix with the slopes of what it is the derivative of; `names` make names of its indices."""
    off = np.abs(got - slopes) / np.maximum(1.0, np.abs(slopes))
    if np.max(off) > 1e-6:
        i, j = (int(k) for k in np.unravel_index(np.argmax(off), off.shape))
        raise Wrong(
            f"{what}: the entry [{i}, {j}] says that {names[0](i)} changes with {names[1](j)} at the rate "
            f"{text(got[i, j])},\nbut a small change of {names[1](j)} changes your own {names[0](i)} at the rate "
            f"{text(slopes[i, j])}."
        )


def _slopes(function, at: np.ndarray) -> np.ndarray:  # noqa: ANN001 - a function of an array
    """Differentiate by central differences, with one extrapolation."""
    columns = []
    for i in range(at.size):

        def slope(size: float, i: int = i) -> np.ndarray:
            step = size * np.eye(at.size)[i]
            return (function(at + step) - function(at - step)) / (2.0 * size)

        columns.append((4.0 * slope(1e-3) - slope(2e-3)) / 3.0)
    return np.stack(columns, axis=1)


def _gx(caller: Caller) -> None:
    for pose, u, dt in _MOTIONS:
        x = np.array((*pose, *_WALLS))
        slopes = _slopes(lambda x, u=u, dt=dt: _move(caller, x, u, dt)[0], x)
        _compare("Gx", _move(caller, x, u, dt)[1], slopes, (_name, _name))


def _gu(caller: Caller) -> None:
    for pose, u, dt in _MOTIONS[:2]:
        x = (*pose, *_WALLS)
        slopes = _slopes(lambda u, x=x, dt=dt: _move(caller, x, u, dt)[0], np.array(u))
        _compare("Gu", _move(caller, x, u, dt)[2], slopes, (_name, ("V", "omega").__getitem__))


def _slow(caller: Caller) -> None:
    for omega in (1e-4, 1e-7, 1e-10, -1e-8):
        parts = [_move(caller, (0.3, -0.5, 0.7, *_WALLS), (1.0, value), 0.8) for value in (omega, 0.0)]
        if max(np.max(np.abs(a - b)) for a, b in zip(*parts, strict=True)) > 2 * abs(omega) + 1e-9:
            raise Wrong(f"The results for omega = {omega} and for omega = 0 are too far apart.")


def _any_map(caller: Caller) -> None:
    for J in (0, 1, 6):
        _move(caller, (0.3, -0.5, 0.7, *([0.5, 2.0] * J)), (1.0, 0.5), 0.8)


def _move_untouched(caller: Caller) -> None:
    for u in ((1.0, 0.5), (1.0, 0.0)):
        _move(caller, (0.3, -0.5, 0.7, *_WALLS), u, 0.8)
        _say_written(caller, ("x", "u", "dt"))


TRANSITION = (
    Check(
        "returns g (n,), Gx (n, n), Gu (n, 2)",
        lambda caller: _move(caller, (0.3, -0.5, 0.7, *_WALLS), (1.0, 0.5), 0.8) and None,
    ),
    _drive("drives straight ahead", (1.0, 2.0, 0.0), (1.5, 0.0), 2.0, (4.0, 2.0, 0.0)),
    _drive("drives a quarter of a circle", (0.0, 0.0, 0.0), (pi / 2, pi / 2), 1.0, (1.0, 1.0, pi / 2)),
    Check("the walls stand still", _walls_stand),
    Check("Gx agrees with small changes of the state", _gx),
    Check("Gu agrees with small changes of the control", _gu),
    Check("a very slow turn is nearly a straight line", _slow),
    Check("any number of lines, and none", _any_map),
    Check("leaves its arguments as they were", _move_untouched),
)
"""Checks of ``transition_model(x, u, dt) -> g, Gx, Gu``."""

_ROOM = (0.0, 4.0, pi / 2, 3.0, -pi, 1.0, -pi / 2, 2.0)
_CORRIDOR = (pi / 2, 1.0, -pi / 2, 1.0)
_CROSSED = (0.4, 0.3, -2.1, 1.5, 2.9, 3.0, 1.2, 2.5)
_POSE, _TF = (1.3, -0.7, 0.6), (0.2, 0.1, -0.5)


def _minus(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return a - b of rows of lines, the angle on the circle."""
    return np.array([wrap(a[0] - b[0]), a[1] - b[1]])


def _sees(story: str, x: tuple, tf: tuple, expected: tuple) -> Check:
    def check(caller: Caller) -> None:
        hs, _ = _predict(caller, x, tf)
        if np.max(np.abs(_minus(hs, np.array(expected)))) > 1e-6:
            raise Wrong(
                f"From the pose {text(x[:3])} with the mounting {text(tf)}, lines {text(x[3:])}:\n"
                f"expected hs = {text(expected)},\ngot      hs = {text(hs)}"
            )

    return Check(story, check)


def _differences(caller: Caller, first: int, last: int) -> None:
    """Compare columns of Hs with differences of hs, nothing fixed; one of the lines was crossed."""
    x = np.array((*_POSE, *_CROSSED))
    hs, Hs = _predict(caller, x, _TF, 0)

    def seen(part: np.ndarray) -> np.ndarray:
        moved = x.copy()
        moved[first:last] = part
        return _minus(_predict(caller, moved, _TF, 0)[0], hs).T.ravel()

    slopes = _slopes(seen, x[first:last])
    for j in range(len(Hs)):
        names = (f"alpha of hs, column {j}", f"r of hs, column {j}").__getitem__
        part = slice(2 * j, 2 * j + 2)
        _compare(
            f"Hs[{j}], columns from {first}",
            Hs[j, :, first:last],
            slopes[part],
            (names, lambda i: _name(i + first)),
        )


def _fixed(caller: Caller) -> None:
    x = (*_POSE, *_CROSSED)
    for fixed, arguments in ((0, (0,)), (1, (1,)), (2, ()), (3, (3,)), (4, (4,))):
        Hs = _predict(caller, x, _TF, *arguments)[1]
        told = f"fixed = {fixed}" if arguments else "fixed left out, which means 2,"
        if np.any(Hs[:, :, 3 : 3 + 2 * fixed]):
            raise Wrong(f"With {told} all columns of the first {fixed} lines should be 0.")
        for j in range(fixed, len(Hs)):
            if not np.any(Hs[j, :, 3 + 2 * j : 5 + 2 * j]):
                raise Wrong(f"With {told} line {j} is not fixed, but its own columns in Hs[{j}] are 0.")


def _fixed_show_the_pose(caller: Caller) -> None:
    x = (*_POSE, *_CROSSED)
    free, bound = (_predict(caller, x, _TF, fixed) for fixed in (0, 2))
    for what, a, b in (("hs", free[0], bound[0]), ("Hs by the pose", free[1][:, :, :3], bound[1][:, :, :3])):
        if np.max(np.abs(a - b)) > 1e-12:
            raise Wrong(
                f"{what} is another one with fixed = 2 than with fixed = 0. The lines are seen all the same."
            )


def _fewer(caller: Caller) -> None:
    _predict(caller, (*_POSE, 0.4, 0.3))
    _predict(caller, (*_POSE, 0.4, 0.3), _TF, 5)


def _normal_form(caller: Caller) -> None:
    for pose in ((0.0, 3.0, 2.9), (5.0, -4.0, -3.0), (-2.0, 1.0, 9.0)):
        hs, _ = _predict(caller, (*pose, *_ROOM))
        if np.any(hs[1] < 0) or np.any(np.abs(hs[0]) > pi + 1e-9):
            raise Wrong(
                f"From {text(pose)} some r is negative or some alpha outside [-pi, pi): hs = {text(hs)}"
            )


def _predict_untouched(caller: Caller) -> None:
    for pose in ((5.0, -4.0, -3.0), (0.0, 0.0, 0.0)):
        _predict(caller, (*pose, *_ROOM), _TF, 1)
        _say_written(caller, ("x", "tf_base_to_camera", "fixed"))


PREDICTED = (
    Check(
        "returns hs (2, J), Hs (J, 2, 3 + 2J)",
        lambda caller: _predict(caller, (*_CENTRE, *_ROOM), _CENTRE, 0) and None,
    ),
    _sees(
        "four walls of a room",
        (1.0, 1.0, 0.0, *_ROOM),
        _CENTRE,
        ((0.0, pi / 2, -pi, -pi / 2), (3.0, 2.0, 2.0, 3.0)),
    ),
    _sees(
        "four walls of a room, scanner mounted elsewhere",
        (0.0, 0.0, 0.0, *_ROOM),
        (0.5, -0.2, pi / 2),
        ((-pi / 2, 0.0, pi / 2, -pi), (3.5, 3.2, 1.5, 1.8)),
    ),
    _sees(
        "walls that were crossed are on the other side",
        (0.0, 3.0, 0.0, *_CORRIDOR),
        _CENTRE,
        ((-pi / 2, -pi / 2), (2.0, 4.0)),
    ),
    Check("Hs agrees with small changes of the pose", lambda caller: _differences(caller, 0, 3)),
    Check("Hs agrees with small changes of the lines", lambda caller: _differences(caller, 3, 11)),
    Check("the first lines are fixed, and no others", _fixed),
    Check("fixed lines are seen like others", _fixed_show_the_pose),
    Check("fewer lines than fixed", _fewer),
    Check("every line is normalised", _normal_form),
    Check("leaves its arguments as they were", _predict_untouched),
)
"""Checks of ``compute_predicted_measurements(x, tf_base_to_camera, fixed=2) -> hs, Hs``."""
