r"""Hidden checks of the notebook *landmark-slam*: start, prediction, look, correction and evaluation of a map.

Every way that is right passes.

* *Headings.* Whether a function wraps the heading of the robot is its own affair: the heading of x is compared on the
  circle. The bearing that `measurement` returns must lie in [-pi, pi); inputs keep away from its ends.
* *Rounding.* A covariance may be off by 1e-6 of its standard deviations and a derivative by as much of its row, so
  that differences pass as well as formulas; a mean by 1e-7. What a wrong version does is a thousand times as large.
* *Order.* Looks may be used all at once or one after the other, as long as all are linearized about the given x.

Every stage gets states with one, two and three landmarks: a size that is written down fails.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from autograder.check import Case, Check, Stage, remembered
from autograder.checks import landmark_inputs as draw
from autograder.checks.circle import nearest_turn
from autograder.checks.kinds import each, repeatable, untouched
from roboloc_reference.landmarks import evaluate, init_landmarks, measurement, predict, update

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.random import Generator

MEAN, SHARE = 1e-7, 1e-6
_BOTH = frozenset({"x", "Sigma"})
_HINT_COPY = "x += ... and Sigma[:3, :3] = ... write into the caller's array; work on copies."
_HINT_GLOBAL = "Use the arguments alone, nothing global."
_HINT_SIZE = "How many landmarks there are is for the arguments to say."


def on_the_circle(right: dict[str, Any], got: dict[str, Any]) -> dict[str, Any]:
    """Write the heading of the returned x in the turn that is nearest to the right one."""
    x = got["x"]
    if x is None or not np.isfinite(x).all():
        return got
    x = x.copy()
    x[2] = nearest_turn(x[2], right["x"][2])
    return got | {"x": x}


def belief_tolerance(x: np.ndarray, Sigma: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Bound the errors of a mean and of its covariance."""
    size = np.sqrt(np.abs(np.diag(Sigma))) + 1e-6
    return MEAN * (1.0 + np.abs(x)), SHARE * np.outer(size, size)


def init_tolerance(*args: Any) -> tuple[np.ndarray, np.ndarray]:
    """Bound the errors of the first map."""
    return belief_tolerance(*init_landmarks(*args))


def predict_tolerance(*args: Any) -> tuple[np.ndarray, np.ndarray]:
    """Bound the errors of a prediction."""
    return belief_tolerance(*predict(*args))


def update_tolerance(x: np.ndarray, Sigma: np.ndarray, *_: Any) -> tuple[np.ndarray, np.ndarray]:
    """Bound the errors of a correction, by the doubt before it."""
    return belief_tolerance(x, Sigma)


def measurement_tolerance(x: np.ndarray, j: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Bound the errors of a predicted look and of its derivatives, row by row."""
    z, Hp, Hl = measurement(x, j)
    rows = [SHARE * np.abs(H).max(axis=1, keepdims=True) * np.ones_like(H) for H in (Hp, Hl)]
    return MEAN * (1.0 + np.abs(z)), *rows


def evaluate_tolerance(*args: Any) -> tuple[np.ndarray, np.ndarray]:
    """Bound the errors of the distances."""
    return tuple(SHARE * (0.01 + values) for values in evaluate(*args))


def _stage_of_belief(
    reference: Callable, tolerance: Callable, arguments: tuple[str, ...], several: Callable, *checks: Check
) -> Stage:
    """Make a stage that returns x and Sigma; `several` are inputs for what is asked of arguments and memory."""
    return Stage(
        name=f"landmarks.{reference.__name__}",
        outputs=("x", "Sigma"),
        reference=reference,
        tolerance=tolerance,
        rows={"x": draw.STATE, "Sigma": draw.STATE},
        columns={"Sigma": draw.STATE},
        aligned=on_the_circle,
        checks=(
            *checks,
            Check("arguments untouched", 2, untouched(several, arguments, _BOTH), _HINT_COPY),
            Check("same call, same result", 1, repeatable(several, _BOTH), _HINT_GLOBAL),
        ),
    )


def _init(rng: Generator, k: int, *, certain: bool = False) -> Case:
    pose_cov = np.zeros((3, 3)) if certain else draw.covariance(rng, (0.3, 0.3, 0.1))
    args = (draw.looks(rng, k), draw.look_covariance(rng), draw.pose(rng), pose_cov)
    return INIT.case(*args)


@remembered
def certain_robot(rng: Generator) -> list[Case]:
    """Make starts of a robot that knows where it is."""
    return [_init(rng, k, certain=True) for k in (1, 1, 2)]


@remembered
def one_landmark(rng: Generator) -> list[Case]:
    """Make starts with one landmark, of a robot in doubt."""
    return [_init(rng, 1) for _ in range(4)]


@remembered
def several_landmarks(rng: Generator) -> list[Case]:
    """Make starts with two and three landmarks."""
    return [_init(rng, k) for k in (2, 3, 2, 3)]


_HINT_PLACE = "In which frame is the bearing measured, and what turns it into a direction in the world?"
_HINT_OWN = "What does 0.1 rad do to a landmark 5 m away, and in which direction of the world?"
_HINT_CROSS = "If the robot is 10 cm further to the left than it believes, where is the landmark?"
_INIT_ARGS = ("z", "Q", "pose", "pose_cov")

INIT = _stage_of_belief(
    init_landmarks,
    init_tolerance,
    _INIT_ARGS,
    several_landmarks,
    Check("x, one landmark", 3, each(one_landmark, "x"), _HINT_PLACE),
    Check("x, several landmarks", 2, each(several_landmarks, "x"), _HINT_SIZE),
    Check("Sigma, a robot that knows its pose", 4, each(certain_robot, "Sigma"), _HINT_OWN),
    Check("Sigma, one landmark", 4, each(one_landmark, "Sigma"), _HINT_CROSS),
    Check("Sigma, several landmarks", 4, each(several_landmarks, "Sigma"), _HINT_CROSS),
)


def _predict(rng: Generator, k: int, *, noise: bool = True, doubt: bool = True) -> Case:
    x = draw.placed(draw.pose(rng), draw.looks(rng, k))
    Sigma = draw.state_covariance(rng, k) if doubt else np.zeros((3 + 2 * k, 3 + 2 * k))
    R = draw.step_covariance(rng) if noise else np.zeros((3, 3))
    control = np.array([rng.uniform(0.8, 2.0), draw.sign(rng) * rng.uniform(0.2, 0.7)])
    return PREDICT.case(x, Sigma, control, R)


@remembered
def without_noise(rng: Generator) -> list[Case]:
    """Make steps without noise."""
    return [_predict(rng, k, noise=False) for k in (1, 2, 3)]


@remembered
def noise_alone(rng: Generator) -> list[Case]:
    """Make steps of a robot that knows everything before it."""
    return [_predict(rng, k, doubt=False) for k in (0, 1, 2)]


@remembered
def whole_steps(rng: Generator) -> list[Case]:
    """Make steps with doubt before and noise in the step."""
    return [_predict(rng, k) for k in (1, 2, 3, 2)]


_HINT_STEP = "The robot drives first and turns afterwards. Draw the step, and one with another heading."
_HINT_G = "A doubt about the heading becomes a doubt about the place: across the way, in proportion to it."
_HINT_L = (
    "Along and across belong to the robot. In which direction of the world does a slip along its way go?"
)
_PREDICT_ARGS = ("x", "Sigma", "control", "control_cov")

PREDICT = _stage_of_belief(
    predict,
    predict_tolerance,
    _PREDICT_ARGS,
    whole_steps,
    Check("x", 4, each(whole_steps, "x"), _HINT_STEP),
    Check("Sigma, a step without noise", 5, each(without_noise, "Sigma"), _HINT_G),
    Check("Sigma, noise alone", 4, each(noise_alone, "Sigma"), _HINT_L),
    Check(
        "Sigma, both",
        4,
        each(whole_steps, "Sigma"),
        "Doubt that is carried on, and noise that comes new.",
    ),
)


def _measurement(rng: Generator, k: int, j: int, *, laps: bool = False) -> Case:
    x = draw.placed(draw.pose(rng, laps=laps), draw.looks(rng, k))
    return MEASUREMENT.case(x, j)


@remembered
def to_the_front(rng: Generator) -> list[Case]:
    """Make looks to the front of a robot whose heading and whose landmark are within a right angle."""
    cases = []
    for _ in range(4):
        heading = draw.sign(rng) * rng.uniform(0.2, 0.6)
        at = np.array([*rng.uniform(0.5, 3.0, 2) * draw.signs(rng, 2), heading])
        cases.append(MEASUREMENT.case(draw.placed(at, draw.looks(rng, 1, ahead=True)), 0))
    return cases


@remembered
def all_around(rng: Generator) -> list[Case]:
    """Make looks in all directions of the world at one of several landmarks, no bearing near straight back."""
    cases: list[Case] = []
    for quarter in (0.8, 2.4, -0.8, -2.4, 2.4):
        at = draw.pose(rng)
        z = draw.looks(rng, 2)
        z[2] = draw.sign(rng) * rng.uniform(0.3, 0.6)
        at[2] = quarter + rng.uniform(-0.3, 0.3) - z[2]
        cases.append(MEASUREMENT.case(draw.placed(at, z), 1))
    return cases


@remembered
def any_landmark(rng: Generator) -> list[Case]:
    """Make looks at each of three landmarks."""
    x = draw.placed(draw.pose(rng), draw.looks(rng, 3))
    return [MEASUREMENT.case(x.copy(), j) for j in (0, 1, 2)]


@remembered
def after_laps(rng: Generator) -> list[Case]:
    """Make looks from headings beyond a turn."""
    return [_measurement(rng, 2, 1, laps=True) for _ in range(20)]


_HINT_Z = "Put the landmark ahead of the robot, then to its left: what are bearing and range?"
_HINT_H = (
    "Move the robot, and then the landmark, by a centimetre along x and along y: what changes, by how much?"
)
_HINT_J = "Where in x does landmark j begin?"
_HINT_TURN = "Print the bearing for a robot that has turned three times on the spot."
_THREE = frozenset({"z", "Hp", "Hl"})

MEASUREMENT = Stage(
    name="landmarks.measurement",
    outputs=("z", "Hp", "Hl"),
    reference=measurement,
    tolerance=measurement_tolerance,
    rows={"z": draw.LOOK, "Hp": draw.LOOK, "Hl": draw.LOOK},
    columns={"Hp": draw.POSE, "Hl": ("l_x", "l_y")},
    checks=(
        Check("z, a landmark ahead", 3, each(to_the_front, "z"), _HINT_Z),
        Check("z, in all directions", 3, each(all_around, "z"), _HINT_Z),
        Check("Hp", 4, each(to_the_front, "Hp"), _HINT_H),
        Check("Hl", 4, each(to_the_front, "Hl"), _HINT_H),
        Check("each of three landmarks", 2, each(any_landmark, "Hp", "Hl"), _HINT_J),
        Check("bearing in one turn", 2, each(after_laps, "z"), _HINT_TURN),
        Check("arguments untouched", 1, untouched(any_landmark, ("x", "j"), _THREE), _HINT_COPY),
        Check("same call, same result", 1, repeatable(any_landmark, _THREE), _HINT_GLOBAL),
    ),
)


def _update(rng: Generator, k: int, *, back: bool = False, laps: bool = False) -> Case:
    """Make a correction by looks that are off by about what both sides admit.

    With `back` one landmark is expected on the one side of straight back and seen on the other.
    """
    seen = draw.looks(rng, k)
    at = draw.pose(rng, laps=laps)
    off = rng.uniform(0.6, 1.4, 2 * k) * draw.signs(rng, 2 * k) * np.tile([0.08, 0.2], k)
    expected = seen + off
    if back:
        side = draw.sign(rng)
        expected[0], seen[0] = (
            side * (np.pi - rng.uniform(0.03, 0.06)),
            -side * (np.pi - rng.uniform(0.03, 0.06)),
        )
    x = draw.placed(at, expected)
    return UPDATE.case(x, draw.state_covariance(rng, k), seen, draw.look_covariance(rng))


@remembered
def one_look(rng: Generator) -> list[Case]:
    """Make corrections by one landmark."""
    return [_update(rng, 1) for _ in range(4)]


@remembered
def several_looks(rng: Generator) -> list[Case]:
    """Make corrections by two and three landmarks."""
    return [_update(rng, k) for k in (2, 3, 2, 3)]


@remembered
def across_the_seam(rng: Generator) -> list[Case]:
    """Make corrections of landmarks behind the robot, and of a robot that has driven laps."""
    return [_update(rng, k, back=back, laps=not back) for k, back in ((1, True), (2, False), (2, True))]


_HINT_V = "Observed minus expected: which numbers, in which order, and in which turn?"
_HINT_STACK = "H has two rows for each landmark. In which columns is it not 0?"
_HINT_JOINT = "S holds the doubt about robot and map, carried to what is seen, and the noise of every look."
_UPDATE_ARGS = ("x", "Sigma", "z", "Q")

UPDATE = _stage_of_belief(
    update,
    update_tolerance,
    _UPDATE_ARGS,
    several_looks,
    Check("x, one landmark", 3, each(one_look, "x"), _HINT_V),
    Check("Sigma, one landmark", 3, each(one_look, "Sigma"), _HINT_JOINT),
    Check("x, several landmarks", 4, each(several_looks, "x"), _HINT_STACK),
    Check("Sigma, several landmarks", 4, each(several_looks, "Sigma"), _HINT_STACK),
    Check("x, behind the robot and after laps", 3, each(across_the_seam, "x"), _HINT_V),
)


def _evaluate(rng: Generator, k: int) -> Case:
    x = draw.placed(draw.pose(rng), draw.looks(rng, k))
    Sigma = draw.covariance(rng, (0.2, 0.2, 0.08, *rng.uniform(0.1, 0.5, 2 * k)))
    truth = x[3:] + rng.uniform(0.1, 0.5, 2 * k) * draw.signs(rng, 2 * k)
    return EVALUATE.case(x, Sigma, truth)


@remembered
def one_place(rng: Generator) -> list[Case]:
    """Make maps of one landmark."""
    return [_evaluate(rng, 1) for _ in range(4)]


@remembered
def several_places(rng: Generator) -> list[Case]:
    """Make maps of two and three landmarks."""
    return [_evaluate(rng, k) for k in (2, 3, 2, 3)]


_HINT_FAR = "How far is the one point from the other, in metres?"
_HINT_ALONE = (
    "A landmark that is 0.2 m off where its standard deviation is 0.1 m: how many standard deviations?"
)
_HINT_BLOCK = "Which four numbers of Sigma are the covariance of landmark j?"
_DISTANCES = frozenset({"euclidean", "mahalanobis"})

EVALUATE = Stage(
    name="landmarks.evaluate",
    outputs=("euclidean", "mahalanobis"),
    reference=evaluate,
    tolerance=evaluate_tolerance,
    checks=(
        Check("euclidean", 5, each(several_places, "euclidean"), _HINT_FAR),
        Check("mahalanobis, one landmark", 6, each(one_place, "mahalanobis"), _HINT_ALONE),
        Check("mahalanobis, several landmarks", 6, each(several_places, "mahalanobis"), _HINT_BLOCK),
        Check(
            "arguments untouched",
            2,
            untouched(several_places, ("x", "Sigma", "truth"), _DISTANCES),
            _HINT_COPY,
        ),
        Check("same call, same result", 1, repeatable(several_places, _DISTANCES), _HINT_GLOBAL),
    ),
)

STAGES = (INIT, PREDICT, MEASUREMENT, UPDATE, EVALUATE)
