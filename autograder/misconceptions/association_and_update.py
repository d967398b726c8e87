"""Wrong versions of `compute_innovations` and `measurement_model`.

One is a fault of the source handout (ERRATA H5), another of a comment in its code (H6); the others are what
people write.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from autograder.misconceptions.model import Misconception
from roboloc.angles import TURN, wrap
from roboloc_reference.association import compute_innovations, measurement_model

if TYPE_CHECKING:
    from collections.abc import Callable

_INNOVATIONS, _STACK = "association.compute_innovations", "association.measurement_model"
_JUDGED = "Take two walls and one line, and work out both d2 by hand. Which numbers does your code get?"


def _squared(v: np.ndarray, S: np.ndarray) -> np.ndarray:
    return np.sum(v * np.linalg.solve(S, v[..., None])[..., 0], axis=-1)


def _association(
    *,
    angle: Callable[[np.ndarray], np.ndarray] = wrap,
    sign: int = 1,
    distance: Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray] = lambda v, P, Q: _squared(v, P + Q),
    nearest: Callable[..., np.ndarray] = lambda d2, **_: d2.argmin(axis=1),
    inside: Callable[[np.ndarray, float], np.ndarray] = lambda d2, g: d2 < g * g,
) -> Callable[..., tuple]:
    """Make an association of which one part is another."""

    def function(
        z_raw: np.ndarray, Q_raw: np.ndarray, hs: np.ndarray, Hs: np.ndarray, Sigma: np.ndarray, g: float
    ) -> tuple:
        v = sign * (z_raw.T[:, None] - hs.T[None])
        v[..., 0] = angle(v[..., 0])
        P = np.broadcast_to((Hs @ Sigma @ Hs.swapaxes(1, 2))[None], (len(Q_raw), len(Hs), 2, 2))
        d2 = distance(v, P, np.broadcast_to(Q_raw[:, None], P.shape))
        i, j = np.arange(len(Q_raw)), nearest(d2, g=g, v=v)
        # Where a choice is impossible, -1 stands for no wall.
        kept = inside(d2[i, j], g) & (j >= 0)
        return v[i, j][kept], Q_raw[kept], Hs[j[kept]]

    return function


def _first_inside(d2: np.ndarray, g: float, **_: Any) -> np.ndarray:
    return (d2 < g * g).argmax(axis=1)


def _each_once(d2: np.ndarray, **_: Any) -> np.ndarray:
    """Let the observations choose in turn among the walls that are left."""
    left, choice = d2.copy(), np.full(len(d2), -1)
    for i in range(len(d2)):
        if np.isfinite(left[i]).any():
            choice[i] = left[i].argmin()
            left[:, choice[i]] = np.inf
    return choice


def last_wall_looked_at(*args: Any) -> tuple:
    """Return the derivatives of the last wall of the loop, whichever was chosen."""
    v, Q, H = compute_innovations(*args)
    return v, Q, np.repeat(args[3][-1:], len(H), axis=0)


def best_distance_not_reset(
    z_raw: np.ndarray, Q_raw: np.ndarray, hs: np.ndarray, Hs: np.ndarray, Sigma: np.ndarray, g: float
) -> tuple:
    """Keep the least distance so far from one observation to the next."""
    best, chosen = np.inf, []
    for i in range(len(Q_raw)):
        one = (z_raw[:, i : i + 1], Q_raw[i : i + 1], hs, Hs, Sigma, 1e6)
        v, Q, H = compute_innovations(*one)
        d2 = float(_squared(v, H @ Sigma @ H.swapaxes(1, 2) + Q)[0])
        if d2 < best:
            best = d2
            if d2 < g * g:
                chosen.append((v[0], Q[0], H[0]))
    if not chosen:
        return np.zeros((0, 2)), np.zeros((0, 2, 2)), np.zeros((0, 2, len(Sigma)))
    return tuple(np.array(part) for part in zip(*chosen, strict=True))


def innovation_covariance_returned(*args: Any) -> tuple:
    """Return S in the place of Q."""
    v, Q, H = compute_innovations(*args)
    return v, H @ args[4] @ H.swapaxes(1, 2) + Q, H


def order_of_the_map(
    z_raw: np.ndarray, Q_raw: np.ndarray, hs: np.ndarray, Hs: np.ndarray, Sigma: np.ndarray, g: float
) -> tuple:
    """Go through the map, and for each wall through the observations that chose it."""
    if not len(Q_raw):
        return compute_innovations(z_raw, Q_raw, hs, Hs, Sigma, g)
    v = z_raw.T[:, None] - hs.T[None]
    v[..., 0] = wrap(v[..., 0])
    nearest = _squared(v, (Hs @ Sigma @ Hs.swapaxes(1, 2))[None] + Q_raw[:, None]).argmin(axis=1)
    order = np.argsort(nearest, kind="stable")
    return compute_innovations(z_raw[:, order], Q_raw[order], hs, Hs, Sigma, g)


def first_covariances(*args: Any) -> tuple:
    """Gate the innovations, and hand back as many covariances from the top of the list."""
    v, _, H = compute_innovations(*args)
    return v, args[1][: len(v)].copy(), H


def observations_overwritten(*args: Any) -> tuple:
    """Subtract the expectation from the caller's observations."""
    results = compute_innovations(*args)
    z_raw, Q_raw, hs, Hs, Sigma, _g = args
    if len(Q_raw):
        z_raw[:] = compute_innovations(z_raw, Q_raw, hs, Hs, Sigma, 1e6)[0].T
    return results


def _stack(fault: Callable[..., dict[str, np.ndarray]]) -> Callable[..., tuple]:
    """Make a wrong stack from the parts that are wrong."""

    def function(v: np.ndarray, Q: np.ndarray, H: np.ndarray) -> tuple:
        right = dict(zip("zQH", measurement_model(v, Q, H), strict=True))
        return tuple((right | (fault(v, Q, H) if len(v) else {})).values())

    return function


def _whole(blocks: np.ndarray) -> np.ndarray:
    """Lay (K, K, 2, 2) blocks out as one matrix."""
    return blocks.swapaxes(1, 2).reshape(2 * len(blocks), -1)


def block_diagonal_of_nothing(v: np.ndarray, Q: np.ndarray, H: np.ndarray) -> tuple:
    """Hand an empty list to scipy's block_diag, which makes a matrix of one row and no column of it."""
    z, Q, H = measurement_model(v, Q, H)
    return z, (Q if len(v) else np.zeros((1, 0))), H


def innovations_overwritten(v: np.ndarray, Q: np.ndarray, H: np.ndarray) -> tuple:
    """Use the caller's array as scratch paper."""
    results = measurement_model(v, Q, H)
    v *= 0.0
    return results


MISCONCEPTIONS = (
    Misconception(
        "squared distance in a gate of g",
        _INNOVATIONS,
        "The squared distance d2 is compared with g. The gate is a number of standard deviations, and so is the "
        "distance; d2 is its square. A handout of another course calls d2 the distance, which invites this.",
        "A line is 2 standard deviations off and the gate is 3. Is it kept? What is its d2?",
        _association(inside=lambda d2, g: d2 < g),
    ),
    Misconception(
        "no gate",
        _INNOVATIONS,
        "Every line is given to its nearest wall, however far that is. A person who walks through the scan then "
        "moves the robot.",
        "A line that belongs to nothing in the map: which wall should have it?",
        _association(inside=lambda d2, _g: d2 < np.inf),
    ),
    Misconception(
        "noise of the observation left out",
        _INNOVATIONS,
        "The distance is judged by the doubt about the pose alone: Q is missing from S. When the filter is sure of "
        "itself, right lines fall out of the gate for their ordinary noise.",
        _JUDGED,
        _association(distance=lambda v, P, _Q: _squared(v, P)),
    ),
    Misconception(
        "doubt about the pose left out",
        _INNOVATIONS,
        "The distance is judged by the noise of the observation alone. When the filter is lost, which is when it "
        "needs the walls most, the right ones fall out of the gate.",
        _JUDGED,
        _association(distance=lambda v, _P, Q: _squared(v, Q)),
    ),
    Misconception(
        "innovation not wrapped",
        _INNOVATIONS,
        "The difference of two angles is not wrapped. A wall behind the scanner, seen on one side of the cut at pi "
        "and expected on the other, is a whole turn off and falls out of the gate.",
        "Subtract -3.1 rad from 3.1 rad: how far are these two directions apart?",
        _association(angle=lambda a: a),
    ),
    Misconception(
        "angles wrapped to [0, 2 pi)",
        _INNOVATIONS,
        "The difference of two angles is taken modulo a turn, so that a small negative one becomes nearly a whole "
        "turn. Half of all innovations are negative.",
        "What does a % b give in Python for a small negative a?",
        _association(angle=lambda a: a % TURN),
    ),
    Misconception(
        "expected minus observed",
        _INNOVATIONS,
        "The innovation has the wrong sign. The distance does not notice, since it is a square, but the update will "
        "push the robot the wrong way.",
        "If the wall is nearer than expected, which sign has the second number of v?",
        _association(sign=-1),
    ),
    Misconception(
        "nearest in plain distance",
        _INNOVATIONS,
        "The nearest wall is looked for with the plain distance of the two numbers, radians and metres alike, and "
        "only the gate uses S. Among walls close together that chooses another one.",
        _JUDGED,
        _association(nearest=lambda _d2, v, **_: np.sum(v * v, axis=-1).argmin(axis=1)),
    ),
    Misconception(
        "S not inverted",
        _INNOVATIONS,
        "The innovation is multiplied by S where it should be divided by it: a doubtful direction counts for more "
        "instead of less.",
        "If S gets larger, must d2 grow or shrink?",
        _association(distance=lambda v, P, Q: np.einsum("ijk,ijkl,ijl->ij", v, P + Q, v)),
    ),
    Misconception(
        "first wall inside the gate",
        _INNOVATIONS,
        "The search stops at the first wall of the map that is inside the gate. The nearest one may come later.",
        "What does the loop over the walls do after it has found one?",
        _association(nearest=_first_inside),
    ),
    Misconception(
        "each wall only once",
        _INNOVATIONS,
        "A wall that has been given away is not available for later lines. A wall seen on both sides of a door is "
        "two lines, and both say something about the robot.",
        "May two observations name the same wall?",
        _association(nearest=_each_once),
    ),
    Misconception(
        "derivative of the wall looked at last",
        _INNOVATIONS,
        "The innovation belongs to the nearest wall, and the derivative to the last wall of the map: the index of "
        "the loop was used after the loop.",
        "After the loop over the walls, which wall does its index name?",
        last_wall_looked_at,
    ),
    Misconception(
        "least distance not reset",
        _INNOVATIONS,
        "The least distance so far is carried from one observation to the next, so a line is dropped unless it "
        "fits better than all before it.",
        "Where in your loops is the least distance set to its first value?",
        best_distance_not_reset,
    ),
    Misconception(
        "S returned for Q",
        _INNOVATIONS,
        "What is returned as Q is the covariance of the innovation, S. The update adds the doubt about the pose "
        "itself, and would count it twice.",
        "Whose covariance is Q, and whose is S?",
        innovation_covariance_returned,
    ),
    Misconception(
        "lines in the order of the map",
        _INNOVATIONS,
        "The results are in the order of the walls. They are asked for in the order of the observations.",
        "Which of your two loops is the outer one?",
        order_of_the_map,
    ),
    Misconception(
        "covariances not gated",
        _INNOVATIONS,
        "Where a line has been dropped, the covariances are those of the first lines of the scan, and no longer "
        "those of the lines that were kept.",
        _JUDGED,
        first_covariances,
    ),
    Misconception(
        "the caller's observations overwritten",
        _INNOVATIONS,
        "The function writes innovations into z_raw. A column of an array is a view of it, and subtracting in place "
        "changes the scan of the caller.",
        "v = z_raw[:, i] names a part of the same array; which operation makes a new one?",
        observations_overwritten,
    ),
    Misconception(
        "all angles first",
        _STACK,
        "z holds all angles and then all distances, while Q and H go line by line. Every number is there, and most "
        "are in another one's place.",
        "Write z for two lines by hand. Which numbers stand in the rows of the first block of Q?",
        _stack(lambda v, _Q, _H: {"z": v.T.flatten()}),
    ),
    Misconception(
        "correlations of a line dropped",
        _STACK,
        "Only the variances are on the diagonal of Q. The angle and the distance of a line are fitted to the same "
        "points, and their errors vary together.",
        "How many numbers of each line's covariance does the whole matrix hold?",
        _stack(lambda _v, Q, _H: {"Q": np.diag(np.diagonal(Q, axis1=1, axis2=2).ravel())}),
    ),
    Misconception(
        "every block from the last line",
        _STACK,
        "All blocks of Q are those of the last line, as if every line had been observed equally well.",
        "Which index do you use inside the loop, on the left and on the right?",
        _stack(lambda _v, Q, _H: {"Q": np.kron(np.eye(len(Q)), Q[-1])}),
    ),
    Misconception(
        "lines vary together",
        _STACK,
        "Q has covariances between different lines as well: each line's block is repeated along its row. The "
        "errors of two lines come from different points and have nothing to do with each other.",
        "What is the covariance of the errors of two different lines?",
        _stack(lambda _v, Q, _H: {"Q": np.hstack([Q.reshape(-1, 2)] * len(Q))}),
    ),
    Misconception(
        "inverse covariances",
        _STACK,
        "The blocks of Q are inverted. They are covariances, and the update inverts what it needs to itself.",
        "If a line is observed twice as badly, what happens to its block?",
        _stack(lambda _v, Q, _H: {"Q": _whole(np.eye(len(Q))[:, :, None, None] * np.linalg.inv(Q)[:, None])}),
    ),
    Misconception(
        "rows of H sorted by kind",
        _STACK,
        "H holds the rows of all angles and then those of all distances, while z and Q go line by line.",
        "Row i of H is the derivative of which number of z?",
        _stack(lambda _v, _Q, H: {"H": H.swapaxes(0, 1).reshape(-1, H.shape[2])}),
    ),
    Misconception(
        "numbers of H reshaped out of order",
        _STACK,
        "H has the right shape and its numbers the wrong places: an array was transposed, or its axes taken in "
        "another order, before it was reshaped.",
        "Compare the first row of your H with the first row of the first line's.",
        _stack(lambda _v, _Q, H: {"H": H.transpose(0, 2, 1).reshape(-1, H.shape[2])}),
    ),
    Misconception(
        "block diagonal of nothing",
        _STACK,
        "Without a line, Q has shape (1, 0): that is what scipy's block_diag makes of no block at all. The robot "
        "that sees no wall stops with an error.",
        "Call your function with no line at all, and look at the shapes.",
        block_diagonal_of_nothing,
    ),
    Misconception(
        "the caller's innovations overwritten",
        _STACK,
        "The function writes into its argument v. What it was given is not its own; the filter still needs it.",
        "Which operation makes a new array, and which changes the one that is there?",
        innovations_overwritten,
    ),
)
