"""How a stage is graded: what is no answer, what a report says and does not say, and what a score is."""

from __future__ import annotations

import dataclasses
import re
import sys

import numpy as np
import pytest

from autograder.check import CallError, Recorder, run_stage
from autograder.checks import STAGES, motion_model
from autograder.grading import Score, grade, grade_expression
from roboloc_reference.gaussian import transition_update
from roboloc_reference.motion import compute_dynamics

DYNAMICS, TRANSITION = STAGES["motion.compute_dynamics"], STAGES["gaussian.transition_update"]


@pytest.mark.parametrize("stage", [DYNAMICS, TRANSITION], ids=lambda stage: stage.name)
@pytest.mark.parametrize(
    ("value", "words"),
    [
        (None, "None"),
        (0.0, "a float"),
        ("text", "text"),
        ((), "0 values"),
        ((None, None, None), "None"),
        (("a", "b", "c"), "text"),
        ((np.zeros((3, 1)), np.zeros(3), np.zeros(3)), "shape (3, 1)"),
        ((1j * np.ones(3), 1j * np.ones((3, 3)), 1j * np.ones((3, 2))), "complex numbers"),
        ((np.full(3, np.nan), np.full((3, 3), np.nan), np.full((3, 2), np.nan)), "NaN"),
        ((np.full(3, np.inf), np.full((3, 3), np.inf), np.full((3, 2), np.inf)), "infinite"),
        ((np.ones(3, bool), np.ones((3, 3), bool), np.ones((3, 2), bool)), "truth values"),
        (([[1], [1, 2]], [[1], [1, 2]], [[1], [1, 2]]), "not numbers"),
        (([object()] * 3, [object()] * 3, [object()] * 3), "not numbers"),
        ((np.zeros(3), np.zeros((3, 3)), np.zeros((3, 2))), "is off"),
    ],
)
def test_what_is_not_an_answer_scores_nothing(stage, value, words, published):
    """None, NaN, a wrong shape, type or number of values, or constants score 0, and the report says which."""
    if isinstance(value, tuple) and len(value) == 3:
        value = value[: len(stage.outputs)]
    assert grade(stage.name, lambda *_: value, 10) == 0
    assert words in published[0]["text/plain"]


class Equal:
    """An object that claims to be equal to everything."""

    __array_priority__ = 1e9
    __eq__ = __ge__ = __le__ = lambda *_: True
    __hash__ = None
    __sub__ = __rsub__ = __abs__ = lambda self, *_: self

    def __float__(self):
        """Pretend to be a number."""
        return 0.0

    @property
    def __class__(self):
        """Refuse to be asked, as an object that stayed in the sandbox does."""
        raise KeyboardInterrupt


@pytest.mark.parametrize("make", [Equal, lambda: [Equal()] * 3, lambda: (Equal(), Equal(), Equal())])
def test_an_object_that_pretends_is_not_asked(make, published):
    """An always-equal object scores 0 without one of its methods being called."""
    assert grade("motion.compute_dynamics", lambda *_: make(), 10) == 0
    assert grade("gaussian.transition_update", lambda *_: make(), 10) == 0


def test_a_function_that_is_not_written_scores_nothing(published):
    """The released cell raises NotImplementedError, and the report says that it is not written."""

    def compute_dynamics(*_):
        raise NotImplementedError

    assert grade("motion.compute_dynamics", compute_dynamics, 10) == 0
    assert "not written yet" in published[0]["text/plain"]


def test_sys_exit_is_a_failed_check(published):
    """A call that asks Python to exit fails its checks and stops nothing else."""
    assert grade("motion.compute_dynamics", lambda *_: sys.exit(0), 10) == 0
    assert "asked Python to exit" in published[0]["text/plain"]


@pytest.mark.parametrize("kind", ["LimitExceeded", "ProcessDied", "MemoryExceeded"])
def test_the_first_limit_ends_the_stage(kind, published):
    """After a call that used up its time or ended its process no call is made; what passed before counts."""
    from autograder import remote  # noqa: PLC0415

    calls = []

    def slow_after_eight(*args):
        calls.append(args)
        if len(calls) > 8:
            raise getattr(remote, kind)("stopped")
        return compute_dynamics(*args)

    assert grade("motion.compute_dynamics", slow_after_eight, 20) == 3
    assert len(calls) == 9
    text = published[0]["text/plain"]
    assert text.count("\n  not run ") == 10
    assert text.count("not run, because an earlier call") == 1


def test_an_error_of_the_grader_is_not_a_failed_check():
    """What derives from BaseException, as GraderError does, passes through; so does a fault of a check of ours."""
    from autograder.remote import GraderError  # noqa: PLC0415

    def refuse(*_):
        raise GraderError

    with pytest.raises(GraderError):
        run_stage(DYNAMICS, refuse, "s")
    broken = dataclasses.replace(DYNAMICS, checks=(motion_model.Check("ours", 1, lambda *_: 1 / 0),))
    with pytest.raises(ZeroDivisionError):
        run_stage(broken, compute_dynamics, "s")


def test_a_student_cannot_write_an_input_into_the_report(published):
    """Text and type of an exception, an assertion's message and a line that changes are not repeated."""
    told = []

    def tell(xvec, u, dt):
        told.append(f"{xvec[0]:.6f}")
        kind = [AssertionError, type(f"E{abs(u[0]):.6f}".replace(".", "_"), (Exception,), {}), ValueError]
        error = kind[len(told) % 3](f"{xvec} {u} {dt} {told[-1]}")
        error.line = int(abs(xvec[0]) * 50) % 199 + 1
        error.ename = told[-1]
        raise error

    assert grade("motion.compute_dynamics", tell, 10) == 0
    text = "".join(published[0].values())
    assert not [number for number in told if number.lstrip("-") in text]
    assert len(set(re.findall(r"line (\d+)", text))) == 1


def test_the_report_holds_no_hidden_number(published):
    """No number of the hidden inputs or right results is in the report, with four digits or more."""
    seen = []

    def spy(*args):
        seen.extend([*args, *transition_update(*args)])
        return args[0] + 1, args[3]

    assert grade("gaussian.transition_update", spy, 10) == 0
    text = "".join(published[0].values())
    numbers = {f"{abs(number):.4g}" for value in seen for number in np.ravel(value) if number}
    assert len(numbers) > 100
    assert not [number for number in numbers if len(number) > 4 and number in text]


def test_a_function_that_remembers_is_caught(published):
    """A result that depends on earlier calls loses the check for it, though each value was right once."""
    calls = []

    def remembers(*args):
        calls.append(args)
        g, Gx, Gu = compute_dynamics(*args)
        repeated = sum(all(map(np.array_equal, args, call)) for call in calls) > 1
        return (g + 1, Gx, Gu) if repeated else (g, Gx, Gu)

    outcome = run_stage(DYNAMICS, remembers, "s")
    assert [result.check.name for result in outcome.failed] == ["same call, same result"]


def test_inputs_follow_from_the_secret():
    """The same secret gives the same inputs, another one gives others."""

    def inputs(secret):
        recorder = Recorder(compute_dynamics)
        run_stage(DYNAMICS, recorder, secret)
        return np.concatenate([np.concatenate([call.args[0], call.args[1]]) for call in recorder.calls])

    assert np.array_equal(inputs("a"), inputs("a"))
    assert not np.isin(inputs("a")[:5], inputs("b")).any()


def test_html_is_simple_and_escaped(published):
    """The report uses plain tags, no style, no script, and escapes what it shows."""
    grade("motion.compute_dynamics", lambda xvec, *_: (xvec, None, np.zeros((9, 9))), 10)
    bundle = published[0]
    assert set(bundle) == {"text/plain", "text/html"}
    allowed = {"h4", "p", "ul", "li", "strong", "em", "code", "table", "tr", "td", "th"}
    assert set(re.findall(r"</?([a-z0-9]+)", bundle["text/html"])) <= allowed
    assert "run-7" in bundle["text/html"]
    assert "numpy" in bundle["text/plain"]
    assert re.search(r"Checks [0-9a-f]{12}", bundle["text/plain"])


def test_report_escapes_even_our_own_words(published):
    """A message with markup in it arrives as text."""

    def run(_function, _rng):
        raise AssertionError("<script>alert(1)</script>")

    stage = dataclasses.replace(DYNAMICS, checks=(motion_model.Check("<b>", 1, run, "<i>"),))
    from autograder.grading import _grade  # noqa: PLC0415

    _grade(stage, compute_dynamics, 1)
    assert not re.search(r"<(script|b|i)>", published[0]["text/html"])


@pytest.mark.parametrize(
    ("value", "text"), [(10 / 3, "3.3333"), (2 / 3, "0.6666"), (0.0, "0"), (10, "10"), (1e-9, "0")]
)
def test_score_prints_as_a_decimal_number(value, text):
    """A score has at most four decimals, no exponent, is never above its value, and prints what it is."""
    score = Score(value)
    assert (repr(score), str(score), float(score)) == (text, text, float(text))
    assert score <= value


def test_score_is_points_times_share(published):
    """A transposed Gx costs a fifth of the points, whatever the points are."""

    def transposed(*args):
        g, Gx, Gu = compute_dynamics(*args)
        return g, Gx.T, Gu

    assert [grade("motion.compute_dynamics", transposed, points) for points in (10, 7, 1 / 3)] == [
        8,
        5.6,
        0.2666,
    ]


@pytest.mark.parametrize("points", [0, -1, float("nan"), "10", None])
def test_points_must_be_a_positive_number(points):
    """A test cell with wrong points is a mistake of the author's and says so."""
    with pytest.raises(ValueError, match="points: expected a positive number, got"):
        grade("motion.compute_dynamics", compute_dynamics, points)


def test_unknown_names_are_refused():
    """An unknown stage or symbolic answer is a mistake of the author's and names what there is."""
    with pytest.raises(
        ValueError, match=r"stage: expected one of .*motion\.compute_dynamics, .*got 'motion'"
    ):
        grade("motion", compute_dynamics, 1)
    with pytest.raises(ValueError, match=r"name: expected one of .*differential_drive\.g, .*got 'g'"):
        grade_expression("g", 1, 1)


def test_recorder_hands_out_what_it_was_given():
    """A call's changes to its arguments are seen by the caller and kept, with the arguments before."""
    recorder = Recorder(lambda a: a.fill(7.0))
    given = np.zeros(2)
    recorder(given)
    assert recorder.calls[0].args[0].tolist() == [0.0, 0.0]
    assert given.tolist() == [7.0, 7.0]
    with pytest.raises(CallError, match="the call raised TypeError"):
        recorder()


def test_kinds_of_errors_tell_little():
    """The first kind of error is named, if an honest mistake raises it; another one after it could be a code."""
    kinds = iter([TypeError, ValueError, BlockingIOError, TypeError])

    def function():
        raise next(kinds)

    recorder = Recorder(function)
    said = []
    for _ in range(4):
        with pytest.raises(CallError) as error:
            recorder()
        said.append(str(error.value))
    assert [text.partition(" (line")[0] for text in said] == [
        "the call raised TypeError",
        "the call raised another error than the first one",
        "the call raised another error than the first one",
        "the call raised TypeError",
    ]
    with pytest.raises(CallError, match="a type of its own"):
        Recorder(lambda: (_ for _ in ()).throw(BlockingIOError))()
