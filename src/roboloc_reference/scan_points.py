"""The points of a scan, with running sums from which any run of them is judged without summing again.

A run is a half-open range of beams. The scatter of a run is a difference of two running sums, so that the line of a
run costs no more for a long one, and the best of all places to cut it is found by one vectorised search; the points
themselves are looked at only for the largest distance from a line. What was asked once is remembered.

A full turn has no first beam. Its points are laid out twice, one turn behind the other, and runs are looked for in
one turn from wherever it is safe to begin.
"""

from itertools import pairwise
from math import atan2, cos, sin

import numpy as np

Run = tuple[int, int]


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
        self.steps = np.hypot(*np.diff(self.points))
        self.gap = self.steps > max_point_gap
        # About the mean of the scan, so that differences of sums keep their digits.
        self.middle = self.points.mean(axis=1, keepdims=True) if rho.size else np.zeros((2, 1))
        x, y = self.offsets = self.points - self.middle
        self.sums = np.zeros((5, rho.size + 1))
        np.cumsum([x, y, x * x, x * y, y * y], axis=1, out=self.sums[:, 1:])
        self.shares = 1.0 / np.maximum(np.arange(rho.size + 1), 1)
        self._distances: dict[Run, float] = {}
        self._corners: dict[tuple[int, int, int], int] = {}

    def runs(self, begin: int = 0, end: int | None = None) -> list[Run]:
        """Return the longest runs without a gap, of all points or of a range of them."""
        end = self.size if end is None else end
        cuts = [begin, *(np.flatnonzero(self.gap[begin : max(end - 1, begin)]) + begin + 1).tolist(), end]
        return list(pairwise(cuts)) if end > begin else []

    def distance(self, i: int, j: int) -> float:
        """Return how far the farthest point of a run is from its line."""
        if j - i <= 2:
            return 0.0
        if (i, j) not in self._distances:
            x, y, xx, xy, yy = (self.sums[:, j] - self.sums[:, i]).tolist()
            x, y = x / (j - i), y / (j - i)
            xx, xy, yy = xx - x * x * (j - i), xy - x * y * (j - i), yy - y * y * (j - i)
            alpha = 0.5 * atan2(-2.0 * xy, yy - xx)
            normal = np.array([cos(alpha), sin(alpha)])
            n = normal @ self.offsets[:, i:j] - (x * normal[0] + y * normal[1])
            self._distances[i, j] = max(float(n.max()), -float(n.min()))
        return self._distances[i, j]

    def is_line(self, i: int, j: int) -> bool:
        """Tell whether all points of a run lie on its line, as far as the parameters care."""
        return self.distance(i, j) <= self.line_point_distance

    def touch(self, a: Run, b: Run) -> bool:
        """Tell whether the second run begins where the first one ends, without a gap."""
        return a[1] == b[0] and not self.gap[a[1] - 1]

    def joint_distance(self, a: Run, b: Run) -> float:
        """Return the distance of two neighbouring runs taken as one, infinite if they do not touch."""
        return self.distance(a[0], b[1]) if self.touch(a, b) else np.inf

    def corner(self, i: int, j: int, least: int) -> int:
        """Return where to cut a run so that two lines fit best, each with `least` points or more."""
        if (i, j, least) not in self._corners:
            middle = self.sums[:, i + least : j - least + 1]
            sides = np.empty((5, 2, middle.shape[1]))
            np.subtract(middle, self.sums[:, i : i + 1], out=sides[:, 0])
            np.subtract(self.sums[:, j : j + 1], middle, out=sides[:, 1])
            share = self.shares[least : j - i - least + 1]
            misfit = _misfit(sides, np.array([share, share[::-1]]))
            self._corners[i, j, least] = i + least + int((misfit[0] + misfit[1]).argmin())
        return self._corners[i, j, least]

    def split(self, begin: int = 0, end: int | None = None) -> list[Run]:
        """Cut the runs without a gap until each is a line."""
        todo, done = self.runs(begin, end)[::-1], []
        while todo:
            i, j = todo.pop()
            if self.is_line(i, j):
                done.append((i, j))
            else:
                k = self.corner(i, j, 1)
                todo += [(k, j), (i, k)]
        return done

    def merge(self, runs: list[Run]) -> list[Run]:
        """Join runs that touch and together are one line, the best pair first."""
        runs = list(runs)
        cost = [self.joint_distance(a, b) for a, b in pairwise(runs)]
        while cost and min(cost) <= self.line_point_distance:
            k = cost.index(min(cost))
            runs[k : k + 2] = [(runs[k][0], runs[k + 1][1])]
            del cost[k]
            for m in (k - 1, k):
                if 0 <= m < len(cost):
                    cost[m] = self.joint_distance(runs[m], runs[m + 1])
        return runs

    def walls(self, least: int, begin: int = 0, end: int | None = None) -> list[Run]:
        """Return the lines of at least `least` points that splitting, merging and sharp corners lead to.

        A run that ends a beam beyond its corner is no line with the rest of its wall. Once the corners are sharp it
        is, so all three take turns until nothing is joined any more.
        """
        runs = [(i, j) for i, j in self.merge(self.split(begin, end)) if j - i >= least]
        while True:
            runs = self.with_sharp_corners(runs, least)
            fewer = self.without_shared(self.merge(runs), least)
            if len(fewer) == len(runs):
                return runs
            runs = fewer

    def with_sharp_corners(self, runs: list[Run], least: int) -> list[Run]:
        """Return runs in which those that touch meet where both fit best.

        A corner may move once more when the other end of one of its walls has moved, hence the second sweep.
        """
        runs = list(runs)
        for _ in range(2):
            for m, (a, b) in enumerate(pairwise(runs)):
                a = runs[m]  # noqa: PLW2901 - its beginning may have moved
                if self.touch(a, b):
                    k = self.corner(a[0], b[1], least)
                    runs[m : m + 2] = [(a[0], k), (k, b[1])]
        return runs

    def without_shared(self, runs: list[Run], least: int) -> list[Run]:
        """Drop runs whose points the two neighbours can share and still be lines."""
        runs, m = list(runs), 1
        while m < len(runs) - 1:
            a, b, c = runs[m - 1 : m + 2]
            if self.touch(a, b) and self.touch(b, c):
                k = self.corner(a[0], c[1], least)
                if self.is_line(a[0], k) and self.is_line(k, c[1]):
                    runs[m - 1 : m + 2] = [(a[0], k), (k, c[1])]
                    continue
            m += 1
        return runs

    def walls_of_full_turn(self, least: int) -> list[Run]:
        """Return the walls of a scan that was laid out twice; none is cut in two where the turn begins.

        The turn begins behind the widest gap, or, if there is none, where 2 * `least` points in a row are least a
        line: in a corner, which is put right when its two walls are known. A run may end in the second turn.
        """
        N, window = self.size // 2, 2 * least
        widest = int(np.argmax(self.steps[:N]))
        if self.gap[widest] or window > N:
            return self.walls(least, widest + 1, widest + 1 + N)
        misfit = _misfit(self.sums[:, window : window + N] - self.sums[:, :N], 1.0 / window)
        begin = (int(np.argmax(misfit)) + least) % N
        runs = self.walls(least, begin, begin + N)
        if len(runs) > 1:
            # The last wall and, a turn later, the first one; where that is too late, both a turn earlier.
            (i, a), (b, j) = runs[-1], runs[0]
            turn = N if j <= N else 0
            last, first = (i - N + turn, a - N + turn), (b + turn, j + turn)
            if self.touch(last, first):
                runs[:] = [*runs[1:-1], *self.merge(self.with_sharp_corners([last, first], least))]
        return runs


def _misfit(sums: np.ndarray, share: np.ndarray | float) -> np.ndarray:
    """Return the sum of squared distances from the best line, the smaller eigenvalue of the scatter.

    `share` is 1 over the number of points. Roots of sums of squares are faster here than hypot, and nothing overflows.
    """
    x, y, xx, xy, yy = sums
    xx, xy, yy = xx - x * x * share, xy - x * y * share, yy - y * y * share
    difference = xx - yy
    return 0.5 * (xx + yy - np.sqrt(difference * difference + 4.0 * xy * xy))
