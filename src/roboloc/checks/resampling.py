"""Public checks of systematic resampling: worked combs, and laws that every right choice of particles obeys."""

import numpy as np

from roboloc.checks.report import Caller, Check, Wrong, text

_WORKED = (
    ("four particles, one of three quarters of the weight", (0.0, 0.75, 0.25, 0.0), 0.1, (1, 1, 1, 2)),
    ("three particles of which the second takes the third's place", (0.5, 0.3, 0.2), 0.1, (0, 0, 1)),
    ("equal weights", (0.25, 0.25, 0.25, 0.25), 0.2, (0, 1, 2, 3)),
    ("two passed over at once", (0.4, 0.02, 0.02, 0.56), 0.2, (0, 3, 3, 3)),
)
_UNEVEN = (0.07, 0.31, 0.02, 0.13, 0.05, 0.25, 0.17)
_OFFSETS = (0.0, 0.01, 0.05, 0.09, 0.14)


def _taken(caller: Caller, ws: tuple, offset: float) -> np.ndarray:
    ws = np.array(ws)
    (ancestors,) = caller((ws, offset), {"ancestors": (len(ws),)})
    wrong = [a for a in ancestors if a not in range(len(ws))]
    if wrong:
        raise Wrong(
            f"For the weights {text(ws)} and the offset {text(offset)}\nancestors holds {text(wrong[0])}: "
            f"the indices of {len(ws)} particles go from 0 to {len(ws) - 1}."
        )
    return ancestors


def _worked(caller: Caller) -> None:
    for story, ws, offset, expected in _WORKED:
        ancestors = _taken(caller, ws, offset)
        if not np.array_equal(ancestors, expected):
            raise Wrong(
                f"For {story}, weights {text(ws)}, offset {text(offset)}:\nexpected {text(expected)}, "
                f"got {text(ancestors)}"
            )


def _fair(caller: Caller) -> None:
    for offset in _OFFSETS:
        share = len(_UNEVEN) * np.array(_UNEVEN)
        copies = np.bincount(_taken(caller, _UNEVEN, offset).astype(int), minlength=len(_UNEVEN))
        if (np.abs(copies - share) >= 1.0).any():
            i = int(np.argmax(np.abs(copies - share)))
            raise Wrong(
                f"For the weights {text(_UNEVEN)} and the offset {text(offset)}\nparticle {i} should be taken "
                f"{text(share[i])} times, rounded up or down, and is taken {copies[i]} times."
            )


def _average(caller: Caller) -> None:
    M = len(_UNEVEN)
    offsets = (np.arange(200) + 0.5) / (200 * M)
    copies = (
        sum(np.bincount(_taken(caller, _UNEVEN, float(o)).astype(int), minlength=M) for o in offsets) / 200
    )
    if np.max(np.abs(copies - M * np.array(_UNEVEN))) > 0.02:
        raise Wrong(
            f"For the weights {text(_UNEVEN)} and 200 offsets from 0 to 1/M the particles are taken\n{text(copies)} "
            f"times on average,\nexpected {text(M * np.array(_UNEVEN))}"
        )


def _any_total(caller: Caller) -> None:
    for scale in (10.0, 0.01):
        for offset in _OFFSETS[1:]:
            one, other = (_taken(caller, tuple(s * w for w in _UNEVEN), offset) for s in (1.0, scale))
            if not np.array_equal(one, other):
                raise Wrong(
                    f"All weights times {text(scale)} are the same belief, but for the offset {text(offset)} other "
                    f"particles are taken:\n{text(other)}, before {text(one)}"
                )


def _no_weight(caller: Caller) -> None:
    for ws in ((0.0, 1.0), (0.0, 0.0, 0.4, 0.6), (0.0, 0.5, 0.0, 0.5)):
        ancestors = _taken(caller, ws, 0.0)
        if any(ws[int(a)] == 0.0 for a in ancestors):
            raise Wrong(
                f"For the weights {text(ws)} and the offset 0\na particle of weight 0 is taken: {text(ancestors)}"
            )


def _largest(caller: Caller) -> None:
    for ws in ((0.5, 0.5), (0.2, 0.3, 0.4, 0.3, 0.8)):
        offset = float(np.nextafter(1.0 / len(ws), 0.0))
        ancestors = _taken(caller, ws, offset)
        if ancestors[-1] != len(ws) - 1:
            raise Wrong(
                f"For the weights {text(ws)} and the largest offset below 1/M\nthe last place should go to the last "
                f"particle, but ancestors is {text(ancestors)}"
            )


def _untouched(caller: Caller) -> None:
    _taken(caller, (3.0, 1.0, 2.0), 0.2)
    if caller.written_to:
        raise Wrong("The function writes to its argument ws. Work on a copy: np.array(ws).")


SYSTEMATIC_RESAMPLE = (
    Check("returns ancestors (M,)", lambda caller: _taken(caller, _UNEVEN, 0.05) is None or None),
    Check("combs worked by hand", _worked),
    Check("each particle is taken as often as it weighs, but for one", _fair),
    Check("and exactly so on average over all offsets", _average),
    Check("the sum of the weights does not matter", _any_total),
    Check("no particle of weight 0 is taken", _no_weight),
    Check("the largest offset leads to the last particle", _largest),
    Check("leaves its arguments as they were", _untouched),
)
"""Checks of ``systematic_resample(ws, offset) -> ancestors``."""
