"""The plane as complex numbers: a line is the point of it that is nearest to the origin, times its side."""

import cmath

import numpy as np


def transform_line_to_scanner_frame(line, x, tf_base_to_camera):
    """Turn the unit normal by the conjugates of both headings; a distance is the real part of a product."""
    normal, place = cmath.exp(1j * line[0]), complex(x[0], x[1])
    ahead, lever = cmath.exp(1j * x[2]), complex(tf_base_to_camera[0], tf_base_to_camera[1])
    scanner = place + ahead * lever
    seen = normal * ahead.conjugate() * cmath.exp(-1j * tf_base_to_camera[2])
    moved = [1, 1j, 1j * ahead * lever]
    slopes = [-(normal.conjugate() * step).real for step in moved]
    h = np.array([cmath.phase(seen), line[1] - (normal.conjugate() * scanner).real])
    return h, np.array([[0, 0, -1], slopes], dtype=float)


def normalize_line_parameters(h, Hx):
    """Read the angle off r times the normal, or off the normal where that is 0."""
    normal = cmath.exp(1j * h[0])
    foot = h[1] * normal if abs(h[1]) > 1e-12 else normal
    side = -1.0 if h[1] < -1e-12 else 1.0
    return np.array([cmath.phase(foot), abs(h[1])]), np.array([[1.0], [side]]) * Hx


def compute_predicted_measurements(x, map_lines, tf_base_to_camera):
    """Do the same for a vector of normals."""
    normals = np.exp(1j * map_lines[0])
    ahead, lever = np.exp(1j * x[2]), tf_base_to_camera[0] + 1j * tf_base_to_camera[1]
    r = map_lines[1] - (normals.conj() * (x[0] + 1j * x[1] + ahead * lever)).real
    side = np.where(r < 0, -1.0, 1.0)
    angle = np.angle(side * normals * np.conj(ahead) * np.exp(-1j * tf_base_to_camera[2]))
    steps = np.array([1, 1j, 1j * ahead * lever])
    slopes = -side[:, None] * np.real(np.conj(normals)[:, None] * steps)
    Hs = np.stack([np.broadcast_to([0.0, 0.0, -1.0], slopes.shape), slopes], axis=1)
    return np.array([angle, np.abs(r)]), Hs
