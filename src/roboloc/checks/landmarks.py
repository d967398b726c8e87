"""Public checks of SLAM with points: worked numbers, the same world turned, and differences of the student's own mean.

No formula stands here. A covariance must follow the function's own mean when that is changed a little, and what is seen
does not change when robot and landmarks are turned together.
"""

from math import pi

import numpy as np

from roboloc.angles import wrap
from roboloc.checks.report import Caller, Check, Wrong, text
from roboloc.se2 import compose

_STEP = 1e-5
_POSE = (1.0, -2.0, 2.2)
_LOOKS = (0.4, 2.0, -1.3, 5.0)
_Q = ((0.0004, 0.0003), (0.0003, 0.01))
_STATE = (1.0, -2.0, 2.2, 3.0, 1.0, -1.0, 2.5)


def _covariance(n: int, seed: int = 1) -> np.ndarray:
    A = np.random.default_rng(seed).normal(size=(n, n)) + 1.5 * np.eye(n)
    return 0.01 * A @ A.T


def _array(*values) -> tuple[np.ndarray, ...]:  # noqa: ANN002 - plain numbers
    return tuple(np.array(value, dtype=float) for value in values)


def _belief(caller: Caller, n: int, *arguments) -> tuple[np.ndarray, ...]:  # noqa: ANN002 - plain numbers
    return caller(_array(*arguments), {"x": (n,), "Sigma": (n, n)})


def _slopes(function, at: np.ndarray) -> np.ndarray:  # noqa: ANN001 - of the student's
    """Differentiate by central differences."""
    steps = _STEP * np.eye(len(at))
    columns = [(function(at + step) - function(at - step)) / (2 * _STEP) for step in steps]
    return np.transpose(columns)


def _off(got: np.ndarray, wanted: np.ndarray, allowed: float = 1e-5) -> bool:
    return bool(
        np.max(np.abs(got - wanted), initial=0.0) > allowed * (1 + np.max(np.abs(wanted), initial=0.0))
    )


def _say_written(caller: Caller, names: tuple) -> None:
    for i in caller.written_to:
        raise Wrong(f"The function writes to its argument {names[i]}. Work on a copy: {names[i]}.copy().")


def _say_symmetric(Sigma: np.ndarray) -> None:
    if np.max(np.abs(Sigma - Sigma.T), initial=0.0) > 1e-9:
        raise Wrong(f"Sigma should equal its transpose, got {text(Sigma)}")


def _turned(points: np.ndarray, angle: float) -> np.ndarray:
    """Turn pairs x, y about the origin."""
    return np.concatenate(
        [compose((0.0, 0.0, angle), (*pair, 0.0))[:2] for pair in np.reshape(points, (-1, 2))]
    )


def _turned_state(x: np.ndarray, angle: float) -> np.ndarray:
    return np.concatenate([_turned(x[:2], angle), [x[2] + angle], *(_turned(x[3:], angle),) * (len(x) > 3)])


def _turn_of(n: int, angle: float) -> np.ndarray:
    """Return the matrix that turns errors of a state of n numbers."""
    return np.transpose(
        [_turned_state(unit, angle) - _turned_state(np.zeros(n), angle) for unit in np.eye(n)]
    )


# ---------------------------------------------------------------- the start


def _init(caller: Caller, z, pose=_POSE, pose_cov=None, Q=_Q) -> tuple[np.ndarray, ...]:  # noqa: ANN001 - plain numbers
    pose_cov = _covariance(3) if pose_cov is None else pose_cov
    return _belief(caller, 3 + len(z), z, Q, pose, pose_cov)


def _placed(name: str, z: tuple, pose: tuple, place: tuple) -> Check:
    def check(caller: Caller) -> None:
        x, _ = _init(caller, z, pose)
        if _off(x, np.array([*pose, *place])):
            raise Wrong(
                f"A robot at {text(pose)} sees bearings and ranges {text(z)}:\nexpected x = {text((*pose, *place))}, "
                f"got {text(x)}"
            )

    return Check(name, check)


def _init_follows(*, doubt: bool) -> Check:
    def check(caller: Caller) -> None:
        for z in (_LOOKS[:2], _LOOKS):
            pose_cov = _covariance(3) if doubt else np.zeros((3, 3))
            _, Sigma = _init(caller, z, pose_cov=pose_cov)

            def mean(given: np.ndarray, count: int = len(z)) -> np.ndarray:
                return _init(caller, given[3 : 3 + count], given[:3])[0]

            J = _slopes(mean, np.array([*_POSE, *z]))
            errors = np.zeros((J.shape[1], J.shape[1]))
            errors[:3, :3] = pose_cov
            errors[3:, 3:] = np.kron(np.eye(len(z) // 2), _Q)
            wanted = J @ errors @ J.T
            _say_symmetric(Sigma)
            if _off(Sigma, wanted, 1e-6):
                where = np.argwhere(np.abs(Sigma - wanted) > 1e-6 * (1 + np.max(np.abs(wanted))))[0]
                raise Wrong(
                    f"With {len(z) // 2} landmarks, pose_cov = {text(pose_cov)} and looks as z = {text(z)}:\nsmall "
                    f"changes of pose and looks move your own x, and so make Sigma[{where[0]}, {where[1]}] about "
                    f"{text(wanted[tuple(where)])};\nyours is {text(Sigma[tuple(where)])}."
                )

    who = "a robot in doubt" if doubt else "a robot that knows its pose"
    return Check(f"Sigma follows your own x, {who}", check)


def _nothing_in_sight(caller: Caller) -> None:
    x, Sigma = _init(caller, ())
    if _off(x, np.array(_POSE)) or _off(Sigma, _covariance(3)):
        raise Wrong(
            "With no landmark in sight, z of shape (0,), the state is the pose and Sigma is pose_cov."
        )


def _init_untouched(caller: Caller) -> None:
    _init(caller, _LOOKS)
    _say_written(caller, ("z", "Q", "pose", "pose_cov"))


INIT = (
    Check("returns x (3 + 2k,), Sigma (3 + 2k, 3 + 2k)", lambda caller: _init(caller, _LOOKS) and None),
    _placed("a landmark straight ahead", (0.0, 2.0), (1.0, 1.0, pi / 2), (1.0, 3.0)),
    _placed(
        "one to the left and one behind", (pi / 2, 1.0, -pi, 3.0), (0.0, 0.0, pi / 2), (-1.0, 0.0, 0.0, -3.0)
    ),
    _init_follows(doubt=False),
    _init_follows(doubt=True),
    Check("nothing in sight", _nothing_in_sight),
    Check("leaves its arguments as they were", _init_untouched),
)
"""Checks of ``init_landmarks(z, Q, pose, pose_cov) -> x, Sigma``."""


# ---------------------------------------------------------------- the step


def _predict(caller: Caller, x, Sigma, control, R=None) -> tuple[np.ndarray, ...]:  # noqa: ANN001 - plain numbers
    R = np.zeros((3, 3)) if R is None else R
    return _belief(caller, len(x), x, Sigma, control, R)


def _driven(name: str, x: tuple, control: tuple, after: tuple) -> Check:
    def check(caller: Caller) -> None:
        got, _ = _predict(caller, x, np.zeros((len(x), len(x))), control)
        got[2] = after[2] + wrap(got[2] - after[2])
        if _off(got, np.array(after)):
            raise Wrong(
                f"From x = {text(x)}, with d, alpha = {text(control)}:\nexpected x = {text(after)}, got {text(got)}"
            )

    return Check(name, check)


def _predict_follows(caller: Caller) -> None:
    x, control = np.array(_STATE), (1.5, 0.4)
    before = _covariance(7)
    _, Sigma = _predict(caller, x, before, control)
    J = _slopes(lambda state: _predict(caller, state, before, control)[0], x)
    _say_symmetric(Sigma)
    wanted = J @ before @ J.T
    if _off(Sigma, wanted, 1e-6):
        block = (
            "the block of the pose",
            "the covariance of pose and landmarks",
            "the block of the landmarks",
        )
        parts = ((slice(3), slice(3)), (slice(3), slice(3, 7)), (slice(3, 7), slice(3, 7)))
        wrong = [
            name for name, part in zip(block, parts, strict=True) if _off(Sigma[part], wanted[part], 1e-6)
        ]
        raise Wrong(
            f"Without noise, Sigma is carried as small changes of x are carried to your own x after the step.\n"
            f"Not so: {', '.join(wrong)}."
        )


def _noise_ahead(caller: Caller) -> None:
    for heading, wanted in (
        (0.0, (0.04, 0.01, 0.09)),
        (pi / 2, (0.01, 0.04, 0.09)),
        (pi, (0.04, 0.01, 0.09)),
    ):
        R = np.diag((0.04, 0.01, 0.09))
        _, Sigma = _predict(caller, (0.0, 0.0, heading), np.zeros((3, 3)), (1.0, 0.5), R)
        if _off(Sigma, np.diag(wanted)):
            raise Wrong(
                f"A robot with heading {text(heading)} errs with variance 0.04 along its way, 0.01 across, 0.09 in "
                f"heading:\nexpected Sigma = diag {text(wanted)}, got {text(Sigma)}"
            )


def _predict_turned(caller: Caller) -> None:
    for angle in (0.7, -2.0):
        before, R, control = _covariance(7), _covariance(3, 2), (1.5, 0.4)
        x, Sigma = _predict(caller, _STATE, before, control, R)
        T = _turn_of(7, angle)
        there, turned = _predict(caller, _turned_state(np.array(_STATE), angle), T @ before @ T.T, control, R)
        if _off(there[:2], _turned_state(x, angle)[:2]) or _off(turned, T @ Sigma @ T.T):
            raise Wrong(
                f"Robot and landmarks, all turned by {text(angle)} rad about the origin, should end as before, turned "
                "by as much, and Sigma with them. What of yours belongs to the robot's axes, and what to the world's?"
            )


def _predict_untouched(caller: Caller) -> None:
    _predict(caller, _STATE, _covariance(7), (1.5, 0.4), _covariance(3, 2))
    _say_written(caller, ("x", "Sigma", "control", "control_cov"))


PREDICT = (
    Check(
        "returns x (n,), Sigma (n, n)",
        lambda caller: _predict(caller, _STATE, np.eye(7), (1.0, 0.2)) and None,
    ),
    _driven("drives along its heading, then turns", (1, 2, pi / 2), (1, 0.3), (1, 3, pi / 2 + 0.3)),
    _driven("landmarks stay", (0, 0, 0, 5, 1), (2, -0.5), (2, 0, -0.5, 5, 1)),
    Check("Sigma follows your own x", _predict_follows),
    Check("noise along the way and across it", _noise_ahead),
    Check("a turned world gives a turned result", _predict_turned),
    Check("leaves its arguments as they were", _predict_untouched),
)
"""Checks of ``predict(x, Sigma, control, control_cov) -> x, Sigma``."""


# ---------------------------------------------------------------- the look


def _look(caller: Caller, x, j: int) -> tuple[np.ndarray, ...]:  # noqa: ANN001 - plain numbers
    return caller((np.array(x, dtype=float), j), {"z": (2,), "Hp": (2, 3), "Hl": (2, 2)})


def _seen(name: str, x: tuple, j: int, wanted: tuple) -> Check:
    def check(caller: Caller) -> None:
        z, _, _ = _look(caller, x, j)
        if _off(z, np.array(wanted)):
            raise Wrong(f"With x = {text(x)}, j = {j}:\nexpected z = {text(wanted)}, got {text(z)}")

    return Check(name, check)


def _look_follows(name: str, part: int, columns: list[int]) -> Check:
    def check(caller: Caller) -> None:
        for j in (0, 1):
            at = np.array(_STATE)
            middle = _look(caller, at, j)[0]

            def near(state: np.ndarray, j: int = j, middle: np.ndarray = middle) -> np.ndarray:
                z = _look(caller, state, j)[0]
                return np.array([wrap(z[0] - middle[0]), z[1]])

            wanted = _slopes(near, at)[:, [i + 2 * j * (i > 2) for i in columns]]
            got = _look(caller, at, j)[part]
            if _off(got, wanted):
                raise Wrong(
                    f"With x = {text(_STATE)}, j = {j}: small changes of x change your own z, which makes {name} "
                    f"about\n{text(wanted.round(4))}, but yours is\n{text(got)}"
                )

    return Check(f"{name} agrees with small changes of x", check)


def _one_turn(caller: Caller) -> None:
    for heading in (-9.0, -3.0, 2.9, 7.0, 25.0):
        z, _, _ = _look(caller, (0, 0, heading, -2, 0.1), 0)
        if abs(z[0]) > pi + 1e-9:
            raise Wrong(f"With the heading {text(heading)} the bearing is {text(z[0])}, outside [-pi, pi).")


def _look_untouched(caller: Caller) -> None:
    _look(caller, _STATE, 1)
    _say_written(caller, ("x", "j"))


MEASUREMENT = (
    Check("returns z (2,), Hp (2, 3), Hl (2, 2)", lambda caller: _look(caller, _STATE, 0) and None),
    _seen("a landmark ahead and one to the left", (1, 1, pi / 2, 1, 4, -1, 1), 1, (pi / 2, 2)),
    _seen("a landmark behind to the right", (0, 0, 0, -3, -4), 0, (-2.2142974, 5)),
    Check("the bearing is in one turn", _one_turn),
    _look_follows("Hp", 1, [0, 1, 2]),
    _look_follows("Hl", 2, [3, 4]),
    Check("leaves its arguments as they were", _look_untouched),
)
"""Checks of ``measurement(x, j) -> z, Hp, Hl``."""
