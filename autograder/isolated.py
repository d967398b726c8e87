"""The preprocessor that takes the place of nbgrader's `Execute`, and the one that flags cells for a person."""

from __future__ import annotations

import os
import uuid
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nbgrader import utils
from nbgrader.api import Gradebook
from nbgrader.preprocessors import Execute, NbGraderPreprocessor
from traitlets import Bool, Float, Integer, List, Unicode, default

from .layout import Layout
from .pool import Job, Pool, pack, unpack
from .repair import read_release
from .roles import REVIEW
from .sandbox import PACKAGES
from .worker.limits import Limits

if TYPE_CHECKING:
    from nbformat import NotebookNode

_DEFAULT = Limits()


class IsolatedExecute(NbGraderPreprocessor):
    """Run the submission in a sandbox and the test cells outside of it."""

    trust_submissions = Bool(
        False, help="Run submissions WITHOUT protection, with nbgrader's own Execute, in this environment."
    ).tag(config=True)
    packages = List(
        Unicode(),
        list(PACKAGES),
        help="Installed distributions that submissions may import, with what they require.",
    ).tag(config=True)
    warm_up = Bool(
        True,
        help="Let the sandbox run the locked cells with which notebooks begin once, and go on from there with each "
        "notebook. Turn it off where these cells must give each notebook something else: the time, or a random number.",
    ).tag(config=True)
    explain = Bool(
        False, help="Write into the graded notebooks what the checks asked: hidden inputs too."
    ).tag(config=True)
    call_cpu = Float(_DEFAULT.call_cpu, help="Processor seconds of one call by a test.").tag(config=True)
    cell_cpu = Float(_DEFAULT.cell_cpu, help="Processor seconds of one cell.").tag(config=True)
    notebook_cpu = Float(_DEFAULT.notebook_cpu, help="Processor seconds of a notebook.").tag(config=True)
    wall_factor = Float(_DEFAULT.wall_factor, help="The wall clock may run this many times longer ...").tag(
        config=True
    )
    wall_extra = Float(_DEFAULT.wall_extra, help="... plus this many seconds.").tag(config=True)
    memory = Integer(_DEFAULT.memory, help="Address space of a process in bytes.").tag(config=True)
    notebook_memory = Integer(
        _DEFAULT.notebook_memory, help="Memory of all processes of a notebook together in bytes."
    ).tag(config=True)
    processes = Integer(_DEFAULT.processes, help="Processes and threads of a notebook.").tag(config=True)
    file_size = Integer(_DEFAULT.file_size, help="Largest file in bytes.").tag(config=True)
    disk = Integer(_DEFAULT.disk, help="All files of a notebook in bytes.").tag(config=True)

    run_id = Unicode(help="Name of this run of the grader; reports show it.")

    @default("run_id")
    def _run_id(self) -> str:
        return uuid.uuid4().hex[:12]

    def limits(self) -> Limits:
        """Return the configured limits."""
        return Limits(**{name: getattr(self, name) for name in asdict(_DEFAULT)})

    def job(self, nb: NotebookNode, resources: dict[str, Any]) -> Job:
        """Describe the execution of a restored notebook: a pure function of what is in the job.

        Parameters
        ----------
        nb : NotebookNode
            Restored by the sanitizing steps.
        resources : dict
            nbconvert's, with nbgrader's part.

        Returns
        -------
        Job
            What a worker anywhere needs.
        """
        info = resources["nbgrader"]
        released = info.get("released") or read_release(info["db_url"], info["assignment"], info["notebook"])
        folder = resources.get("metadata", {}).get("path") or "."
        problem = ""
        files: dict[str, tuple[bytes, int]] = {}
        try:
            files = read_folder(folder, self.disk // 2)
        except (ValueError, OSError) as error:
            problem = str(error)
        return Job(
            key=f"{info['student']}/{info['assignment']}/{info['notebook']}",
            notebook=pack(nb),
            release={cell.name: cell.source for cell in released},
            layout=info.get("layout", Layout()),
            given=info.get("given", frozenset()),
            files=files,
            limits=tuple(self.limits().to_list()),
            packages=tuple(self.packages),
            hidden=(str(Path.cwd().resolve()), str(Path(__file__).resolve().parents[1])),
            problem=problem,
            nothing=info.get("unreadable", ""),
            run=self.run_id,
            warm=self.warm_up,
            explain=self.explain,
        )

    def preprocess(self, nb: NotebookNode, resources: dict[str, Any]) -> tuple[NotebookNode, dict[str, Any]]:
        """Return the executed notebook: from the pool where it has been executed already, else executed now."""
        if self.trust_submissions:
            return Execute(parent=self).preprocess(nb, resources)
        executed = resources["nbgrader"].pop("executed", None)
        if executed is None:
            with Pool(1) as pool:
                executed = unpack(pool.submit(self.job(nb, resources)).result())
        return executed, resources


def read_folder(folder: str, limit: int) -> dict[str, tuple[bytes, int]]:
    """Return the files of a submission's folder.

    Parameters
    ----------
    folder : str
        The folder; links are not followed.
    limit : int
        Most bytes together.

    Returns
    -------
    dict of str to tuple of (bytes, int)
        Content and mode by relative name.

    Raises
    ------
    ValueError
        If the files are too large together.
    """
    found: dict[str, tuple[bytes, int]] = {}
    size = 0
    for root, _, names in os.walk(folder):
        for name in sorted(names):
            path = os.path.join(root, name)  # noqa: PTH118  (a folder of thousands of files is read for each notebook)
            status = os.lstat(path)
            if not os.path.isfile(path) or os.path.islink(path):  # noqa: PTH113, PTH114
                continue
            size += status.st_size
            if size > limit:
                raise ValueError(f"the submission's files take more than {limit} bytes")
            with open(path, "rb") as file:  # noqa: PTH123
                found[os.path.relpath(path, folder)] = (file.read(), status.st_mode & 0o777)
    return found


class FlagForReview(NbGraderPreprocessor):
    """After `SaveGrades`: a cell the grader cannot judge gets no automatic score and waits for a person."""

    def preprocess(self, nb: NotebookNode, resources: dict[str, Any]) -> tuple[NotebookNode, dict[str, Any]]:
        """Write what the cells' metadata say into the gradebook."""
        flagged = [cell for cell in nb.cells if utils.is_grade(cell) and cell.metadata.get(REVIEW)]
        if flagged:
            info = resources["nbgrader"]
            with Gradebook(info["db_url"]) as gradebook:
                for cell in flagged:
                    grade = gradebook.find_grade(
                        cell.metadata.nbgrader["grade_id"],
                        info["notebook"],
                        info["assignment"],
                        info["student"],
                    )
                    grade.auto_score = None
                    grade.needs_manual_grade = True
                    self.log.warning(
                        "%s, cell %s: for manual grading: %s",
                        info["student"], cell.metadata.nbgrader["grade_id"], cell.metadata[REVIEW],
                    )  # fmt: skip
                gradebook.db.commit()
        return nb, resources
