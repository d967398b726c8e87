"""The plane as complex numbers: an arc is an integral of exp(i theta)."""

import cmath

import numpy as np


def _way(theta, v, omega, dt):
    """Return the chord of an arc and its derivative by omega, by series where the arc is short."""
    w = 1j * omega * dt
    if abs(w) < 0.05:
        first = sum(w**k / np.prod(np.arange(1.0, k + 2)) for k in range(9))
        second = sum((k + 1) * w**k / np.prod(np.arange(1.0, k + 3)) for k in range(9))
    else:
        first = (cmath.exp(w) - 1) / w
        second = (cmath.exp(w) - first) / w
    turn = cmath.exp(1j * theta)
    return v * dt * turn * first, v * dt * turn * 1j * dt * second


def motion(x, u, dt):
    """Add the chord."""
    v, omega, gamma = u
    z = complex(x[0], x[1]) + _way(x[2], v, omega, dt)[0]
    return np.array([z.real, z.imag, x[2] + (omega + gamma) * dt])


def jacobians(x, u, dt):
    """Turn the chord with its start."""
    v, omega, _ = u
    chord, by_omega = _way(x[2], v, omega, dt)
    by_v = _way(x[2], 1.0, omega, dt)[0]
    turned = 1j * chord
    F = [[1, 0, turned.real], [0, 1, turned.imag], [0, 0, 1]]
    W = [[by_v.real, by_omega.real, 0], [by_v.imag, by_omega.imag, 0], [0, dt, dt]]
    return np.array(F), np.array(W)


def noise(u, alphas):
    """One matrix product."""
    return np.diag(np.reshape(alphas, (3, 2)) @ np.square(u[:2]))


def range_bearing(x, landmark):
    """Take both from the logarithm, whose derivative by the place is -1 / difference."""
    d = complex(landmark[0] - x[0], landmark[1] - x[1])
    seen = d * cmath.exp(-1j * x[2])
    step = -1 / d  # of log d by x; by y it is i times that
    r = abs(d)
    H = [[step.imag, (1j * step).imag, -1], [r * step.real, r * (1j * step).real, 0]]
    return np.array([cmath.phase(seen), r]), np.array(H)
