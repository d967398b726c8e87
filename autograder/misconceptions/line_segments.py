"""Wrong versions of `segments` and of `extract_lines`: what is kept of a scan, and in which order."""

from __future__ import annotations

import numpy as np

from autograder.misconceptions.model import Misconception
from autograder.misconceptions.scan_runs import (
    feet,
    found_in,
    keep,
    lengths,
    merge_right,
    segments_right,
    split_right,
)

_SEGMENTS = "extraction.segments"
_EXTRACT = "extraction.extract_lines"


def more_points(
    theta: np.ndarray, rho: np.ndarray, ranges: np.ndarray, lines: np.ndarray, params: dict
) -> tuple:
    """Drop runs of exactly as many points as are needed."""
    more = {**params, "min_points": params["min_points"] + 1}
    return segments_right(theta, rho, ranges, lines, more)


def points_alone(
    theta: np.ndarray, rho: np.ndarray, ranges: np.ndarray, lines: np.ndarray, params: dict
) -> tuple:
    """Ask for points, and not for length."""
    any_length = {**params, "min_segment_length": 0.0}
    return segments_right(theta, rho, ranges, lines, any_length)


def either(theta: np.ndarray, rho: np.ndarray, ranges: np.ndarray, lines: np.ndarray, params: dict) -> tuple:
    """Keep what has points enough or is long enough."""
    ends, size = feet(theta, rho, ranges, lines, 1.0), ranges[:, 1] - ranges[:, 0]
    good = (size >= params["min_points"]) | (lengths(ends) >= params["min_segment_length"])
    return keep(ranges, ends, good)


def not_projected(
    theta: np.ndarray, rho: np.ndarray, ranges: np.ndarray, lines: np.ndarray, params: dict
) -> tuple:
    """Return the first and the last point as they were seen."""
    kept, _ = segments_right(theta, rho, ranges, lines, params)
    return kept, feet(theta, rho, kept, lines, 0.0)


def mirrored(
    theta: np.ndarray, rho: np.ndarray, ranges: np.ndarray, lines: np.ndarray, params: dict
) -> tuple:
    """Move the points away from the line."""
    kept, _ = segments_right(theta, rho, ranges, lines, params)
    return kept, feet(theta, rho, kept, lines, -1.0)


def next_beam(
    theta: np.ndarray, rho: np.ndarray, ranges: np.ndarray, lines: np.ndarray, params: dict
) -> tuple:
    """End with the first beam that does not belong to the run."""
    kept, ends = segments_right(theta, rho, ranges, lines, params)
    for n, (i, j) in enumerate(kept.tolist()):
        k, (alpha, r) = min(j, len(rho) - 1), lines[i, j]
        z = np.exp(1j * alpha) * (r + 1j * rho[k] * np.sin(theta[k] - alpha))
        ends[n, 2:] = z.real, z.imag
    return kept, ends


def runs_shortened(
    theta: np.ndarray, rho: np.ndarray, ranges: np.ndarray, lines: np.ndarray, params: dict
) -> tuple:
    """Turn the caller's half-open runs into first and last beam."""
    result = segments_right(theta, rho, ranges, lines, params)
    ranges[:, 1] -= 1
    return result


def never_merged(theta: np.ndarray, rho: np.ndarray, lines: np.ndarray, params: dict) -> tuple:
    """Leave the runs as splitting left them."""
    seen = np.flatnonzero(np.isfinite(rho))
    beams = theta[seen], rho[seen]
    runs = split_right(*beams, lines, params) if len(seen) else np.zeros((0, 2), dtype=int)
    return found_in(seen, lines, *segments_right(*beams, runs, lines, params))


def dropped_before_merging(theta: np.ndarray, rho: np.ndarray, lines: np.ndarray, params: dict) -> tuple:
    """Drop what is too small first, and merge what is left."""
    seen = np.flatnonzero(np.isfinite(rho))
    beams = theta[seen], rho[seen]
    runs = split_right(*beams, lines, params) if len(seen) else np.zeros((0, 2), dtype=int)
    runs, _ = segments_right(*beams, runs, lines, params)
    runs = merge_right(*beams, runs, lines, params) if len(runs) else runs
    return found_in(seen, lines, runs, feet(*beams, runs, lines, 1.0))


def nothing_dropped(theta: np.ndarray, rho: np.ndarray, lines: np.ndarray, params: dict) -> tuple:
    """Return runs of any size, as long as they are runs."""
    seen = np.flatnonzero(np.isfinite(rho))
    beams = theta[seen], rho[seen]
    runs = split_right(*beams, lines, params) if len(seen) else np.zeros((0, 2), dtype=int)
    return found_in(seen, lines, runs, feet(*beams, runs, lines, 1.0))


def extract_right(theta: np.ndarray, rho: np.ndarray, lines: np.ndarray, params: dict) -> tuple:
    """Split, merge, drop; runs in beams that saw something, and which those are."""
    seen = np.flatnonzero(np.isfinite(rho))
    beams = theta[seen], rho[seen]
    runs = split_right(*beams, lines, params) if len(seen) else np.zeros((0, 2), dtype=int)
    runs = merge_right(*beams, runs, lines, params) if len(runs) else runs
    return seen, *segments_right(*beams, runs, lines, params)


def counted_among_the_seen(theta: np.ndarray, rho: np.ndarray, lines: np.ndarray, params: dict) -> tuple:
    """Count beams among those that saw something."""
    seen, runs, ends = extract_right(theta, rho, lines, params)
    return found_in(np.arange(len(seen)), lines, runs, ends)


def up_to_the_next_seen(theta: np.ndarray, rho: np.ndarray, lines: np.ndarray, params: dict) -> tuple:
    """End a run where the next beam saw something."""
    seen, runs, ends = extract_right(theta, rho, lines, params)
    alpha, r, _, found = found_in(seen, lines, runs, ends)
    for n, (_, j) in enumerate(runs.tolist()):
        found[n, 1] = seen[j] if j < len(seen) else len(rho)
    return alpha, r, ends, found


def cut_at_lost_beams(theta: np.ndarray, rho: np.ndarray, lines: np.ndarray, params: dict) -> tuple:
    """Cut wherever a beam saw nothing."""
    seen, runs, _ = extract_right(theta, rho, lines, params)
    parts = []
    for i, j in runs.tolist():
        cuts = [k for k in range(i + 1, j) if seen[k] - seen[k - 1] > 1]
        parts += list(zip([i, *cuts], [*cuts, j], strict=True))
    runs = np.array(parts, dtype=int).reshape(-1, 2)
    beams = theta[seen], rho[seen]
    return found_in(seen, lines, *segments_right(*beams, runs, lines, params))


def lost_beams_filled(theta: np.ndarray, rho: np.ndarray, lines: np.ndarray, params: dict) -> tuple:
    """Write 0 for NaN into the caller's scan."""
    seen, runs, ends = extract_right(theta, rho, lines, params)
    rho[np.isnan(rho)] = 0.0
    return found_in(seen, lines, runs, ends)


def longest_first(theta: np.ndarray, rho: np.ndarray, lines: np.ndarray, params: dict) -> tuple:
    """Sort the lines by their length."""
    seen, runs, ends = extract_right(theta, rho, lines, params)
    order = np.argsort(-lengths(ends))
    return found_in(seen, lines, runs[order], ends[order])


_ONE = "Take one run of exactly min_points points, and print what becomes of it."
_LINE = "Put an end into x cos(alpha) + y sin(alpha), and compare with r."
_LOST = "Take a scan of five beams of which the second saw nothing, and count."
_STEPS = "Print the runs after every step, for a wall that splitting has cut too often."
MISCONCEPTIONS = (
    Misconception(
        "one point more than needed",
        _SEGMENTS,
        "A run of exactly min_points points is dropped. What has fewer is dropped, and what has as many stays.",
        _ONE,
        more_points,
    ),
    Misconception(
        "length not asked for",
        _SEGMENTS,
        "Short segments are kept as long as they have points enough. Near the scanner the beams are close together: a "
        "leg of a table has ten points, and the direction of its line means nothing.",
        "Which of the four parameters does your function not use?",
        points_alone,
    ),
    Misconception(
        "points or length",
        _SEGMENTS,
        "A run is kept if it has points enough or is long enough. It has to have and to be.",
        "Which runs are dropped for their points, and which for their length? What is left?",
        either,
    ),
    Misconception(
        "ends as they were seen",
        _SEGMENTS,
        "The first and the last point are returned as they were measured. They have the errors of a single beam, and "
        "are beside the line that is returned with them.",
        _LINE,
        not_projected,
    ),
    Misconception(
        "moved away from the line",
        _SEGMENTS,
        "The ends are moved across the line by the right distance, to the wrong side: they are now twice as far from "
        "the line as the points were.",
        _LINE,
        mirrored,
    ),
    Misconception(
        "end of the next run",
        _SEGMENTS,
        "The segment ends at beam number j, which is the first that does not belong to the run [i, j), and "
        "beyond a gap "
        "or a corner it is on another wall.",
        "Which is the last beam of the run [3, 5)?",
        next_beam,
    ),
    Misconception(
        "the caller's runs shortened",
        _SEGMENTS,
        "The runs are turned into first and last beam in the caller's own array, which then means something else.",
        "An array that is handed over is not copied; which operation makes a new one?",
        runs_shortened,
    ),
    Misconception(
        "never merged",
        _EXTRACT,
        "The runs go from splitting to measuring without being merged. Where a run had several corners a first cut "
        "often falls inside a wall, and that wall stays in pieces.",
        _STEPS,
        never_merged,
    ),
    Misconception(
        "dropped before merging",
        _EXTRACT,
        "What is too small is dropped before the pieces are joined. A small piece may be the missing part of "
        "a wall, and "
        "without it the rest of that wall is shorter, or in two.",
        _STEPS,
        dropped_before_merging,
    ),
    Misconception(
        "split alone",
        _EXTRACT,
        "Everything that splitting leaves is returned, in pieces and of any size. Small pieces near a corner are lines "
        "of two or three points, whose direction is noise.",
        _STEPS,
        nothing_dropped,
    ),
    Misconception(
        "beams counted among the seen",
        _EXTRACT,
        "The beams are counted among those that saw something. The caller has the whole scan, where every "
        "beam that was "
        "lost shifts the count by one.",
        _LOST,
        counted_among_the_seen,
    ),
    Misconception(
        "lost beams behind the wall",
        _EXTRACT,
        "A run ends where the next beam saw something, so that lost beams behind its last point are counted to it. The "
        "end is the last beam that belongs to it, and one.",
        _LOST,
        up_to_the_next_seen,
    ),
    Misconception(
        "cut at every lost beam",
        _EXTRACT,
        "A beam that saw nothing is taken for a gap. One lost beam is no doorway: its neighbours are close "
        "together, and "
        "how close a wall needs is what max_point_gap says.",
        "How far apart are the points on both sides of a lost beam?",
        cut_at_lost_beams,
    ),
    Misconception(
        "longest line first",
        _EXTRACT,
        "The lines are sorted by length. Here they come in the order of their beams.",
        "In which order are the lines to be?",
        longest_first,
    ),
    Misconception(
        "lost beams filled in place",
        _EXTRACT,
        "NaN is overwritten with 0 in the caller's scan, which then has points in the middle of the scanner.",
        "An array that is handed over is not copied; which operation makes a new one?",
        lost_beams_filled,
    ),
)
