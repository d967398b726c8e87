"""Public checks of Monte Carlo localization: clouds one can follow by hand, and laws that hold for any cloud."""

import contextlib
import warnings
from math import exp, pi

import numpy as np

from roboloc.angles import wrap
from roboloc.checks.report import Caller, Check, Wrong, text

_CENTRE = (0.0, 0.0, 0.0)
_TENTH = ((0.01, 0.0), (0.0, 0.01))


def _array(value) -> np.ndarray:  # noqa: ANN001 - plain numbers
    return np.array(value, dtype=float)


def _expect(story: str, name: str, expected, got: np.ndarray, *, angle: bool = False) -> None:  # noqa: ANN001
    off = _array(expected) - got
    if np.abs(wrap(off) if angle else off).max(initial=0.0) > 1e-6:
        raise Wrong(f"{story}\nexpected {name} = {text(expected)}, got {text(got)}")


def _say_written(caller: Caller, names: tuple[str, ...]) -> None:
    for i in caller.written_to:
        raise Wrong(f"The function writes to its argument {names[i]}. Work on a copy: np.array({names[i]}).")


def _quiet(_: np.ndarray) -> None:
    """Forget a result that only had to have its shape."""


# The motion

_CLOUD = ((0.3, -0.5, 0.7), (1.2, 0.8, -1.1), (0.3, -0.5, 0.7), (-2.0, 1.0, 9.0))
_CONTROLS = ((1.0, 0.5), (-0.7, -0.9), (0.6, 0.0), (1.0, 1e-9))


def _move(caller: Caller, xs, us, dt: float) -> np.ndarray:  # noqa: ANN001
    xs = _array(xs)
    (moved,) = caller((xs, _array(us), float(dt)), {"xs": xs.shape})
    return moved


def _drives(caller: Caller) -> None:
    got = _move(caller, [[1, 2, 0], [0, 0, 0]], [[1.5, 0], [pi / 2, pi / 2]], 1.0)
    story = "One particle at (1, 2, 0) drives 1.5 m straight on, another at (0, 0, 0) a quarter circle of radius 1 m:"
    _expect(story, "xs", [[2.5, 2, 0], [1, 1, pi / 2]], got)


def _one_by_one(caller: Caller) -> None:
    together = _move(caller, _CLOUD, _CONTROLS, 0.8)
    for m, (x, u) in enumerate(zip(_CLOUD, _CONTROLS, strict=True)):
        alone = _move(caller, [x], [u], 0.8)[0]
        if np.abs(alone - together[m]).max() > 1e-9:
            raise Wrong(
                f"Particle {m} of a cloud of {len(_CLOUD)} ends at {text(together[m])}, alone at {text(alone)}.\n"
                "What a particle does must not depend on the others."
            )


def _in_pieces(caller: Caller) -> None:
    once, twice = _move(caller, _CLOUD, _CONTROLS, 0.8), _array(_CLOUD)
    for _ in range(2):
        twice = _move(caller, twice, _CONTROLS, 0.4)
    if np.abs(once - twice).max() > 1e-6:
        raise Wrong(f"0.8 s at once and twice 0.4 s end {text(np.abs(once - twice).max())} apart.")


def _turns(caller: Caller) -> None:
    got = _move(caller, _CLOUD, _CONTROLS, 0.8)[:, 2]
    ends = _array(_CLOUD)[:, 2] + 0.8 * _array(_CONTROLS)[:, 1]
    _expect("Headings grow by omega dt and keep their turn:", "theta", ends, got)


def _move_untouched(caller: Caller) -> None:
    _move(caller, _CLOUD, _CONTROLS, 0.8)
    _say_written(caller, ("xs", "us", "dt"))


TRANSITION = (
    Check("returns xs (M, 3)", lambda caller: _quiet(_move(caller, _CLOUD, _CONTROLS, 0.8))),
    Check("two particles, two motions", _drives),
    Check("each particle as if it were alone", _one_by_one),
    Check("one step or two", _in_pieces),
    Check("headings keep their turn", _turns),
    Check("leaves its arguments as they were", _move_untouched),
)
"""Checks of ``transition_model(xs, us, dt) -> xs``."""


# The lines that are expected

_ROOM = ((0.0, pi / 2, -pi, -pi / 2), (4.0, 3.0, 1.0, 2.0))
_PLACES = ((1.0, 0.5, 0.4), (-0.5, 2.0, -2.0), (2.5, -1.0, 3.0))


def _expected(caller: Caller, xs, map_lines=_ROOM, tf=_CENTRE) -> np.ndarray:  # noqa: ANN001
    xs, map_lines = _array(xs), _array(map_lines)
    shape = len(xs), 2, map_lines.shape[1]
    (hs,) = caller((xs, map_lines, _array(tf)), {"hs": shape})
    return hs


def _by_hand(caller: Caller) -> None:
    hs = _expected(caller, [[0, 0, 0], [1, 0, pi / 2]], [[0.0], [2.0]])
    story = "A wall 2 m ahead of one particle is 1 m to the right of another, 1 m nearer and turned left:"
    _expect(story, "hs[:, 1, 0]", [2, 1], hs[:, 1, 0])
    _expect(story, "hs[:, 0, 0]", [0, -pi / 2], hs[:, 0, 0], angle=True)


def _mounted(caller: Caller) -> None:
    hs = _expected(caller, [[0, 0, pi / 2]], [[pi / 2], [3.0]], (1.0, 0.5, 0.0))
    story = "The scanner is 1 m ahead of the robot and 0.5 m to its left. The robot looks along y, at a wall y = 3:"
    _expect(story, "hs[0, :, 0]", [0, 2], hs[0, :, 0])


def _behind(caller: Caller) -> None:
    hs = _expected(caller, [[3.0, 0, 0.1], [1.0, 0, 0.1]], [[0.0], [2.0]])
    story = "The line x = 2; one particle has crossed it by 1 m, the other has 1 m to go:"
    _expect(story, "hs[:, 1, 0]", [1, 1], hs[:, 1, 0])
    _expect(story, "hs[:, 0, 0]", [pi - 0.1, -0.1], hs[:, 0, 0], angle=True)


def _scans(caller: Caller) -> None:
    for tf in (_CENTRE, (0.3, -0.2, 1.0)):
        hs = _expected(caller, _PLACES, _ROOM, tf)
        if (hs[:, 1] < 0).any() or (np.abs(hs[:, 0]) > pi + 1e-9).any():
            raise Wrong("A scanner reports r >= 0 and alpha in [-pi, pi). Some of hs is neither.")
        for m, place in enumerate(_PLACES):
            off = hs[m] - _expected(caller, [place], _ROOM, tf)[0]
            if max(np.abs(wrap(off[0])).max(), np.abs(off[1]).max()) > 1e-9:
                raise Wrong(f"Particle {m} expects other lines in a cloud than it does alone.")


def _expected_untouched(caller: Caller) -> None:
    _expected(caller, _PLACES)
    _say_written(caller, ("xs", "map_lines", "tf_base_to_camera"))


PREDICTED = (
    Check("returns hs (M, 2, J)", lambda caller: _quiet(_expected(caller, _PLACES))),
    Check("a wall ahead, a wall to the right", _by_hand),
    Check("a scanner that is not at the centre", _mounted),
    Check("a line that was crossed", _behind),
    Check("each particle as if it were alone, and as scanners report", _scans),
    Check("leaves its arguments as they were", _expected_untouched),
)
"""Checks of ``compute_predicted_measurements(xs, map_lines, tf_base_to_camera) -> hs``."""


# Which line is which


def _innovate(caller: Caller, z_raw, Q_raw, hs) -> np.ndarray:  # noqa: ANN001
    z_raw, hs = _array(z_raw), _array(hs)
    (vs,) = caller((z_raw, _array(Q_raw), hs), {"vs": (len(hs), 2 * z_raw.shape[1])})
    return vs


_WALLS = ((0.0, 1.5), (2.0, 3.0))


def _ordered(caller: Caller) -> None:
    vs = _innovate(caller, [[1.6, 0.1], [2.9, 2.05]], [_TENTH] * 2, [_WALLS, ((0.2, 1.7), (2.1, 3.2))])
    story = "Two particles expect walls ahead and to the left; a line is seen to the left, then one ahead:"
    _expect(story, "vs", [[0.1, -0.1, 0.1, 0.05], [-0.1, -0.3, -0.1, -0.05]], vs)


def _own(caller: Caller) -> None:
    vs = _innovate(caller, [[0.0], [2.0]], [_TENTH], [((0.1, 1.5), (2.0, 2.0)), ((1.5, 0.1), (2.0, 2.0))])
    _expect(
        "For one particle its first line is the nearest, for the other its second:", "vs", [[-0.1, 0]] * 2, vs
    )


def _across(caller: Caller) -> None:
    vs = _innovate(caller, [[-3.1], [2.0]], [_TENTH], [((3.1, -2.0), (2.0, 2.0))])
    story = "A wall is seen at -3.1 rad, and walls are expected at 3.1 and at -2.0 rad:"
    _expect(story, "vs", [[2 * pi - 6.2, 0]], vs)


def _judged(caller: Caller) -> None:
    Q_raw = [((0.0001, 0.0), (0.0, 1.0))]
    vs = _innovate(caller, [[0.0], [2.0]], Q_raw, [((0.2, 0.0), (2.0, 2.5))])
    story = "Angles are seen to 0.01 rad, distances to 1 m. One line is 0.2 rad off, the other 0.5 m:"
    _expect(story, "vs", [[0, -0.5]], vs)


def _own_covariance(caller: Caller) -> None:
    Q_raw = [((0.0001, 0.0), (0.0, 1.0)), ((1.0, 0.0), (0.0, 0.0001))]
    vs = _innovate(caller, [[0.0, 0.0], [2.0, 2.0]], Q_raw, [((0.2, 0.0), (2.0, 2.5))])
    story = "The same line is seen twice: once its angle is the better known number, once its distance:"
    _expect(story, "vs", [[0, -0.5, -0.2, 0]], vs)


def _ungated(caller: Caller) -> None:
    vs = _innovate(caller, [[0.5], [9.0]], [_TENTH], [_WALLS])
    _expect("Nothing is near, and the nearer of the two is still the nearest:", "vs", [[-1.0, 6.0]], vs)


def _innovate_untouched(caller: Caller) -> None:
    _innovate(caller, [[1.6, 0.1], [2.9, 2.05]], [_TENTH] * 2, [_WALLS])
    _say_written(caller, ("z_raw", "Q_raw", "hs"))


INNOVATIONS = (
    Check(
        "returns vs (M, 2I)", lambda caller: _quiet(_innovate(caller, [[0.1], [2.1]], [_TENTH], [_WALLS] * 3))
    ),
    Check("each observation in its place", _ordered),
    Check("each particle has a nearest line of its own", _own),
    Check("across the end of a turn", _across),
    Check("nearest by the covariance", _judged),
    Check("each observation by its own covariance", _own_covariance),
    Check("what is far is kept", _ungated),
    Check("leaves its arguments as they were", _innovate_untouched),
)
"""Checks of ``compute_innovations(z_raw, Q_raw, hs) -> vs``."""


# Weights


def _weigh(caller: Caller, vs, Q_raw, ws) -> np.ndarray:  # noqa: ANN001
    ws = _array(ws)
    (after,) = caller((_array(vs), _array(Q_raw), ws), {"ws": ws.shape})
    return after


def _one_off(caller: Caller) -> None:
    got = _weigh(caller, [[0, 0], [0, 0.1]], [_TENTH], [0.5, 0.5])
    share = 1 / (1 + exp(-0.5))
    _expect(
        "Of two particles one is right, the other one standard deviation off:", "ws", [share, 1 - share], got
    )


def _before(caller: Caller) -> None:
    got = _weigh(caller, [[0.1, 0.0]] * 3, [_TENTH], [0.5, 0.3, 0.2])
    _expect("All explain the scan alike, so nothing changes:", "ws", [0.5, 0.3, 0.2], got)


def _one_after_the_other(caller: Caller) -> None:
    vs = _array([[0.1, 0.05, -0.2, 0.1], [0.2, -0.1, 0.0, 0.2], [0, 0.1, 0.1, 0.1]])
    Q_raw = [_TENTH, ((0.02, 0.01), (0.01, 0.03))]
    ws = _array([0.2, 0.5, 0.3])
    both = _weigh(caller, vs, Q_raw, ws)
    after = _weigh(caller, vs[:, 2:], Q_raw[1:], _weigh(caller, vs[:, :2], Q_raw[:1], ws))
    if np.abs(both - after).max() > 1e-9:
        raise Wrong(
            f"Two lines at once give {text(both)}, one after the other {text(after)}.\n"
            "They are the same evidence."
        )


def _correlated(caller: Caller) -> None:
    got = _weigh(caller, [[0.1, 0.1], [0.1, -0.1]], [((0.01, 0.005), (0.005, 0.01))], [0.5, 0.5])
    share = 1 / (1 + exp(-2 / 1.5))
    story = "Errors of alpha and r are correlated by 1/2. Both particles are 0.1 off in each, one with unlike signs:"
    _expect(story, "ws", [share, 1 - share], got)


def _tiny(caller: Caller) -> None:
    got = _weigh(caller, [[5.0, 0.0], [5.0, 0.01]], [_TENTH], [0.5, 0.5])
    share = 1 / (1 + exp(-0.005))
    _expect("Both are 50 standard deviations off, one of them a little more:", "ws", [share, 1 - share], got)


def _lost(caller: Caller) -> None:
    for vs, ws in (([[0, 0], [0, 0.1]], [0, 0]), ([[1e170, 0], [0, 1e170]], [0.5, 0.5])):
        _expect("No particle can explain what is seen:", "ws", [0.5, 0.5], _weigh(caller, vs, [_TENTH], ws))
    with warnings.catch_warnings(record=True) as said, contextlib.suppress(Exception):
        warnings.simplefilter("always")
        caller.function(np.zeros((2, 2)), _array([_TENTH]), np.zeros(2))
    if not [one for one in said if "divide by zero" not in str(one.message)]:
        raise Wrong("All weights were set to 1/M without a word. Say so: warnings.warn(...).")


def _weigh_untouched(caller: Caller) -> None:
    _weigh(caller, [[0, 0], [0, 0.1]], [_TENTH], [0.5, 0.5])
    _say_written(caller, ("vs", "Q_raw", "ws"))


WEIGHTS = (
    Check("returns ws (M,)", lambda caller: _quiet(_weigh(caller, [[0, 0]] * 3, [_TENTH], [0.2, 0.3, 0.5]))),
    Check("one standard deviation", _one_off),
    Check("the weights before", _before),
    Check("two lines are two pieces of evidence", _one_after_the_other),
    Check("correlated errors", _correlated),
    Check("likelihoods too small for a number", _tiny),
    Check("nobody can be right", _lost),
    Check("leaves its arguments as they were", _weigh_untouched),
)
"""Checks of ``measurement_weights(vs, Q_raw, ws) -> ws``."""
