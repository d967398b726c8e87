"""Look at what a graded class leaves behind: recognised mistakes, leaks in feedback, grades, processor time."""

from __future__ import annotations

import csv
import html
import math
import re
from html.parser import HTMLParser
from typing import TYPE_CHECKING

import nbformat
import numpy as np

from autograder.check import Recorder, run_stage
from autograder.checks import EXPRESSIONS, STAGES
from autograder.roles import visible_part

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from nbformat import NotebookNode

REACHED = "REACHED"  # what a hostile sample prints beside anything it could get hold of
_MISTAKE = re.compile(r"^ *Recognised mistake: (?P<title>.+) \([^()]*\)\.$", re.MULTILINE)
_MARK_SCHEME = re.compile(r"BEGIN MARK SCHEME(.*?)END MARK SCHEME", re.DOTALL)
_WORD = re.compile(r"\w+")
_TAG = re.compile(r"<[^>]*>")
_DATA = re.compile(r"data:image/[a-z]+;base64,[A-Za-z0-9+/=\s]+")
_STYLE = re.compile(r"<style.*?</style>", re.DOTALL)
_COLOUR = re.compile(r'<span(?: class="[\w -]*")?>|</span>')  # nearly all tags of a page; they run nothing
_NUMBER = re.compile(r"\d+\.\d+")
SLACK = 5.0  # seconds: a clock that stops a cell looks at it now and then
_DIGITS = 6  # a page of the course shows none of its own with more, and numpy prints eight decimals
_OF_AN_ARRAY = 12


def diagnosis(path: Path) -> str:
    """Return the recognised mistakes in the reports of a graded notebook, each once, separated by semicolons."""
    if not path.is_file():
        return ""
    found: list[str] = []
    for cell in nbformat.read(path, as_version=4).cells:
        if cell.metadata.get("nbgrader", {}).get("grade"):
            for output in cell.get("outputs", []):
                found += _MISTAKE.findall(output.get("data", {}).get("text/plain", ""))
    return "; ".join(dict.fromkeys(found))


class _Scripts(HTMLParser):
    """Collect what a page would run."""

    def __init__(self) -> None:
        super().__init__()
        self.found: set[str] = set()
        self.inside = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Note scripts from elsewhere, and what runs on an event or when a link is followed."""
        self.inside = tag == "script"
        for name, value in attrs:
            text = (value or "").strip()
            if (tag == "script" and name == "src") or name.startswith("on"):
                self.found.add(f"{name}={text}")
            elif text.lower().startswith(("javascript:", "data:text")) or tag in {
                "iframe",
                "object",
                "embed",
            }:
                self.found.add(f"{tag} {name}={text}")

    handle_startendtag = handle_starttag

    def handle_data(self, data: str) -> None:
        """Note a script that stands in the page."""
        if self.inside and data.strip():
            self.found.add(data)

    def handle_endtag(self, _tag: str) -> None:
        """Leave a script."""
        self.inside = False


def scripts(html: str) -> set[str]:
    """Return everything that a page would run."""
    parser = _Scripts()
    parser.feed(_COLOUR.sub("", html))
    parser.close()
    return parser.found


def hidden_lines(source: NotebookNode) -> set[str]:
    """Return the lines of a source notebook's hidden tests and mark schemes, each as `words`.

    Lines of one word are left out: a page holds such a word by chance.
    """
    found: set[str] = set()
    for cell in source.cells:
        if cell.cell_type == "code":
            found |= set(cell.source.splitlines()) - set(visible_part(cell.source).splitlines())
        else:
            for scheme in _MARK_SCHEME.findall(cell.source):
                found |= {"MARK SCHEME", *scheme.splitlines()}
    return {text for line in found if " " in (text := words(line).strip())}


def words(text: str) -> str:
    """Return the words of a text alone, so that code is found whatever colours it has, and prose whatever markup."""
    return f" {' '.join(_WORD.findall(text))} "


def hidden_numbers(secret: str) -> set[str]:
    """Return the hidden inputs of all checks and the right results, as they begin when they are printed.

    Only numbers of more than six digits are taken: shorter ones stand in a page by chance, as do parts of a turn. Of a
    large array the first dozen stands for all, or the thousands of a cloud would be met by chance.
    """
    seen: list[float] = []
    stages = [*STAGES.values(), *(expression.stage() for expression in EXPRESSIONS.values())]
    for stage in stages:
        recorder = Recorder(stage.reference)
        run_stage(stage, recorder, secret)
        for call in recorder.calls:
            seen += _numbers([call.args, call.returned])
    return {text for value in seen if "." in (text := _printed(value))} - {
        _printed(k * math.pi / 4) for k in range(1, 9)
    }


def _numbers(value: object) -> Iterator[float]:
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, (list, tuple)):
        for one in value:
            yield from _numbers(one)
    elif isinstance(value, (int, float, np.ndarray)):
        yield from (float(one) for one in np.ravel(value)[:_OF_AN_ARRAY])


def _printed(value: float) -> str:
    """Return the first digits of a number as it is printed; empty if it has few."""
    return _head(repr(abs(value)).partition("e")[0])


def _head(text: str) -> str:
    """Return a number's text up to its sixth digit; empty if it has fewer, or only just as many."""
    start = len(text) - len(text.lstrip("0."))
    end = start + _DIGITS + ("." in text[start : start + _DIGITS])
    return text[:end] if len(text) > end else ""


def leaks(
    course: Path,
    assignment: str,
    notebook: str,
    students: Sequence[str],
    source: NotebookNode,
    numbers: set[str],
) -> list[str]:
    """Say what students see or did that they must not.

    Parameters
    ----------
    course : pathlib.Path
        Folder of the graded course.
    assignment, notebook : str
        Which notebook.
    students : sequence of str
        All of the class; there must be feedback for each, and one is named ``perfect``.
    source : NotebookNode
        The source notebook, with its hidden tests and mark schemes.
    numbers : set of str
        See `hidden_numbers`.

    Returns
    -------
    list of str
        A line for each fault.
    """
    lines = hidden_lines(source)
    faults = [] if lines and numbers else ["there is nothing hidden to look for"]
    pages = {name: course / "feedback" / name / assignment / f"{notebook}.html" for name in students}
    usual = scripts(_bare(pages["perfect"])) if pages["perfect"].is_file() else set()
    for student, page in pages.items():
        if not page.is_file():
            faults.append(f"{student}: expected feedback, got none")
            continue
        text = _bare(page)
        read = words(html.unescape(_TAG.sub(" ", text)))
        faults += [
            f"{student}: the feedback holds the hidden line {line!r}"
            for line in sorted(lines)
            if f" {line} " in read
        ]
        shown = {_head(number) for number in _NUMBER.findall(text)} & numbers
        faults += [f"{student}: the feedback holds the hidden number {number}" for number in sorted(shown)]
        faults += [f"{student}: the feedback would run {one[:80]!r}" for one in scripts(text) - usual]
        graded = course / "autograded" / student / assignment / f"{notebook}.ipynb"
        for cell in nbformat.read(graded, as_version=4).cells:
            printed = "".join(one.get("text", "") for one in cell.get("outputs", []))
            faults += [f"{student}: {line}" for line in printed.splitlines() if line.startswith(REACHED)]
    return faults


def _bare(page: Path) -> str:
    """Return a page without style sheets and pictures, which are most of it."""
    return _STYLE.sub("", _DATA.sub("", page.read_text(encoding="utf-8")))


def exported(path: Path, handed_in: Sequence[tuple[str, str]]) -> list[str]:
    """Say which submissions, by assignment and student, the exported grades lack, or have more than once."""
    with path.open(newline="", encoding="utf-8") as file:
        found = [(row["assignment"], row["student_id"]) for row in csv.DictReader(file)]
    return [
        f"{student}, {assignment}: expected one line of {path.name}, got {found.count((assignment, student))}"
        for assignment, student in handed_in
        if found.count((assignment, student)) != 1
    ]


def seconds(course: Path, assignment: str, notebook: str, students: Sequence[str]) -> dict[str, float]:
    """Return the processor seconds of each student's notebook, where they are recorded."""
    found = {}
    for student in students:
        path = course / "autograded" / student / assignment / f"{notebook}.ipynb"
        record = nbformat.read(path, as_version=4).metadata.get("grading", {}) if path.is_file() else {}
        if "seconds" in record:
            found[student] = float(record["seconds"])
    return found


def overruns(took: dict[str, float], students: Sequence[str], limit: float) -> list[str]:
    """Say which notebooks ran for longer than they may, or do not say how long.

    Parameters
    ----------
    took : dict of str to float
        Processor seconds by student.
    students : sequence of str
        All of the class.
    limit : float
        Processor seconds that a notebook may take; `SLACK` comes on top.

    Returns
    -------
    list of str
        A line for each fault.
    """
    faults = [
        f"{student}: expected processor seconds, got none" for student in students if student not in took
    ]
    return faults + [
        f"{student}: expected at most {limit:g} + {SLACK:g} processor seconds, got {value:.1f}"
        for student, value in took.items()
        if value > limit + SLACK
    ]
