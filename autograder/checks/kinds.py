"""Kinds of checks that every stage shares: right outputs, untouched arguments, no memory of earlier calls.

Each function makes the `run` of a :class:`autograder.check.Check` from a maker of cases.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from autograder.check import CallError, Case
from autograder.compare import as_numbers, compare, right_outputs

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.random import Generator

_NOT_JUDGED = "not judged: of what the calls returned, nothing that this check looks at is right yet"


def each(cases: Callable[[Generator], tuple[Case, ...]], *names: str) -> Callable[[Any, Generator], None]:
    """Make the check that the named outputs are right in every case."""

    def run(function: Callable[..., Any], rng: Generator) -> None:
        compare(function, cases(rng), *names)

    return run


def untouched(
    cases: Callable[[Generator], tuple[Case, ...]], names: tuple[str, ...], wanted: frozenset[str]
) -> Callable[[Any, Generator], None]:
    """Make the check that no argument is written to; judged only where some call returned something right."""

    def run(function: Callable[..., Any], rng: Generator) -> None:
        right: set[str] = set()
        for case in cases(rng):
            given = case.fresh()
            try:
                right.update(right_outputs(case, function(*given)))
            except CallError as error:
                if error.final:
                    raise
            changed = [
                name for name, now, was in zip(names, given, case.args, strict=True) if not _same(now, was)
            ]
            if changed:
                raise AssertionError(
                    f"the call changed its argument {', '.join(changed)}; the caller still needs it"
                )
        if not right & wanted:
            raise AssertionError(_NOT_JUDGED)

    return run


def _same(now: Any, was: Any) -> bool:
    if isinstance(was, np.random.Generator):
        return True  # it is there to be drawn from
    if isinstance(was, np.ndarray):
        nan = was.dtype.kind in "fc"
        return (
            isinstance(now, np.ndarray) and now.dtype == was.dtype and np.array_equal(now, was, equal_nan=nan)
        )
    return type(now) is type(was) and now == was


def repeatable(
    cases: Callable[[Generator], tuple[Case, ...]], wanted: frozenset[str]
) -> Callable[[Any, Generator], None]:
    """Make the check that calls give the same again after calls with other arguments."""

    def run(function: Callable[..., Any], rng: Generator) -> None:
        first = [_right(function, case) & wanted for case in cases(rng)]
        if not any(first):
            raise AssertionError(_NOT_JUDGED)
        again = [_right(function, case) for case in cases(rng)]
        lost = {name for before, now in zip(first, again, strict=True) for name in before - now}
        if lost:
            raise AssertionError(
                f"the same call gave another {', '.join(sorted(lost))} after calls with other arguments: "
                "the result depends on something besides the arguments"
            )

    return run


def seeded(
    cases: Callable[[Generator], tuple[Case, ...]], wanted: frozenset[str] | None = None
) -> Callable[[Any, Generator], None]:
    """Make the check that samples are drawn from the given generator alone: the same state, the same samples.

    It is judged only where something that is `wanted`, or anything, is right.
    """

    def run(function: Callable[..., Any], rng: Generator) -> None:
        judged = False
        for case in cases(rng):
            first = function(*case.fresh())
            right = set(right_outputs(case, first))
            if not (right if wanted is None else right & wanted):
                continue
            judged = True
            if not _same_numbers(first, function(*case.fresh())):
                raise AssertionError(
                    "two calls with generators in the same state gave different samples: "
                    "every draw must come from the generator that is given"
                )
        if not judged:
            raise AssertionError(_NOT_JUDGED)

    return run


def _same_numbers(a: Any, b: Any) -> bool:
    if type(a) in {tuple, list}:
        return type(a) is type(b) and len(a) == len(b) and all(map(_same_numbers, a, b))
    a, b = as_numbers(a), as_numbers(b)
    return a is not None and b is not None and np.array_equal(a, b)


def _right(function: Callable[..., Any], case: Case) -> set[str]:
    """Call the function and return the outputs that are right; none if it raises."""
    try:
        return set(right_outputs(case, function(*case.fresh())))
    except CallError as error:
        if error.final:
            raise
        return set()
