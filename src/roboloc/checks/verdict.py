"""Public checks of what judges filters: errors, regions and intervals worked by hand, and laws that they obey."""

from collections.abc import Callable

import numpy as np

from roboloc.checks.report import Caller, Check, Wrong, text

_PICKS = np.array([[0, 1, 2, 3], [3, 3, 0, 1], [2, 2, 2, 2], [1, 0, 0, 3], [1, 1, 2, 3]])


def _rms(caller: Caller, poses: object, truth: object) -> tuple:
    poses, truth = np.array(poses, dtype=float), np.array(truth, dtype=float)
    return caller((poses, truth), {"position": (poses.shape[1],), "heading": (poses.shape[1],)})


def _expect(name: str, story: str, got: object, expected: object) -> None:
    if not np.allclose(got, expected, rtol=0, atol=1e-8):
        raise Wrong(f"{story}:\nexpected {name} = {text(expected)}, got {text(got)}")


def _rms_shape(caller: Caller) -> None:
    _rms(caller, np.zeros((4, 3, 3)), np.zeros((4, 3, 3)))


def _distances(caller: Caller) -> None:
    position, _ = _rms(caller, [[[3, 4, 0]]], [[[0, 0, 0]]])
    _expect("position", "One run, 3 m off to the east and 4 m to the north", position, [5])
    position, _ = _rms(caller, [[[1, 0, 0]], [[-7, 0, 0]]], np.zeros((2, 1, 3)))
    _expect("position", "Two runs, 1 m too far east and 7 m too far west", position, [5])


def _cut(caller: Caller) -> None:
    _, heading = _rms(caller, [[[0, 0, 3.0]]], [[[0, 0, -3.0]]])
    _expect("heading", "A heading of 3 rad where it is -3 rad", heading, [2 * np.pi - 6])
    _, heading = _rms(caller, [[[0, 0, 0.1 + 6 * np.pi]]], [[[0, 0, 0]]])
    _expect("heading", "A heading three turns and 0.1 rad on", heading, [0.1])


def _share(caller: Caller, errors: object, covs: object, probability: float) -> np.ndarray:
    errors, covs = np.array(errors, dtype=float), np.array(covs, dtype=float)
    (share,) = caller((errors, covs, probability), {"share": (errors.shape[1],)})
    return share


def _share_shape(caller: Caller) -> None:
    _share(caller, np.zeros((4, 3, 2)), np.broadcast_to(np.eye(2), (4, 3, 2, 2)), 0.9)


def _tables(caller: Caller) -> None:
    for n, known in ((1, 3.841), (2, 5.991), (3, 7.815)):
        for factor, inside in ((0.98, 1), (1.02, 0)):
            errors = np.zeros((1, 1, n))
            errors[0, 0, -1] = np.sqrt(factor * known)
            story = f"{n} numbers, squared {factor * known:.3g}, unit covariance, 95 percent (table: {known})"
            _expect("share", story, _share(caller, errors, np.eye(n)[None, None], 0.95), [inside])


def _own_claim(caller: Caller) -> None:
    errors, covs = [[[1.0]], [[1.0]]], [[[[0.01]]], [[[100.0]]]]
    _expect(
        "share", "Two errors of 1, one known to 0.1 and one to 10", _share(caller, errors, covs, 0.95), [0.5]
    )


def _slanted(caller: Caller) -> None:
    covs = np.broadcast_to([[1.0, 0.9], [0.9, 1.0]], (1, 2, 2, 2))
    share = _share(caller, [[[2, 2], [1.5, -1.5]]], covs, 0.95)
    _expect("share", "Errors (2, 2) and (1.5, -1.5) of covariance ((1, 0.9), (0.9, 1))", share, [1, 0])


def _mean(caller: Caller, values: object) -> tuple:
    mean, error = caller((np.array(values, dtype=float),), {"mean": (), "error": ()})
    return float(mean), float(error)


def _mean_shape(caller: Caller) -> None:
    _mean(caller, np.arange(12).reshape(3, 4))


def _two(caller: Caller) -> None:
    mean, error = _mean(caller, [[1.0, 3.0], [4.0, 4.0]])
    _expect("mean", "Two runs, (1, 3) and (4, 4)", mean, 3)
    _expect("error", "Two runs of means 2 and 4, so with a variance of 2", error, 1)


def _repeated(caller: Caller) -> None:
    values = np.array([[1.0, 2.0], [5.0, 3.0], [2.0, 8.0]])
    one, ten = _mean(caller, values), _mean(caller, np.repeat(values, 10, axis=1))
    _expect("error", "Every instant ten times over tells nothing new", ten[1], one[1])


def _interval(caller: Caller, a: object, b: object, picks: object, probability: float) -> tuple:
    arguments = (np.array(a, dtype=float), np.array(b, dtype=float), np.array(picks), probability)
    low, high = caller(arguments, {"low": (), "high": ()})
    return float(low), float(high)


def _interval_shape(caller: Caller) -> None:
    _interval(caller, [1, 2, 3, 4], [0, 0, 0, 0], _PICKS, 0.9)


def _always_one(caller: Caller) -> None:
    a = np.array([5.0, 90.0, 1.0, 7.0])
    ends = _interval(caller, a, a - 1, _PICKS, 0.9)
    _expect("low, high", "A filter that is worse by 1 in every run", ends, (1, 1))


def _half(caller: Caller) -> None:
    picks = np.repeat(np.arange(5)[:, None], 5, axis=1)
    ends = _interval(caller, [0, 10, 20, 30, 40], np.zeros(5), picks, 0.5)
    _expect("low, high", "Five draws of means 0, 10, 20, 30, 40, and the half in the middle", ends, (10, 30))
    ends = _interval(caller, [0, 10, 20, 30, 40], [40, 30, 20, 10, 0], picks, 0.5)
    story = "Five draws of means 0, 10, 20, 30, 40, less 40, 30, 20, 10, 0, and the half in the middle"
    _expect("low, high", story, ends, (-20, 20))


def _one_hard_run(caller: Caller) -> None:
    picks = [[0, 1, 2, 3], [3, 1, 1, 2], [0, 3, 0, 0]]
    ends = _interval(caller, [0, 0, 0, 8], np.zeros(4), picks, 0.8)
    _expect("low, high", "Three draws, each with three runs of 0 and one of 8, so of mean 2", ends, (2, 2))


def _untouched(call: Callable, *arguments: object) -> Check:
    names = {
        _rms: ("poses", "truth"),
        _share: ("errors", "covs", "probability"),
        _mean: ("values",),
        _interval: ("a", "b", "picks", "probability"),
    }[call]

    def untouched(caller: Caller) -> None:
        call(caller, *arguments)
        for i in caller.written_to:
            raise Wrong(f"The function writes to its argument {names[i]}. Work on a copy.")

    return Check("leaves its arguments as they were", untouched)


_RUNS = np.arange(18.0).reshape(3, 2, 3) / 5
RMS_ERRORS = (
    Check("returns position (N,), heading (N,)", _rms_shape),
    Check("distances worked by hand", _distances),
    Check("headings across the cut, and of many turns", _cut),
    _untouched(_rms, _RUNS, _RUNS[::-1] + 1),
)
"""Checks of ``rms_errors(poses, truth) -> position, heading``."""
COVERAGE = (
    Check("returns a share for each instant (N,)", _share_shape),
    Check("bounds from a table", _tables),
    Check("every run by its own claim", _own_claim),
    Check("along and across a narrow ellipse", _slanted),
    _untouched(_share, _RUNS, np.tile(2 * np.eye(3), (3, 2, 1, 1)), 0.9),
)
"""Checks of ``coverage(errors, covs, probability) -> share``."""
MEAN_AND_ERROR = (
    Check("returns two numbers", _mean_shape),
    Check("two runs worked by hand", _two),
    Check("repeated instants add no precision", _repeated),
    _untouched(_mean, _RUNS[0]),
)
"""Checks of ``mean_and_error(values) -> mean, error``."""
PAIRED_INTERVAL = (
    Check("returns two numbers", _interval_shape),
    Check("a filter that is worse by the same in every run", _always_one),
    Check("five draws worked by hand", _half),
    Check("one hard run in every draw", _one_hard_run),
    _untouched(_interval, [4, 1, 3, 2], [1, 2, 5, 3], _PICKS, 0.7),
)
"""Checks of ``paired_interval(a, b, picks, probability) -> low, high``."""
