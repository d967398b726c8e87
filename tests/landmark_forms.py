"""The models of SLAM with points, written by SymPy and evaluated with many digits, and scenes to try them on."""

from functools import cache
from math import pi

import mpmath as mp
import numpy as np
import sympy as sp
from oracles import DIGITS


def covariance(rng, n):
    """Draw a correlated covariance."""
    A = rng.normal(size=(n, n))
    return A @ A.T + 0.1 * np.eye(n)


def scene(rng, k):
    """Draw a pose with its covariance, k observations and their covariance, angles all around the circle."""
    pose = np.array([*rng.uniform(-5, 5, 2), rng.uniform(-pi, pi)])
    z = np.stack([rng.uniform(-pi, pi, k), rng.uniform(0.5, 8, k)], axis=-1).ravel()
    return z, 0.01 * covariance(rng, 2), pose, 0.01 * covariance(rng, 3)


def floats(matrix):
    """Round an mpmath matrix to floats."""
    return np.array(matrix.tolist(), dtype=float)


@cache
def derived():
    """Let SymPy write the three models and their derivatives; return functions for mpmath."""
    x, y, theta, d, alpha, beta, r, lx, ly, e1, e2, e3 = sp.symbols(
        "x y theta d alpha beta r lx ly e1:4", real=True
    )
    pose = [x, y, theta]
    c, s = sp.cos(theta), sp.sin(theta)
    g = sp.Matrix([x + d * c + e1 * c - e2 * s, y + d * s + e1 * s + e2 * c, theta + alpha + e3])
    l = sp.Matrix([x + r * sp.cos(beta + theta), y + r * sp.sin(beta + theta)])
    z = sp.Matrix([sp.atan2(ly - y, lx - x) - theta, sp.sqrt((lx - x) ** 2 + (ly - y) ** 2)])
    still = {e1: 0, e2: 0, e3: 0}
    seen = [x, y, theta, lx, ly]
    forms = {
        "G": ((*pose, d, alpha), g.jacobian(pose).subs(still)),
        "L": ((*pose, d, alpha), g.jacobian([e1, e2, e3]).subs(still)),
        "g": ((*pose, d, alpha), g.subs(still)),
        "l": ((*pose, beta, r), l),
        "J_pose": ((*pose, beta, r), l.jacobian(pose)),
        "J_z": ((*pose, beta, r), l.jacobian([beta, r])),
        "z": (seen, z),
        "Hp": (seen, z.jacobian(pose)),
        "Hl": (seen, z.jacobian([lx, ly])),
    }
    return {name: sp.lambdify(args, form, "mpmath") for name, (args, form) in forms.items()}


def exactly(name, *values):
    """Evaluate one of the derived forms with 50 digits."""
    with mp.workdps(DIGITS):
        return mp.matrix(derived()[name](*(mp.mpf(float(v)) for v in values)))
