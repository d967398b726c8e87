"""Print which wrong versions of the stages the hidden checks catch, and which correct ones they let pass.

Every misconception must lose points and be recognised by name, every alternative way of writing a stage must
get them all, whatever the course's secret. Each column is a check: ``.`` passes with every secret, ``X``
fails with every one, a number says with how many it fails. The exit status is 0 if all holds.

Usage: ``python tools/kill_matrix.py [--secrets N]``
"""

from __future__ import annotations

import argparse
import importlib.util
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from autograder.check import run_stage
from autograder.checks import EXPRESSIONS, STAGES, SUBJECTS
from autograder.diagnose import diagnose
from autograder.misconceptions import of_stage

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from autograder.check import Stage

ALTERNATIVES = Path(__file__).resolve().parents[1] / "tests" / "autograder" / "alternatives"


@dataclass(frozen=True)
class Row:
    """One version of a stage: how often each check failed, the shares of the points, what was recognised."""

    name: str
    wrong: bool
    failures: tuple[int, ...]
    shares: frozenset[float]
    recognised: frozenset[tuple[str, ...]]

    @property
    def holds(self) -> bool:
        """A wrong version loses points and is recognised, a correct one loses none, with every secret."""
        if self.wrong:
            return max(self.shares) < 1 and self.recognised == {(self.name,)}
        return self.shares == {1.0}


def stages() -> dict[str, Stage]:
    """Return all stages, symbolic answers included."""
    return STAGES | {name: expression.stage() for name, expression in EXPRESSIONS.items()}


def alternatives(stage: Stage) -> dict[str, Callable[..., Any]]:
    """Load the correct versions of a stage that are not the reference, from the folder of its subject."""
    found = {}
    for path in sorted((ALTERNATIVES / SUBJECTS[stage.name]).glob("*.py")):
        spec = importlib.util.spec_from_file_location(f"alternative_{path.stem}", path)
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        if hasattr(module, stage.function_name):
            found[path.stem] = getattr(module, stage.function_name)
    return found


def rows(stage: Stage, secrets: list[str]) -> Iterator[Row]:
    """Run the checks of a stage on every version with every secret."""
    correct = {"reference": stage.reference} | alternatives(stage)
    wrong = {item.name: item.function for item in of_stage(stage.name)}
    for name, function in (correct | wrong).items():
        outcomes = [run_stage(stage, function, secret) for secret in secrets]
        failed = [[not result.passed for result in outcome.results] for outcome in outcomes]
        titles = [tuple(found.title for found in diagnose(one, of_stage(stage.name))) for one in outcomes]
        yield Row(
            name,
            name in wrong,
            tuple(sum(column) for column in zip(*failed, strict=True)),
            frozenset(outcome.share for outcome in outcomes),
            frozenset(titles),
        )


def main(arguments: list[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description="Print what the hidden checks catch and what they let pass.")
    parser.add_argument("--secrets", type=int, default=20, help="number of course secrets")
    count = parser.parse_args(arguments).secrets
    secrets = [f"course-{number}" for number in range(count)]
    good = True
    for stage in stages().values():
        print(f"\n{stage.name}: {count} secrets")
        for number, check in enumerate(stage.checks, start=1):
            print(f"  {number:2}  {check.name} (weight {check.weight:g})")
        print(f"  {'':50}" + "".join(f"{number:3}" for number in range(1, len(stage.checks) + 1)) + "  share")
        for row in rows(stage, secrets):
            good &= row.holds
            marks = ("." if not n else "X" if n == count else str(n) for n in row.failures)
            shares = ", ".join(f"{share:.3g}" for share in sorted(row.shares))
            kind = "wrong  " if row.wrong else "correct"
            line = f"  {kind} {row.name:42}" + "".join(f"{mark:>3}" for mark in marks)
            print(f"{line}  {shares}{'' if row.holds else '   <-- MUST NOT BE'}")
    print(
        "\nEvery wrong version is caught and named, every correct one passes."
        if good
        else "\nIt does not hold."
    )
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
