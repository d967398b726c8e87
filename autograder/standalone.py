"""Grading notebooks on their own: no course folder, no gradebook that stays, the same grader.

`nbgrader autograde` grades a class that has been collected into the course's folders. Here any notebook is graded
where it lies: it becomes the submission of a nameless student in a course that lives in a temporary folder, with a
gradebook of its own and the configuration of the real course: limits, sandbox and checks are the ones of the class.
What is reported about a cell is what feedback shows: never a hidden test, its inputs, or what a hidden call printed.

Only the notebook itself is handed in; files beside it are not. Files of the assignment are there as they are for the
class.
"""

from __future__ import annotations

import logging
import os
import shutil
import sys
import tempfile
import warnings
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from nbgrader.apps import NbGraderAPI
from sqlalchemy.exc import SAWarning
from traitlets.config import Config
from traitlets.config.loader import PyFileConfigLoader

from .notebook_grades import NotebookGrade, collect
from .parallel import ParallelAutograde
from .plugin import configure
from .secret import course_root

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence


CONFIG = "nbgrader_config.py"


class UsageError(ValueError):
    """The request cannot be understood; the text says in one line what is wrong and what would be right."""


@dataclass(frozen=True)
class Task:
    """A file, and what it is graded as."""

    file: str
    assignment: str
    notebook: str


def course_config(root: Path) -> Config:
    """Return the configuration of a course, its relative folders made absolute.

    Parameters
    ----------
    root : pathlib.Path
        The folder of its `nbgrader_config.py`; without that file, nbgrader's defaults hold.

    Returns
    -------
    traitlets.config.Config
        With submissions isolated, whether or not the file says so.
    """
    config = Config()
    if (root / CONFIG).is_file():
        config = PyFileConfigLoader(CONFIG, path=str(root)).load_config()
    configure(config)
    directory = config.CourseDirectory
    given = directory.get("source_directory", "source")
    directory.source_directory = str(root / given)
    return config


def find_tasks(files: Sequence[str], source: Path, assignment: str = "") -> list[Task]:
    """Find out what each file is a submission of.

    Parameters
    ----------
    files : sequence of str
        Notebooks. A file of the name of a released notebook is a submission of that one; any name will do where
        the assignment is given and has only one notebook.
    source : pathlib.Path
        Folder of the source notebooks, `<assignment>/<name>.ipynb`.
    assignment : str, optional
        Which assignment; looked for in all of them if not given.

    Returns
    -------
    list of Task
        One for each file, in order.

    Raises
    ------
    UsageError
        If a file is not there, or fits no assignment or several.
    """
    known = [
        path for path in sorted(source.glob("*/*.ipynb")) if not path.name.startswith(".")
    ]  # a checkpoint lies a folder deeper
    if not known:
        raise UsageError(f"no assignment has a source notebook in {source}; `make notebooks` makes them")
    if assignment:
        names = sorted({path.parent.name for path in known})
        known = [path for path in known if path.parent.name == assignment]
        if not known:
            raise UsageError(f"--assignment: expected one of {', '.join(names)}, got {assignment}")
    return [_task(file, known, given=bool(assignment)) for file in files]


def _task(file: str, known: list[Path], *, given: bool) -> Task:
    try:
        Path(file).open("rb").close()
    except OSError as error:
        raise UsageError(f"{file}: expected a notebook, got {str(error.strerror).lower()}") from None
    fitting = [path for path in known if path.stem == Path(file).stem]
    if not fitting and given and len(known) == 1:
        fitting = known
    names = ", ".join(f"{path.parent.name}/{path.name}" for path in fitting or known)
    if not fitting:
        raise UsageError(f"{file}: expected the file name of a released notebook ({names}), or --assignment")
    if len(fitting) > 1:
        raise UsageError(
            f"{file}: several assignments have a notebook of that name ({names}); give --assignment"
        )
    return Task(file, fitting[0].parent.name, fitting[0].stem)


def grade_files(
    files: Sequence[str], assignment: str = "", root: Path | None = None, *, explain: bool = False
) -> list[NotebookGrade]:
    """Grade notebooks on their own.

    Parameters
    ----------
    files : sequence of str
        Notebooks; see :func:`find_tasks`.
    assignment : str, optional
        Which assignment they belong to.
    root : pathlib.Path, optional
        The course: the folder of its `nbgrader_config.py`; found from the working directory if not given.
    explain : bool, optional
        Whether the cells come with explanations, which show what is hidden.

    Returns
    -------
    list of NotebookGrade
        One for each file, in order.

    Raises
    ------
    UsageError
        If it is not clear what to grade.
    nbgrader.converters.base.NbGraderException
        If the grader could not do its work: no sandbox, a faulty assignment.
    """
    root = root or course_root()
    config = course_config(root)
    config.IsolatedExecute.explain = explain
    tasks = find_tasks(files, Path(config.CourseDirectory.source_directory), assignment)
    with tempfile.TemporaryDirectory(prefix="grade-") as folder, _api(config, root, Path(folder)) as api:
        for name in sorted({task.assignment for task in tasks}):
            result = api.generate_assignment(name, force=True)
            if not result["success"]:
                raise RuntimeError(f"nbgrader cannot release {name}:\n{result.get('log', '')}")
        students = [f"submission-{number:04d}" for number in range(len(tasks))]
        for student, task in zip(students, tasks, strict=True):
            target = Path(folder, "submitted", student, task.assignment, f"{task.notebook}.ipynb")
            target.parent.mkdir(parents=True)
            shutil.copyfile(task.file, target, follow_symlinks=False)
        for what in sorted({(task.assignment, task.notebook) for task in tasks}):
            # The other notebooks of an assignment were not handed in for grading: they are not missing.
            api.coursedir.assignment_id, api.coursedir.notebook_id = what
            ParallelAutograde(coursedir=api.coursedir, parent=api).start()
        return [
            collect(api, Path(folder), *pair, explain=explain) for pair in zip(students, tasks, strict=True)
        ]


@contextmanager
def _api(config: Config, root: Path, folder: Path) -> Iterator[NbGraderAPI]:
    """Give nbgrader with a gradebook and submissions of its own in a folder.

    Its working directory is the course's, where it looks for what the configuration names: `autotests.yml`, a header.
    """
    own = Config()
    own.CourseDirectory.root = str(root.resolve())
    own.CourseDirectory.db_url = f"sqlite:///{folder}/gradebook.db"
    own.CourseDirectory.student_id = "*"
    for kind in ("release", "submitted", "autograded", "feedback"):
        own.CourseDirectory[f"{kind}_directory"] = str(folder / kind)
    own.ParallelAutograde.create_student = True
    own.ParallelAutograde.progress = False
    config.merge(own)
    with quiet(NbGraderAPI(config=config)) as api:
        yield api


@contextmanager
def quiet(api: NbGraderAPI) -> Iterator[NbGraderAPI]:
    """Let nbgrader say nothing but what goes wrong, and find alembic.

    It calls alembic from the path, where an environment that is not activated does not stand.

    Parameters
    ----------
    api : nbgrader.apps.NbGraderAPI
        Of a course.

    Yields
    ------
    nbgrader.apps.NbGraderAPI
        The same.
    """
    before, level = os.environ.get("PATH", os.defpath), api.log.level
    handler = logging.StreamHandler()  # without an application of nbgrader's the log goes nowhere
    api.log.addHandler(handler)
    os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), before])
    api.log.setLevel(logging.ERROR)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SAWarning)  # nbgrader's own queries, which work
            yield api
    finally:
        api.log.removeHandler(handler)
        api.log.setLevel(level)
        os.environ["PATH"] = before
