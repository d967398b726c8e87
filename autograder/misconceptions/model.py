"""What a misconception is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable


def _always(*_args: Any) -> bool:
    return True


@dataclass(frozen=True)
class Misconception:
    """One wrong version of a stage.

    `explanation` says what the mistake is and why people make it, `hint` where to look, neither what the
    answer is. `function` differs from the right one by the named fault alone. `determined(args)` is false
    where its numbers are rounding noise, which another program with the same mistake need not share.
    """

    name: str
    stage: str
    explanation: str
    hint: str
    function: Callable[..., Any]
    determined: Callable[..., bool] = _always
