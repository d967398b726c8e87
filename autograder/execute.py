"""Executing a notebook in two places: the submission's cells in the sandbox, the test cells here.

All cells of the submission run first, in order; the state before each test cell is kept. Then the test cells run, each
against a fork of its state that is thrown away. No output of the submission is written after the first hidden input has
been sent, so none can carry one.
"""

from __future__ import annotations

import contextlib
import itertools
import math
import signal
from dataclasses import dataclass, field
from types import ModuleType
from typing import TYPE_CHECKING, Any

from . import outputs as outputs_
from .analysis import BUILTINS, Names, analyse, statements
from .beside import modules_of
from .crossing import out_of_place, out_of_reach
from .layout import Layout
from .mirror import Mirror, import_for_test, installed
from .remote import GraderError, is_remote
from .roles import REVIEW, grade_id, role_of, visible_part
from .session import REASONS, Ended, Session
from .worker.shell import fresh_namespace, make_shell, run_cell

if TYPE_CHECKING:
    from collections.abc import Iterator

    from nbformat import NotebookNode

    from .sandbox import Sandbox
    from .worker.limits import Limits

_ENDLESS = "the test itself did not come to an end"


@dataclass
class Cell:
    """A code cell with what is known of it before it runs.

    Attributes
    ----------
    node : NotebookNode
        The cell itself; its outputs are filled in.
    role : {"test", "given", "answer", "plain"}
        A test cell; a locked cell of the instructor's; a cell the release gives to the student; any other.
    names : Names
        The cell's own names.
    stub : Names
        Those of the released version of an answer cell.
    """

    node: NotebookNode
    role: str
    names: Names
    stub: Names = field(default_factory=Names)


class Execution:
    """One notebook's execution.

    Parameters
    ----------
    notebook : NotebookNode
        Restored: its locked cells are the instructor's. Its outputs are filled in.
    release : dict of str to str
        Released source by grade id: what students were given.
    sandbox : Sandbox
        Where the submission runs.
    limits : Limits
        What it may use.
    files : dict of str to tuple of (bytes, int)
        The notebook's folder.
    warm : bool, optional
        Whether the sandbox may run the instructor's cells at the beginning once for all; see `worker.zygote`.
    layout : layout.Layout, optional
        What else is known of the release.
    beside : frozenset of str, optional
        Those of the files that are the instructor's; they lie in the working directory, see `beside.beside_tests`.
    """

    def __init__(
        self,
        notebook: NotebookNode,
        release: dict[str, str],
        sandbox: Sandbox,
        limits: Limits,
        files: dict[str, tuple[bytes, int]],
        *,
        warm: bool = True,
        layout: Layout | None = None,
        beside: frozenset[str] = frozenset(),
    ) -> None:
        self.limits = limits
        self.cells = [
            Cell(node, role_of(node), analyse(node.source), analyse(release.get(grade_id(node), "")))
            for node in notebook.cells
            if node.cell_type == "code"
        ]
        layout = layout or Layout()
        self.places = {name: place for place, name in enumerate(layout.order)}
        there = {grade_id(cell.node) for cell in self.cells}
        # What cells import that were deleted, and those that nbgrader does not keep track of.
        gone = [text for name, text in release.items() if name not in there]
        self.imported = {
            name: what for text in [*gone, *layout.plain] for name, what in analyse(text).imports.items()
        }
        self.session = Session(sandbox, limits, files, self.beginning() if warm else ())
        self.shell = make_shell("__test__")
        # IPython inspects the objects that a one-line cell names; a `Remote` refuses that.
        self.shell.prefilter_manager.prefilter_lines = lambda lines, continue_prompt=False: lines  # noqa: ARG005
        self.namespace = fresh_namespace(self.shell, "__test__")
        self.given_run: set[int] = set()
        stubs = [cell.stub for cell in self.cells if cell.role == "answer"]
        given = [cell.names for cell in self.cells if cell.role == "given"]
        shared = frozenset().union(*(names.stores - set(names.imports) for names in [*stubs, *given]))
        self.packages = installed() | modules_of(beside)
        self.mirror = Mirror(self.session, self.namespace, shared, modules_of(beside))

    def beginning(self) -> list[str]:
        """Return the instructor's cells before the first one that a submission could have changed."""
        given = itertools.takewhile(lambda cell: cell.role == "given", self.cells)
        return [cell.node.source for cell in given]

    def run(self) -> None:
        """Run all cells and close the session."""
        try:
            with _alarm(self.limits.wall(self.limits.notebook_cpu) * 2):
                try:
                    self.run_submission()
                except GraderError as error:  # the alarm: what its outputs are does not come to an end
                    self.flag_all(str(error))
                    return
                for index, cell in enumerate(self.cells):
                    if cell.role == "test":
                        self.run_test(index, cell)
        finally:
            self.session.close()

    def flag_all(self, reason: str) -> None:
        """Leave all test cells to a person."""
        for cell in self.cells:
            if cell.role == "test":
                _flag(cell.node, reason)

    # the submission

    def run_submission(self) -> None:
        """Run the cells of the submission, and keep the state before each test cell."""
        count = shown = 0
        for index, cell in enumerate(self.cells):
            cell.node.execution_count = count = count + 1
            if cell.role == "test":
                self.session.mark(index)
                if self.is_needed_later(index):
                    self.session.cell(visible_part(cell.node.source))
                continue
            result = self.session.cell(cell.node.source, careful=not self.is_independent(index))
            shown += outputs_.weight(result.outputs)
            if shown <= outputs_.MAX_NOTEBOOK:
                cell.node.outputs = outputs_.clean(result.outputs)
            elif result.outputs:
                text = (
                    f"the outputs of a notebook are kept up to {outputs_.MAX_NOTEBOOK // 10**6} MB together"
                )
                cell.node.outputs = [outputs_.error("OutputError", text)]
            for output in cell.node.outputs:
                if output.output_type == "execute_result":
                    output.execution_count = count
            if result.ended:
                text = f"this cell was stopped: {REASONS[result.ended]}.\nThe next one went on from the state before it"
                cell.node.outputs.append(outputs_.error("CellStopped", text))

    def is_independent(self, index: int) -> bool:
        """Return whether a cell is the instructor's and reads nothing of the submission's."""
        cell = self.cells[index]
        if cell.role != "given":
            return False
        own = frozenset().union(*(c.names.stores for c in self.cells[:index] if c.role != "given"))
        return not cell.names.loads & own

    def is_needed_later(self, index: int) -> bool:
        """Return whether a later cell of the submission reads a name that only this test cell binds."""
        bound = self.cells[index].names.stores
        before = frozenset().union(*(c.names.stores for c in self.cells[:index] if c.role != "test"))
        later = frozenset().union(*(c.names.loads for c in self.cells[index + 1 :] if c.role != "test"))
        return bool((bound - before) & later)

    # the tests

    def run_test(self, index: int, cell: Cell) -> None:
        """Run one test cell here, its calls of the submission's functions in a fork of its state."""
        self.mirror.enter(index, cell.node.source)
        self.mirror.cells = [
            (c.node.source, c.role == "given") for c in self.cells[:index] if c.role != "test"
        ]
        before = dict(self.namespace)
        try:
            students = self.prepare(index, cell.names.loads | cell.names.deletes)
            self.mirror.bind(sorted(students))
            self.shell.failure = None
            found, succeeded = run_cell(self.shell, cell.node.source)
            if not succeeded and not any(output["output_type"] == "error" for output in found):
                raise GraderError("the test cell failed, and its error could not be shown")  # noqa: TRY301
            found = [o for o in found if o["output_type"] != "stream" or o["name"] == "stdout"]
            cell.node.outputs = [outputs_.new_output(**_for_notebook(output)) for output in found]
        except Ended as ended:
            cell.node.outputs = [outputs_.error("SubmissionStopped", str(ended))]
        except GraderError as error:
            self.mirror.fault = self.mirror.fault or str(error)
        finally:
            with contextlib.suppress(Ended):
                self.session.end()
        self.forget(before, index, cell)
        self.judge(index, cell)

    def judge(self, index: int, cell: Cell) -> None:
        """Flag the cell where the grader cannot stand for its verdict."""
        failed = any(output.output_type == "error" for output in cell.node.outputs)
        fault = self.mirror.fault or _bad_score(cell.node)
        if any(output.get("ename") == "GraderError" for output in cell.node.outputs):
            fault = fault or _ENDLESS  # IPython catches what the alarm raises
        if not fault and failed and (names := self.redefined(index, cell)):
            cells = "a given cell or an earlier test"
            fault = f"the submission gives {', '.join(names)} another value than {cells}, which the test used"
        if not fault and failed:
            fault = self.excuse(index, cell)
        if fault:
            _flag(cell.node, fault)

    def excuse(self, index: int, cell: Cell) -> str:
        """Say why the test may have failed for running elsewhere than the submission; "" where nothing tells that."""
        modules = {name for name, value in self.namespace.items() if type(value) is ModuleType}
        own = [c.names for c in self.cells[:index] if c.role in ("plain", "answer")]
        theirs = {name for names in own for name in names.stores} & {n for names in own for n in names.loads}
        return out_of_place(self.shell.failure, self.mirror.cast) or out_of_reach(
            cell.node.source, cell.names.stores, modules, theirs
        )

    def redefined(self, index: int, cell: Cell) -> list[str]:
        """Return data of given cells and earlier tests that the test reads and the submission assigns anew."""
        given = {
            name for i in self.given_run if self.precedes(i, index) for name in self.cells[i].names.stores
        }
        tests = (c.names.stores for c in self.cells[:index] if c.role == "test")
        given |= frozenset().union(*tests) - cell.names.stores
        own = frozenset().union(
            *(c.names.stores for c in self.cells[:index] if c.role in ("plain", "answer"))
        )
        return sorted(
            name
            for name in given & own & cell.names.loads
            # who imports a module once more does not change it
            if not callable(value := self.namespace.get(name)) and type(value) is not ModuleType
        )

    def prepare(self, index: int, wanted: frozenset[str]) -> set[str]:
        """Run the given cells that a test cell needs; return the names that are the student's."""
        students: set[str] = set()
        seen: set[str] = set()
        waiting = sorted(wanted)
        needed: list[int] = []
        while waiting:
            name = waiting.pop()
            if name in seen:
                continue
            seen.add(name)
            origin = self.origin(name, index)
            imports = self.imported if origin is None else self.cells[origin].stub.imports
            if origin is not None and self.cells[origin].role == "given":
                if origin not in self.given_run and origin not in needed:
                    needed.append(origin)
                    waiting += sorted(self.cells[origin].names.loads)
            elif name in imports and self.import_released(name, *imports[name]):
                continue
            elif origin is not None or (name not in BUILTINS and name not in self.namespace):
                students.add(name)
        for origin in sorted(needed, key=self.place):
            self.run_given(origin, students)
        return students

    def place(self, index: int) -> tuple[int, int]:
        """Return where a cell stands: in the release if that is known, then in the submission."""
        return self.places.get(grade_id(self.cells[index].node), -1), index

    def precedes(self, index: int, test: int) -> bool:
        """Return whether a cell of the release stands before a test cell there, wherever a submission has moved it."""
        (known, _), (of_test, _) = self.place(index), self.place(test)
        return known < of_test if known >= 0 and of_test >= 0 else index < test

    def origin(self, name: str, index: int) -> int | None:
        """Return the last cell of the release before a test cell that binds a name."""
        found = [
            i
            for i, cell in enumerate(self.cells)
            if name in (cell.names if cell.role == "given" else cell.stub).stores
            and cell.role in ("given", "answer")
            and self.precedes(i, index)
        ]
        return max(found, key=self.place, default=None)

    def run_given(self, index: int, students: set[str]) -> None:
        """Run a given cell here too. Where it needs what stays in the sandbox, take its names from there."""
        cell = self.cells[index]
        theirs = students & cell.names.loads
        self.mirror.bind(sorted(theirs))
        self.given_run.add(index)
        for source in statements(cell.node.source) if theirs else [cell.node.source]:
            self.mirror.giving = True
            _, succeeded = run_cell(self.shell, source)
            self.mirror.giving = False
            if self.mirror.fault:
                # Of one statement alone: what the others bind does not hang on what a submission's object does.
                self.mirror.fault = ""
                names = sorted(analyse(source).stores)
                self.mirror.bind(names)
                for name in names:
                    if is_remote(self.namespace.get(name)):
                        del self.namespace[name]
            elif not succeeded:
                break

    def import_released(self, name: str, module: str, attribute: str | None) -> bool:
        """Do here what an import statement of the release does; return False where there is no such module here."""
        found = import_for_test(module, self.packages)
        if not isinstance(found, ModuleType):
            return False
        if attribute is not None:
            found = getattr(found, attribute, None)
        self.namespace[name] = found
        return True

    def forget(self, before: dict[str, Any], index: int, cell: Cell) -> None:
        """Take the student's names out of the test cells' namespace again; what the test computed itself is kept."""
        for name in self.mirror.known:
            own = name in cell.names.stores and self.origin(name, index) is None
            if name in before and not is_remote(before[name]):
                if not own:
                    self.namespace[name] = before[name]
            elif is_remote(self.namespace.get(name)) or (name in self.mirror.described and not own):
                self.namespace.pop(name, None)


def _flag(node: NotebookNode, reason: str) -> None:
    """Leave a test cell to a person."""
    node.metadata[REVIEW] = reason
    node.outputs = [outputs_.error("GraderError", f"a person will look at this cell: {reason}")]


def _for_notebook(output: dict[str, Any]) -> dict[str, Any]:
    """Return an output of our own as `new_output` takes it."""
    fields = dict(output)
    if fields["output_type"] == "execute_result":
        fields["execution_count"] = None
    return fields


def _bad_score(node: NotebookNode) -> str:
    """Say what is wrong with a test cell's result where nbgrader would give full marks for it, or stop."""
    for output in node.outputs:
        if output.output_type == "error":
            return ""
        if output.output_type == "execute_result":
            try:
                score = float(output.data.get("text/plain", "0"))
            except ValueError:
                return ""
            points = float(node.metadata.nbgrader["points"])
            if not 0 <= score <= points or math.isnan(score):
                return f"the test's result {score} is not between 0 and {points}"
            return ""
    return ""


@contextlib.contextmanager
def _alarm(seconds: float) -> Iterator[None]:
    """Stop a test that does not come to an end by itself."""

    def stop(*_: object) -> None:
        raise GraderError(_ENDLESS)

    try:
        before = signal.signal(signal.SIGALRM, stop)
    except ValueError:  # not the main thread: no alarm, the caller's own limit holds
        yield
        return
    signal.setitimer(
        signal.ITIMER_REAL, seconds, seconds
    )  # again and again: the next test may not end either
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
