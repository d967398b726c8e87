"""Independent oracles for the tests: exact derivations, many digits, finite differences.

Nothing here shares a line with the code under test. The motion model is integrated and differentiated by
SymPy from the unicycle's differential equation and evaluated by mpmath with as many digits as cancellation
may cost; the Kalman updates are the textbook formulas in mpmath matrices.
"""

import math
from functools import cache

import mpmath as mp
import numpy as np
import sympy as sp

DIGITS = 50


@cache
def derive_motion():
    """Integrate the unicycle; return symbols, {name: form} and {name: limit of the form as omega -> 0}."""
    symbols = x, y, theta, V, omega, dt = sp.symbols("x y theta V omega dt", real=True)
    tau = sp.Symbol("tau", real=True)
    turning = sp.Symbol("turning", real=True, nonzero=True)
    rates = sp.Matrix([V * sp.cos(theta + turning * tau), V * sp.sin(theta + turning * tau), turning])
    g = sp.Matrix([x, y, theta]) + rates.integrate((tau, 0, dt)).subs(turning, omega)
    generic = {"g": g, "Gx": g.jacobian([x, y, theta]), "Gu": g.jacobian([V, omega])}
    limits = {name: form.applyfunc(lambda e: sp.limit(e, omega, 0)) for name, form in generic.items()}
    return symbols, generic, limits


@cache
def _evaluators():
    symbols, generic, limits = derive_motion()
    return tuple(
        {name: sp.lambdify(symbols, form, "mpmath") for name, form in forms.items()}
        for forms in (generic, limits)
    )


def dynamics(xvec, u, dt):
    """Return g, Gx, Gu as mpmath matrices, from the floats given, correct to more than `DIGITS` digits."""
    # A formula with omega**2 below costs twice the leading zeros of omega on top of the digits wanted.
    zeros = max(0.0, -math.log10(abs(u[1]))) if u[1] else 0.0
    with mp.workdps(DIGITS + 20 + int(2 * zeros)):
        values = [mp.mpf(float(value)) for value in (*xvec, *u, dt)]
        forms = _evaluators()[0 if values[4] else 1]
        return tuple(mp.matrix(forms[name](*values)) for name in ("g", "Gx", "Gu"))


def prediction(Gx, Gu, Sigma, R, dt):
    """Return Gx Sigma Gx^T + dt Gu R Gu^T as an mpmath matrix."""
    with mp.workdps(DIGITS):
        Gx, Gu, Sigma, R = (mp.matrix(np.asarray(a, dtype=float).tolist()) for a in (Gx, Gu, Sigma, R))
        return Gx * Sigma * Gx.T + mp.mpf(float(dt)) * Gu * R * Gu.T


def correction(x, Sigma, z, Q, H):
    """Return mean and covariance conditioned on an innovation as mpmath matrices, in information form."""
    with mp.workdps(2 * DIGITS):
        Sigma, Q, H = (mp.matrix(np.asarray(a, dtype=float).tolist()) for a in (Sigma, Q, H))
        x, z = (mp.matrix([mp.mpf(float(value)) for value in a]) for a in (x, z))
        posterior = (Sigma**-1 + H.T * Q**-1 * H) ** -1
        return x + posterior * H.T * Q**-1 * z, posterior


def relative_error(got, exact):
    """Return the Frobenius norm of got - exact over that of exact, computed with many digits."""
    got = np.asarray(got, dtype=float)
    with mp.workdps(DIGITS):
        got = mp.matrix(got.tolist())
        return float(mp.norm(got - exact) / mp.norm(exact))


def finite_difference(function, x, step=1e-3):
    """Return the Jacobian of `function` at `x` by central differences, extrapolated once (error step**4)."""
    x = np.asarray(x, dtype=float)

    def slope(i, size):
        offset = np.zeros_like(x)
        offset[i] = size
        return (np.asarray(function(x + offset)) - np.asarray(function(x - offset))) / (2 * size)

    return np.stack([(4 * slope(i, step) - slope(i, 2 * step)) / 3 for i in range(x.size)], axis=-1)


def read_only(*arrays):
    """Return float arrays that raise when they are written to."""
    copies = tuple(np.array(a, dtype=float) for a in arrays)
    for copy in copies:
        copy.flags.writeable = False
    return copies
