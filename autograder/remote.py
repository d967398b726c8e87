"""What a test cell holds in place of a student's function.

A :class:`Remote` looks like the function: calling it sends the arguments into the sandbox and brings plain data back.
Changes which the call made to a list, dict, set, array or random generator among its arguments are made here too, as if
it had run here. An exception comes back as the exception of that name. Anything else one could do with it - compare it,
take its length, ask its class - would need the student's object itself, so it raises :class:`GraderError` and a person
looks at the cell: never a silent pass, never a silent 0.
"""

from __future__ import annotations

import builtins
import inspect
from typing import Any, NoReturn, Protocol

from . import wire
from .worker import lines, symbolic


class GraderError(BaseException):
    """The grader cannot judge this cell; a person must.

    It derives from `BaseException` so that a test's ``except Exception`` does not take it for the student's failure.
    """


class StudentError(Exception):
    """The submission's code raised an exception that has no counterpart here.

    Parameters
    ----------
    message : str
        What happened, for a person.
    ename, evalue : str, optional
        Class and text of the exception.
    line : int, optional
        Line of the student's cell; 0 where it is not known.
    source : str, optional
        That line's text.
    """

    def __init__(
        self, message: str, ename: str = "", evalue: str = "", line: int = 0, source: str = ""
    ) -> None:
        super().__init__(message)
        self.ename = ename or type(self).__name__
        self.evalue = evalue or message
        self.line = line
        self.source = source


class LimitExceeded(StudentError):  # noqa: N818  (the name a reader of feedback sees)
    """The call used up its time."""


class ProcessDied(StudentError):  # noqa: N818
    """The call ended its process."""


class MemoryExceeded(StudentError):  # noqa: N818
    """The call took more memory than a notebook may."""


class Border(Protocol):
    """What a `Remote` needs of the session it belongs to."""

    def call(self, remote: Remote, attribute: str, args: tuple, kwargs: dict) -> Any:
        """Call the object or a method of it."""

    def get_attribute(self, remote: Remote, attribute: str) -> Any:
        """Return an attribute."""

    def evaluate(self, remote: Remote, values: dict[str, float]) -> Any:
        """Evaluate a symbolic expression."""

    def line_events(self, remote: Remote, args: tuple, most: int) -> Any:
        """Call the object and count the lines of Python that run."""

    def sources(self) -> list[tuple[str, bool]]:
        """Return the cells before the test, each with whether it is the instructor's."""

    def refuse(self, reason: str) -> NoReturn:
        """Record that the cell cannot be judged and raise GraderError."""


def _refusing(operation: str) -> Any:
    def method(self: Remote, *_: object) -> NoReturn:
        border, ref = parts(self)[:2]
        border.refuse(
            f"the test uses {operation} on an object of type {ref.type_name}, which stays in the sandbox"
        )

    method.__name__ = operation
    return method


class Remote:
    """An object of the submission's that stays in the sandbox.

    Parameters
    ----------
    border : Border
        The session it belongs to.
    ref : wire.Ref
        Its number and type.
    name : str, optional
        The global name it was found under; it is looked up again where its process was ended.
    process : object, optional
        Stands for the process in which the number is valid.
    """

    __slots__ = ("_parts",)

    def __init__(self, border: Border, ref: wire.Ref, name: str = "", process: object = None) -> None:
        object.__setattr__(self, "_parts", (border, ref, name, process))

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        """Call the student's function with copies of the arguments."""
        return parts(self)[0].call(self, "", args, kwargs)

    def __getattr__(self, attribute: str) -> Any:
        """Return an attribute of the student's object: plain data, or another `Remote`."""
        if attribute == "__name__" and parts(self)[2]:
            return parts(self)[2]
        if attribute in _OF_DEFINITIONS:
            _refusing(attribute)(self)
        if attribute.startswith("__") or attribute in {"_repr_mimebundle_", "_ipython_display_"}:
            raise AttributeError(attribute)
        return parts(self)[0].get_attribute(self, attribute)

    def __repr__(self) -> str:
        """Name it without asking it."""
        _, ref, name, _ = parts(self)
        return f"<{name or ref.type_name} of the submission>"

    def __setattr__(self, attribute: str, value: object) -> NoReturn:
        _refusing("attribute assignment")(self)

    @property
    def __class__(self) -> type:
        """Refuse `isinstance`: its answer would be False whatever the object is."""
        return _refusing("isinstance or __class__")(self)

    __hash__ = object.__hash__


# What the definition of a function or class says, which tests of style and signature ask.
_OF_DEFINITIONS = frozenset(
    f"__{name}__"
    for name in [
        "bases",
        "mro",
        "annotations",
        "code",
        "defaults",
        "kwdefaults",
        "closure",
        "globals",
        "signature",
    ]
)
_OPERATIONS = (
    "eq ne lt le gt ge bool len iter next getitem setitem delitem contains float int complex index round abs neg pos "
    "invert add radd sub rsub mul rmul truediv rtruediv floordiv rfloordiv mod rmod pow rpow matmul rmatmul and rand "
    "or ror xor rxor lshift rlshift rshift rrshift divmod rdivmod enter exit await array reduce_ex delattr "
    "instancecheck subclasscheck mro_entries"
)
for _operation in _OPERATIONS.split():
    setattr(Remote, f"__{_operation}__", _refusing(f"__{_operation}__"))
Remote.__hash__ = object.__hash__  # type: ignore[method-assign]


def parts(remote: Remote) -> tuple[Border, wire.Ref, str, object]:
    """Return border, reference, global name and process of a `Remote`."""
    return object.__getattribute__(remote, "_parts")


def is_remote(value: object) -> bool:
    """Return whether a value is an object that stays in the sandbox (`isinstance` refuses to say)."""
    return type(value) is Remote


def evaluate(target: Any, values: dict[str, float]) -> Any:
    """Evaluate a symbolic answer at a point.

    Parameters
    ----------
    target : Remote or SymPy expression or matrix
        The student's answer: in the grader it stays in the sandbox and is evaluated there.
    values : dict of str to float
        A number for each symbol, by its name.

    Returns
    -------
    float, complex or numpy.ndarray
        Plain numbers.

    Raises
    ------
    ValueError, TypeError, StudentError
        If the answer contains another symbol, is not finite at the point, or is not something to evaluate.

    Examples
    --------
    >>> import sympy as sp
    >>> evaluate(sp.Matrix([sp.Symbol("v") * 2, 1]), {"v": 1.5}).tolist()
    [[3.0], [1.0]]
    """
    if is_remote(target):
        return parts(target)[0].evaluate(target, values)
    return symbolic.evaluate(target, values)


def line_events(target: Any, args: tuple, most: int) -> tuple[int | None, Any]:
    """Call a function and count the lines of Python that run in the call.

    Parameters
    ----------
    target : Remote or callable
        The student's function: in the grader it stays in the sandbox, and the lines are counted there.
    args : tuple
        Its arguments.
    most : int
        Where counting ends, and the call with it.

    Returns
    -------
    events : int or None
        How many, at most `most`; None where the counting was disturbed. The number comes from the process that runs
        the submission, so it can be wrong: see :mod:`autograder.worker.lines`.
    value : object
        What the call returned; None where it was ended.

    Raises
    ------
    Exception
        What the call raised; `StudentError` where the answer is none.

    Examples
    --------
    >>> line_events(lambda x: x + 1, (2.0,), 100)
    (1, 3.0)
    """
    if not is_remote(target):
        return lines.count(target, list(args), most)
    answer = parts(target)[0].line_events(target, args, most)
    if not (type(answer) is tuple and len(answer) == 2):
        raise StudentError("the submission's process answered with something that is not a count")
    events, value = answer
    if events is not None and not (type(events) is int and 0 <= events <= most):
        raise StudentError("the submission's process answered with something that is not a count")
    return events, value


def sources_of(target: Any) -> list[tuple[str, bool]]:
    """Return the cells a function may be made of: their source, and whether it is the instructor's.

    Parameters
    ----------
    target : Remote or callable
        The student's function. One that is here was defined in a notebook that runs here, or in a file.

    Returns
    -------
    list of tuple of (str, bool)
        In the order in which they ran.
    """
    if is_remote(target):
        return parts(target)[0].sources()
    cells = getattr(target, "__globals__", {}).get("In")
    if isinstance(cells, list):
        return [(cell, False) for cell in cells]
    try:
        lines_of_file, _ = inspect.findsource(target)
    except (OSError, TypeError):
        return []
    return [("".join(lines_of_file), False)]


def rebuild_exception(described: list) -> Exception:
    """Make an exception out of what the worker said of one.

    Parameters
    ----------
    described : list
        Module, class, nearest builtin class, text, line number and text of the submission's line.

    Returns
    -------
    Exception
        Of the builtin or library class where there is one and a test cannot take it for the end of a loop, else a
        `StudentError`; with ``line`` and ``source``.
    """
    module, name, nearest, text, line, source = described
    kind: Any = None
    if module == "builtins" and name == nearest:
        kind = getattr(builtins, nearest, None)
    elif module != "builtins":
        try:
            kind = wire.resolve_named(module, name, loaded_only=True)
        except wire.WireError:
            kind = None
    ends_loops = (
        StopIteration,
        StopAsyncIteration,
    )  # raised here, one would end a loop of the test's without a word
    if not (isinstance(kind, type) and issubclass(kind, Exception)) or issubclass(kind, ends_loops):
        return StudentError(f"{name}: {text}", name, text, line, source)
    try:
        error = kind(text)
    except Exception:  # noqa: BLE001  (UnicodeDecodeError and the like want more than a text)
        return StudentError(f"{name}: {text}", name, text, line, source)
    error.line, error.source = line, source  # type: ignore[attr-defined]
    return error
