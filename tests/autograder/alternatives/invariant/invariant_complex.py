"""Complex numbers for places and turns, one landmark after the other in plain Python."""

import cmath

import numpy as np


def _exp(twist):
    """Return shift and turn as complex numbers."""
    v, omega = complex(twist[0], twist[1]), float(twist[2])
    if abs(omega) < 1e-5:
        return v * (1 + 1j * omega / 2 - omega**2 / 6), cmath.exp(1j * omega)
    return v * (cmath.exp(1j * omega) - 1) / (1j * omega), cmath.exp(1j * omega)


def _matrix(p, turn):
    return [[turn.real, -turn.imag, p.real], [turn.imag, turn.real, p.imag], [0.0, 0.0, 1.0]]


def _parts(X):
    return complex(X[0][2], X[1][2]), complex(X[0][0], X[1][0])


def predict(X, P, twist, W, dt):
    """Carry the noise by a factor of W's square root."""
    p, turn = _parts(X)
    shift, more = _exp([dt * t for t in twist])
    Ad = np.array([[turn.real, -turn.imag, p.imag], [turn.imag, turn.real, -p.real], [0, 0, 1]])
    values, vectors = np.linalg.eigh(W)
    root = Ad @ vectors * np.sqrt(np.maximum(values, 0))
    return _matrix(p + turn * shift, turn * more), np.asarray(P) + root @ root.T


def correct(X, P, Y, landmarks, N):
    """Condition on one landmark after the other: the errors add up, since H does not depend on the estimate."""
    p, turn = _parts(X)
    R = np.array([[turn.real, -turn.imag], [turn.imag, turn.real]])
    xi, Sigma = np.zeros(3), np.array(P, dtype=float)
    for (y1, y2, _), (mx, my) in zip(Y, landmarks, strict=True):
        off = p + turn * complex(y1, y2) - complex(mx, my)
        H = np.array([[-1, 0, my], [0, -1, -mx]])
        S = H @ Sigma @ H.T + R @ N @ R.T
        L = Sigma @ H.T @ np.linalg.inv(S)
        xi = xi + L @ (np.array([off.real, off.imag]) - H @ xi)
        Sigma = Sigma - L @ S @ L.T
    shift, more = _exp(xi)
    return _matrix(shift + more * p, more * turn), Sigma
