"""Public checks of the velocity model: worked drives, laws of the derivatives, differences of the student's own z."""

from math import pi

import numpy as np

from roboloc.checks.report import Caller, Check, Wrong, text
from roboloc.se2 import compose

_MOVE, _SEE = ("x", "u", "dt"), ("x", "landmark")
_DRIVES = (
    ((0.0, 0.0, 0.0), (1.0, 0.5, 0.2), 1.0),
    ((1.0, -2.0, 0.8), (0.7, -0.4, -0.3), 0.5),
    ((-3.0, 0.5, 2.5), (-1.2, 1.1, 0.4), 2.0),
)


def _floats(*arguments) -> tuple:  # noqa: ANN002 - plain numbers
    return tuple(float(a) if np.ndim(a) == 0 else np.array(a, dtype=float) for a in arguments)


def _say_written(caller: Caller, names: tuple) -> None:
    for i in caller.written_to:
        raise Wrong(f"The function writes to its argument {names[i]}. Work on a copy: np.array({names[i]}).")


def _moved(caller: Caller, *arguments) -> np.ndarray:  # noqa: ANN002 - plain numbers
    return caller(_floats(*arguments), {"moved": (3,)})[0]


def _drive(name: str, x: tuple, u: tuple, dt: float, expected: tuple) -> Check:
    def check(caller: Caller) -> None:
        got = _moved(caller, x, u, dt)
        if np.max(np.abs(got - expected)) > 1e-6:
            raise Wrong(
                f"From x, y, theta = {text(x)} with v, omega, gamma = {text(u)} for dt = {text(dt)} s:\n"
                f"expected {text(expected)}, got {text(got)}"
            )

    return Check(name, check)


def _hardly_turning(caller: Caller) -> None:
    for x, (v, _, gamma), dt in _DRIVES:
        wanted = _moved(caller, x, (v, 0.0, gamma), dt)
        for omega in (1e-6, 1e-9, -1e-12):
            got = _moved(caller, x, (v, omega, gamma), dt)
            if np.max(np.abs(got - wanted)) > 1e-5:
                raise Wrong(
                    f"With omega = 0 the drive from {text(x)} ends at {text(wanted)}, with omega = {omega:g} at "
                    f"{text(got)}:\nthe first is the limit of the second."
                )


def _motion_untouched(caller: Caller) -> None:
    for arguments in (*_DRIVES, ((1.0, 2.0, 0.3), (0.5, 0.0, 0.1), 0.1)):
        _moved(caller, *arguments)
        _say_written(caller, _MOVE)


MOTION = (
    Check("returns a pose (3,)", lambda caller: _moved(caller, *_DRIVES[0]) is None),
    _drive("drives straight ahead", (1, 2, 0), (1.5, 0, 0), 2, (4, 2, 0)),
    _drive("drives a quarter circle to the left", (0, 0, 0), (pi / 2, pi / 2, 0), 1, (1, 1, pi / 2)),
    _drive("drives a quarter circle and turns back", (0, 0, 0), (pi / 2, pi / 2, -pi / 2), 1, (1, 1, 0)),
    _drive("turns on the spot for two seconds", (1, 2, 0.5), (0, 0, 0.25), 2, (1, 2, 1)),
    _drive("does not wrap the heading", (0, 0, 3), (0, 0.5, 0.5), 1, (0, 0, 4)),
    Check("omega nearly 0", _hardly_turning),
    Check("leaves its arguments as they were", _motion_untouched),
)
"""Checks of ``motion(x, u, dt) -> moved``."""


def _derived(caller: Caller, *arguments) -> tuple[np.ndarray, ...]:  # noqa: ANN002 - plain numbers
    return caller(_floats(*arguments), {"F": (3, 3), "W": (3, 3)})


def _column(story: str, arguments: tuple, which: str, column: int, expected: tuple) -> Check:
    def check(caller: Caller) -> None:
        got = _derived(caller, *arguments)[("F", "W").index(which)][:, column]
        if np.max(np.abs(got - expected)) > 1e-5:
            x, u, dt = arguments
            raise Wrong(
                f"From {text(x)} with v, omega, gamma = {text(u)} for dt = {text(dt)} s, worked by hand in the book:\n"
                f"column {column + 1} of {which} is {text(expected)}, got {text(got)}"
            )

    return Check(story, check)


def _turned_world(caller: Caller) -> None:
    for (_, _, theta), u, dt in _DRIVES:
        plain, turned = _derived(caller, (0, 0, 0), u, dt), _derived(caller, (0, 0, theta), u, dt)
        for name, J, other in zip("FW", plain, turned, strict=True):
            columns = (2,) if name == "F" else (0, 1, 2)
            for i in columns:
                wanted = np.array([*compose((0, 0, theta), (*J[:2, i], 0))[:2], J[2, i]])
                if np.max(np.abs(other[:, i] - wanted)) > 1e-6:
                    raise Wrong(
                        f"With the robot turned by {text(theta)} at its start, column {i + 1} of {name} must turn by "
                        f"as much:\nfrom {text(J[:, i])} to {text(wanted)}, got {text(other[:, i])}"
                    )


def _continuous(caller: Caller) -> None:
    for x, (v, _, gamma), dt in _DRIVES:
        wanted = _derived(caller, x, (v, 0.0, gamma), dt)
        for omega in (1e-6, 1e-9, -1e-12):
            got = _derived(caller, x, (v, omega, gamma), dt)
            if max(np.max(np.abs(a - b)) for a, b in zip(got, wanted, strict=True)) > 1e-4:
                raise Wrong(
                    f"F or W with omega = {omega:g} is far from what it is with omega = 0, its limit."
                )


def _jacobians_untouched(caller: Caller) -> None:
    for arguments in _DRIVES:
        _derived(caller, *arguments)
        _say_written(caller, _MOVE)


_ARC, _LINE = ((0, 0, 0), (1, 1, 0.3), 1), ((0, 0, 0), (1, 0, 0.3), 2)
JACOBIANS = (
    Check("returns F (3, 3), W (3, 3)", lambda caller: _derived(caller, *_DRIVES[0]) is None),
    _column("heading at the start, one radian of a circle", _ARC, "F", 2, (-0.459698, 0.841471, 1)),
    _column("speed, one radian of a circle", _ARC, "W", 0, (0.841471, 0.459698, 0)),
    _column("turning rate, one radian of a circle", _ARC, "W", 1, (-0.301169, 0.381773, 1)),
    _column("turning rate, straight ahead for 2 s", _LINE, "W", 1, (0, 2, 2)),
    _column("gamma, straight ahead for 2 s", _LINE, "W", 2, (0, 0, 2)),
    Check("a robot that is turned", _turned_world),
    Check("omega nearly 0", _continuous),
    Check("leaves its arguments as they were", _jacobians_untouched),
)
"""Checks of ``jacobians(x, u, dt) -> F, W``."""


def _noise(caller: Caller, u: tuple, alphas: np.ndarray) -> np.ndarray:
    return caller(_floats(u, alphas), {"M": (3, 3)})[0]


def _one_alpha(caller: Caller) -> None:
    for i in range(6):
        alphas = np.zeros(6)
        alphas[i] = 0.01
        u = (2.0, 0.0, 0.5) if i % 2 == 0 else (0.0, 2.0, 0.5)
        M = _noise(caller, u, alphas)
        wanted = np.zeros((3, 3))
        wanted[i // 2, i // 2] = 0.2**2
        if np.max(np.abs(M - wanted)) > 1e-12:
            raise Wrong(
                f"With the alphas {text(alphas)} and v, omega, gamma = {text(u)}\n{('v', 'omega', 'gamma')[i // 2]} is "
                f"kept to 0.2 and the others are kept exactly.\nGot M = {text(M)}"
            )


def _at_rest(caller: Caller) -> None:
    M = _noise(caller, (0.0, 0.0, 0.5), np.full(6, 0.01))
    if M.any():
        raise Wrong(
            f"A robot that neither drives nor is told to turn by omega has no noise. Got M = {text(M)}"
        )


def _noise_untouched(caller: Caller) -> None:
    _noise(caller, (1.0, -0.5, 0.2), np.arange(6.0))
    _say_written(caller, ("u", "alphas"))


NOISE = (
    Check("returns M (3, 3)", lambda caller: _noise(caller, (1.0, -0.5, 0.2), np.arange(6.0)) is None),
    Check("one alpha after the other", _one_alpha),
    Check("no noise at rest", _at_rest),
    Check("leaves its arguments as they were", _noise_untouched),
)
"""Checks of ``noise(u, alphas) -> M``."""


def _sighted(caller: Caller, x: tuple, landmark: tuple) -> tuple[np.ndarray, np.ndarray]:
    return caller(_floats(x, landmark), {"z": (2,), "H": (2, 3)})


_SIGHTS = (
    ("east by north", (0, 0, 0), (3, 4), (0.927295, 5)),
    ("straight ahead", (1, 1, pi / 2), (1, 3), (0, 2)),
    ("to the right", (0, 0, pi), (0, 2), (-pi / 2, 2)),
    ("ahead to the left, looking back", (0, 0, 3), (-2, -0.5), (0.386571, 2.061553)),
    ("after a turn and a half", (0, 0, 3 * pi), (-2, 0), (0, 2)),
)


def _where(caller: Caller) -> None:
    for story, x, landmark, expected in _SIGHTS:
        z, _ = _sighted(caller, x, landmark)
        if np.max(np.abs(z - expected)) > 1e-5:
            raise Wrong(
                f"A landmark {story}: from {text(x)}, at {text(landmark)}\nexpected z = {text(expected)}, got {text(z)}"
            )


def _slopes(caller: Caller) -> None:
    for _, x, landmark, _ in _SIGHTS[:4]:
        _, H = _sighted(caller, x, landmark)
        for i, name in enumerate(("x", "y", "theta")):
            step = 1e-5 * np.eye(3)[i]
            slope = (_sighted(caller, x + step, landmark)[0] - _sighted(caller, x - step, landmark)[0]) / 2e-5
            if np.max(np.abs(H[:, i] - slope)) > 1e-5:
                raise Wrong(
                    f"From {text(x)}, with a landmark at {text(landmark)}: a small change of {name}\nchanges your z at "
                    f"the rates {text(slope)}, but column {i + 1} of H is {text(H[:, i])}"
                )


def _towards(caller: Caller) -> None:
    for distance in (2.0, 5.0):
        _, H = _sighted(caller, (0, 0, 0), (distance, 0))
        if abs(H[1, 0] + 1) > 1e-6:
            raise Wrong(
                f"A landmark {distance:g} m ahead: a centimetre towards it takes a centimetre off the range.\n"
                f"Your H[1, 0] is {text(H[1, 0])}"
            )


def _sighting_untouched(caller: Caller) -> None:
    for _, x, landmark, _ in _SIGHTS:
        _sighted(caller, x, landmark)
        _say_written(caller, _SEE)


RANGE_BEARING = (
    Check("returns z (2,), H (2, 3)", lambda caller: _sighted(caller, (0, 0, 0), (3, 4)) is None),
    Check("bearing and range, worked by hand", _where),
    Check("H agrees with small moves", _slopes),
    Check("a centimetre is a centimetre", _towards),
    Check("leaves its arguments as they were", _sighting_untouched),
)
"""Checks of ``range_bearing(x, landmark) -> z, H``."""
