"""Public checks of the bouncing ball: worked throws, two steps in one, and differences of the student's own mean."""

import numpy as np

from roboloc.checks.report import Caller, Check, Wrong, text

_PREDICT = ("x", "Sigma", "dt", "gravity", "restitution", "Q")
_CORRECT = ("x", "Sigma", "z", "R")
_STATE = ("px", "py", "vx", "vy")
_SHAPES = {"x": (4,), "Sigma": (4, 4)}
_NONE = np.zeros((4, 4))

# State, dt, gravity, restitution: in the air, after one impact, after three.
_STEPS = (
    ((0.3, 2.0, 1.0, -1.0), 0.3, 9.81, 0.8),
    ((0.3, 2.0, 1.0, -1.0), 0.9, 9.81, 0.8),
    ((0.0, 1.0, -0.5, 2.0), 2.0, 9.81, 0.7),
)


def _predict(caller: Caller, x, dt, gravity, e, Sigma=_NONE, Q=_NONE) -> tuple[np.ndarray, ...]:  # noqa: ANN001 - plain numbers
    x, Sigma, Q = (np.array(a, dtype=float) for a in (x, Sigma, Q))
    return caller((x, Sigma, float(dt), float(gravity), float(e), Q), _SHAPES)


def _correct(caller: Caller, *arguments) -> tuple[np.ndarray, ...]:  # noqa: ANN002 - plain numbers
    return caller(tuple(np.array(a, dtype=float) for a in arguments), _SHAPES)


def _covariance(seed: int, n: int = 4) -> np.ndarray:
    A = np.random.default_rng(seed).normal(size=(n, n)) + np.eye(n)
    return A @ A.T


def _told(x: tuple, dt: float, gravity: float, e: float) -> str:
    return f"From x = {text(x)}, with gravity {text(gravity)} and restitution {text(e)}, after {text(dt)} s"


def _thrown(name: str, x: tuple, dt: float, gravity: float, e: float, expected: tuple) -> Check:
    def check(caller: Caller) -> None:
        got, _ = _predict(caller, x, dt, gravity, e)
        if np.max(np.abs(got - expected)) > 1e-6:
            raise Wrong(f"{_told(x, dt, gravity, e)}:\nexpected x = {text(expected)}, got {text(got)}")

    return Check(name, check)


def _in_two_steps(caller: Caller) -> None:
    for x, dt, gravity, e in _STEPS:
        for part in (0.3, 0.6):
            once, Sigma = _predict(caller, x, dt, gravity, e, np.eye(4))
            half, between = _predict(caller, x, part * dt, gravity, e, np.eye(4))
            twice, after = _predict(caller, half, (1 - part) * dt, gravity, e, between)
            if np.max(np.abs(once - twice)) > 1e-6:
                raise Wrong(
                    f"{_told(x, dt, gravity, e)}, in one step:\nx = {text(once)}; in two steps, "
                    f"of {text(part * dt)} s and the rest: x = {text(twice)}"
                )
            if np.max(np.abs(Sigma - after)) > 1e-5 * np.max(np.abs(Sigma)):
                raise Wrong(
                    f"{_told(x, dt, gravity, e)}, from Sigma = I and with Q = 0:\nSigma is another one in one step "
                    "than in two."
                )


def _slopes(caller: Caller, x: tuple, dt: float, gravity: float, e: float) -> np.ndarray:
    """Differentiate the student's own mean by the state before: central differences."""
    step, columns = 1e-5, []
    for nudge in step * np.eye(4):
        there, _ = _predict(caller, x + nudge, dt, gravity, e)
        back, _ = _predict(caller, x - nudge, dt, gravity, e)
        columns.append((there - back) / (2 * step))
    return np.stack(columns, axis=1)


def _follows(which: int) -> Check:
    x, dt, gravity, e = _STEPS[which]

    def check(caller: Caller) -> None:
        slopes = _slopes(caller, x, dt, gravity, e)
        for i, name in enumerate(_STATE):
            alone = np.zeros((4, 4))
            alone[i, i] = 1.0
            _, Sigma = _predict(caller, x, dt, gravity, e, alone)
            wanted = np.outer(slopes[:, i], slopes[:, i])
            if np.max(np.abs(Sigma - wanted)) > 1e-5 * (1 + np.max(wanted)):
                raise Wrong(
                    f"{_told(x, dt, gravity, e)}:\na small change of {name} by d changes your own mean by d times "
                    f"{text(slopes[:, i])}.\nBut a doubt about {name} alone, of variance 1 and with Q = 0, becomes "
                    f"the variances {text(np.diag(Sigma))}\ninstead of the squares of these numbers, or their "
                    "covariances are others."
                )
        _, Sigma = _predict(caller, x, dt, gravity, e, _covariance(1))
        wanted = slopes @ _covariance(1) @ slopes.T
        if np.max(np.abs(Sigma - wanted)) > 1e-5 * np.max(np.abs(wanted)):
            raise Wrong(
                "Doubts about one number alone are carried as your own mean says, but not correlated ones."
            )

    return Check(
        f"Sigma follows the mean, {('in the air', 'through an impact', 'through three')[which]}", check
    )


def _noise(caller: Caller) -> None:
    for x, dt, gravity, e in _STEPS:
        Q = _covariance(2)
        _, without = _predict(caller, x, dt, gravity, e, np.eye(4))
        _, Sigma = _predict(caller, x, dt, gravity, e, np.eye(4), Q)
        if np.max(np.abs(Sigma - without - Q)) > 1e-8:
            raise Wrong("Q is what the step adds to Sigma at its end, as it is; yours adds something else.")


def _rests(caller: Caller) -> None:
    x, dt, gravity, e = (0.0, 1.0, 2.0, 0.5), 10.0, 9.81, 0.5
    got, Sigma = _predict(caller, x, dt, gravity, e, np.eye(4))
    if np.max(np.abs(got - (20.0, 0.0, 2.0, 0.0))) > 1e-6:
        raise Wrong(
            f"{_told(x, dt, gravity, e)} it lies on the ground and has slid on:\n"
            f"expected x = [20, 0, 2, 0], got {text(got)}"
        )
    if np.max(np.abs(Sigma[1::2])) > 1e-6:
        raise Wrong(
            f"{_told(x, dt, gravity, e)}, with Q = 0, it lies on the ground: nothing of py and vy is in doubt.\n"
            f"But Sigma = {text(Sigma)}"
        )


def _say_written(caller: Caller, names: tuple) -> None:
    for i in caller.written_to:
        raise Wrong(f"The function writes to its argument {names[i]}. Make a new array instead (no +=).")


def _predict_untouched(caller: Caller) -> None:
    for x, dt, gravity, e in _STEPS:
        _predict(caller, x, dt, gravity, e, np.eye(4), np.eye(4))
        _say_written(caller, _PREDICT)


PREDICT = (
    Check("returns x (4,), Sigma (4, 4)", lambda caller: _predict(caller, *_STEPS[0]) and None),
    _thrown("falls", (0, 5, 2, 0), 0.5, 10, 0.5, (1, 3.75, 2, -5)),
    _thrown("bounces once, to a quarter of the height", (0, 5, 2, 0), 1.5, 10, 0.5, (3, 1.25, 2, 0)),
    _thrown("bounces twice in one step", (0, 5, 2, 0), 2.25, 10, 0.5, (4.5, 0.3125, 2, 0)),
    _thrown("loses nothing with restitution 1", (1, 5, -1, 0), 2.5, 10, 1.0, (-1.5, 3.75, -1, -5)),
    _thrown("starts below the ground as on the ground", (0, -0.1, 0, -4), 0.2, 10, 0.5, (0, 0.2, 0, 0)),
    Check("two steps are one", _in_two_steps),
    *map(_follows, range(3)),
    Check("Q is added once", _noise),
    Check("comes to rest", _rests),
    Check("leaves its arguments as they were", _predict_untouched),
)
"""Checks of ``predict(x, Sigma, dt, gravity, restitution, Q) -> x, Sigma``."""

_BALL = (1.0, 2.0, 0.5, -3.0)
_LINKED = ((3.0, 0.0, 2.0, 0.0), (0.0, 1.0, 0.0, 1.0), (2.0, 0.0, 5.0, 0.0), (0.0, 1.0, 0.0, 4.0))


def _seen(name: str, story: str, given: tuple, x_after: tuple, Sigma_after: tuple) -> Check:
    def check(caller: Caller) -> None:
        x, Sigma = _correct(caller, *given)
        for key, wanted, got in (("x", x_after, x), ("Sigma", Sigma_after, Sigma)):
            if np.max(np.abs(np.array(wanted) - got)) > 1e-9:
                told = "\n".join(f"{key} = {text(value)}" for key, value in zip(_CORRECT, given, strict=True))
                raise Wrong(f"{story}\n{told}\nexpected {key} = {text(wanted)}\ngot      {key} = {text(got)}")

    return Check(name, check)


def _useless(caller: Caller) -> None:
    x, Sigma = _correct(caller, _BALL, _covariance(3), (4.0, -1.0), 1e12 * np.eye(2))
    if np.max(np.abs(x - _BALL)) > 1e-6 or np.max(np.abs(Sigma - _covariance(3))) > 1e-6:
        raise Wrong("With R = 1e12 times the identity the camera says nothing, but x or Sigma changed.")


def _sharp(caller: Caller) -> None:
    x, Sigma = _correct(caller, _BALL, _covariance(4), (4.0, 1.0), 1e-8 * np.eye(2))
    if np.max(np.abs(x[:2] - (4.0, 1.0))) > 1e-5 or np.max(np.abs(Sigma[:2])) > 1e-5:
        raise Wrong(
            "With R = 1e-8 times the identity the ball is where it was seen, and no doubt is left of that."
        )


def _as_expected(caller: Caller) -> None:
    x, _ = _correct(caller, _BALL, _covariance(5), _BALL[:2], np.eye(2))
    if np.max(np.abs(x - _BALL)) > 1e-9:
        raise Wrong(
            f"The ball is seen just where it was expected, at {text(_BALL[:2])}, but x changed to {text(x)}."
        )


def _both_or_one_by_one(caller: Caller) -> None:
    before, z, R = _covariance(6), (2.0, 1.0), np.diag((0.5, 1.5))
    both, together = _correct(caller, _BALL, before, z, R)
    first, between = _correct(caller, _BALL, before, z, np.diag((0.5, 1e14)))
    second, after = _correct(caller, first, between, z, np.diag((1e14, 1.5)))
    if np.max(np.abs(both - second)) > 1e-5 or np.max(np.abs(together - after)) > 1e-5:
        raise Wrong(
            "A camera that sees px alone and then one that sees py alone should tell what one tells that sees both,\n"
            f"if their errors are independent. Both: x = {text(both)}; one by one: x = {text(second)}."
        )


def _is_covariance(caller: Caller) -> None:
    for seed in range(7, 12):
        before = _covariance(seed)
        _, Sigma = _correct(caller, _BALL, before, (2.0, 1.0), _covariance(seed, 2))
        if np.max(np.abs(Sigma - Sigma.T)) > 1e-9:
            raise Wrong(f"Sigma should equal its transpose, got {text(Sigma)}")
        if np.linalg.eigvalsh(Sigma)[0] < -1e-9 or np.linalg.eigvalsh(before - Sigma)[0] < -1e-9:
            raise Wrong(
                "In some direction the variance is negative, or larger than before: looking takes no knowledge away."
            )


def _correct_untouched(caller: Caller) -> None:
    _correct(caller, _BALL, _covariance(12), (2.0, 1.0), np.eye(2))
    _say_written(caller, _CORRECT)


CORRECT = (
    Check(
        "returns x (4,), Sigma (4, 4)",
        lambda caller: _correct(caller, _BALL, np.eye(4), (1.0, 2.0), np.eye(2)) and None,
    ),
    _seen(
        "the velocity is corrected along",
        "Place and velocity are correlated, in each direction for itself:",
        ((0.0, 5.0, 0.0, 0.0), _LINKED, (4.0, 7.0), np.eye(2)),
        (3.0, 6.0, 2.0, 1.0),
        ((0.75, 0, 0.5, 0), (0, 0.5, 0, 0.5), (0.5, 0, 4.0, 0), (0, 0.5, 0, 3.5)),
    ),
    _seen(
        "a ball may be a little below the ground",
        "Expected on the ground, and seen 2 cm below it:",
        ((0.0, 0.0, 1.0, -1.0), np.eye(4), (0.0, -0.02), np.eye(2)),
        (0.0, -0.01, 1.0, -1.0),
        np.diag((0.5, 0.5, 1.0, 1.0)),
    ),
    Check("seen as expected, the ball stays", _as_expected),
    Check("a useless camera changes nothing", _useless),
    Check("a sharp camera is believed", _sharp),
    Check("two numbers together are two one by one", _both_or_one_by_one),
    Check("Sigma is symmetric and grows in no direction", _is_covariance),
    Check("leaves its arguments as they were", _correct_untouched),
)
"""Checks of ``correct(x, Sigma, z, R) -> x, Sigma``."""
