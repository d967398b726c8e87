"""Public checks of association and of the stacked measurement: worked numbers, and where each number belongs."""

from math import pi

import numpy as np

from roboloc.checks.report import Caller, Check, Wrong, text

_SCENE = ("z_raw", "Q_raw", "hs", "Hs", "Sigma", "g")
_STACK = ("v", "Q", "H")
_TENTH = np.diag([0.01, 0.01])

# Three walls, and derivatives that tell them apart: ahead, to the left, and straight behind.
_WALLS = ((0.0, pi / 2, 3.1), (2.0, 3.0, 4.0))
_H = np.array(
    [
        [[1.0, 0.0, 2.0], [0.0, 1.0, -1.0]],
        [[0.0, 2.0, 1.0], [1.0, 0.0, 3.0]],
        [[1.0, 1.0, 0.0], [0.0, 0.0, 4.0]],
    ]
)
_SURE = 1e-6 * np.eye(3)


def _associate(
    caller: Caller,
    lines: tuple,
    Q_raw: list,
    walls: tuple,
    Hs: np.ndarray,
    Sigma: np.ndarray,
    g: float,
    count: int,
) -> tuple[np.ndarray, ...]:
    """Call the function where `count` lines must be kept; observed `lines` and `walls` are given as rows."""
    z_raw, hs = np.array(lines, dtype=float).reshape(-1, 2).T.copy(), np.array(walls, dtype=float)
    Q_raw = np.array(Q_raw, dtype=float).reshape(-1, 2, 2)
    shapes = {"v": (count, 2), "Q": (count, 2, 2), "H": (count, 2, len(Sigma))}
    return caller((z_raw, Q_raw, hs, np.array(Hs), np.array(Sigma), float(g)), shapes)


def _worked(
    name: str,
    story: str,
    *,
    lines: tuple,
    kept: tuple,
    chosen: tuple,
    v: tuple,
    Q_raw: tuple = (),
    walls: tuple = _WALLS,
    Hs: np.ndarray = _H,
    Sigma: np.ndarray = _SURE,
    g: float = 3.0,
) -> Check:
    """Make a check of one scene: which lines are kept, which walls they get, and the innovations by hand."""
    covariances = np.array(Q_raw if len(Q_raw) else [_TENTH] * len(lines), dtype=float)

    def check(caller: Caller) -> None:
        try:
            got = _associate(caller, lines, covariances, walls, Hs, Sigma, g, len(kept))
        except Wrong as fault:
            raise Wrong(f"{story}\n{fault}") from None
        expected = np.reshape(v, (-1, 2)), covariances[list(kept)], Hs[list(chosen)]
        for key, wanted, value in zip("vQH", expected, got, strict=True):
            if np.abs(wanted - value).max(initial=0.0) > 1e-9:
                raise Wrong(f"{story}\nexpected {key} = {text(wanted)}\ngot      {key} = {text(value)}")

    return Check(name, check)


def _returns(caller: Caller) -> None:
    _associate(caller, ((0.0, 2.1),), [_TENTH], _WALLS, _H, np.eye(3), 3.0, 1)


def _sizes(caller: Caller) -> None:
    rng = np.random.default_rng(1)
    for n in (2, 5):
        Hs = rng.normal(size=(3, 2, n))
        _, _, H = _associate(caller, ((0.0, 2.1),), [_TENTH], _WALLS, Hs, 1e-3 * np.eye(n), 3.0, 1)
        if np.abs(H[0] - Hs[0]).max() > 1e-9:
            raise Wrong(
                f"With a state of {n} numbers, the line 0.1 m behind the first wall got another wall's H."
            )


def _unseen(caller: Caller) -> None:
    _associate(caller, (), [], _WALLS, _H, _SURE, 3.0, 0)


def _untouched_scene(caller: Caller) -> None:
    _associate(caller, ((0.05, 2.1), (1.5, 2.9)), [_TENTH] * 2, _WALLS, _H, _SURE, 3.0, 2)
    for i in caller.written_to:
        raise Wrong(
            f"The function writes to its argument {_SCENE[i]}. A column such as z_raw[:, i] is a view: "
            "make a new array instead (no -=)."
        )


_LONG_NORMAL = np.array([[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], [[0.0, 0.0, 1.0], [0.0, 0.0, 0.0]]])

COMPUTE_INNOVATIONS = (
    Check("returns v (K, 2), Q (K, 2, 2), H (K, 2, n)", _returns),
    _worked(
        "each line goes to its wall, in the order of the lines",
        "Walls are expected ahead, to the left and behind; lines are observed to the left, then ahead:",
        lines=((1.6, 2.9), (0.1, 2.05)),
        Q_raw=(((0.01, 0.002), (0.002, 0.02)), ((0.03, 0.0), (0.0, 0.01))),
        kept=(0, 1),
        chosen=(1, 0),
        v=((1.6 - pi / 2, -0.1), (0.1, 0.05)),
    ),
    _worked(
        "angles are compared across the cut at pi",
        "The wall behind is expected at 3.1 rad and observed at -3.1 rad, which is 0.083 rad further, not 6.2 back:",
        lines=((-3.1, 4.0),),
        kept=(0,),
        chosen=(2,),
        v=((2 * pi - 6.2, 0.0),),
    ),
    _worked(
        "two standard deviations are inside a gate of 3",
        "With a standard deviation of 0.1 m a line 0.2 m too far is 2 of them off, and the gate is 3:",
        lines=((0.0, 2.2),),
        kept=(0,),
        chosen=(0,),
        v=((0.0, 0.2),),
    ),
    _worked(
        "four standard deviations are outside a gate of 3",
        "One line is 0.4 m too far, 4 standard deviations; the other fits. Only the second is kept:",
        lines=((0.0, 2.4), (1.5, 3.0)),
        Q_raw=(_TENTH, 2 * _TENTH),
        kept=(1,),
        chosen=(1,),
        v=((1.5 - pi / 2, 0.0),),
    ),
    _worked(
        "a doubtful pose widens the gate",
        "The robot does not know to 0.5 m how far the wall ahead is, so a line 0.4 m too far is no surprise:",
        lines=((0.0, 2.4),),
        kept=(0,),
        chosen=(0,),
        v=((0.0, 0.4),),
        walls=((0.0, 1.5), (2.0, 3.0)),
        Hs=_LONG_NORMAL,
        Sigma=np.diag([0.25, 0.0, 0.0]),
    ),
    _worked(
        "the nearest wall is not the one that looks nearest",
        "The distance of the first wall is in doubt, the direction of the second is not: 0.5 m off the first is less\n"
        "of a surprise than 0.3 rad off the second:",
        lines=((0.0, 2.5),),
        kept=(0,),
        chosen=(0,),
        v=((0.0, 0.5),),
        walls=((0.0, 0.3), (2.0, 2.5)),
        Hs=_LONG_NORMAL,
        Sigma=np.diag([1.0, 0.0, 0.0]),
        g=10.0,
    ),
    _worked(
        "of two walls inside the gate the nearer is taken",
        "Two walls are expected 2.0 and 2.2 m ahead, and a line is observed at 2.15 m:",
        lines=((0.0, 2.15),),
        kept=(0,),
        chosen=(1,),
        v=((0.0, -0.05),),
        walls=((0.0, 0.0), (2.0, 2.2)),
        Hs=_LONG_NORMAL,
    ),
    _worked(
        "two lines may belong to one wall",
        "The wall ahead is seen on both sides of a door:",
        lines=((0.05, 2.0), (-0.05, 2.1)),
        kept=(0, 1),
        chosen=(0, 0),
        v=((0.05, 0.0), (-0.05, 0.1)),
    ),
    _worked(
        "nothing inside the gate leaves no rows",
        "A person stands in the way, a metre from any wall:",
        lines=((0.0, 1.0),),
        kept=(),
        chosen=(),
        v=(),
    ),
    Check("no line leaves no rows", _unseen),
    Check("works for states of any size", _sizes),
    Check("leaves its arguments as they were", _untouched_scene),
)
"""Checks of ``compute_innovations(z_raw, Q_raw, hs, Hs, Sigma, g) -> v, Q, H``."""


def _stack(caller: Caller, count: int, n: int = 3) -> tuple[tuple[np.ndarray, ...], tuple[np.ndarray, ...]]:
    """Call the function on lines whose numbers say where they come from; return arguments and results."""
    line = np.arange(1.0, count + 1)
    v = np.stack([line + 0.1, line + 0.2], axis=1)
    Q = line[:, None, None] * np.array([[2.0, 0.5], [0.5, 1.0]])
    H = 10 * line[:, None, None] + np.arange(2.0 * n).reshape(2, n)
    shapes = {"z": (2 * count,), "Q": (2 * count, 2 * count), "H": (2 * count, n)}
    return (v, Q, H), caller((v, Q, H), shapes)


def _stack_returns(caller: Caller) -> None:
    _stack(caller, 2)


def _numbers(caller: Caller) -> None:
    _, (z, _, _) = _stack(caller, 3)
    expected = (1.1, 1.2, 2.1, 2.2, 3.1, 3.2)
    if np.abs(z - expected).max() > 1e-9:
        raise Wrong(
            f"Three lines with innovations (1.1, 1.2), (2.1, 2.2), (3.1, 3.2)\nexpected z = {text(expected)}\n"
            f"got      z = {text(z)}"
        )


def _blocks(caller: Caller) -> None:
    (_, blocks, _), (_, Q, _) = _stack(caller, 3)
    for k in range(3):
        for m in range(3):
            part = Q[2 * k : 2 * k + 2, 2 * m : 2 * m + 2]
            wanted = blocks[k] if k == m else np.zeros((2, 2))
            if np.abs(part - wanted).max() > 1e-9:
                which = f"of line {k}" if k == m else f"of the errors of line {k} with those of line {m}"
                raise Wrong(f"The covariance {which} should be {text(wanted)}, but in Q it is {text(part)}.")


def _rows(caller: Caller) -> None:
    (_, _, given), (_, _, H) = _stack(caller, 3)
    for k in range(6):
        wanted = given[k // 2, k % 2]
        if np.abs(H[k] - wanted).max() > 1e-9:
            name = ("alpha", "r")[k % 2]
            raise Wrong(
                f"Row {k} of H should be the derivative of {name} of line {k // 2}, {text(wanted)},\n"
                f"but it is {text(H[k])}."
            )


def _few(caller: Caller) -> None:
    _stack(caller, 1)
    _stack(caller, 0)


def _wide(caller: Caller) -> None:
    for n in (2, 5):
        _stack(caller, 2, n)


def _untouched_stack(caller: Caller) -> None:
    _stack(caller, 2)
    for i in caller.written_to:
        raise Wrong(f"The function writes to its argument {_STACK[i]}. Make a new array instead.")


MEASUREMENT_MODEL = (
    Check("returns z (2K,), Q (2K, 2K), H (2K, n)", _stack_returns),
    Check("z is one line after another", _numbers),
    Check("Q is one block after another on the diagonal", _blocks),
    Check("the rows of H go with the numbers of z", _rows),
    Check("works for one line and for none", _few),
    Check("works for states of any size", _wide),
    Check("leaves its arguments as they were", _untouched_stack),
)
"""Checks of ``measurement_model(v, Q, H) -> z, Q, H``."""
