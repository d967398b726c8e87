"""The report on one stage, as plain text and as simple HTML: display data for the cell that asked for it.

Nothing in it comes from the student but numbers that were rounded and names that were known beforehand, and
all of it is escaped all the same.
"""

from __future__ import annotations

import functools
import hashlib
from dataclasses import dataclass
from html import escape
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING

from roboloc_reference import motion

if TYPE_CHECKING:
    from autograder.check import Outcome, Result
    from autograder.diagnose import Diagnosis

_SOURCES = (
    "check.py", "compare.py", "diagnose.py", "observe.py", "symbolic.py", "checks", "misconceptions", "reading.py",
    "lengths.py", "loops.py", "vectorised.py",
)  # fmt: skip


@functools.cache
def checks_version() -> str:
    """Return a short hash of all that decides on a score: the checks, their tools, the reference."""
    here, reference = Path(__file__).parent, Path(motion.__file__).parent
    roots = [(here, here / name) for name in _SOURCES] + [(reference.parent, reference)]
    digest = hashlib.sha256()
    for base, path in roots:
        for file in sorted(path.rglob("*.py")) if path.is_dir() else [path]:
            digest.update(file.relative_to(base).as_posix().encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()[:12]


@functools.cache
def environment_version() -> str:
    """Return the versions of the packages that a numerical result depends on."""
    found = []
    for package in ("roboloc", "numpy", "scipy", "sympy"):
        try:
            found.append(f"{package} {version(package)}")
        except PackageNotFoundError:
            found.append(f"{package} unknown")
    return ", ".join(found)


@dataclass(frozen=True)
class Report:
    """What a student reads about one stage."""

    outcome: Outcome
    diagnoses: tuple[Diagnosis, ...]
    points: float
    score: float
    run_id: str = ""

    @property
    def title(self) -> str:
        """The first line: the stage and its score."""
        return f"{self.outcome.stage.name}: {self.score:g} of {self.points:g} points"

    @property
    def footer(self) -> str:
        """The last line: what an appeal refers to."""
        run = f"; run {self.run_id}" if self.run_id else ""
        return f"Checks {checks_version()}; {environment_version()}{run}"

    def __str__(self) -> str:
        """Return the report as plain text."""
        lines = [self.title]
        for result in self.outcome.results:
            lines.append(f"  {_word(result):8}{result.check.name}")
            if not result.passed:
                lines.extend([f"          {result.message}"] if self._said(result) else [])
                lines.extend([f"          Hint: {result.check.hint}"] if self._hinted(result) else [])
        for item in self.diagnoses:
            lines.append(f"  {_heading(item)}")
            lines.append(f"    {item.explanation}")
            lines.extend([f"    Look here: {item.hint}"] if item.hint else [])
        return "\n".join([*lines, self.footer])

    __repr__ = __str__

    def _repr_html_(self) -> str:
        items = []
        for result in self.outcome.results:
            text = f"<strong>{_word(result)}:</strong> {escape(result.check.name)}"
            if result.message:
                text += f". {escape(result.message[0].upper() + result.message[1:])}."
            if self._hinted(result):
                text += f" <em>Hint: {escape(result.check.hint)}</em>"
            items.append(f"<li>{text}</li>")
        # A list, because the pages that show it have no style for the cells of a table.
        parts = [f"<h4>{escape(self.title)}</h4>", f"<ul>{''.join(items)}</ul>"]
        for item in self.diagnoses:
            hint = f" <em>Look here: {escape(item.hint)}</em>" if item.hint else ""
            parts.append(f"<p><strong>{escape(_heading(item))}</strong> {escape(item.explanation)}{hint}</p>")
        return "\n".join([*parts, f"<p><code>{escape(self.footer)}</code></p>"])

    def bundle(self) -> dict[str, str]:
        """Return the report as display data."""
        return {"text/plain": str(self), "text/html": self._repr_html_()}

    def _said(self, result: Result) -> bool:
        """Whether a check's message is shown: of those that did not run, only the first one's."""
        return result.ran or result is next(one for one in self.outcome.results if not one.ran)

    def _hinted(self, result: Result) -> bool:
        """Whether a check's hint is shown: only beside numbers that are off, and with no mistake recognised."""
        judged = result.ran and result.message and not result.message.startswith("the call ")
        return bool(result.check.hint and judged) and not any(d.known for d in self.diagnoses)


def _word(result: Result) -> str:
    if result.passed:
        return "passed"
    return "failed" if result.ran else "not run"


def _heading(item: Diagnosis) -> str:
    outputs = ", ".join(item.outputs)
    return f"Recognised mistake: {item.title} ({outputs})." if item.known else f"{item.title} ({outputs}):"
