"""Wrong versions of `mcl.compute_innovations`: of which line is which for each particle."""

from __future__ import annotations

import numpy as np

from autograder.misconceptions.model import Misconception
from roboloc.angles import wrap
from roboloc_reference.mcl import compute_innovations

_STAGE = "mcl.compute_innovations"


def _all(z_raw: np.ndarray, hs: np.ndarray, *, wrapping: bool = True) -> np.ndarray:
    """Return z - h for all pairs, (M, I, J, 2)."""
    v = z_raw.T[None, :, None, :] - hs.transpose(0, 2, 1)[:, None]
    if wrapping:
        v[..., 0] = wrap(v[..., 0])
    return v


def _chosen(v: np.ndarray, d2: np.ndarray) -> np.ndarray:
    nearest = np.take_along_axis(v, d2.argmin(axis=2)[..., None, None], axis=2)
    return nearest.reshape(len(v), -1)


def _forms(v: np.ndarray, S: np.ndarray) -> np.ndarray:
    return np.einsum("mija,iab,mijb->mij", v, S, v)


def not_wrapped(z_raw: np.ndarray, Q_raw: np.ndarray, hs: np.ndarray) -> np.ndarray:
    """Subtract angles as numbers."""
    v = _all(z_raw, hs, wrapping=False)
    return _chosen(v, _forms(v, np.linalg.inv(Q_raw)))


def expected_minus_seen(z_raw: np.ndarray, Q_raw: np.ndarray, hs: np.ndarray) -> np.ndarray:
    """Return h - z."""
    return -compute_innovations(z_raw, Q_raw, hs)


def euclidean(z_raw: np.ndarray, _: np.ndarray, hs: np.ndarray) -> np.ndarray:
    """Judge by radians and metres alike."""
    v = _all(z_raw, hs)
    return _chosen(v, np.sum(v * v, axis=-1))


def covariance_not_inverted(z_raw: np.ndarray, Q_raw: np.ndarray, hs: np.ndarray) -> np.ndarray:
    """Judge by v^T Q v."""
    v = _all(z_raw, hs)
    return _chosen(v, _forms(v, Q_raw))


def covariance_of_the_first(z_raw: np.ndarray, Q_raw: np.ndarray, hs: np.ndarray) -> np.ndarray:
    """Judge every observation by the covariance of the first."""
    return compute_innovations(z_raw, np.broadcast_to(Q_raw[:1], Q_raw.shape), hs)


def choice_of_the_first(z_raw: np.ndarray, Q_raw: np.ndarray, hs: np.ndarray) -> np.ndarray:
    """Give the lines to the observations once, for the first particle."""
    v = _all(z_raw, hs)
    d2 = _forms(v, np.linalg.inv(Q_raw))
    return _chosen(v, np.broadcast_to(d2[:1], d2.shape))


def angles_first(z_raw: np.ndarray, Q_raw: np.ndarray, hs: np.ndarray) -> np.ndarray:
    """Return all angles, then all distances."""
    vs = compute_innovations(z_raw, Q_raw, hs)
    return np.concatenate([vs[:, ::2], vs[:, 1::2]], axis=1)


def gated(z_raw: np.ndarray, Q_raw: np.ndarray, hs: np.ndarray) -> np.ndarray:
    """Set to 0 what is beyond three standard deviations."""
    vs = np.array(compute_innovations(z_raw, Q_raw, hs)).reshape(len(hs), -1, 2)
    d2 = np.einsum("mia,iab,mib->mi", vs, np.linalg.inv(Q_raw), vs)
    vs[d2 > 9] = 0.0
    return vs.reshape(len(hs), -1)


MISCONCEPTIONS = (
    Misconception(
        "angles subtracted as numbers",
        _STAGE,
        "Both angles are inside one turn, and so it seems that their difference is. Near the end of the turn it "
        "is almost a whole one, and the particle that is right is judged to be the farthest off.",
        "How far apart are 3.1 and -3.1 rad?",
        not_wrapped,
    ),
    Misconception(
        "expected minus seen",
        _STAGE,
        "The weights are the same for v and -v, so nothing shows in this filter. Everything else in the course "
        "means z - h.",
        "Which is the innovation: what the observation adds to the expectation, or the reverse?",
        expected_minus_seen,
    ),
    Misconception(
        "radians and metres alike",
        _STAGE,
        "The nearest line by eye is that of the least distance. A tenth of a radian and a tenth of a metre are "
        "not equally unlikely.",
        "What do you divide by, so that both numbers are counted in standard deviations?",
        euclidean,
    ),
    Misconception(
        "covariance not inverted",
        _STAGE,
        "v^T Q v has the right shape and no inverse to compute. It counts most where the scanner knows least.",
        "The scanner becomes worse at angles. Should an error of the angle count more, or less?",
        covariance_not_inverted,
    ),
    Misconception(
        "one covariance for all observations",
        _STAGE,
        "Lines of one scanner seem to be equally good. A long wall gives a better line than a short one.",
        "How many covariances does Q_raw hold?",
        covariance_of_the_first,
    ),
    Misconception(
        "one association for the whole cloud",
        _STAGE,
        "The robot is in one place, so each wall it sees is one wall. But each particle is another guess of that "
        "place, and has another wall in front of it.",
        "Two particles are in opposite corners: which wall do they expect ahead?",
        choice_of_the_first,
    ),
    Misconception(
        "angles first, then distances",
        _STAGE,
        "Joining the two rows is the easiest way to 2I numbers. Who reads the vector expects each observation's "
        "two numbers side by side.",
        "Write down row 0 for two observations by hand.",
        angles_first,
    ),
    Misconception(
        "gated",
        _STAGE,
        "In the EKF an observation that fits nothing is dropped. Here that rewards the particle that explains "
        "nothing: its innovation becomes 0, the best there is.",
        "Two particles see a line; for one of them it is 2 standard deviations off, for the other 20. Who is to "
        "win?",
        gated,
    ),
)
