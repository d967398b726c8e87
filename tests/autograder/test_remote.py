"""What stands for a student's function: it can be called, and refuses everything that would need the object."""

# ruff: noqa: ARG002, PLW0108  (a stand-in takes what the real one takes)

from __future__ import annotations

import copy
import operator
import pickle

import numpy as np
import pytest
import sympy as sp

from autograder import wire
from autograder.remote import (
    GraderError,
    LimitExceeded,
    ProcessDied,
    Remote,
    StudentError,
    evaluate,
    is_remote,
    parts,
    rebuild_exception,
)


class Border:
    """Record what a `Remote` asks for."""

    def __init__(self):
        self.asked = []

    def call(self, remote, attribute, args, kwargs):
        """Record a call."""
        self.asked.append((attribute, args, kwargs))
        return 42

    def get_attribute(self, remote, attribute):
        """Record an attribute."""
        self.asked.append(attribute)
        return 43

    def evaluate(self, remote, values):
        """Record an evaluation."""
        self.asked.append(values)
        return 44.0

    def refuse(self, reason):
        """Refuse as the session's border does."""
        raise GraderError(reason)


@pytest.fixture
def border():
    """Return a border that answers by itself."""
    return Border()


@pytest.fixture
def remote(border):
    """Return an object that stays in the sandbox."""
    return Remote(border, wire.Ref(3, "Robot", is_callable=True), "robot")


def test_calls_and_attributes_go_over_the_border(remote, border):
    """A call carries its arguments, an attribute its name, and both give back what the border says."""
    assert remote(1, x=[2]) == 42
    assert remote.pose == 43
    assert evaluate(remote, {"r": 1.0}) == 44.0
    assert border.asked == [("", (1,), {"x": [2]}), "pose", {"r": 1.0}]


UNARY = [
    len, iter, next, bool, int, float, complex, round, abs, operator.neg, operator.pos, operator.invert, operator.index,
    np.asarray, copy.copy, copy.deepcopy, pickle.dumps, lambda r: r.__class__, lambda r: isinstance(r, int),
    lambda r: isinstance(r, (list, Exception)), lambda r: r[0], lambda r: 1 in r, lambda r: list(r),
    lambda r: r.__setattr__("x", 1), lambda r: setattr(r, "x", 1), lambda r: delattr(r, "x"), lambda r: r.__enter__(),
    lambda r: operator.setitem(r, 0, 1), lambda r: operator.delitem(r, 0), lambda r: not r, lambda r: divmod(r, 2),
    lambda r: r or 0, lambda r: issubclass(type(r).__class__, int) or isinstance(r, Border),
]  # fmt: skip


@pytest.mark.parametrize("operation", UNARY, ids=range(len(UNARY)))
def test_what_needs_the_object_is_refused(remote, operation):
    """Size, truth, iteration, conversion, class, copies and changes are refused, not answered with a default."""
    with pytest.raises(GraderError, match="Robot"):
        operation(remote)


@pytest.mark.parametrize(
    "operation",
    [
        operator.eq, operator.ne, operator.lt, operator.le, operator.gt, operator.ge, operator.add, operator.sub,
        operator.mul, operator.truediv, operator.floordiv, operator.mod, operator.pow, operator.matmul, operator.and_,
        operator.or_, operator.xor, operator.lshift, operator.rshift,
    ],
)  # fmt: skip
def test_comparison_and_arithmetic_are_refused_from_both_sides(remote, operation):
    """Neither side of a comparison or an operation gives an answer that the object was not asked for."""
    for left, right in ((remote, 1), (1, remote), (remote, remote)):
        with pytest.raises(GraderError):
            operation(left, right)


def test_what_python_itself_needs(remote):
    """An object can be named, printed, hashed and asked whether it can be called, without its process."""
    assert repr(remote) == "<robot of the submission>"
    assert f"{remote}" == "<robot of the submission>"
    assert remote.__name__ == "robot"
    assert callable(remote)
    assert {remote: 1}[remote] == 1
    assert is_remote(remote)
    assert not is_remote(3)
    assert parts(remote)[1].number == 3
    with pytest.raises(AttributeError):
        remote.__wrapped__  # noqa: B018


def test_a_grader_error_is_not_an_exception():
    """A test's `except Exception` does not take the grader's fault for the student's; the student's it takes."""
    assert not issubclass(GraderError, Exception)
    assert issubclass(LimitExceeded, StudentError)
    assert issubclass(ProcessDied, StudentError)
    error = StudentError("Odd: x", "Odd", "x", 3, "f(x)")
    assert (error.ename, error.evalue, error.line, error.source) == ("Odd", "x", 3, "f(x)")
    assert ProcessDied("gone").ename == "ProcessDied"


@pytest.mark.parametrize(
    ("described", "kind"),
    [
        (["builtins", "ValueError", "ValueError", "bad", 3, "f()"], ValueError),
        (["numpy.linalg", "LinAlgError", "ValueError", "bad", 3, "f()"], np.linalg.LinAlgError),
        (["__main__", "ValueError", "ValueError", "bad", 3, "f()"], StudentError),
        (["builtins", "Odd", "ValueError", "bad", 3, "f()"], StudentError),
        (["builtins", "SystemExit", "SystemExit", "bad", 3, "f()"], StudentError),
        (["builtins", "KeyboardInterrupt", "KeyboardInterrupt", "bad", 3, "f()"], StudentError),
        (["builtins", "UnicodeDecodeError", "UnicodeDecodeError", "bad", 3, "f()"], StudentError),
        (["builtins", "StopIteration", "StopIteration", "bad", 3, "f()"], StudentError),
        (["builtins", "StopAsyncIteration", "StopAsyncIteration", "bad", 3, "f()"], StudentError),
        (["builtins", "print", "print", "bad", 3, "f()"], StudentError),
        (["builtins", "eval", "eval", "1/0", 3, "f()"], StudentError),
        (["os", "system", "object", "true", 3, "f()"], StudentError),
        (["autograder.remote", "GraderError", "BaseException", "bad", 3, "f()"], StudentError),
        (["sympy", "sympify", "object", "bad", 3, "f()"], StudentError),
        (["scipy.no", "Such", "Exception", "bad", 3, "f()"], StudentError),
    ],
    ids=lambda value: "-".join(value[:2]) if isinstance(value, list) else None,
)
def test_exceptions_are_rebuilt_from_their_name_alone(described, kind):
    """Only an Exception class of Python or a known library is made again; nothing else that is named is called."""
    error = rebuild_exception(described)
    assert type(error) is kind
    assert (error.line, error.source) == (3, "f()")
    assert "bad" in str(error) or described[3] in str(error)


def test_evaluate_here():
    """An expression that is here is evaluated here: symbols by name, matrices by shape, errors as errors."""
    r, s = sp.Symbol("r"), sp.Symbol("r", positive=True)
    assert evaluate(r + s, {"r": 1.5}) == 3.0
    assert evaluate(sp.Matrix([[r, 0], [1, 2]]), {"r": 1.5}).tolist() == [[1.5, 0.0], [1.0, 2.0]]
    assert evaluate([r, 2 * r], {"r": 1.0}).tolist() == [1.0, 2.0]
    assert evaluate(sp.sqrt(r), {"r": -4.0}) == 2j
    with pytest.raises(ValueError, match="q"):
        evaluate(r + sp.Symbol("q"), {"r": 1.0})
    for infinite in (1 / r, sp.log(r), sp.zoo, sp.nan):
        with pytest.raises(ValueError, match="finite"):
            evaluate(infinite, {"r": 0.0})


@pytest.mark.parametrize(
    "text", ["print('ran')", ["print('ran')"], ([1, ("print('ran')",)],), b"1", np.array(["print('ran')"]), {"a": 1},
             np.array([1, "print('ran')"], dtype=object), np.str_("print('ran')"), {"print('ran')"}, print],
    ids=str,
)  # fmt: skip
def test_text_is_no_expression(text, capsys):
    """SymPy evaluates text as Python, and this may be the grader's own process: it is refused, wherever it stands."""
    with pytest.raises(TypeError, match="expected an expression"):
        evaluate(text, {"r": 1.0})
    assert capsys.readouterr().out == ""
    assert evaluate([1, np.float64(2.5), sp.Integer(3)], {}).tolist() == [1.0, 2.5, 3.0]
