"""What *split-and-merge* asks for, given all fits of a scan: `lines[i, j]` is that of the beams i to j - 1."""

from __future__ import annotations

import numpy as np

from roboloc_reference import extraction


def split(theta: np.ndarray, rho: np.ndarray, _lines: np.ndarray, params: dict[str, float]) -> np.ndarray:
    """Return the runs as the reference cuts them, which fits its own lines."""
    return extraction.split(theta, rho, params)


def merge(
    theta: np.ndarray, rho: np.ndarray, ranges: np.ndarray, _lines: np.ndarray, params: dict[str, float]
) -> np.ndarray:
    """Return the runs as the reference joins them, which fits its own lines."""
    return extraction.merge(theta, rho, ranges, params)


def segments(
    theta: np.ndarray, rho: np.ndarray, ranges: np.ndarray, lines: np.ndarray, params: dict[str, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Return the runs that are long enough, and where each begins and ends on its line."""
    ranges = np.asarray(ranges, dtype=int).reshape(-1, 2)
    outer = ranges - [0, 1]
    alpha, r = lines[ranges[:, :1], ranges[:, 1:]].transpose(2, 0, 1)
    turned = theta[outer] - alpha
    along = rho[outer] * np.sin(turned)
    ends = np.exp(1j * alpha) * (r + 1j * along)
    many = np.ptp(ranges, axis=1) >= params["min_points"]
    good = many & (np.ptp(along, axis=1) >= params["min_segment_length"])
    return ranges[good], np.stack([ends.real, ends.imag], axis=-1).reshape(-1, 4)[good]


def extract_lines(
    theta: np.ndarray, rho: np.ndarray, lines: np.ndarray, params: dict[str, float]
) -> tuple[np.ndarray, ...]:
    """Return the lines of a scan, where each begins and ends, and its beams: splitting, merging, and no more."""
    seen = np.flatnonzero(~np.isnan(rho))
    beams = theta[seen], rho[seen]
    runs, ends = segments(*beams, merge(*beams, split(*beams, lines, params), lines, params), lines, params)
    alpha, r = lines[runs[:, 0], runs[:, 1]].T
    found = np.append(seen, 0)[runs - [0, 1]] + [0, 1]
    return alpha, r, ends, found
