"""The border between a test cell, which runs here, and the submission, which runs in the sandbox.

A test cell's names are found in this order. Names the *release* gives to students (their stubs) are theirs. What
given cells and earlier test cells define is ours, whatever a submission calls by that name; a builtin is a builtin.
What is left is the student's: a module becomes the grader's own import of it, data comes as a copy, anything else as a
`remote.Remote`.

Before each call, what the test cell did to the student's names is carried over: ``del squares`` is seen by their
functions, and so is an assignment to a name of the release. A test's own variables are not carried over: a submission
must not be able to read ``expected`` by having a variable of that name.
"""

from __future__ import annotations

import importlib
import sys
from functools import cache
from importlib.metadata import packages_distributions
from typing import TYPE_CHECKING, Any, NoReturn

from . import wire
from .crossing import seeds
from .remote import (
    GraderError,
    LimitExceeded,
    MemoryExceeded,
    ProcessDied,
    Remote,
    StudentError,
    is_remote,
    parts,
    rebuild_exception,
)
from .session import Ended
from .worker import randomness

if TYPE_CHECKING:
    from collections.abc import Callable, Container

    from .session import Session

_GONE = object()


class Mirror:
    """The border of one notebook's test cells; see the module.

    Parameters
    ----------
    session : Session
        The notebook.
    namespace : dict
        The globals of the test cells.
    shared : frozenset of str
        Names of the release, which a test cell may assign data to.
    beside : frozenset of str, optional
        Modules of the instructor's that lie beside the notebook.
    """

    def __init__(
        self,
        session: Session,
        namespace: dict[str, Any],
        shared: frozenset[str],
        beside: frozenset[str] = frozenset(),
    ) -> None:
        self.session = session
        self.beside = beside
        self.namespace = namespace
        self.shared = shared
        self.cells: list[tuple[str, bool]] = []  # source of those before the test, and whether it is ours
        self.enter(0)

    def enter(self, number: int, source: str = "") -> None:
        """Begin with the test cell at a mark: nothing of an earlier one is left."""
        self.number = number
        self.random = randomness.states() if seeds(source) else None  # as both sides have them
        self.sown = False  # whether the test has set them
        self.cast: set[str] = set()  # classes of what came as plain data
        self.fault = ""
        self.giving = False  # whether a given cell runs, which the submission has run too
        self.process: object = None  # stands for the process that answers; None before it is started
        self.started_before = False
        self.described: dict[str, list] = {}
        self.known: dict[
            str, Any
        ] = {}  # what the submission's process has under a name: encoded, Remote or _GONE
        self.changes: list[list] = []

    # names

    def describe(self, names: list[str]) -> dict[str, list]:
        """Ask what names stand for in the submission; the answers hold for the process."""
        unknown = [name for name in names if name not in self.described]
        if unknown:
            answer = self._ask(["describe", unknown])
            said = answer[1] if len(answer) > 1 else None
            if answer[0] != "value" or type(said) is not list or len(said) != len(unknown):
                raise Ended("protocol")
            self.described.update(zip(unknown, said, strict=True))
        return {name: self.described[name] for name in names}

    def bind(self, names: list[str]) -> None:
        """Put what names stand for in the submission into the test cell's namespace.

        Parameters
        ----------
        names : list of str
            Those that are the student's.

        Raises
        ------
        Ended
            If the submission's process cannot even say.
        """
        for name, said in self.describe(names).items():
            value = self.resolve(name, said)
            if value is _GONE:
                self.namespace.pop(name, None)
            else:
                self.namespace[name] = value
                self.known[name] = (
                    value if is_remote(value) or said[0] == "module" else wire.encode(value, self._to_ref)
                )
        for name in self.shared:
            if self.known.get(name, _GONE) is _GONE:
                # A given cell's function or other object, which both sides have, is only sent where a test replaces it.
                value = self.namespace.get(name, _GONE)
                self.known[name] = _GONE if value is _GONE or _is_plain(value) else value

    def resolve(self, name: str, said: list) -> Any:
        """Turn the description of a name into what the test cell sees."""
        if type(said) is not list or len(said) < 1:
            raise Ended("protocol")
        if said[0] == "module" and len(said) == 2 and type(said[1]) is str:
            return import_for_test(said[1], {*self.beside, *self.session.sandbox.importable})
        if said[0] == "data" and len(said) == 2:
            try:
                top = lambda ref: Remote(self, ref, name, self.process)  # noqa: E731
                inner = lambda ref: Remote(self, ref, "", self.process)  # noqa: E731
                return wire.decode(said[1], top if _is_ref(said[1]) else inner, casts=self.cast)
            except wire.WireError:
                return _GONE
        return _GONE

    def collect(self) -> list[list]:
        """Return what the test cell did to the student's names since it was last asked."""
        if self.giving:
            return []
        new: list[list] = []
        if self.random is not None and (now := randomness.states()) != self.random:
            self.random, self.sown = now, True
            new.append(["random", wire.encode(now)])
        for name, before in self.known.items():
            value = self.namespace.get(name, _GONE)
            if value is before:
                continue
            if value is _GONE:
                new.append(["del", name])
                self.known[name] = _GONE
            elif is_remote(value) or name in self.shared:
                encoded = self._encode(value, f"the assignment to {name}")
                if encoded != before:
                    new.append(["set", name, encoded])
                self.known[name] = value if is_remote(value) else encoded
        self.changes += [change for change in new if change[0] != "random"]
        return new

    # requests

    def call(self, remote: Remote, attribute: str, args: tuple, kwargs: dict) -> Any:
        """Call an object of the submission's; see `remote.Remote`."""
        return self._request(lambda: self._call(remote, attribute, args, kwargs), args, kwargs)

    def _call(self, remote: Remote, attribute: str, args: tuple, kwargs: dict) -> list:
        number = self._number(remote)
        sent = [self._encode(list(args), "an argument"), self._encode(kwargs, "an argument")]
        return ["call", number, attribute, *sent, self.collect()]

    def get_attribute(self, remote: Remote, attribute: str) -> Any:
        """Return an attribute of an object of the submission's."""
        return self._request(lambda: ["getattr", self._number(remote), attribute, self.collect()])

    def evaluate(self, remote: Remote, values: dict[str, float]) -> Any:
        """Evaluate a symbolic expression of the submission's."""
        point = {name: float(value) for name, value in values.items()}
        return self._request(lambda: ["evaluate", self._number(remote), point])

    def line_events(self, remote: Remote, args: tuple, most: int) -> Any:
        """Call an object of the submission's and count the lines that run; see `remote.line_events`."""
        sent = self._encode(list(args), "an argument")
        return self._request(lambda: ["lines", self._number(remote), sent, most, self.collect()])

    def sources(self) -> list[tuple[str, bool]]:
        """Return the cells before the test cell, as they were handed in."""
        return list(self.cells)

    def refuse(self, reason: str) -> NoReturn:
        """Record that a person must look at this cell, and stop it."""
        self.fault = self.fault or reason
        raise GraderError(reason)

    def _request(self, make: Callable[[], list], args: tuple = (), kwargs: dict | None = None) -> Any:
        """Send a request, once more where only the wall clock ran out, and turn the answer into what Python expects."""
        for last in (False, True):
            try:
                answer = self._ask(make())
                break
            except Ended as ended:
                if ended.reason != "wall" or last:
                    kind = MemoryExceeded if ended.by_memory else ProcessDied
                    raise (LimitExceeded if ended.by_time else kind)(str(ended)) from None
        if answer[0] == "uncrossable":
            reason = answer[1] if len(answer) > 1 and type(answer[1]) is str else "an object"
            self.refuse(f"something does not cross the border of the sandbox: {reason[:200]}")
        try:
            value, error, printed = self._read(answer, args, kwargs or {})
        except (wire.WireError, ValueError, TypeError, IndexError, KeyError):
            raise StudentError(
                "the submission's process answered with something that is not a value"
            ) from None
        if printed:
            sys.stdout.write(printed)
        if error is not None:
            raise error
        return value

    def _read(self, answer: list, args: tuple, kwargs: dict) -> tuple[Any, Exception | None, str]:
        """Read an answer and carry the changes of arguments over."""
        kind, body, changed, printed = answer
        if kind not in ("value", "raised") or type(changed) is not list or type(printed) is not str:
            raise wire.WireError("an answer of another kind")
        for place, new in changed:
            if place == randomness.DRAWN and self.random is not None:
                drawn = wire.decode(new)
                randomness.put(drawn)
                self.random = drawn
            elif not _update(args[place] if type(place) is int else kwargs[place], wire.decode(new)):
                self.refuse(
                    "the call changed type, size or content of an argument to what cannot be shown to the test"
                )
        if kind == "value":
            remote = lambda ref: Remote(self, ref, "", self.process)  # noqa: E731
            return wire.decode(body, remote, casts=self.cast), None, printed
        if [type(item) for item in body] != [str, str, str, str, int, str]:
            raise wire.WireError("an exception of another kind")
        return None, rebuild_exception(body), printed

    def _ask(self, request: list) -> list:
        """Ask the test cell's process; start it first where it does not run."""
        try:
            if self.process is None:
                self._start()
            return self.session.ask(request)
        except Ended:
            self.process = None
            raise

    def _start(self) -> None:
        """Fork the state of the mark, and bring it to where the test cell is."""
        (self.session.again if self.started_before else self.session.begin)(self.number)
        self.started_before = True
        self.process = object()
        names, self.described = list(self.described), {}
        if names:
            self.describe(names)
        changes = [*self.changes, *([["random", wire.encode(self.random)]] if self.sown else [])]
        if changes:
            self.session.ask(["apply", changes])

    def _number(self, remote: Remote) -> int:
        """Return the number of an object in the process that runs now."""
        _, ref, name, process = parts(remote)
        if not name:
            if process is not self.process:
                raise ProcessDied("the object went with the process that held it")
            return ref.number
        said = self.describe([name])[name]
        found = self.resolve(name, said)
        return parts(found)[1].number if is_remote(found) else ref.number

    def _encode(self, value: object, what: str) -> Any:
        try:
            return wire.encode(value, self._to_ref, named=True)
        except wire.WireError as error:
            self.refuse(f"{what} does not cross the border of the sandbox: {error}")

    def _to_ref(self, value: object) -> wire.Ref:
        if is_remote(value):
            return wire.Ref(self._number(value))
        raise wire.WireError(f"an object of type {type(value).__name__} is not plain data")


def _is_plain(value: object) -> bool:
    try:
        wire.encode(value, named=True)
    except wire.WireError:
        return False
    return True


def _is_ref(encoded: object) -> bool:
    return type(wire.decode(encoded)) is wire.Ref


def _update(target: Any, new: Any) -> bool:
    """Do to an argument what the call did to its copy; return whether that can be done."""
    import numpy as np  # noqa: PLC0415

    if type(target) is not type(new):
        return False
    if isinstance(target, np.ndarray):
        if target.shape != new.shape or target.dtype != new.dtype:
            return False
        if not target.flags.writeable:
            return target.tobytes() == new.tobytes()
        target[...] = new
    elif isinstance(target, tuple):
        return len(target) == len(new) and all(map(_update, target, new))
    elif isinstance(target, (list, bytearray)):
        target[:] = new
    elif isinstance(target, (dict, set)):
        target.clear()
        target.update(new)
    elif isinstance(target, np.random.Generator):
        target.bit_generator.state = new.bit_generator.state
    return True


@cache
def installed() -> frozenset[str]:
    """Return the names of all packages that are installed here."""
    return frozenset(packages_distributions())


# Modules that do something when they are imported, and parts of packages that are not for use.
_NOT_FOR_USE = frozenset(
    [
        "antigravity",
        "this",
        "idlelib",
        "turtle",
        "turtledemo",
        "test",
        "tests",
        "autograder",
        "roboloc_reference",
    ]
)


def import_for_test(name: str, packages: Container[str]) -> Any:
    """Return the grader's own import of a module that a submission, or the release, imported.

    Parameters
    ----------
    name : str
        The module's name in the sandbox. A submission can say anything there.
    packages : container of str
        The packages, besides the standard library, that may be imported; see `sandbox.Sandbox.importable`.

    Returns
    -------
    module or object
        The module, or a mark that there is none. No program is started: private modules, `__main__` among them, are
        none.
    """
    root, *_ = parts = name.split(".")
    if root not in sys.stdlib_module_names and root not in packages:
        return _GONE
    if any(part in _NOT_FOR_USE or part.startswith("_") for part in parts):
        return _GONE
    if name in sys.modules:
        return sys.modules[name]
    try:
        return importlib.import_module(name)
    except (Exception, SystemExit):  # noqa: BLE001  (whatever a package does that is not complete here)
        return _GONE
