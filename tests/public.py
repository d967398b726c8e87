"""What public checks are held to: right functions pass, wrong ones are told what is wrong, every check can fail."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import kill_matrix
from autograder.checks import STAGES
from autograder.misconceptions import of_stage
from roboloc import checks

if TYPE_CHECKING:
    from collections.abc import Callable, Collection
    from types import ModuleType


@functools.cache
def unmet(function: Callable[..., Any], stage: str) -> dict[str, str]:
    """Return the names of the public checks that a function fails, and their messages."""
    report = checks.check(function, stage=stage)
    return {item.name: item.message for item in report.items if item.passed is False}


@dataclass(frozen=True)
class Public:
    """Public checks as their author says they are.

    Attributes
    ----------
    stages : tuple of str
        Which stages they are of.
    findings : dict of str to str
        What a known mistake must be told by, at least: the name of one check.
    """

    stages: tuple[str, ...]
    findings: dict[str, str]

    def hold(
        self,
        stage: str,
        *others: Callable[..., Any],
        seen: Collection[str] = (),
        right: Callable[..., Any] | None = None,
    ) -> None:
        """Assert that a stage's correct versions pass, that each mistake is told, and that no line is right by default.

        Parameters
        ----------
        stage : str
            The stage.
        *others : callable
            Further wrong functions, for what no known mistake fails.
        seen : collection of str
            Checks that another test sees fail.
        right : callable, optional
            The reference, if that of the hidden checks does less.
        """
        for function in (right or STAGES[stage].reference, *kill_matrix.alternatives(STAGES[stage]).values()):
            report = checks.check(function, stage=stage)
            assert report, str(report)
        failed = set(seen)
        for item in of_stage(stage):
            told = unmet(item.function, stage)
            assert self.findings.get(item.name, next(iter(told), None)) in told, item.name
            assert all(told.values()), item.name
            failed |= set(told)
        for function in (*others, lambda *_: ()):
            told = unmet(function, stage)
            assert told, function
            assert all(told.values()), function
            failed |= set(told)
        assert failed == {check.name for check in checks.STAGES[stage]}
        assert set(self.findings) <= {item.name for name in self.stages for item in of_stage(name)}


def words_in(words: str, *modules: ModuleType) -> list[str]:
    """Return which of some words, given with spaces between them, stand in the source of modules."""
    text = "".join(Path(module.__file__).read_text(encoding="utf-8") for module in modules)
    return [word for word in words.split() if word in text]


def writes(reference: Callable[..., Any], *, where: Any = ...) -> Callable[..., Any]:
    """Return a stage that is right and writes to its first argument."""

    def function(*args: Any) -> Any:
        returned = reference(*args)
        args[0][where] += 1.0
        return returned

    return function
