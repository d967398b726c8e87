r"""One problem for four filters: a figure of eight among six landmarks.

A robot is told to drive a circle to the left and one to the right. What it does differs by noise of the covariance
M of its control (:func:`roboloc_reference.velocity.noise`), drawn anew in every step, and it starts at a pose drawn
about the one it was told. After each step it sees two landmarks, known ones, in turns: bearing and range, with
noise of covariance Q. A filter that is told all that has no excuse: its errors must be what it claims.

Which landmarks are seen does not depend on where the robot is, so what is not seen says nothing either.

The generator is part of the reference and not of the students' package: its two lines of mathematics are the
stages that a student has to write. Students get runs, which are arrays.

Source: the problem is that of Michigan ROB530, homework 5, problem 1; course, map and noise are our own.
"""

import numpy as np

from roboloc.validation import as_number
from roboloc.velocity_logs import VelocityLog
from roboloc_reference.velocity import motion, noise, range_bearings

DT, SPEED, TURN_RATE, STEPS_A_CIRCLE = 0.25, 1.0, 0.4, 63
ALPHAS = np.array([0.01, 0.002, 0.002, 0.01, 0.0005, 0.0005])
Q = np.diag([0.05, 0.1]) ** 2
START, SIGMA0 = np.array([0.0, 0.0, 0.0]), np.diag([0.1, 0.1, 0.05]) ** 2
LANDMARKS = np.array([[-4.0, 6.0], [4.0, 6.0], [5.0, 0.0], [4.0, -6.0], [-4.0, -6.0], [-5.0, 0.0]])
SEEN_AT_ONCE = 2


def simulate(rng: np.random.Generator | None, scale: float = 1.0) -> VelocityLog:
    """Drive the figure of eight once.

    Parameters
    ----------
    rng : numpy.random.Generator or None
        Source of the draws: the start (3), then for each step the control (3) and the observations (2k). With
        None nothing is drawn: the robot does as it is told and sees what there is, though no filter knows that.
    scale : float
        Factor of all standard deviations, drawn and told, positive; towards 0 all filters become one.

    Returns
    -------
    VelocityLog
        The run.

    Raises
    ------
    ValueError
        If scale is not positive.

    Examples
    --------
    If nothing goes wrong, the robot is back after half a minute, to a few centimetres: a circle is no whole
    number of steps.

    >>> run = simulate(None)
    >>> len(run.us) * run.dt, bool(np.hypot(*run.truth[-1, :2]) < 0.1)
    (31.5, True)
    """
    scale = as_number("scale", scale)
    if scale <= 0:
        raise ValueError(f"scale: expected a number above 0, got {scale}")
    alphas, R, Sigma0 = scale**2 * ALPHAS, scale**2 * Q, scale**2 * SIGMA0
    turns = np.repeat([TURN_RATE, -TURN_RATE], STEPS_A_CIRCLE)
    us = np.stack([np.full(turns.size, SPEED), turns, np.zeros(turns.size)], axis=1)
    k = np.arange(turns.size)[:, None]
    seen = (k + len(LANDMARKS) // SEEN_AT_ONCE * np.arange(SEEN_AT_ONCE)) % len(LANDMARKS)

    def draw(variances: np.ndarray) -> np.ndarray:
        """Return independent normal numbers, or zeros."""
        return np.sqrt(variances) * (rng.normal(size=variances.size) if rng else 0.0)

    truth, zs = [START + draw(np.diag(Sigma0))], []
    for u, which in zip(us, seen, strict=True):
        truth.append(motion(truth[-1], u + draw(np.diag(noise(u, alphas))), DT))
        z = range_bearings(truth[-1][None], LANDMARKS[which]).ravel()
        zs.append(z + draw(np.tile(np.diag(R), SEEN_AT_ONCE)))
    return VelocityLog(DT, us, alphas, LANDMARKS, seen, np.array(zs), R, START, Sigma0, np.array(truth))
