"""The plane as complex numbers; the derivative by a line is that of the foot of its perpendicular."""

import numpy as np


def transition_model(x, u, dt):
    """Integrate the heading with the function sin(t) / t and its derivative, and enlarge an identity."""
    V, omega = u
    half = omega * dt / 2
    chord = np.sinc(half / np.pi)
    slope = (np.cos(half) - chord) / half if abs(half) > 1e-4 else -half / 3
    way = dt * chord * np.exp(1j * (x[2] + half))
    bend = dt**2 / 2 * (slope + 1j * chord) * np.exp(1j * (x[2] + half))
    g = np.array(x, dtype=float)
    g[:3] += [V * way.real, V * way.imag, omega * dt]
    Gx, Gu = np.identity(len(x)), np.zeros((len(x), 2))
    Gx[0, 2], Gx[1, 2] = (1j * V * way).real, (1j * V * way).imag
    Gu[:3] = [[way.real, V * bend.real], [way.imag, V * bend.imag], [0, dt]]
    return g, Gx, Gu


def compute_predicted_measurements(x, tf, fixed=2):
    """See every normal from the scanner; a step of alpha turns the normal by 1j."""
    place, ahead, lever = x[0] + 1j * x[1], np.exp(1j * x[2]), tf[0] + 1j * tf[1]
    scanner = place + ahead * lever
    J = (len(x) - 3) // 2
    normals, far = np.exp(1j * x[3::2]), x[4::2]
    r = far - (normals.conj() * scanner).real
    side = np.where(r < 0, -1.0, 1.0)
    angle = np.angle(side * normals * np.conj(ahead) * np.exp(-1j * tf[2]))
    Hs = np.zeros((J, 2, len(x)))
    Hs[:, 0, 2] = -1
    for column, step in enumerate((1, 1j, 1j * ahead * lever)):
        Hs[:, 1, column] = -side * (normals.conj() * step).real
    for j in range(min(fixed, J), J):
        Hs[j, 0, 3 + 2 * j] = 1
        Hs[j, 1, 3 + 2 * j] = -side[j] * ((1j * normals[j]).conjugate() * scanner).real
        Hs[j, 1, 4 + 2 * j] = side[j]
    return np.array([angle, side * r]), Hs
