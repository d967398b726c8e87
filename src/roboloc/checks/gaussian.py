"""Public checks of the prediction and the correction of a Gaussian belief: worked numbers and laws."""

import numpy as np

from roboloc.checks.report import Caller, Check, Wrong, text

_NAMES = ("g", "Gx", "Gu", "Sigma", "R", "dt")


def _call(caller: Caller, g, Gx, Gu, Sigma, R, dt) -> tuple[np.ndarray, ...]:  # noqa: ANN001 - plain numbers
    arrays = tuple(np.array(a, dtype=float) for a in (g, Gx, Gu, Sigma, R))
    n = len(g)
    return caller((*arrays, float(dt)), {"x": (n,), "Sigma": (n, n)})


def _random(n: int, seed: int) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(seed)
    A, B = rng.normal(size=(n, n)), rng.normal(size=(2, 2))
    return rng.normal(size=n), rng.normal(size=(n, n)), rng.normal(size=(n, 2)), A @ A.T, B @ B.T


def _returns(caller: Caller) -> None:
    Gu = ((0.1, 0.0), (0.0, 0.0), (0.0, 0.1))
    _call(caller, (1.0, 2.0, 0.3), np.eye(3), Gu, np.eye(3), np.eye(2), 0.1)


def _mean(caller: Caller) -> None:
    for seed in (1, 2):
        g, Gx, Gu, Sigma, R = _random(3, seed)
        x, _ = _call(caller, g, Gx, Gu, Sigma, R, 0.1)
        if np.max(np.abs(x - g)) > 1e-12:
            raise Wrong(f"g = {text(g)} is the mean after the motion already, but x is {text(x)}.")


def _worked(name: str, story: str, expected: tuple, **arguments: tuple) -> Check:
    def check(caller: Caller) -> None:
        n = len(arguments["Gx"])
        _, Sigma = _call(caller, np.zeros(n), **arguments)
        if np.max(np.abs(Sigma - np.array(expected))) > 1e-9:
            given = "\n".join(f"{key} = {text(value)}" for key, value in arguments.items())
            raise Wrong(
                f"{story}\n{given}\nexpected Sigma = {text(expected)}\ngot      Sigma = {text(Sigma)}"
            )

    return Check(name, check)


def _duration(caller: Caller) -> None:
    g, Gx, Gu, Sigma, R = _random(3, 3)
    _, at_0 = _call(caller, g, Gx, Gu, Sigma, R, 0.0)
    _, at_1 = _call(caller, g, Gx, Gu, Sigma, R, 0.2)
    _, at_2 = _call(caller, g, Gx, Gu, Sigma, R, 0.4)
    if np.max(np.abs(at_1 - at_0)) < 1e-12:
        raise Wrong("Sigma is the same for dt = 0 and dt = 0.2. The noise of the control grows with time.")
    if np.max(np.abs((at_2 - at_0) - 2.0 * (at_1 - at_0))) > 1e-9:
        raise Wrong(
            "With the same Gu, twice the time dt should add twice the noise; yours adds another multiple."
        )


def _covariance(caller: Caller) -> None:
    for seed in range(4, 9):
        _, Sigma = _call(caller, *_random(3, seed), 0.1)
        if np.max(np.abs(Sigma - Sigma.T)) > 1e-9:
            raise Wrong(f"Sigma should equal its transpose, got {text(Sigma)}")
        smallest = np.linalg.eigvalsh(Sigma)[0]
        if smallest < -1e-9:
            raise Wrong(f"A variance is negative in some direction: {text(smallest)}, in {text(Sigma)}")


def _sizes(caller: Caller) -> None:
    for n in (2, 5):
        _call(caller, *_random(n, n), 0.1)


def _untouched(caller: Caller) -> None:
    _call(caller, *_random(3, 9), 0.1)
    for i in caller.written_to:
        raise Wrong(f"The function writes to its argument {_NAMES[i]}. Make a new array instead (no +=).")


TRANSITION_UPDATE = (
    Check("returns x (n,), Sigma (n, n)", _returns),
    Check("the new mean is g", _mean),
    _worked(
        "a doubtful heading makes the position doubtful",
        "Only the heading is in doubt, by 0.1 rad, and the robot has driven by 2 in x and 1 in y:",
        Gx=((1.0, 0.0, -1.0), (0.0, 1.0, 2.0), (0.0, 0.0, 1.0)),
        Gu=((0.0, 0.0), (0.0, 0.0), (0.0, 0.0)),
        Sigma=((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.01)),
        R=((0.1, 0.0), (0.0, 0.1)),
        dt=1.0,
        expected=((0.01, -0.02, -0.01), (-0.02, 0.04, 0.02), (-0.01, 0.02, 0.01)),
    ),
    _worked(
        "a doubtful control makes the pose doubtful",
        "The pose was certain; the speed is not, and neither is the turning rate:",
        Gx=((1.0, 0.0, 0.0), (0.0, 1.0, 2.0), (0.0, 0.0, 1.0)),
        Gu=((1.0, 0.0), (0.0, 0.5), (0.0, 1.0)),
        Sigma=((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
        R=((0.04, 0.0), (0.0, 0.16)),
        dt=1.0,
        expected=((0.04, 0.0, 0.0), (0.0, 0.04, 0.08), (0.0, 0.08, 0.16)),
    ),
    _worked(
        "everything at once, correlations included",
        "By hand, with whole numbers and half a second:",
        Gx=((1.0, 0.0, -1.0), (0.0, 1.0, 2.0), (0.0, 0.0, 1.0)),
        Gu=((1.0, 0.0), (2.0, 1.0), (0.0, 1.0)),
        Sigma=((4.0, 1.0, 0.0), (1.0, 2.0, 1.0), (0.0, 1.0, 3.0)),
        R=((2.0, 1.0), (1.0, 3.0)),
        dt=0.5,
        expected=((8.0, -3.5, -2.5), (-3.5, 25.5, 9.5), (-2.5, 9.5, 4.5)),
    ),
    Check("the noise grows with dt", _duration),
    Check("Sigma is symmetric and no variance is negative", _covariance),
    Check("works for states of any size", _sizes),
    Check("leaves its arguments as they were", _untouched),
)
"""Checks of ``transition_update(g, Gx, Gu, Sigma, R, dt) -> x, Sigma``."""


_UPDATE_NAMES = ("x", "Sigma", "z", "Q", "H")


def _correct(caller: Caller, x, Sigma, z, Q, H) -> tuple[np.ndarray, ...]:  # noqa: ANN001 - plain numbers
    n, k = len(x), len(z)
    shapes = ((n,), (n, n), (k,), (k, k), (k, n))
    given = tuple(
        np.array(a, dtype=float).reshape(s) for a, s in zip((x, Sigma, z, Q, H), shapes, strict=True)
    )
    return caller(given, {"x": (n,), "Sigma": (n, n)})


def _observation(n: int, k: int, seed: int) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(n, n)) + np.eye(n)
    return (
        rng.normal(size=n),
        A @ A.T,
        rng.normal(size=k),
        np.diag(rng.uniform(0.2, 2.0, k)),
        rng.normal(size=(k, n)),
    )


def _update_returns(caller: Caller) -> None:
    _correct(caller, (1.0, 2.0, 0.3), np.eye(3), (0.1, 0.2), np.eye(2), ((1.0, 0.0, 0.0), (1.0, 1.0, 0.0)))


def _by_hand(name: str, story: str, x_after: tuple, Sigma_after: tuple, **arguments: tuple) -> Check:
    def check(caller: Caller) -> None:
        x, Sigma = _correct(caller, **arguments)
        for key, wanted, got in (("x", x_after, x), ("Sigma", Sigma_after, Sigma)):
            if np.max(np.abs(np.array(wanted) - got)) > 1e-9:
                given = "\n".join(f"{name} = {text(value)}" for name, value in arguments.items())
                raise Wrong(
                    f"{story}\n{given}\nexpected {key} = {text(wanted)}\ngot      {key} = {text(got)}"
                )

    return Check(name, check)


def _useless(caller: Caller) -> None:
    x, Sigma, z, _, H = _observation(3, 2, 1)
    after, shrunk = _correct(caller, x, Sigma, z, 1e12 * np.eye(2), H)
    if np.max(np.abs(after - x)) > 1e-6 or np.max(np.abs(shrunk - Sigma)) > 1e-6:
        raise Wrong("With Q = 1e12 times the identity the observation says nothing, but x or Sigma changed.")


def _sharp(caller: Caller) -> None:
    x, Sigma, z, _, H = _observation(3, 2, 2)
    after, shrunk = _correct(caller, x, Sigma, z, 1e-8 * np.eye(2), H)
    if np.max(np.abs(H @ (after - x) - z)) > 1e-5:
        raise Wrong("With Q = 1e-8 times the identity the mean should move until the innovation is used up.")
    if np.max(np.abs(H @ shrunk @ H.T)) > 1e-5:
        raise Wrong(
            "With Q = 1e-8 times the identity nothing is left in doubt of what was observed, but Sigma says so."
        )


def _one_by_one(caller: Caller) -> None:
    x, Sigma, z, Q, H = _observation(3, 2, 3)
    both, together = _correct(caller, x, Sigma, z, Q, H)
    first, between = _correct(caller, x, Sigma, z[:1], Q[:1, :1], H[:1])
    left = z[1:] - H[1:] @ (first - x)
    second, after = _correct(caller, first, between, left, Q[1:, 1:], H[1:])
    if np.max(np.abs(both - second)) > 1e-8 or np.max(np.abs(together - after)) > 1e-8:
        raise Wrong(
            "Two observations with independent errors, used together or one after the other, should give the same\n"
            f"belief. Together x = {text(both)}, one by one x = {text(second)}."
        )


def _shrinks(caller: Caller) -> None:
    for seed in range(4, 9):
        arguments = _observation(3, 2, seed)
        _, Sigma = _correct(caller, *arguments)
        if np.max(np.abs(Sigma - Sigma.T)) > 1e-9:
            raise Wrong(f"Sigma should equal its transpose, got {text(Sigma)}")
        if np.linalg.eigvalsh(Sigma)[0] < -1e-9:
            raise Wrong(f"A variance is negative in some direction, in {text(Sigma)}")
        if np.linalg.eigvalsh(arguments[1] - Sigma)[0] < -1e-9:
            raise Wrong(
                "In some direction the variance is larger than before; an observation never takes knowledge away."
            )


def _stays(caller: Caller) -> None:
    rng = np.random.default_rng(10)
    for _ in range(20):
        A, h = rng.normal(size=(4, 4)) + np.eye(4), rng.normal(size=4)
        H = h + 1e-4 * rng.normal(size=(2, 4))
        _, Sigma = _correct(caller, np.zeros(4), A @ A.T, (0.0, 0.0), 1e-13 * np.eye(2), H)
        smallest = np.linalg.eigvalsh((Sigma + Sigma.T) / 2)[0]
        if smallest < -1e-14 * np.linalg.norm(A @ A.T, 2):
            raise Wrong(
                "Two sharp observations (Q = 1e-13 times the identity) of nearly the same thing:\n"
                f"Sigma gets the negative eigenvalue {text(smallest)}, by more than rounding. A difference of two\n"
                "large matrices can do that; a sum of products A P A^T cannot."
            )


def _nothing(caller: Caller) -> None:
    x, Sigma, _, _, _ = _observation(3, 1, 11)
    after, same = _correct(caller, x, Sigma, (), np.zeros((0, 0)), np.zeros((0, 3)))
    if np.max(np.abs(after - x)) > 1e-12 or np.max(np.abs(same - Sigma)) > 1e-12:
        raise Wrong("Without an observation (k = 0) the belief should stay as it is.")


def _update_sizes(caller: Caller) -> None:
    for n, k in ((2, 1), (5, 4), (3, 6)):
        _correct(caller, *_observation(n, k, n))


def _update_untouched(caller: Caller) -> None:
    _correct(caller, *_observation(3, 2, 12))
    for i in caller.written_to:
        raise Wrong(
            f"The function writes to its argument {_UPDATE_NAMES[i]}. Make a new array instead (no +=)."
        )


MEASUREMENT_UPDATE = (
    Check("returns x (n,), Sigma (n, n)", _update_returns),
    _by_hand(
        "two opinions meet, weighted by what they know",
        "The prior says 10 with variance 4, the observation 15 with variance 1, so the innovation is 5:",
        x=(10.0,),
        Sigma=((4.0,),),
        z=(5.0,),
        Q=((1.0,),),
        H=((1.0,),),
        x_after=(14.0,),
        Sigma_after=((0.8,),),
    ),
    _by_hand(
        "what is correlated is corrected along",
        "Only the first number is observed, and the second varies with it:",
        x=(0.0, 0.0),
        Sigma=((3.0, 2.0), (2.0, 5.0)),
        z=(4.0,),
        Q=((1.0,),),
        H=((1.0, 0.0),),
        x_after=(3.0, 2.0),
        Sigma_after=((0.75, 0.5), (0.5, 4.0)),
    ),
    Check("a useless observation changes nothing", _useless),
    Check("a sharp observation is believed", _sharp),
    Check("two observations together are two one by one", _one_by_one),
    Check("Sigma is symmetric and grows in no direction", _shrinks),
    Check("no variance becomes negative", _stays),
    Check("no observation changes nothing", _nothing),
    Check("works for states and observations of any size", _update_sizes),
    Check("leaves its arguments as they were", _update_untouched),
)
"""Checks of ``measurement_update(x, Sigma, z, Q, H) -> x, Sigma``."""
