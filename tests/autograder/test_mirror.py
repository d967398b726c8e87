"""The border between a test cell and the submission, with a submission's process that may say anything."""

# ruff: noqa: E501, PT017  (what an answer may be is told by which exception it becomes)

from __future__ import annotations

import contextlib
import math
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from autograder import wire
from autograder.mirror import _GONE, Mirror, import_for_test
from autograder.remote import GraderError, LimitExceeded, ProcessDied, StudentError, is_remote
from autograder.session import Ended

REF = wire.encode(wire.Ref(0, "function", is_callable=True))


class Answers:
    """A session whose process answers from a list, and keeps what it was asked."""

    def __init__(self, *answers):
        self.answers = list(answers)
        self.asked = []

    def begin(self, number):
        """Keep that a test cell began."""
        self.asked.append(["begin", number])

    def again(self, number):
        """Keep that it began once more."""
        self.asked.append(["again", number])

    def ask(self, request):
        """Answer from the list."""
        self.asked.append(request)
        answer = self.answers.pop(0)
        if isinstance(answer, Exception):
            raise answer
        return answer


def mirror(*answers, shared=()):
    """Return a border whose process has a function `f` and then gives some answers."""
    session = Answers(["value", [["data", REF]]], *answers)
    border = Mirror(session, {}, frozenset(shared))
    border.bind(["f"])
    return border, session


def value(it, changed=(), printed=""):
    """Return the answer of a call."""
    return ["value", wire.encode(it), list(changed), printed]


def test_a_call_carries_copies_and_brings_data_back():
    """Arguments cross encoded, the value comes decoded, and the changes the test made go with the next call."""
    border, session = mirror(value((1, 2.0)), value(None), shared=["rate"])
    f = border.namespace["f"]
    assert f([1], k=np.float32(2)) == (1, 2.0)
    _, number, attribute, args, kwargs, changes = session.asked[-1]
    assert (number, attribute, wire.decode(args), wire.decode(kwargs)) == (0, "", [[1]], {"k": np.float32(2)})
    assert changes == []
    border.namespace["rate"] = [3]
    border.namespace["expected"] = 42
    del border.namespace["f"]
    f()
    assert session.asked[-1][-1] == [["del", "f"], ["set", "rate", wire.encode([3])]]


def test_unchanged_names_are_not_sent_twice():
    """What was carried over once is carried again only where the test changed it again, in place included."""
    border, session = mirror(value(None), value(None), value(None), shared=["rate"])
    f = border.namespace["f"]
    border.namespace["rate"] = [3]
    f()
    f()
    assert session.asked[-1][-1] == []
    border.namespace["rate"].append(4)
    f()
    assert session.asked[-1][-1] == [["set", "rate", wire.encode([3, 4])]]


def test_changes_of_arguments_arrive_in_place():
    """A change of an argument, by place or by keyword, is made to the very object the test handed over."""
    changed = [[0, wire.encode([1, 9])], ["d", wire.encode({"k": 1})], [1, wire.encode(np.ones(2))]]
    border, _ = mirror(value(None, changed))
    items, mapping, array = [1], {}, np.zeros(2)
    border.namespace["f"](items, array, d=mapping)
    assert (items, mapping, array.tolist()) == ([1, 9], {"k": 1}, [1.0, 1.0])


@pytest.mark.parametrize(
    ("target", "new"),
    [
        ([1], (9,)), ((1,), [9]), ({}, [9]), (np.zeros(2), np.ones(3)), (np.zeros(2), np.ones(2, dtype=int)), (3, 4),
        (np.zeros(2), [1.0, 1.0]), ("a", "b"),
    ],
    ids=str,
)  # fmt: skip
def test_no_argument_becomes_another_kind(target, new):
    """A process that claims another type, shape or dtype for an argument does not change it; a person looks."""
    border, _ = mirror(value(None, [[0, wire.encode(new)]]))
    before = repr(target)
    with (
        contextlib.nullcontext()
        if isinstance(target, (int, str))
        else pytest.raises(GraderError, match="argument")
    ):
        border.namespace["f"](target)
    assert repr(target) == before


def test_a_read_only_array_stays():
    """A process cannot change an array that the test made read-only; that it changed its copy, a person sees."""
    border, _ = mirror(value(None, [[0, wire.encode(np.ones(2))]]))
    array = np.zeros(2)
    array.flags.writeable = False
    with pytest.raises(GraderError, match="argument"):
        border.namespace["f"](array)
    assert array.tolist() == [0.0, 0.0]


JUNK = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-2, 20)
    | st.text(max_size=4)
    | st.binary(max_size=4)
    | st.floats(),
    lambda inner: st.lists(inner, max_size=5) | st.dictionaries(st.text(max_size=2), inner, max_size=2),
    max_leaves=10,
)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(st.sampled_from(["value", "raised", "x"]), st.lists(JUNK, max_size=4))
def test_a_forged_answer_is_the_students_failure(kind, fields):
    """Whatever a process answers to a call, the test sees plain data or a StudentError, and the grader goes on."""
    border, _ = mirror([kind, *fields])
    items = [1]
    try:
        result = border.namespace["f"](items)
    except StudentError:
        return
    except GraderError:  # a forged reference in the place of a value is refused where it is used
        return
    except Exception as error:  # noqa: BLE001
        assert kind == "raised"
        assert type(error).__module__ == "builtins"
        return
    assert is_remote(result) or not callable(result)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(JUNK)
def test_a_forged_description_ends_the_process_or_is_data(said):
    """Whatever a process says a name stands for, the name is data, a library module, or not there."""
    session = Answers(["value", [said]])
    border = Mirror(session, {}, frozenset())
    try:
        border.bind(["x"])
    except Ended as ended:
        assert ended.reason == "protocol"


@pytest.mark.parametrize(
    "answer", [["value"], ["value", []], ["value", None], ["raised", [["missing"]]], ["x"]]
)
def test_a_description_of_another_length_is_recognised(answer):
    """An answer that does not describe what was asked for ends the process."""
    with pytest.raises(Ended, match="channel"):
        Mirror(Answers(answer), {}, frozenset()).bind(["x"])


def test_what_does_not_cross_is_the_graders_fault():
    """A function or object of the test's own as argument, and an uncrossable value, are recorded as grader errors."""
    border, _ = mirror(["uncrossable", "an integer of more than 100000 bits"])
    with pytest.raises(GraderError):
        border.namespace["f"](lambda: 1)
    assert "argument" in border.fault
    border.fault = ""
    with pytest.raises(GraderError):
        border.namespace["f"](object())
    border.fault = ""
    with pytest.raises(GraderError):
        border.namespace["f"](1)
    assert "cross" in border.fault


@pytest.mark.parametrize(
    ("reason", "kind"),
    [("cpu", LimitExceeded), ("cell", LimitExceeded), ("notebook", LimitExceeded), ("died", ProcessDied), ("lost", ProcessDied)],
)  # fmt: skip
def test_the_end_of_a_process_is_an_exception_that_says_why(reason, kind):
    """A call whose process ended raises once, and the next call starts from the mark again with the test's changes."""
    border, session = mirror(
        Ended(reason), ["value", [["data", REF]]], ["value", None], value(5), shared=["rate"]
    )
    border.namespace["rate"] = 3
    with pytest.raises(kind):
        border.namespace["f"](1)
    assert border.namespace["f"](1) == 5
    assert ["again", 0] in session.asked
    assert ["apply", [["set", "rate", 3]]] in session.asked


def test_the_wall_clock_is_asked_twice():
    """A call that only the wall clock ended is made once more; a second time it is the student's failure."""
    border, _ = mirror(Ended("wall"), ["value", [["data", REF]]], value(5))
    assert border.namespace["f"](1) == 5
    border, _ = mirror(Ended("wall"), ["value", [["data", REF]]], Ended("wall"))
    with pytest.raises(LimitExceeded):
        border.namespace["f"](1)


def test_an_object_goes_with_its_process():
    """An object that a call returned is gone when its process is; a global is found again under its name."""
    robot = ["value", wire.encode(wire.Ref(7, "Robot")), [], ""]
    border, _session = mirror(robot, Ended("died"), ["value", [["data", REF]]])
    made = border.namespace["f"]()
    with pytest.raises(ProcessDied):
        border.namespace["f"]()
    with pytest.raises(ProcessDied, match="process that held it"):
        made.drive(1)


def test_modules_that_a_test_may_use():
    """A module is the grader's own import; programs, what the sandbox lacks, and the grader's own packages are none."""
    packages = {"numpy", "autograder", "roboloc_reference", "tests", "IPython"}
    assert import_for_test("math", packages) is math
    assert import_for_test("numpy.linalg", packages) is np.linalg
    assert import_for_test("numpy.linalg", {"scipy"}) is _GONE
    for name in ("autograder", "autograder.remote", "roboloc_reference", "roboloc_reference.motion", "no_such", "this",
                 "antigravity", "", "__main__", "numpy.no_such", "tests", "conftest", "unittest.__main__", "IPython.__main__", "jupyterlab_server",
                 "numpy.tests", "numpy._core", "test.autotest"):  # fmt: skip
        assert import_for_test(name, packages) is _GONE
    assert "unittest.__main__" not in sys.modules
