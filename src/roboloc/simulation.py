"""Simulated motion: the truth that a filter tries to recover.

The robot holds a control [V, omega] for a step of length dt and moves by the exponential of SE(2), exactly.
What it was told and what it does differ by the control noise. The noise model is the handout's, whose
prediction adds dt Gu R Gu^T: in each step one control error is drawn with covariance dt R.

Source: Stanford AA274A (2021), problem set 4, problem 1.
"""

from math import pi

import numpy as np
from numpy.typing import ArrayLike

from roboloc import se2
from roboloc.validation import as_array, as_covariance, as_number


def figure_eight(radius: float = 1.0, speed: float = 0.5, dt: float = 0.1) -> np.ndarray:
    """Return the controls of one figure-eight: a full circle to the left, then one to the right.

    The number of steps is whole, so the speed is adjusted, by at most half a step in a circle, to make each
    circle close exactly.

    Parameters
    ----------
    radius : float
        Radius of both circles [m], positive.
    speed : float
        Approximate forward speed [m/s], positive.
    dt : float
        Length of a step [s], positive.

    Returns
    -------
    (N, 2) ndarray
        Controls V, omega of the N steps [m/s, rad/s].

    Raises
    ------
    ValueError
        If an argument is not a positive number, or if a circle takes fewer than three steps.

    Examples
    --------
    Two circles of radius 1 m at about half a metre per second take 25 s and end where they began.

    >>> us = figure_eight()
    >>> round(len(us) * 0.1, 9), bool(abs(us[0, 0] - 0.5) < 0.005)
    (25.2, True)
    >>> bool(np.abs(simulate_motion([1.0, 2.0, 0.5], us, 0.1)[-1] - [1.0, 2.0, 0.5]).max() < 1e-13)
    True
    """
    values = {"radius": radius, "speed": speed, "dt": dt}
    radius, speed, dt = (as_number(name, value) for name, value in values.items())
    for name, value in (("radius", radius), ("speed", speed), ("dt", dt)):
        if value <= 0.0:
            raise ValueError(f"{name}: expected a positive number, got {value}")
    steps = round(2.0 * pi * radius / (speed * dt))
    if steps < 3:
        raise ValueError(f"dt: expected at least 3 steps in a circle, got {steps} with dt = {dt}")
    omega = 2.0 * pi / (steps * dt)
    left, right = [radius * omega, omega], [radius * omega, -omega]
    return np.array([left] * steps + [right] * steps)


def simulate_motion(
    x0: ArrayLike,
    us: ArrayLike,
    dt: float,
    R: ArrayLike | None = None,
    rng: np.random.Generator | None = None,
) -> np.ndarray:
    """Drive a robot from a pose through a list of controls.

    Parameters
    ----------
    x0 : (3,) array_like
        Pose at the start [m, m, rad].
    us : (N, 2) array_like
        Commanded controls V, omega [m/s, rad/s].
    dt : float
        Length of a step [s], not negative.
    R : (2, 2) array_like, optional
        Covariance of the control. The control of each step is drawn with covariance dt R about the commanded
        one. Without it the robot does exactly as it is told.
    rng : numpy.random.Generator, optional
        Source of the noise, needed with `R`. N draws are taken.

    Returns
    -------
    (N + 1, 3) ndarray
        True poses [m, m, rad], the first being `x0`; headings are not wrapped.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, if dt is negative, if R is no covariance, or if R
        is given without a generator.

    Examples
    --------
    Four steps of a quarter turn each at 1 m radius make a circle.

    >>> xs = simulate_motion([0.0, 0.0, 0.0], [[np.pi / 2, np.pi / 2]] * 4, 1.0)
    >>> xs[2].round(12).tolist()
    [0.0, 2.0, 3.14159265359]
    """
    x0 = as_array("x0", x0, (3,))
    us = as_array("us", us, ("N", 2))
    dt = as_number("dt", dt, minimum=0.0)
    if R is not None:
        R = as_covariance("R", R, 2)
        if not isinstance(rng, np.random.Generator):
            raise ValueError(f"rng: expected a numpy.random.Generator with R, got {type(rng).__name__}")
        us = us + rng.multivariate_normal(np.zeros(2), dt * R, size=len(us), method="eigh")
    xs = np.empty((len(us) + 1, 3))
    xs[0] = x0
    for k, (V, omega) in enumerate(us.tolist()):
        xs[k + 1] = se2.compose(xs[k], se2.exp([V * dt, 0.0, omega * dt]))
    return xs
