"""Public checks of the bootstrap filter: ways one can draw, errors one can count, laws of a bearing and of a step.

Draws are judged by their means and spreads over some thousand particles, and by whether they come from the given
generator alone.
"""

from math import pi

import numpy as np

from roboloc.checks.report import Caller, Check, Wrong, text

_COUNT = 4000
_NONE = np.zeros(4)


def _rng() -> np.random.Generator:
    return np.random.default_rng(7)


def _motion(caller: Caller, xs: object, odometry: tuple, alphas: object) -> np.ndarray:
    xs = np.array(xs, dtype=float)
    arguments = (xs, np.array(odometry, dtype=float), np.array(alphas, dtype=float), _rng())
    (moved,) = caller(arguments, {"xs": xs.shape})
    return moved


_WAYS = (
    ("straight ahead", (0.0, 0.0, 0.0), (0.0, 2.0, 0.0), (2.0, 0.0, 0.0)),
    ("a quarter turn left, 2 m, and the turn back", (0.0, 0.0, 0.0), (pi / 2, 2.0, -pi / 2), (0.0, 2.0, 0.0)),
    ("2 m ahead, then a quarter turn right", (1.0, 1.0, pi / 2), (0.0, 2.0, -pi / 2), (1.0, 3.0, 0.0)),
    ("half a turn left, 1 m, a quarter right", (0.0, 1.0, 0.0), (pi, 1.0, -pi / 2), (-1.0, 1.0, pi / 2)),
    ("a quarter turn right on the spot", (3.0, 1.0, 0.5), (-pi / 2, 0.0, 0.0), (3.0, 1.0, 0.5 - pi / 2)),
)


def _apart(pose: np.ndarray, other: tuple) -> float:
    """Return how far two poses are apart; a heading may be some turns on."""
    off = pose - other
    return float(max(abs(off[0]), abs(off[1]), abs(np.angle(np.exp(1j * off[2])))))


def _ways(caller: Caller) -> None:
    for story, start, odometry, end in _WAYS:
        moved = _motion(caller, [start, start], odometry, _NONE)
        for pose in moved:
            if _apart(pose, end) > 1e-9:
                raise Wrong(
                    f"Without error, {story}:\nfrom {text(start)} with odometry {text(odometry)}\n"
                    f"expected {text(end)}, got {text(pose)}"
                )


# What errs alone, the odometry and the alphas for which it does, and its standard deviation.
_SPREADS = (
    ("heading", (1.0, 0.0, 0.0), (0.1, 0, 0, 0), 2, 0.1),
    ("heading", (-1.0, 0.0, 0.0), (0.1, 0, 0, 0), 2, 0.1),
    ("heading", (0.0, 0.0, -2.0), (0.1, 0, 0, 0), 2, 0.2),
    ("heading", (0.0, 2.0, 0.0), (0, 0.05, 0, 0), 2, 0.1 * 2**0.5),
    ("way", (0.0, 2.0, 0.0), (0, 0, 0.05, 0), 0, 0.1),
    ("way", (0.0, -2.0, 0.0), (0, 0, 0.05, 0), 0, 0.1),
    ("way", (0.0, 2.0, 1.0), (0, 0, 0, 0.1), 0, 0.1),
)


def _spreads(caller: Caller) -> None:
    for name, odometry, alphas, column, expected in _SPREADS:
        found = _motion(caller, np.zeros((_COUNT, 3)), odometry, alphas)[:, column]
        middle = np.array([odometry[1], 0.0, odometry[0] + odometry[2]])[column]
        if abs(found.std() / expected - 1.0) > 0.08:
            raise Wrong(
                f"For the odometry {text(odometry)} and alphas {text(alphas)} the {name} should have a standard "
                f"deviation of {text(expected)}\nover {_COUNT} particles, but it has {text(found.std())}"
            )
        if abs(found.mean() - middle) > 0.12 * expected:
            raise Wrong(
                f"For the odometry {text(odometry)} and alphas {text(alphas)} the {name} should be {text(middle)} "
                f"on average,\nbut it is {text(found.mean())}"
            )


def _both_sides(caller: Caller) -> None:
    found = [
        _motion(caller, np.zeros((_COUNT, 3)), (turn, 2.0, back), (0, 0, 0, 0.05))
        for turn, back in ((0.5, 0.5), (0.5, -0.5))
    ]
    one, other = (np.hypot(xs[:, 0], xs[:, 1]).std() for xs in found)
    if abs(other - one) > 0.12 * max(one, other):
        raise Wrong(
            "A robot that turns by 0.5 twice to the same side, and one that turns by 0.5 and back, have turned as much:"
            f"\ntheir ways should err alike, but they do by {text(one)} and {text(other)}"
        )


def _own_errors(caller: Caller) -> None:
    moved = _motion(caller, np.zeros((_COUNT, 3)), (0.5, 2.0, -0.3), (0.1, 0.02, 0.05, 0.02))
    if len({float(x) for x in moved[:, 0]}) < _COUNT / 2:
        raise Wrong("Particles that start together stay together: each needs errors of its own.")
    first = np.arctan2(moved[:, 1], moved[:, 0])
    done = np.array([first, np.hypot(moved[:, 0], moved[:, 1]), moved[:, 2] - first])
    off = done - done.mean(axis=1, keepdims=True)
    off /= done.std(axis=1, keepdims=True) + 1e-9
    correlation = off @ off.T / _COUNT * (1.0 - np.eye(3))
    if np.abs(correlation).max() > 0.1:
        raise Wrong(
            "Turn, way and second turn err independently, but over many particles two of them have a correlation of "
            f"{text(correlation.flat[np.abs(correlation).argmax()])}"
        )


def _seeded(caller: Caller) -> None:
    one, other = (_motion(caller, np.zeros((5, 3)), (0.5, 2.0, -0.3), (0.1, 0.1, 0.1, 0.1)) for _ in range(2))
    if not np.array_equal(one, other):
        raise Wrong(
            "Two calls with generators in the same state give different particles: draw from rng alone."
        )


def _say_written(caller: Caller, *names: str) -> None:
    for i in caller.written_to:
        if i < len(names):
            raise Wrong(
                f"The function writes to its argument {names[i]}. Work on a copy: np.array({names[i]})."
            )


def _motion_untouched(caller: Caller) -> None:
    _motion(caller, [(0.0, 0.0, 0.0)], (0.5, 2.0, -0.3), _NONE)
    _say_written(caller, "xs", "odometry", "alphas")


SAMPLE_MOTION = (
    Check(
        "returns xs (M, 3)",
        lambda caller: _motion(caller, np.zeros((4, 3)), (0, 1, 0), _NONE) is None or None,
    ),
    Check("ways without error", _ways),
    Check("spreads of one error at a time", _spreads),
    Check("turns to either side count alike", _both_sides),
    Check("every particle and every control errs for itself", _own_errors),
    Check("draws from rng alone", _seeded),
    Check("leaves its arguments as they were", _motion_untouched),
)
"""Checks of ``sample_motion(xs, odometry, alphas, rng) -> xs``."""

_LOOKING = np.array([(0.0, 0.0, 0.0), (0.0, 0.0, 0.2), (1.0, -1.0, 0.7), (-2.0, 0.5, -1.1), (0.5, 2.0, 3.0)])


def _support(caller: Caller, xs: object, landmark: tuple, bearing: float, sigma: float) -> np.ndarray:
    xs = np.array(xs, dtype=float)
    (support,) = caller((xs, np.array(landmark, dtype=float), bearing, sigma), {"support": (len(xs),)})
    return support


# A particle, a landmark, and the bearing at which it is seen.
_SIGHTS = (
    ("straight ahead", (0.0, 0.0, 0.0), (5.0, 0.0), 0.0),
    ("to the left of a robot that faces along x", (0.0, 0.0, 0.0), (0.0, 2.0), pi / 2),
    ("to the right of a robot that faces along y", (1.0, 1.0, pi / 2), (3.0, 1.0), -pi / 2),
    ("behind to the left", (0.0, 0.0, 0.0), (-1.0, 1.0), 3 * pi / 4),
    ("behind to the right, by a robot that faces along y", (0.0, 0.0, pi / 2), (1.0, -1.0), -3 * pi / 4),
)


def _sights(caller: Caller) -> None:
    for story, pose, landmark, bearing in _SIGHTS:
        for left in (0.1, -0.1):
            seen, off = (_support(caller, [pose], landmark, b, 0.2)[0] for b in (bearing, bearing + left))
            if not seen > off * 1.05:
                raise Wrong(
                    f"A landmark {story}:\nparticle {text(pose)} sees {text(landmark)} at {text(bearing)} rad, but its "
                    f"support is {text(seen)} there,\nand {text(off)} for a bearing of {text(bearing + left)}"
                )


def _height(caller: Caller) -> None:
    for sigma in (0.1, 0.5):
        total = sum(
            _support(caller, _LOOKING[:1], (5.0, 0.0), b, sigma)[0] for b in np.arange(-3.14, 3.14, 0.02)
        )
        if abs(0.02 * total - 1.0) > 1e-3:
            raise Wrong(
                f"A density is 1 in all, but for sigma = {sigma}, added up over all bearings,\n"
                f"it is {text(0.02 * total)}"
            )


def _width(caller: Caller) -> None:
    for sigma in (0.1, 0.5):
        found = [_support(caller, _LOOKING[:1], (5.0, 0.0), n * sigma, sigma)[0] for n in (0.0, 1.0, 2.0)]
        ratios = np.array(found[1:]) / max(found[0], 1e-300)
        if np.max(np.abs(ratios - (0.606531, 0.135335))) > 1e-5:
            raise Wrong(
                f"One and two standard deviations off, a normal density is 0.6065 and 0.1353 of its height;\n"
                f"for sigma = {sigma} yours is {text(ratios)}"
            )


def _behind(caller: Caller) -> None:
    before, after = (_support(caller, [(0.0, 0.0, 0.0)], (-2.0, y), 3.1, 0.3)[0] for y in (0.03, -0.03))
    if not 0.7 < after / max(before, 1e-300) < 1.3:
        raise Wrong(
            "A landmark at (-2, 0.03) or (-2, -0.03) is straight behind: seen at 3.1 rad, both should have nearly the "
            f"same support,\nbut they have {text(before)} and {text(after)}"
        )
    for bearing in (0.5, 3.1, -2.0):
        one = _support(caller, _LOOKING, (2.0, 1.5), bearing, 0.4)
        for turns, xs in (
            (1, _LOOKING + np.array((0, 0, 2 * pi))),
            (-2, _LOOKING - np.array((0, 0, 4 * pi))),
        ):
            if np.max(np.abs(_support(caller, xs, (2.0, 1.5), bearing, 0.4) - one)) > 1e-6:
                raise Wrong(
                    f"Particles that are turned by {turns} whole turns see the same, but their support changes."
                )


def _together(caller: Caller) -> None:
    one = _support(caller, _LOOKING, (2.0, 1.5), 0.5, 0.4)
    turned = np.array([(-y, x, theta + pi / 2) for x, y, theta in _LOOKING])
    other = _support(caller, turned, (-1.5, 2.0), 0.5, 0.4)
    if np.max(np.abs(one - other)) > 1e-6:
        raise Wrong(
            "Turn particles and landmark by a quarter together: nothing that is seen changes, but support does."
        )


def _bearing_untouched(caller: Caller) -> None:
    _support(caller, _LOOKING, (2.0, 1.5), 3.0, 0.4)
    _say_written(caller, "xs", "landmark", "bearing", "sigma")


BEARING_LIKELIHOOD = (
    Check(
        "returns support (M,)", lambda caller: _support(caller, _LOOKING, (2, 1), 0.5, 0.4) is None or None
    ),
    Check("landmarks all around", _sights),
    Check("the density adds up to 1", _height),
    Check("the density has the right width", _width),
    Check("behind the robot and after whole turns", _behind),
    Check("the world may be turned", _together),
    Check("leaves its arguments as they were", _bearing_untouched),
)
"""Checks of ``bearing_likelihood(xs, landmark, bearing, sigma) -> support``."""
