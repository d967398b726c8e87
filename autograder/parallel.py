"""`nbgrader autograde`, several notebooks at a time.

nbgrader's own `Autograde` takes one notebook after the other through sanitizing, execution and storing. Here execution,
which takes the time and needs no gradebook, is handed to a pool of processes, or to the workers of a Dask scheduler;
sanitizing and storing stay in this process, which is the only one that writes.

A submission that is being graded carries a marker in its folder of `autograded`. Where the grader was killed, the next
run finds the marker and grades that submission again; finished ones are skipped as nbgrader does.
"""

from __future__ import annotations

import glob
import os
import re
import sys
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import nbformat
import nbgrader.converters.base
from nbformat.v4 import new_notebook
from nbgrader import utils
from nbgrader.api import Gradebook, MissingEntry
from nbgrader.converters import Autograde
from nbgrader.converters.base import NbGraderException
from sqlalchemy.engine import make_url
from traitlets import Bool, Integer, Unicode

from .beside import released_files
from .database import one_engine
from .interrupted import (
    MARKER,
    begin,
    hearing_ctrl_c,
    is_interrupted,
    of_the_machine,
    remove,
    state_of,
)
from .isolated import IsolatedExecute
from .late import STAMP, submitted_at
from .layout import Layout, read_layout
from .pool import Job, Pool, unpack
from .progress import Progress
from .repair import Released, read_release, read_submission
from .sandbox import SandboxError, require_bubblewrap
from .versions import read_history

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from .cluster import ClusterPool

AHEAD = 4  # submissions prepared for each process of the pool
LISTEN = 1.0  # seconds between two looks at whether there has been a Ctrl-C
READS = 3  # times that a submission is read which somebody writes to meanwhile


@contextmanager
def replaced(name: str, own: Callable[..., Any]) -> Iterator[Callable[..., Any]]:
    """Let nbgrader's converters use a function of ours; give theirs."""
    before = getattr(nbgrader.converters.base, name)
    setattr(nbgrader.converters.base, name, own)
    try:
        yield before
    finally:
        setattr(nbgrader.converters.base, name, before)


@dataclass
class Submission:
    """One student's assignment on its way.

    Attributes
    ----------
    student, assignment : str
        Whose, and which.
    files : list of str
        Its notebooks in the submitted folder, those that are missing included.
    jobs : dict of str to concurrent.futures.Future
        The executed notebook by file.
    seconds : float
        Processor time that those which are stored took [s].
    state : tuple
        Of its submitted folder when it was read; see `interrupted.state_of`.
    whole : bool
        Whether all its notebooks are graded, and what is there of it makes room.
    """

    student: str
    assignment: str
    files: list[str]
    jobs: dict[str, Future[str]] = field(default_factory=dict)
    seconds: float = 0.0
    state: tuple = ()
    whole: bool = True

    @property
    def done(self) -> bool:
        """Whether all its notebooks have been executed."""
        return all(future.done() for future in self.jobs.values())


class ParallelAutograde(Autograde):
    """nbgrader's autograding step with the execution of notebooks in other processes, here or on other machines."""

    jobs = Integer(0, help="How many notebooks are executed at a time; 0 for one per processor.").tag(
        config=True
    )
    scheduler = Unicode(
        "",
        help="Address of a Dask scheduler, tcp://HOST:8786: its workers execute, and jobs does not count.",
    ).tag(config=True)
    progress = Bool(True, help="Show a progress bar where there is a terminal.").tag(config=True)

    def init_notebooks(self) -> None:
        """Find the submissions, also those in whose folder there is no notebook: they get their row too."""
        try:
            super().init_notebooks()
        except NbGraderException:
            if not self._empty_folders():
                raise
        for folder in self._empty_folders():
            self.assignments.setdefault(folder, [])

    def _empty_folders(self) -> list[str]:
        if self.coursedir.notebook_id != "*":
            return []
        pattern = self._format_source(self.coursedir.assignment_id, self.coursedir.student_id)
        return [folder for folder in glob.glob(pattern) if os.path.isdir(folder)]  # noqa: PTH112, PTH207

    def convert_notebooks(self) -> None:
        """Grade all submissions that need it."""
        isolated = IsolatedExecute(parent=self)
        scheduler = "" if isolated.trust_submissions else self.scheduler
        if not (isolated.trust_submissions or scheduler):
            self._require_sandbox()
        self.coursedir.get_existing_timestamp = partial(submitted_at, self.coursedir)
        self.exporter.optimistic_validation = True  # once after all steps, not after each
        self._releases: dict[tuple[str, str, str], tuple[Layout, list[Released], frozenset[str]]] = {}
        todo = [self._submission(folder) for folder in sorted(self.assignments)]
        progress = Progress(len(todo), shown=self.progress and sys.stderr.isatty())
        errors: list[Submission] = []
        under_way: list[Submission] = []
        with hearing_ctrl_c() as check_ctrl_c, self._pool(scheduler) as pool, one_engine():
            while todo or under_way:
                check_ctrl_c()
                while todo and len(under_way) < AHEAD * pool.size:
                    submission = todo.pop(0)
                    if self._attempt(
                        submission, errors, lambda s=submission: self._prepare(s, isolated, pool)
                    ):
                        under_way.append(submission)
                    else:
                        progress.step(submission.student)
                futures = [future for submission in under_way for future in submission.jobs.values()]
                if futures and not any(submission.done for submission in under_way):
                    unfinished = [future for future in futures if not future.done()]
                    wait(unfinished, timeout=LISTEN, return_when=FIRST_COMPLETED)
                for submission in [s for s in under_way if s.done]:
                    under_way.remove(submission)
                    self._attempt(submission, errors, lambda s=submission: self._store(s))
                    progress.step(submission.student, submission.seconds)
        if errors:
            for submission in errors:
                self.log.error(
                    "%s of %s could not be graded and waits for a person",
                    submission.assignment,
                    submission.student,
                )
            raise NbGraderException("some submissions could not be graded; the log says why")

    def _pool(self, scheduler: str) -> Pool | ClusterPool:
        """Return what executes notebooks: processes here, or the workers of a scheduler."""
        if not scheduler:
            return Pool(self.jobs or os.cpu_count() or 1)
        try:
            from .cluster import ClusterPool  # noqa: PLC0415  (an extra of the package)

            return ClusterPool(scheduler)
        except (ImportError, SandboxError) as error:
            text = str(error)
            if isinstance(error, ImportError):
                text = f"Dask is not installed ({error}): pip install 'roboloc[grader,cluster]'"
            self.log.error("%s", text)  # noqa: TRY400  (no traceback: the text says what to do)
            raise NbGraderException(text) from error

    def _require_sandbox(self) -> None:
        """Refuse before anything is touched; nbgrader's command is silent about what it catches, so say it here."""
        try:
            require_bubblewrap()
        except SandboxError as error:
            self.log.error("%s", error)  # noqa: TRY400  (no traceback: the text says what to do)
            raise NbGraderException(str(error)) from error

    def _submission(self, folder: str) -> Submission:
        regexp = self._format_source("(?P<assignment_id>.*)", "(?P<student_id>.*)", escape=True)
        match = re.match(regexp, folder)
        if match is None:
            raise NbGraderException(f"Could not match {folder!r} with {regexp!r}")
        return Submission(match["student_id"], match["assignment_id"], sorted(self.assignments[folder]))

    def _attempt(self, submission: Submission, errors: list[Submission], step: Any) -> bool:
        """Do one step; what goes wrong with a submission must not touch another one."""
        try:
            return step() is not False
        except KeyboardInterrupt:
            remove(self._folder(submission))
            raise
        except NbGraderException:
            raise
        except Exception as error:
            gradebook = make_url(self.coursedir.db_url).render_as_string()
            if text := of_the_machine(error, self._folder(submission), gradebook):
                with suppress(OSError):
                    remove(self._folder(submission))
                self.log.error("%s", text)  # noqa: TRY400  (nbgrader's command is silent about what it catches)
                raise NbGraderException(text) from error
            say = self.log.error if isinstance(error, OSError) else self.log.exception
            say("grading %s of %s failed: %s", submission.assignment, submission.student, error)
            errors.append(submission)
            remove(self._folder(submission))
            self._flag(submission)
            return False

    def _folder(self, submission: Submission) -> Path:
        return Path(os.path.normpath(self._format_dest(submission.assignment, submission.student)))

    def init_destination(self, assignment_id: str, student_id: str) -> bool:
        """Return whether to grade a submission; what is there of it is removed so that a kill meanwhile is seen."""
        folder = Path(os.path.normpath(self._format_dest(assignment_id, student_id)))
        a_part = self.coursedir.notebook_id != "*" and folder.is_dir()
        if a_part:
            begin(folder)
        with replaced("rmtree", lambda path: remove(Path(path))):
            wanted = super().init_destination(assignment_id, student_id)
        if a_part and not wanted:
            (folder / MARKER).unlink()
        return wanted

    def init_assignment(self, assignment_id: str, student_id: str) -> None:
        """Copy the files beside the notebooks; links are not followed."""

        def find_own(path: str, exclude: list[str]) -> list[str]:
            if os.path.islink(path):  # noqa: PTH114
                return []
            own = [f for f in find(path, exclude) if not os.path.islink(f)]  # noqa: PTH114
            # Later steps stumble over what is no time.
            timeless = self.coursedir.get_existing_timestamp(path) is None
            return [f for f in own if not (timeless and Path(f).relative_to(path).parts[0] == STAMP)]

        with replaced("find_all_files", find_own) as find:
            super().init_assignment(assignment_id, student_id)

    def _flag(self, submission: Submission) -> None:
        """Give every grade cell of a submission its row, without a score, for a person to look at."""
        with Gradebook(self.coursedir.db_url, self.coursedir.course_id) as gradebook:
            try:
                found = gradebook.find_submission(submission.assignment, submission.student)
            except MissingEntry:
                try:
                    gradebook.update_or_create_student(submission.student)
                    found = gradebook.add_submission(submission.assignment, submission.student)
                except MissingEntry:  # no such assignment
                    return
            for notebook in found.notebooks:
                for grade in notebook.grades:
                    grade.auto_score = None
                    grade.needs_manual_grade = True
            gradebook.db.commit()

    # before execution

    def _prepare(self, submission: Submission, isolated: IsolatedExecute, pool: Pool | ClusterPool) -> bool:
        """Sanitize a submission and hand its notebooks to the pool; return whether there is anything to do."""
        folder = self._folder(submission)
        name = f"{submission.assignment} of {submission.student}"
        submission.whole = self.coursedir.notebook_id == "*"
        if is_interrupted(folder):
            submission.whole = True  # what is there of its other notebooks goes too
            self.log.warning("Grading %s again: the last run was interrupted, or it was replaced", name)
            remove(folder)
        self._sanitizing = True
        self.notebooks = submission.files
        if not self.init_destination(submission.assignment, submission.student):
            return False
        source = Path(self._format_source(submission.assignment, submission.student))
        for left in reversed(range(READS)):
            submission.state = state_of(source)
            jobs = self._read(submission, isolated)
            if not left or state_of(source) == submission.state:
                break
            self.log.warning("Reading %s again: it was replaced meanwhile", name)
            if submission.whole:
                remove(folder)
        submission.jobs = {filename: pool.submit(job) for filename, job in jobs.items()}
        return True

    def _read(self, submission: Submission, isolated: IsolatedExecute) -> dict[str, Job]:
        """Copy a submission's files and sanitize its notebooks; return what is to be executed."""
        begin(self._folder(submission))
        self.notebooks = submission.files = self._with_missing(submission)
        self.run_pre_convert_hook()
        self.init_assignment(submission.assignment, submission.student)
        submission.files = list(self.notebooks)
        restored = {filename: self._sanitize(filename) for filename in submission.files}
        return {} if isolated.trust_submissions else {f: isolated.job(*one) for f, one in restored.items()}

    def _with_missing(self, submission: Submission) -> list[str]:
        """Return a submission's notebooks and those of the assignment that it lacks."""
        if not submission.whole:
            return submission.files
        source = self._format_source(submission.assignment, submission.student)
        with Gradebook(self.coursedir.db_url, self.coursedir.course_id) as gradebook:
            try:
                names = [
                    notebook.name for notebook in gradebook.find_assignment(submission.assignment).notebooks
                ]
            except MissingEntry:
                return submission.files
        return sorted({*submission.files, *(os.path.join(source, f"{name}.ipynb") for name in names)})  # noqa: PTH118

    def _sanitize(self, filename: str) -> tuple[Any, dict[str, Any]]:
        """Repair and restore one notebook and write it to the autograded folder."""
        self.log.info("Sanitizing %s", filename)
        resources = self.init_single_notebook_resources(filename)
        info = resources["nbgrader"]
        # What was handed in goes past nbconvert, which stumbles over what is not quite a notebook, to `RepairNotebook`.
        info["submitted"], info["unreadable"] = read_submission(Path(filename))
        info["layout"], info["released"], info["given"] = self._released(info["assignment"], info["notebook"])
        folder = self._format_dest(info["assignment"], info["student"])
        resources["metadata"] = {"name": info["notebook"], "path": folder}
        self._init_preprocessors()
        output, resources = self.exporter.from_notebook_node(new_notebook(), resources=resources)
        self.write_single_notebook(output, resources)
        return nbformat.reads(output, as_version=4), resources

    def _released(self, assignment: str, notebook: str) -> tuple[Layout, list[Released], frozenset[str]]:
        """Return layout, cells and files of a release; they are read once in a run."""
        what = (self.coursedir.db_url, assignment, notebook)
        if what not in self._releases:
            folder = self.coursedir.format_path(self.coursedir.release_directory, ".", assignment)
            *_, last = {}, *(version.cells for version in read_history(*what))
            layout = read_layout(Path(folder, f"{notebook}.ipynb"), last)
            given = released_files(self.coursedir, assignment, self.exclude_overwriting)
            self._releases[what] = layout, read_release(*what, layout.order), given
        return self._releases[what]

    # after execution

    def _store(self, submission: Submission) -> bool:
        """Save grades and the executed notebooks of a submission."""
        self.notebooks = submission.files
        self._sanitizing = False
        self._init_preprocessors()
        try:
            for filename in submission.files:
                self._store_notebook(filename, submission)
        finally:
            self._sanitizing = True
        self.log.info(
            "Graded %s of %s: %.1f processor seconds",
            submission.assignment,
            submission.student,
            submission.seconds,
        )
        if state_of(Path(self._format_source(submission.assignment, submission.student))) == submission.state:
            (self._folder(submission) / MARKER).unlink()
        else:
            self.log.warning(
                "%s of %s was replaced while it was graded: the next run grades the new one",
                submission.assignment,
                submission.student,
            )
        self.set_permissions(submission.assignment, submission.student)
        self.run_post_convert_hook()
        return True

    def _store_notebook(self, filename: str, submission: Submission) -> None:
        restored = str(self._folder(submission) / Path(filename).name)
        resources = self.init_single_notebook_resources(restored)
        with utils.setenv(NBGRADER_EXECUTION="autograde"):
            if filename in submission.jobs:  # what lies there is what went into the job: not read again
                executed = unpack(submission.jobs[filename].result())
                submission.seconds += executed.metadata["grading"]["seconds"]
                resources["nbgrader"]["executed"] = executed
                resources["metadata"] = {"name": Path(restored).stem, "path": str(Path(restored).parent)}
                output, resources = self.exporter.from_notebook_node(new_notebook(), resources=resources)
            else:
                output, resources = self.exporter.from_filename(restored, resources=resources)
        self.write_single_notebook(output, resources)
