r"""How far a filter is off, and whether it knows.

A filter makes two statements, a mean and a covariance. With the error e = x - truth and the innovation v of
covariance S, the normalized squares

.. math:: \mathrm{NEES} = e^T \Sigma^{-1} e, \qquad \mathrm{NIS} = v^T S^{-1} v

of an honest filter are distributed as chi-squared, with as many degrees of freedom as e or v has entries. Too
large: the filter is surer than it may be; too small: it knows more than it says. The NEES needs the truth, so
it is for simulations; the NIS needs nothing that a filter does not have.

What a Gaussian claims is drawn as the ellipse that holds the position with a given probability.

Source: Y. Bar-Shalom, X. R. Li, T. Kirubarajan, *Estimation with Applications to Tracking and Navigation*,
section 5.4; the book, *Is the filter honest*.
"""

from math import atan2, log1p

import numpy as np
from numpy.typing import ArrayLike

from roboloc.angles import wrap
from roboloc.validation import as_array, as_number


def pose_error(x: ArrayLike, truth: ArrayLike) -> np.ndarray:
    """Return x - truth, the heading on the circle.

    Parameters
    ----------
    x : (3,) or (N, 3) array_like
        Poses [m, m, rad].
    truth : (3,) or (N, 3) array_like
        The true ones, in the same shape.

    Returns
    -------
    (3,) or (N, 3) ndarray
        Errors [m, m, rad], the last entry in [-pi, pi).

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite.

    Examples
    --------
    A heading of 359 degrees where it should be 1 degree is wrong by 2 degrees, to the right.

    >>> error = pose_error([1.5, 2.0, np.radians(359.0)], [1.0, 2.0, np.radians(1.0)])
    >>> error[:2].tolist(), round(float(np.degrees(error[2])), 9)
    ([0.5, 0.0], -2.0)
    """
    shape = (3,) if np.ndim(x) == 1 else ("N", 3)
    x = as_array("x", x, shape)
    truth = as_array("truth", truth, x.shape)
    error = x - truth
    error[..., 2] = wrap(error[..., 2])
    return error


def nees(error: ArrayLike, Sigma: ArrayLike) -> float | np.ndarray:
    """Return the normalized estimation error squared.

    Parameters
    ----------
    error : (n,) or (N, n) array_like
        Estimate minus truth, angles wrapped.
    Sigma : (n, n) or (N, n, n) array_like
        Covariance that the filter claims, positive definite.

    Returns
    -------
    float or (N,) ndarray
        Error in standard deviations, squared and summed over the directions.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, or if Sigma is singular.

    Examples
    --------
    A filter that is 2 cm off and claims 1 cm is off by two standard deviations.

    >>> round(nees([0.02, 0.0], np.diag([0.01**2, 0.01**2])), 9)
    4.0
    """
    return _normalized_square("error", error, "Sigma", Sigma)


def nis(v: ArrayLike, S: ArrayLike) -> float | np.ndarray:
    """Return the normalized innovation squared.

    Parameters
    ----------
    v : (k,) or (N, k) array_like
        Innovation, angles wrapped. Nothing observed (k = 0) gives 0.
    S : (k, k) or (N, k, k) array_like
        Its covariance, positive definite.

    Returns
    -------
    float or (N,) ndarray
        Innovation in standard deviations, squared and summed over the directions.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, or if S is singular.

    Examples
    --------
    A wall seen 3 cm nearer than predicted, give or take 1 cm, is three standard deviations off.

    >>> round(nis([-0.03], [[0.01**2]]), 9)
    9.0
    """
    return _normalized_square("v", v, "S", S)


def chi2_band(dof: int, probability: float, runs: int = 1) -> tuple[float, float]:
    """Return the band in which the mean of independent chi-squared numbers lies.

    Parameters
    ----------
    dof : int
        Degrees of freedom of each number, positive.
    probability : float
        Probability of the band, between 0 and 1; as much is left out below as above.
    runs : int
        How many numbers the mean is of, positive.

    Returns
    -------
    low, high : float
        Ends of the band.

    Raises
    ------
    ValueError
        If an argument is outside these limits.

    Examples
    --------
    The NEES of one pose is below 9.35 in 39 runs of 40; the mean over 50 runs hardly leaves 3.

    >>> [round(end, 2) for end in chi2_band(3, 0.95)]
    [0.22, 9.35]
    >>> [round(end, 2) for end in chi2_band(3, 0.95, runs=50)]
    [2.36, 3.72]
    """
    from scipy.special import chdtri  # noqa: PLC0415  (roboloc imports without SciPy)

    dof, runs = as_number("dof", dof), as_number("runs", runs)
    for name, value in (("dof", dof), ("runs", runs)):
        if value <= 0.0:
            raise ValueError(f"{name}: expected a positive number, got {value}")
    probability = _as_probability(probability)
    # The sum over the runs is chi-squared too, with all degrees of freedom; chdtri inverts the upper tail.
    outside = (1.0 - probability) / 2.0
    low, high = (float(chdtri(dof * runs, tail)) / runs for tail in (1.0 - outside, outside))
    return low, high


def credible_ellipse(Sigma: ArrayLike, probability: float = 0.95) -> tuple[np.ndarray, float]:
    """Return the ellipse about the mean that holds a position in the plane with a given probability.

    The squared Mahalanobis distance of a Gaussian in the plane exceeds d2 with probability exp(-d2 / 2),
    which gives the size; the eigenvectors of the covariance give the axes.

    Parameters
    ----------
    Sigma : (2, 2) array_like
        Covariance of the position, symmetric [m^2]. A variance that rounding made negative counts as 0.
    probability : float
        Between 0 and 1, both excluded.

    Returns
    -------
    half_axes : (2,) ndarray
        From the middle to the outline along either axis, the longer first [m].
    angle : float
        Direction of the longer axis, in [-pi / 2, pi / 2) [rad].

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, or if the probability is not between 0 and 1.

    Examples
    --------
    A position known to 0.1 m east and 0.2 m north is, with a probability of 95 percent, in an ellipse that reaches
    0.49 m to the north and 0.24 m to the east: 2.45 standard deviations, not 1.96 as for one number.

    >>> half_axes, angle = credible_ellipse(np.diag([0.1**2, 0.2**2]))
    >>> half_axes.round(2).tolist(), abs(round(float(np.degrees(angle)), 9))
    ([0.49, 0.24], 90.0)
    """
    Sigma = as_array("Sigma", Sigma, (2, 2))
    d2 = -2.0 * log1p(-_as_probability(probability))
    variances, axes = np.linalg.eigh(Sigma)
    x, y = axes[:, 1]
    return np.sqrt(d2 * np.maximum(variances[::-1], 0.0)), wrap(2.0 * atan2(y, x)) / 2.0


def _as_probability(probability: float) -> float:
    probability = as_number("probability", probability)
    if not 0.0 < probability < 1.0:
        raise ValueError(f"probability: expected a number between 0 and 1, got {probability}")
    return probability


def _normalized_square(name: str, v: ArrayLike, name_S: str, S: ArrayLike) -> float | np.ndarray:
    one = np.ndim(v) == 1
    v = as_array(name, v, ("n",) if one else ("N", "n"))
    S = as_array(name_S, S, (*v.shape, v.shape[-1]))
    try:
        scaled = np.linalg.solve(S, v[..., None])[..., 0]
    except np.linalg.LinAlgError as error:
        raise ValueError(f"{name_S}: expected a positive definite matrix, got a singular one") from error
    d2 = np.sum(v * scaled, axis=-1)
    return float(d2) if one else d2
