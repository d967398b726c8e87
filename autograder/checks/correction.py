r"""Hidden checks of the update in the notebook *association-and-update*.

There are many right ways to condition a Gaussian: by a gain, by information matrices, by square roots. On
updates of ordinary size they agree to about ten digits, and that is what is compared. One check is another:
two observations of nearly the same thing, far sharper than the prior. There

.. math:: \Sigma - K S K^T \quad\text{and}\quad (I - K H) \Sigma

are off by the rounding of K times the size of the prior, which is more than what is left of the variance, and
a variance becomes negative. Joseph's form and square roots cannot do that, and so the check does not look at
digits but at the smallest eigenvalue: below -10 n eps times the norm of the prior, it is no covariance.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from autograder.check import Case, Check, Stage, remembered
from autograder.checks.association_inputs import covariance
from autograder.checks.kinds import each, repeatable, untouched
from autograder.compare import pick, read
from roboloc_reference.gaussian import measurement_update

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.random import Generator

_EPS = np.finfo(float).eps
_RELATIVE = 1e-11
_SHARP = 12


def update_tolerance(
    x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, Q: np.ndarray, H: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Bound the error of x and Sigma that rounding may cause, in the units of each entry."""
    size = np.sqrt(np.diag(Sigma))
    S = H @ Sigma @ H.T + Q
    surprise = float(np.sqrt(z @ np.linalg.solve(S, z))) if len(z) else 0.0
    return _RELATIVE * (np.abs(x) + (1 + surprise) * size), _RELATIVE * np.outer(size, size)


def _update_case(rng: Generator, n: int, k: int) -> Case:
    """Make an update whose prior and observation matter about equally, and whose numbers are of any sign."""
    while True:
        scales = rng.uniform(0.5, 2.0, n)
        Sigma = covariance(rng, n) * np.outer(scales, scales)
        Q = covariance(rng, k) * rng.uniform(0.5, 2.0) if k else np.zeros((0, 0))
        H = rng.uniform(0.3, 1.5, (k, n)) * rng.choice([-1, 1], (k, n))
        P = H @ Sigma @ H.T
        S = P + Q
        parts = (Sigma, Q, S, P) if k <= n else (Sigma, Q, S)
        if all(np.linalg.cond(part) < 1e3 for part in parts if part.size):
            break
    z = rng.uniform(0.3, 1.5, k) * rng.choice([-1, 1], k)
    return _case(rng.uniform(-3, 3, n), Sigma, z, Q, H)


def _case(*args: np.ndarray) -> Case:
    return UPDATE.case(*args)


@remembered
def scalar(rng: Generator) -> list[Case]:
    """Make updates of one number by one number."""
    return [_update_case(rng, 1, 1) for _ in range(3)]


@remembered
def poses(rng: Generator) -> list[Case]:
    """Make updates of a pose by one line, by one number, and by two lines at once."""
    return [_update_case(rng, 3, k) for k in (2, 3, 1, 4)]


@remembered
def sizes(rng: Generator) -> list[Case]:
    """Make updates of states with 2, 5 and 9 numbers."""
    return [_update_case(rng, n, k) for n, k in ((2, 2), (5, 4), (9, 6))]


@remembered
def unobserved(rng: Generator) -> list[Case]:
    """Make updates by no line."""
    return [_update_case(rng, n, 0) for n in (3, 5)]


def short_form(x: np.ndarray, Sigma: np.ndarray, z: np.ndarray, Q: np.ndarray, H: np.ndarray) -> tuple:
    """Subtract K S K^T from Sigma: right on paper."""
    S = H @ Sigma @ H.T + Q
    K = np.linalg.solve(S, H @ Sigma).T
    return x + K @ z, Sigma - K @ S @ K.T


def _lost(args: tuple, Sigma: np.ndarray) -> bool:
    """Tell whether a result is no covariance: an eigenvalue below zero by more than rounding."""
    smallest = np.linalg.eigvalsh((Sigma + Sigma.T) / 2)[0]
    return bool(smallest < -10 * len(Sigma) * _EPS * np.linalg.norm(args[1], 2))


def ill_conditioned(args: tuple) -> bool:
    """Tell whether an update is one of those whose digits are not compared."""
    *_, Sigma, _, Q, H = args
    return bool(Q.size and np.linalg.cond(H @ Sigma @ H.T + Q) > 1e6)


@remembered
def sharp(rng: Generator) -> list[Case]:
    """Make updates by two sharp observations of nearly the same thing; the innovation is 0, and x stays."""
    cases: list[Case] = []
    while len(cases) < _SHARP:
        n = (3, 4, 6)[len(cases) % 3]
        Sigma = covariance(rng, n)
        h = rng.normal(size=n)
        H = h / np.linalg.norm(h) + 1e-4 * rng.normal(size=(2, n))
        case = _case(rng.uniform(-3, 3, n), Sigma, np.zeros(2), 1e-13 * np.eye(2), H)
        _, _, _, _, H = case.args
        K = np.linalg.solve(H @ Sigma @ H.T + case.args[3], H @ Sigma).T
        short = (short_form(*case.args)[1], (np.eye(n) - K @ H) @ Sigma)
        if all(_lost(case.args, form) for form in short):
            cases.append(case)
    return cases


def _stays_a_covariance(function: Callable[..., Any], rng: Generator) -> None:
    lost = 0
    cases = sharp(rng)
    for case in cases:
        returned = function(*case.fresh())
        n = len(case.args[0])
        Sigma = read(pick(UPDATE, case.args, returned, "Sigma"), "Sigma", (n, n))
        scale = np.linalg.norm(case.args[1], 2)
        if np.abs(Sigma - case.expected[1]).max() > 0.1 * scale:
            raise AssertionError("Sigma is far from right where the observations are sharp and nearly alike")
        lost += _lost(case.args, Sigma)
    if lost:
        raise AssertionError(
            f"Sigma has a negative eigenvalue in {lost} of {len(cases)} updates by sharp observations of nearly "
            "the same thing: a negative variance, by more than rounding"
        )


_HINT_MEAN = "z is an innovation already; the gain K says how far the mean follows it."
_HINT_SIGMA = "S is the covariance of the innovation: of what is expected, and of what is observed."
_ARGUMENTS = ("x", "Sigma", "z", "Q", "H")
_BOTH = frozenset({"x", "Sigma"})

UPDATE = Stage(
    name="gaussian.measurement_update",
    outputs=("x", "Sigma"),
    reference=measurement_update,
    tolerance=update_tolerance,
    checks=(
        Check(
            "one number, observed once",
            2,
            each(scalar),
            "Two opinions, each with a variance: where do they meet?",
        ),
        Check("mean of a pose", 5, each(poses, "x"), _HINT_MEAN),
        Check("covariance of a pose", 5, each(poses, "Sigma"), _HINT_SIGMA),
        Check(
            "states of another size", 2, each(sizes), "Nothing in this step knows that a pose has 3 numbers."
        ),
        Check("no observation", 1, each(unobserved), "An update by nothing changes nothing."),
        Check(
            "a covariance stays one",
            2,
            _stays_a_covariance,
            "A sum of two products A P A^T can have no negative variance; a difference can.",
        ),
        Check(
            "arguments untouched",
            1.5,
            untouched(poses, _ARGUMENTS, _BOTH),
            "x += ... writes into the caller's array; x = x + ... does not.",
        ),
        Check(
            "same call, same result",
            1.5,
            repeatable(poses, _BOTH),
            "Use the arguments alone, nothing global.",
        ),
    ),
)

STAGES = (UPDATE,)
