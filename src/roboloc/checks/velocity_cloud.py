"""Public checks of a cloud driven by velocities: drives by hand, spreads one can count, weights one can work out."""

from math import exp, pi

import numpy as np

from roboloc.checks.report import Caller, Check, Wrong, text

_COUNT = 4000
_Q = np.diag([0.01, 0.25])


def _say_written(caller: Caller, *names: str) -> None:
    for i in caller.written_to:
        if i < len(names):
            raise Wrong(f"The function writes to its argument {names[i]}. Work on a copy.")


def _moved(caller: Caller, xs: object, u: tuple, alphas: object, dt: float) -> np.ndarray:
    xs = np.array(xs, dtype=float)
    arguments = (
        xs,
        np.array(u, dtype=float),
        np.array(alphas, dtype=float),
        float(dt),
        np.random.default_rng(7),
    )
    return caller(arguments, {"xs": xs.shape})[0]


_DRIVES = (
    ("straight ahead", (1.0, 2.0, 0.0), (1.5, 0.0, 0.0), 2.0, (4.0, 2.0, 0.0)),
    ("a quarter circle to the left", (0.0, 0.0, 0.0), (pi / 2, pi / 2, 0.0), 1.0, (1.0, 1.0, pi / 2)),
    (
        "a quarter circle, then the turn back",
        (0.0, 0.0, 0.0),
        (pi / 2, pi / 2, -pi / 2),
        1.0,
        (1.0, 1.0, 0.0),
    ),
    ("on the spot", (1.0, 2.0, 0.5), (0.0, 0.0, 0.25), 2.0, (1.0, 2.0, 1.0)),
)


def _drives(caller: Caller) -> None:
    for story, start, u, dt, end in _DRIVES:
        for pose in _moved(caller, [start, start], u, np.zeros(6), dt):
            off = pose - end
            off[2] = np.angle(np.exp(1j * off[2]))
            if np.max(np.abs(off)) > 1e-9:
                raise Wrong(
                    f"Without noise, {story}:\nfrom {text(start)} with v, omega, gamma = {text(u)} for dt = {dt:g} s\n"
                    f"expected {text(end)}, got {text(pose)}"
                )


# What spreads, the control, the one alpha, dt, the column, and the deviation to be seen there.
_SPREADS = (
    ("way", (2.0, 0.0, 0.0), 0, 1.0, 0, 0.2),
    ("way", (-2.0, 0.0, 0.0), 0, 0.25, 0, 0.05),
    ("way", (0.0, 0.5, 0.0), 1, 0.1, 0, 0.005),
    ("heading", (2.0, 0.0, 0.0), 2, 0.5, 2, 0.1),
    ("heading", (0.0, -0.5, 0.0), 3, 1.0, 2, 0.05),
    ("heading", (2.0, 0.0, 0.0), 4, 0.5, 2, 0.1),
    ("heading", (0.0, 0.5, 0.0), 5, 2.0, 2, 0.1),
)


def _spreads(caller: Caller) -> None:
    for name, u, which, dt, column, expected in _SPREADS:
        alphas = 0.01 * np.eye(6)[which]
        found = _moved(caller, np.zeros((_COUNT, 3)), u, alphas, dt)[:, column].std()
        if abs(found / expected - 1.0) > 0.08:
            raise Wrong(
                f"With v, omega, gamma = {text(u)}, dt = {dt:g} s and all alphas 0 but alpha_{which + 1} = 0.01, the "
                f"{name}\nshould have a standard deviation of {expected:g} and has {text(found)}"
            )


def _own(caller: Caller) -> None:
    alphas = (0.001, 0, 0.01, 0, 0.01, 0)
    moved = _moved(caller, np.zeros((_COUNT, 3)), (2.0, 0.0, 0.0), alphas, 1.0)
    if len({float(x) for x in moved[:, 0]}) < _COUNT / 2:
        raise Wrong("Particles that start together stay together: each needs a control of its own.")
    chord = np.arctan2(moved[:, 1], moved[:, 0])
    done = np.array([np.hypot(moved[:, 0], moved[:, 1]), chord, moved[:, 2] - 2.0 * chord])
    off = done - done.mean(axis=1, keepdims=True)
    off /= done.std(axis=1, keepdims=True) + 1e-9
    together = np.abs(off @ off.T / _COUNT * (1.0 - np.eye(3))).max()
    if together > 0.1:
        raise Wrong(
            f"v, omega and gamma err independently, but two of them have a correlation of {text(together)}"
        )


def _seeded(caller: Caller) -> None:
    one, other = (_moved(caller, np.zeros((5, 3)), (1.0, 0.5, 0.0), np.full(6, 0.01), 1.0) for _ in range(2))
    if not np.array_equal(one, other):
        raise Wrong("Two calls with generators in the same state give different clouds: draw from rng alone.")


def _predict_untouched(caller: Caller) -> None:
    _moved(caller, [(0.0, 0.0, 0.0)], (1.0, 0.5, 0.1), np.zeros(6), 1.0)
    _say_written(caller, "xs", "u", "alphas")


PREDICT = (
    Check(
        "returns xs (M, 3)", lambda c: _moved(c, np.zeros((4, 3)), (1, 0, 0), np.zeros(6), 1) is None or None
    ),
    Check("drives without noise", _drives),
    Check("spread, one alpha at a time", _spreads),
    Check("every particle and every control errs for itself", _own),
    Check("draws from rng alone", _seeded),
    Check("leaves its arguments as they were", _predict_untouched),
)
"""Checks of ``predict(xs, u, alphas, dt, rng) -> xs``."""

_PAIR = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.1))


def _weights(
    caller: Caller, xs: object, ws: object, z: object, landmarks: object, Q: object = _Q
) -> np.ndarray:
    landmarks = np.reshape(np.array(landmarks, dtype=float), (-1, 2))
    arguments = [np.array(a, dtype=float) for a in (xs, ws, z)]
    return caller((*arguments, landmarks, np.array(Q, dtype=float)), {"ws": (len(xs),)})[0]


def _ratio(
    caller: Caller,
    story: str,
    wanted: float,
    xs: object,
    ws: object,
    z: object,
    marks: object,
    Q: object = _Q,
) -> None:
    got = _weights(caller, xs, ws, z, marks, Q)
    share = 1.0 / (1.0 + wanted)
    if np.max(np.abs(got - (1.0 - share, share))) > 1e-6:
        raise Wrong(f"{story}:\nexpected the weights {text((1.0 - share, share))}, got {text(got)}")


def _bearing(caller: Caller) -> None:
    story = "Two particles, the second turned by one deviation of the bearing; the first sees what is seen"
    _ratio(caller, story, exp(0.5), _PAIR, (0.5, 0.5), (0, 5), [(5, 0)])
    story = "The same with the landmark behind: the bearings, one deviation apart, are on either side of pi"
    poses = ((0.0, 0.0, pi - 3.1), (0.0, 0.0, pi - 3.2))
    _ratio(caller, story, exp(0.5), poses, (0.5, 0.5), (3.1, 5), [(-5, 0)])
    story = "The same two after some turns"
    laps = ((0.0, 0.0, 2 * pi), (0.0, 0.0, 0.1 - 4 * pi))
    _ratio(caller, story, exp(0.5), laps, (0.5, 0.5), (0, 5), [(5, 0)])


def _range(caller: Caller) -> None:
    story = "Two particles, the second two deviations of the range farther away; the first sees what is seen"
    _ratio(caller, story, exp(2.0), ((0, 0, 0), (-1, 0, 0)), (0.5, 0.5), (0, 5), [(5, 0)])


def _together(caller: Caller) -> None:
    Q = ((0.01, 0.025), (0.025, 0.25))
    story = (
        "Bearing and range err together, correlation 1/2; the second particle is one deviation off in both"
    )
    _ratio(caller, story, exp(2 / 3), (_PAIR[0], (-0.5, 0, -0.1)), (0.5, 0.5), (0, 5), [(5, 0)], Q)


def _two_marks(caller: Caller) -> None:
    story = "Two landmarks ahead; the second particle is one deviation of the bearing off for each"
    _ratio(caller, story, exp(1.0), _PAIR, (0.5, 0.5), (0, 5, 0, 8), [(5, 0), (8, 0)])


def _earlier(caller: Caller) -> None:
    story = "Two particles that explain what is seen equally well, with weights 3 and 1"
    _ratio(caller, story, 3.0, (_PAIR[0], _PAIR[0]), (3, 1), (0.05, 5), [(5, 0)])
    story = "No landmark is seen; the weights are 3 and 1"
    _ratio(caller, story, 3.0, _PAIR, (3, 1), (), ())


def _far_off(caller: Caller) -> None:
    story = (
        "A range 50 m off; the second particle is 0.0025 m farther away, which is half a unit in the exponent"
    )
    _ratio(caller, story, exp(0.5 + 0.0025**2 / 0.5), ((0, 0, 0), (-0.0025, 0, 0)), (1, 1), (0, 5), [(55, 0)])


def _zeros(caller: Caller) -> None:
    got = _weights(caller, (_PAIR[0], *_PAIR), (0, 0.5, 0.5), (0, 5), [(5, 0)])
    if got[0] != 0 or abs(got.sum() - 1) > 1e-9:
        raise Wrong(f"A particle of weight 0 stays at 0, and the sum is 1; got {text(got)}")


def _correct_untouched(caller: Caller) -> None:
    _weights(caller, _PAIR, (3, 1), (0, 5), [(5, 0)])
    _say_written(caller, "xs", "ws", "z", "landmarks", "Q")


CORRECT = (
    Check("returns ws (M,)", lambda c: _weights(c, _PAIR, (1, 1), (0, 5), [(5, 0)]) is None or None),
    Check("a bearing, ahead and behind", _bearing),
    Check("a range", _range),
    Check("bearing and range that err together", _together),
    Check("two landmarks", _two_marks),
    Check("earlier weights count", _earlier),
    Check("an observation that nothing explains", _far_off),
    Check("weights of 0 stay", _zeros),
    Check("leaves its arguments as they were", _correct_untouched),
)
"""Checks of ``correct(xs, ws, z, landmarks, Q) -> ws``."""


def _size(caller: Caller, ws: object) -> float:
    return float(caller((np.array(ws, dtype=float),), {"n_eff": ()})[0])


def _sizes(*cases: tuple[tuple, float]):  # noqa: ANN202 - a check
    def check(caller: Caller) -> None:
        for ws, wanted in cases:
            got = _size(caller, ws)
            if not abs(got - wanted) < 1e-9 * wanted:
                raise Wrong(f"The weights {ws} are worth {text(wanted)} particles, got {text(got)}")

    return check


def _size_untouched(caller: Caller) -> None:
    _size(caller, (3, 1))
    _say_written(caller, "ws")


EFFECTIVE_SAMPLE_SIZE = (
    Check("returns a number", lambda c: _size(c, (0.5, 0.5)) is None or None),
    Check("equal weights, and one that has all", _sizes(((0.25,) * 4, 4.0), ((0.0, 1.0, 0.0), 1.0))),
    Check("uneven weights, by hand", _sizes(((0.5, 0.25, 0.25), 8 / 3))),
    Check("the sum does not matter", _sizes(((2.0, 1.0, 1.0), 8 / 3))),
    Check("nor how small they are", _sizes(((2e-200, 1e-200, 1e-200), 8 / 3))),
    Check("leaves its arguments as they were", _size_untouched),
)
"""Checks of ``effective_sample_size(ws) -> n_eff``."""
