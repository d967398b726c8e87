"""The points of a scan, with running sums from which any run of them is judged without summing again.

A run is a half-open range of beams. The scatter of a run is a difference of two running sums, so that the best of
all places to cut it is found by one vectorised search; the points themselves are looked at only for the largest
distance from a line.
"""

from itertools import pairwise

import numpy as np


class ScanPoints:
    """Points of a scan and what can be asked of a run of them.

    Parameters
    ----------
    theta, rho : (N,) ndarray
        Bearings [rad] and ranges [m] of the beams that saw something, in order.
    line_point_distance : float
        How far a point may lie from the line of its run [m].
    max_point_gap : float
        Neighbours farther apart are separated by a gap [m].

    Examples
    --------
    Three posts in a row and one beside them, 3 m away: the first three are a line, and there is one gap.

    >>> scan = ScanPoints(np.radians([-45.0, 0.0, 45.0, 90.0]), np.array([2**0.5, 1.0, 2**0.5, 4.0]), 0.1, 2.0)
    >>> scan.runs(), scan.is_line(0, 3)
    ([(0, 3), (3, 4)], True)
    """

    def __init__(
        self, theta: np.ndarray, rho: np.ndarray, line_point_distance: float, max_point_gap: float
    ) -> None:
        self.line_point_distance = line_point_distance
        self.size = rho.size
        self.points = rho * np.stack([np.cos(theta), np.sin(theta)])
        self.gap = np.hypot(*np.diff(self.points)) > max_point_gap
        # About the mean of the scan, so that differences of sums keep their digits.
        x, y = self.points - self.points.mean(axis=1, keepdims=True) if rho.size else self.points
        self.sums = np.zeros((5, rho.size + 1))
        np.cumsum([x, y, x * x, x * y, y * y], axis=1, out=self.sums[:, 1:])

    def runs(self) -> list[tuple[int, int]]:
        """Return the longest runs without a gap."""
        cuts = [0, *(np.flatnonzero(self.gap) + 1).tolist(), self.size]
        return list(pairwise(cuts)) if self.size else []

    def distance(self, i: int, j: int) -> float:
        """Return how far the farthest point of a run is from its line."""
        if j - i <= 2:
            return 0.0
        points = self.points[:, i:j]
        x, y = points - points.mean(axis=1, keepdims=True)
        alpha = 0.5 * np.arctan2(-2.0 * (x @ y), y @ y - x @ x)
        return float(np.abs(x * np.cos(alpha) + y * np.sin(alpha)).max())

    def is_line(self, i: int, j: int) -> bool:
        """Tell whether all points of a run lie on its line, as far as the parameters care."""
        return self.distance(i, j) <= self.line_point_distance

    def joint_distance(self, a: tuple[int, int], b: tuple[int, int]) -> float:
        """Return the distance of two neighbouring runs taken as one, infinite if they do not touch."""
        return np.inf if a[1] != b[0] or self.gap[a[1] - 1] else self.distance(a[0], b[1])

    def corner(self, i: int, j: int, least: int) -> int:
        """Return where to cut a run so that two lines fit best, each with `least` points or more."""
        k = np.arange(i + least, j - least + 1)
        begin, middle, end = self.sums[:, [i]], self.sums[:, k], self.sums[:, [j]]
        return int(k[np.argmin(_misfit(middle - begin, k - i) + _misfit(end - middle, j - k))])

    def with_sharp_corners(self, runs: list[list[int]], least: int) -> list[list[int]]:
        """Return runs in which those that touch meet where both fit best.

        A corner may move once more when the other end of one of its walls has moved, hence the second sweep.
        """
        for _ in range(2):
            for a, b in pairwise(runs):
                if a[1] == b[0] and not self.gap[a[1] - 1]:
                    a[1] = b[0] = self.corner(a[0], b[1], least)
        return runs


def _misfit(sums: np.ndarray, count: np.ndarray) -> np.ndarray:
    """Return the sum of squared distances from the best line, the smaller eigenvalue of the scatter."""
    x, y, xx, xy, yy = sums
    xx, xy, yy = xx - x * x / count, xy - x * y / count, yy - y * y / count
    return 0.5 * (xx + yy - np.hypot(xx - yy, 2.0 * xy))
