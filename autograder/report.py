"""The report on one stage, as plain text and as simple HTML: display data for the cell that asked for it.

Nothing in it comes from the student but numbers that were rounded and names that were known beforehand, and
all of it is escaped all the same.
"""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING

from autograder.explain import details
from autograder.provenance import checks_version, environment_version
from autograder.roles import EXPLANATION

if TYPE_CHECKING:
    from collections.abc import Callable

    from autograder.check import Outcome, Result
    from autograder.diagnose import Diagnosis


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
        return f"Checks {checks_version(self.outcome.stage.name)}; {environment_version()}{run}"

    def __str__(self) -> str:
        """Return the report as plain text."""
        return self._text(lambda result: [])  # noqa: ARG005

    def explanation(self) -> str:
        """Return the report with what each check asked: for the instructor alone."""
        return self._text(lambda result: details(self.outcome, result, self.points))

    def _text(self, more: Callable[[Result], list[str]]) -> str:
        lines = [self.title]
        for result in self.outcome.results:
            lines.append(f"  {_word(result):8}{result.check.name}")
            lines += [f"          {line}" for line in more(result)]
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

    def bundle(self, *, explained: bool = False) -> dict[str, str]:
        """Return the report as display data; explained, it shows what is hidden."""
        plain = {"text/plain": str(self), "text/html": self._repr_html_()}
        return plain | {EXPLANATION: self.explanation()} if explained else plain

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
