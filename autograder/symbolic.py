"""Symbolic answers: what a student's SymPy expression must be worth at random points.

Two expressions are the same function if they agree wherever one looks, however they are written. The
student's object stays where it is; :func:`autograder.remote.evaluate` asks its process for the numbers, and
the comparison is made here.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from autograder.check import Check, Stage
from autograder.compare import compare

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.random import Generator

_POINTS = 6
_SYMBOLS = "Only the given symbols may occur in it."
# Expressions are evaluated away from their removable singularities, where a few digits can cancel at most.
_RELATIVE = 1e-9


@dataclass(frozen=True)
class Expression:
    """A symbolic answer: its name, its value at given values of the symbols, and how such values are drawn.

    `value(values)` is the trusted (rows, columns) matrix; `point(rng)` maps names of symbols to numbers.
    """

    name: str
    value: Callable[[dict[str, float]], np.ndarray]
    point: Callable[[Generator], dict[str, float]]
    hint: str = ""
    rows: tuple[str, ...] = ()
    columns: tuple[str, ...] = ()

    def stage(self) -> Stage:
        """Return the answer as a stage of one output, checked at random points.

        The stage's function takes the values of the symbols and returns the value of the expression.
        """
        output = self.name.rpartition(".")[2]
        stage = Stage(
            name=self.name,
            outputs=(output,),
            reference=self.value,
            tolerance=lambda values: _tolerance(self.value(values)),
            checks=(),
            rows={output: self.rows},
            columns={output: self.columns},
            action="evaluating the answer",
        )

        def equal(function: Callable[..., Any], rng: Generator) -> None:
            points = [self.point(rng) for _ in range(_POINTS)]
            compare(function, (stage.case(values) for values in points))

        return replace(
            stage, checks=(Check(f"{output} equals what one derives", 1, equal, f"{self.hint} {_SYMBOLS}"),)
        )


def _tolerance(expected: np.ndarray) -> np.ndarray:
    return np.full(expected.shape, _RELATIVE * (1 + np.abs(expected).max()))


def evaluated(
    evaluate: Callable[[Any, dict[str, float]], Any], target: Any
) -> Callable[[dict[str, float]], Any]:
    """Make the function of a stage out of a student's expression.

    A value with a negligible imaginary part is real: SymPy leaves one behind where it integrates by
    exponentials.
    """

    def function(values: dict[str, float]) -> Any:
        result = evaluate(target, dict(values))
        if isinstance(result, (complex, np.complexfloating)) or (
            isinstance(result, np.ndarray) and result.dtype.kind == "c"
        ):
            array = np.asarray(result)
            small = _RELATIVE * (1 + float(np.nanmax(np.abs(array), initial=0.0)))
            if np.isfinite(array).all() and float(np.abs(array.imag).max(initial=0.0)) <= small:
                return np.real(array)
        return result

    return function
