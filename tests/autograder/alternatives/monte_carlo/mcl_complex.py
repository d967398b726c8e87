"""Complex numbers and whole arrays: a pose is a point and a turn, a line the point of it that is nearest."""

import warnings

import numpy as np


def transition_model(xs, us, dt):
    """Drive the chord of the arc, as long as its sinc says."""
    V, omega = us.T
    half = omega * dt / 2
    chord = V * dt * np.sinc(half / np.pi) * np.exp(1j * (xs[:, 2] + half))
    return np.column_stack([xs[:, 0] + chord.real, xs[:, 1] + chord.imag, xs[:, 2] + omega * dt])


def compute_predicted_measurements(xs, map_lines, tf_base_to_camera):
    """Bring the foot of the perpendicular into the scanner's frame; its angle is wrapped by itself."""
    turn = np.exp(1j * xs[:, 2:])
    place = xs[:, :1] + 1j * xs[:, 1:2] + turn * (tf_base_to_camera[0] + 1j * tf_base_to_camera[1])
    normal = np.exp(1j * map_lines[0])
    foot = normal * (map_lines[1] - (place * normal.conj()).real)
    seen = foot * (turn * np.exp(1j * tf_base_to_camera[2])).conj()
    return np.stack([np.angle(seen), np.abs(seen)], axis=1)


def compute_innovations(z_raw, Q_raw, hs):
    """Make all differences at once, whiten them, and take the shortest."""
    angle = np.angle(np.exp(1j * (z_raw[0][:, None] - hs[:, None, 0])))
    v = np.stack([angle, z_raw[1][:, None] - hs[:, None, 1]], axis=-1)
    white = np.linalg.solve(np.linalg.cholesky(Q_raw)[:, None], v[..., None])[..., 0]
    nearest = np.abs(white[..., 0] + 1j * white[..., 1]).argmin(axis=-1)
    chosen = np.take_along_axis(v, nearest[..., None, None], axis=2)
    return chosen.reshape(len(hs), -1)


def measurement_weights(vs, Q_raw, ws):
    """Whiten the innovations; the squared length is the exponent."""
    v = vs.reshape(len(ws), -1, 2)
    with np.errstate(all="ignore"):
        white = np.linalg.solve(np.linalg.cholesky(Q_raw), v[..., None])[..., 0]
        logs = np.log(ws) - np.sum(white**2, axis=(1, 2)) / 2
    logs = np.where(np.isnan(logs), -np.inf, logs)
    if np.isneginf(logs).all():
        warnings.warn("no particle is possible: all weights are 1/M", RuntimeWarning, stacklevel=2)
        return np.ones(len(ws)) / len(ws)
    found = np.exp(logs - logs.max())
    return found / found.sum()
