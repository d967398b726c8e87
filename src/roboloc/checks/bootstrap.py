"""Public checks of one step of the bootstrap filter: which particles survive, where they are, what they weigh."""

from math import pi

import numpy as np

from roboloc.checks.report import Caller, Check, Wrong, text

_STILL, _NONE = (0.0, 0.0, 0.0), np.zeros(4)
_AROUND = np.array([(0.0, 0.0, 0.0), (0.0, 0.0, pi / 2), (0.0, 0.0, pi), (0.0, 0.0, -pi / 2)])


def _step(
    caller: Caller,
    xs: np.ndarray,
    ws: np.ndarray,
    landmark: tuple,
    bearing: float,
    *,
    odometry: tuple = _STILL,
    alphas: np.ndarray = _NONE,
    sigma: float = 0.2,
) -> tuple[np.ndarray, np.ndarray]:
    xs, ws = np.array(xs, dtype=float), np.array(ws, dtype=float)
    rest = (np.array(odometry), np.array(alphas), np.array(landmark, dtype=float), bearing, sigma)
    return caller((xs, ws, *rest, np.random.default_rng(3)), {"xs": xs.shape, "ws": ws.shape})


def _facing(caller: Caller) -> None:
    for bearing, landmark, survivor in (
        (0.0, (5, 0), 0),
        (pi / 2, (5, 0), 3),
        (3.1, (5, 0), 2),
        (0.0, (0, 5), 1),
    ):
        xs, _ = _step(caller, _AROUND, np.full(4, 0.25), landmark, bearing)
        if np.max(np.abs(np.exp(1j * xs[:, 2]) - np.exp(1j * _AROUND[survivor, 2]))) > 1e-9:
            raise Wrong(
                f"Four particles stand still at the origin and face four ways. A landmark at {text(landmark)} seen at "
                f"{text(bearing)} rad\nleaves copies of the one that faces {text(_AROUND[survivor, 2])} alone, "
                f"but there are headings {text(xs[:, 2])}"
            )


def _behind(caller: Caller) -> None:
    heading = np.array([0.05, -0.05])
    xs = np.repeat(np.column_stack([np.zeros((2, 2)), heading]), 50, axis=0)
    kept, _ = _step(caller, xs, np.full(100, 0.01), (-5, 0), pi - 0.001)
    share = float(np.mean(kept[:, 2] > 0))
    if abs(share - 0.5) > 0.02:
        raise Wrong(
            "Half of the particles look a little to the left, half a little to the right, and a landmark is straight "
            f"behind:\nboth explain it alike, but {text(100 * share)} percent of the copies are of the first half"
        )


def _weights(caller: Caller) -> None:
    _, ws = _step(caller, _AROUND, (0.1, 0.2, 0.3, 0.4), (5, 0), 0.5, sigma=1.0)
    if np.max(np.abs(ws - 0.25)) > 1e-9:
        raise Wrong(f"After resampling 4 particles weigh 1/4 each, but ws is {text(ws)}")


def _earlier(caller: Caller) -> None:
    xs = np.repeat([(0.0, 0.0, 0.0), (3.0, 0.0, 0.0)], 50, axis=0)
    kept, _ = _step(caller, xs, np.repeat((0.016, 0.004), 50), (9, 0), 0.0)
    share = float(np.mean(kept[:, 0] < 1.0))
    if abs(share - 0.8) > 0.011:
        raise Wrong(
            "Two places explain the bearing alike, and the first has four fifths of the weight from before:\n"
            f"it should get 80 percent of the copies, but it gets {text(100 * share)} percent"
        )


def _ratio(caller: Caller) -> None:
    xs = np.repeat([(0.0, 0.0, 0.0), (0.0, 0.0, 0.2)], 100, axis=0)
    kept, _ = _step(caller, xs, np.full(200, 0.005), (9, 0), 0.0)
    share = float(np.mean(kept[:, 2] < 0.1))
    if abs(share - 0.62246) > 0.006:
        raise Wrong(
            "Half of the particles face the landmark, half look one sigma past it: 1 to exp(-1/2).\n"
            f"The first should get 62.2 percent of the copies, but they get {text(100 * share)} percent"
        )


def _moved(caller: Caller) -> None:
    xs, _ = _step(caller, _AROUND, np.full(4, 0.25), (10, 1), 0.0, odometry=(pi / 2, 1.0, -pi / 2))
    if np.max(np.abs(xs - (0.0, 1.0, 0.0))) > 1e-9:
        raise Wrong(
            "Four particles at the origin turn left, drive 1 m and turn back; then a landmark far ahead along x is "
            f"seen straight ahead.\nCopies of [0, 1, 0] should be left, but there are {text(xs)}"
        )


def _errs(caller: Caller) -> None:
    xs, _ = _step(
        caller, np.zeros((2000, 3)), np.full(2000, 1 / 2000), (9, 0), 0.0,
        odometry=(0.0, 1.0, 0.0), alphas=np.array([0, 0, 0.1, 0]),
    )  # fmt: skip
    if abs(xs[:, 0].std() / 0.1 - 1.0) > 0.15:
        raise Wrong(
            "2000 particles drive 1 m with errors of 0.1 m towards a landmark that is straight ahead of all of them.\n"
            f"Their places should have a standard deviation of 0.1 m, but it is {text(xs[:, 0].std())}"
        )


def _weighs_errors(caller: Caller) -> None:
    xs, _ = _step(
        caller, np.zeros((2000, 3)), np.full(2000, 1 / 2000), (1e6, 0), -1.0,
        odometry=(0.0, 0.0, 1.0), alphas=np.array([0.2, 0, 0, 0]),
    )  # fmt: skip
    if abs(xs[:, 2].std() / 0.1414 - 1.0) > 0.15:
        raise Wrong(
            "2000 particles turn by 1 rad with errors of 0.2 rad, and see a star with a sigma of 0.2 rad.\n"
            f"Together the two leave a standard deviation of 0.141 rad, but that of your headings is "
            f"{text(xs[:, 2].std())}"
        )


def _seeded(caller: Caller) -> None:
    one, other = (
        _step(
            caller,
            np.zeros((20, 3)),
            np.full(20, 0.05),
            (3, 1),
            0.3,
            odometry=(0.5, 1.0, 0.0),
            alphas=_NONE + 0.1,
        )
        for _ in range(2)
    )
    if not all(map(np.array_equal, one, other)):
        raise Wrong(
            "Two calls with generators in the same state give different particles: draw from rng alone."
        )


def _untouched(caller: Caller) -> None:
    _step(caller, _AROUND, np.full(4, 0.25), (5, 0), 0.4, odometry=(0.1, 1.0, 0.1))
    names = ("xs", "ws", "odometry", "alphas", "landmark", "bearing", "sigma")
    for i in caller.written_to:
        if i < len(names):
            raise Wrong(
                f"The function writes to its argument {names[i]}. Work on a copy: np.array({names[i]})."
            )


BOOTSTRAP_STEP = (
    Check(
        "returns xs (M, 3), ws (M,)",
        lambda caller: _step(caller, _AROUND, np.full(4, 0.25), (5, 0), 0.0) and None,
    ),
    Check("the particle that explains the bearing survives", _facing),
    Check("landmarks behind", _behind),
    Check("all weigh 1/M afterwards", _weights),
    Check("earlier weights count", _earlier),
    Check("one sigma off counts exp(-1/2)", _ratio),
    Check("particles are moved before they are weighed", _moved),
    Check("particles err", _errs),
    Check("the bearing weighs the errors", _weighs_errors),
    Check("draws from rng alone", _seeded),
    Check("leaves its arguments as they were", _untouched),
)
"""Checks of ``bootstrap_step(xs, ws, odometry, alphas, landmark, bearing, sigma, rng) -> xs, ws``."""
