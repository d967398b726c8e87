"""Build the sample class: hand in the released notebooks as students would, once for every sample.

A sample is a small text file, ``samples/<assignment>/<notebook>/<student>.md``: a heading, a sentence on what the
student does, and the cells that the student writes, by grade id::

    ```{cell} dynamics
    def compute_dynamics(xvec, u, dt):
        ...
    ```

``{cell} dynamics from tests/autograder/alternatives/motion_model/series.py`` takes the cell from a file instead. Lines
between ``---`` at the top say more, all of it optional:

``rest: release``
    The student's other cells stay as released; without it they hold the right answers.
``further: release``
    Only those stay as released that no test looks at.
``delete: [name]``, ``duplicate: [name]``, ``rename: {name: other}``
    What happens to cells of the release.
``file: text`` or ``file: none``
    The cells are handed in as plain text, or nothing is.
``student: name``
    The cells are not a student's own: the student of that name writes them too. No other option goes with it.

``@repository@``, ``@course@`` and ``@port@`` stand for two folders and a port that something listens on, and
``@solution@`` for the right answer to the same cell.

Every wrong version of a stage in `autograder.misconceptions` is handed in too, once: the cell is made from the source
of that version, so that there is one home for it. A sample makes one mistake in each stage, since a mistake in one
costs nothing in another: ``mistake-<the mistake in the notebook's first stage>`` makes the mistake of the same place in
the lists of the other stages as well, as long as there is one, and leaves the cells that no test looks at as released.
Mistakes in symbolic answers are written by hand, by the samples that say ``student``. The table that `course` prints
names all mistakes of each sample.

The samples of an assignment's notebooks are dealt to students: one who hands in a sample of the largest class hands in
one of the same kind of each other notebook too, as long as there are any; see :func:`deal`.
"""

from __future__ import annotations

import copy
import re
import textwrap
from dataclasses import dataclass, field, replace
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING

import nbformat
import yaml

from autograder.misconceptions import MISCONCEPTIONS
from student_source import student_source

if TYPE_CHECKING:
    from nbformat import NotebookNode

    from autograder.misconceptions.model import Misconception

ROOT = Path(__file__).resolve().parents[1]
KINDS = ("perfect", "blank", "alternative-", "mistake-", "several-")
_HEAD = re.compile(
    r"\A(?:---\n(?P<options>.*?)^---\n)?\s*# (?P<title>[^\n]+)\n(?P<text>.*)\Z", re.DOTALL | re.MULTILINE
)
_CELL = re.compile(
    r"^```\{cell\} (?P<name>\S+)(?: from (?P<path>\S+))?\n(?P<source>.*?)^```$", re.DOTALL | re.MULTILINE
)
_MARKER = re.compile(r"^.*(?:###|===) (?:BEGIN|END) SOLUTION.*\n?", re.MULTILINE)
_OPTIONS = {"rest", "further", "delete", "duplicate", "rename", "file", "student"}


@dataclass(frozen=True)
class Sample:
    """One student of the sample class.

    Attributes
    ----------
    name, about : str
        The student's id, and a sentence on what is tried.
    cells : dict of str to str
        What the student writes, by grade id.
    rest : {"solution", "release"}
        What the other cells of the student's hold.
    further : {"solution", "release"}
        What those hold that no test looks at.
    delete, duplicate : tuple of str
        Cells of the release that are missing, or there twice.
    rename : dict of str to str
        New grade ids by old.
    file : {"notebook", "text", "none"}
        What is handed in.
    student : str
        Who writes the cells, if it is not a student of this name.
    """

    name: str
    about: str
    cells: dict[str, str] = field(default_factory=dict)
    rest: str = "solution"
    further: str = "solution"
    delete: tuple[str, ...] = ()
    duplicate: tuple[str, ...] = ()
    rename: dict[str, str] = field(default_factory=dict)
    file: str = "notebook"
    student: str = ""


def read_sample(path: Path) -> Sample:
    """Read a sample.

    Raises
    ------
    ValueError
        If the file has no heading, no sentence, an unknown option, or one beside ``student``.
    """
    match = _HEAD.match(path.read_text(encoding="utf-8"))
    about = _CELL.sub("", match["text"]).strip() if match else ""
    if not about:
        raise ValueError(f"{path.name}: expected a heading and what the student does")
    options = yaml.safe_load(match["options"] or "") or {}
    if unknown := set(options) - _OPTIONS:
        raise ValueError(f"{path.name}: expected options {sorted(_OPTIONS)}, got {sorted(unknown)}")
    if "student" in options and len(options) > 1:
        raise ValueError(f"{path.name}: expected no option beside student, got {sorted(options)}")
    cells = {}
    for cell in _CELL.finditer(match["text"]):
        source = (ROOT / cell["path"]).read_text(encoding="utf-8") if cell["path"] else cell["source"]
        cells[cell["name"]] = source.strip()
    options |= {name: tuple(options[name]) for name in ("delete", "duplicate") if name in options}
    return Sample(path.stem, " ".join(about.split()), cells, **options)


def stage_cells(source: NotebookNode) -> dict[str, str]:
    """Return the cell in which a student writes each graded function: its grade id, by stage, in order.

    The stages are read off the test cells, ``grade("module.stage", function, ...)``; the cell is the last one before
    that defines the function.
    """
    found: dict[str, str] = {}
    writes: dict[str, str] = {}
    for cell in source.cells:
        meta = cell.metadata.get("nbgrader", {})
        if cell.cell_type != "code":
            continue
        if meta.get("solution"):
            writes |= dict.fromkeys(re.findall(r"^def (\w+)\(", cell.source, re.MULTILINE), meta["grade_id"])
        elif meta.get("grade"):
            for stage, name in re.findall(r'^ *grade\(\s*"([\w.]+)",\s*(\w+)', cell.source, re.MULTILINE):
                found[stage] = writes[name]
    return found


def sample_class(folder: Path, cells: dict[str, str]) -> list[Sample]:
    """Return all samples of a notebook: those with a file, and those that make the known mistakes.

    Parameters
    ----------
    folder : Path
        The samples of one notebook.
    cells : dict of str to str
        See `stage_cells`.

    Returns
    -------
    list of Sample
        Sorted by name.

    Raises
    ------
    ValueError
        If a sample names a student whom there is not, or two samples write the same cell of a student's.
    """
    written = [read_sample(path) for path in sorted(folder.glob("*.md"))]
    students = {sample.name: sample for sample in [*mistaken(cells), *written] if not sample.student}
    for sample in written:
        if not sample.student:
            continue
        if sample.student not in students:
            raise ValueError(f"{sample.name}: expected a student of the class, got {sample.student}")
        students[sample.student] = together(students[sample.student], sample)
    return sorted(students.values(), key=lambda sample: sample.name)


def mistaken(cells: dict[str, str]) -> list[Sample]:
    """Return the students who between them make every known mistake once, each one mistake in a stage."""
    stages = [[mistake(item, cells) for item in MISCONCEPTIONS if item.stage == stage] for stage in cells]
    return [replace(together(*filter(None, row)), further="release") for row in zip_longest(*stages)]


def deal(classes: dict[str, list[Sample]]) -> dict[str, dict[str, Sample]]:
    """Deal the samples of an assignment's notebooks to students.

    Parameters
    ----------
    classes : dict of str to list of Sample
        The samples of each notebook.

    Returns
    -------
    dict of str to dict of str to Sample
        What each student hands in, by notebook. Students have the names of the samples of the largest class; one gets
        the sample of the same name of another notebook, or else one of the same kind. Samples that are left over are
        students of their own.
    """
    first, *others = sorted(classes, key=lambda name: -len(classes[name]))
    students = {sample.name: {first: sample} for sample in classes[first]}
    for notebook in others:
        left = []
        for sample in classes[notebook]:
            if sample.name in students:
                students[sample.name][notebook] = sample
            else:
                left.append(sample)
        for sample in left:
            free = (
                name
                for name, has in students.items()
                if notebook not in has and _kind(name) == _kind(sample.name)
            )
            students.setdefault(next(free, sample.name), {})[notebook] = sample
    return dict(sorted(students.items()))


def _kind(name: str) -> str:
    return next((kind for kind in KINDS if name.startswith(kind)), "")


def mistake(item: Misconception, cells: dict[str, str]) -> Sample:
    """Return the student who makes one mistake, and makes it in the words of the wrong version itself."""
    cell = cells[item.stage]
    slug = re.sub(r"[^a-z0-9]+", "-", item.name.lower().replace("'", "")).strip("-")
    return Sample(f"mistake-{slug}", f"{item.name}: {item.explanation}", {cell: student_source(item)})


def together(student: Sample, *others: Sample) -> Sample:
    """Return a student who also writes the cells of other samples.

    Raises
    ------
    ValueError
        If two of them write the same cell.
    """
    for other in others:
        if both := student.cells.keys() & other.cells:
            raise ValueError(
                f"{student.name}: expected one answer to {min(both)}, got {other.name}'s as well"
            )
        student = replace(student, about=f"{student.about} {other.about}", cells=student.cells | other.cells)
    return student


def solutions(source: NotebookNode) -> dict[str, str]:
    """Return the right answers of a source notebook by grade id."""
    cells = [(cell, cell.metadata.get("nbgrader", {})) for cell in source.cells]
    return {
        meta["grade_id"]: textwrap.dedent(_MARKER.sub("", cell.source)).strip()
        for cell, meta in cells
        if meta.get("solution")
    }


def graded(release: NotebookNode) -> set[str]:
    """Return the cells that a student writes and that are graded: by points of their own, or by the next test cell."""
    found: set[str] = set()
    since: set[str] = set()
    for cell in release.cells:
        meta = cell.metadata.get("nbgrader", {})
        if meta.get("solution"):
            since.add(meta["grade_id"])
        if meta.get("grade"):
            found |= {meta["grade_id"]} if meta["solution"] else since
            since = set()
    return found


def hand_in(
    sample: Sample, release: NotebookNode, answers: dict[str, str], places: dict[str, str]
) -> bytes | None:
    """Return the file that a student hands in, None if there is none.

    Parameters
    ----------
    sample : Sample
        The student.
    release : NotebookNode
        The released notebook; not changed.
    answers : dict of str to str
        Right answers by grade id.
    places : dict of str to str
        What ``@name@`` stands for.

    Raises
    ------
    ValueError
        If the sample names a cell that the release does not have.
    """
    if sample.file == "none":
        return None
    written = {name: _filled(source, name, answers, places) for name, source in sample.cells.items()}
    if sample.file == "text":
        return "\n\n".join(written.values()).encode()
    notebook = copy.deepcopy(release)
    named = {cell.metadata["nbgrader"]["grade_id"] for cell in notebook.cells if "nbgrader" in cell.metadata}
    if unknown := {*written, *sample.delete, *sample.duplicate, *sample.rename} - named:
        raise ValueError(f"{sample.name}: expected cells of the release, got {', '.join(sorted(unknown))}")
    if sample.rest == "solution":
        looked_at = graded(release)
        written = {
            name: text for name, text in answers.items() if sample.further == "solution" or name in looked_at
        } | written
    cells = []
    for cell in notebook.cells:
        meta = cell.metadata.get("nbgrader", {})
        name = meta.get("grade_id")
        if name in sample.delete:
            continue
        if name in written:
            cell.source = written[name]
        if name in sample.duplicate:
            cells.append(copy.deepcopy(cell))
            cells[-1]["id"] = f"{name}-copy"
        if name in sample.rename:
            meta["grade_id"] = sample.rename[name]
        cells.append(cell)
    notebook.cells = cells
    return (nbformat.writes(notebook) + "\n").encode()


def _filled(source: str, name: str, answers: dict[str, str], places: dict[str, str]) -> str:
    for key, value in {**places, "solution": answers.get(name, "")}.items():
        source = source.replace(f"@{key}@", value)
    return source
