"""What holds of the hidden checks of every stage and every symbolic answer, whatever it is about."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp
from diagnosis import COURSE

import kill_matrix
from autograder.check import Recorder, run_stage
from autograder.checks import EXPRESSIONS, STAGES
from autograder.grading import grade, grade_expression
from autograder.secret import generator

POINTS = 10


def filled(stage, number):
    """Make a function that returns the number in arrays of the right shapes, and one number where none is right."""

    def function(*args):
        shapes = [np.shape(value) for value in stage.each(stage.reference(*args))]
        values = [np.full(shape if np.prod(shape) else (1,), number) for shape in shapes]
        return values[0] if len(values) == 1 else tuple(values)

    return function


@pytest.mark.parametrize("name", STAGES)
@pytest.mark.parametrize(
    ("value", "of_one", "of_several"),
    [
        (None, "returned None", "returned None"),
        ("0.5", "holds text", "returned text"),
        ((), "shape (0,)", "0 values"),
        (("a", "b", "c", "d", "e"), "holds text", "5 values"),
        ([object()] * 5, "a list, not numbers", "5 values"),
        ({}, "a dict, not numbers", "returned a dict"),
    ],
    ids=["none", "text", "nothing", "texts", "objects", "dict"],
)
def test_what_is_not_an_answer_scores_nothing(name, value, of_one, of_several, published):
    """None, text, or nothing at all score 0, and the report says what is wrong with them."""
    assert grade(name, lambda *_: value, POINTS) == 0
    words = of_several if len(STAGES[name].outputs) > 1 else of_one
    assert STAGES[name].summary or words in published[0]["text/plain"]


@pytest.mark.parametrize("name", STAGES)
@pytest.mark.parametrize("number", [np.nan, np.inf, 1e300])
def test_numbers_that_are_none_score_nothing(name, number, published):
    """NaN, infinite or huge numbers in the right shapes score 0."""
    assert grade(name, filled(STAGES[name], number), POINTS) == 0


@pytest.mark.parametrize("name", STAGES)
@pytest.mark.parametrize("number", [1e17, 1e300])
def test_one_huge_number_among_right_ones_costs_points(name, number):
    """No entry may be so large that it is taken for right: an angle of 1e17, say, that is brought into its turn."""
    stage = STAGES[name]

    def changed(output, entry):
        def function(*args):
            values = [np.array(value, dtype=float) for value in stage.each(stage.reference(*args))]
            if values[output].size:
                values[output].flat[entry % values[output].size] = number
            return values[0] if len(values) == 1 else tuple(values)

        return function

    for output, title in enumerate(stage.outputs):
        for entry in (0, 1, 2):
            assert run_stage(stage, changed(output, entry), COURSE).share < 1, (title, entry)


@pytest.mark.parametrize("name", STAGES)
def test_there_are_two_other_right_ways(name):
    """Of every stage there are at least two correct versions that are written differently: rows of its kill matrix."""
    assert len(kill_matrix.alternatives(STAGES[name])) >= 2


@pytest.mark.parametrize("name", STAGES)
def test_a_function_that_is_not_written_scores_nothing(name, published):
    """A released cell raises NotImplementedError, and the report says that it is not written."""

    def stub(*_):
        raise NotImplementedError

    assert grade(name, stub, POINTS) == 0
    assert "not written yet" in published[0]["text/plain"]


def digits(values):
    """Write down the numbers of some values as a report would that gave them away: four digits or more."""
    numbers = [number for value in values for number in np.ravel(value) if np.isreal(number) and number]
    return {text for text in (f"{abs(float(number)):.4g}" for number in numbers) if len(text) > 4}


def plain(values):
    """Keep what numbers can be taken from, dicts by their values."""
    for value in values:
        if isinstance(value, dict):
            yield from plain(value.values())
        elif not isinstance(value, (np.random.Generator, str, type(None))):
            yield value


@pytest.mark.parametrize("name", STAGES)
def test_the_report_holds_no_hidden_number(name, published):
    """No number of the hidden inputs or the right results is in the report, with four digits or more."""
    stage = STAGES[name]
    recorder = Recorder(stage.reference)
    with np.errstate(all="ignore"):
        run_stage(stage, recorder, "course-0")
        grade(name, filled(stage, 0.3), POINTS)
    seen = [value for call in recorder.calls for value in (*call.args, *stage.each(call.returned))]
    hidden = digits(plain(seen)) - {"1e-10"}
    assert hidden
    text = "".join(published[0].values())
    assert [number for number in hidden if number in text] == []


@pytest.mark.parametrize("name", STAGES)
def test_a_function_that_remembers_is_caught(name):
    """A result that is right the first time and another one the second time loses points."""
    stage, seen = STAGES[name], {}

    def remembers(*args):
        key = repr(args[:-1] if isinstance(args[-1], np.random.Generator) else args)
        seen[key] = seen.get(key, 0) + 1
        values = stage.each(stage.reference(*args))
        if seen[key] > 1 and not stage.summary:
            values = tuple(np.asarray(value) + 1 for value in values)
        return values[0] if len(values) == 1 else tuple(values)

    assert run_stage(stage, remembers, COURSE).share < 1 or stage.summary


def shape_of(name):
    """Return the shape of a right symbolic answer."""
    expression = EXPRESSIONS[name]
    return np.shape(expression.value(expression.point(generator("shape"))))


def of_shape(entry, shape):
    """Make an expression whose entries are all one."""
    return sp.ones(*shape) * entry if shape else sp.sympify(entry)


@pytest.mark.parametrize("name", EXPRESSIONS)
def test_an_expression_that_is_no_answer_scores_nothing(name, published):
    """None, NaN, infinity, text, an unknown symbol, a number, or another shape: 0 points and a reason."""
    shape = shape_of(name)
    wrong = [None, "x", sp.zeros(0, 0), sp.ones(*shape, 3) if not shape else sp.ones(shape[0] + 1, shape[-1])]
    wrong += [
        of_shape(entry, shape) for entry in (sp.nan, sp.oo, sp.zoo, sp.Symbol("own"), sp.Rational(1, 3))
    ]
    for answer in wrong:
        assert grade_expression(name, answer, 2) == 0, answer
    assert len(published) == len(wrong)
    assert all("failed" in bundle["text/plain"] for bundle in published)


@pytest.mark.parametrize("name", EXPRESSIONS)
def test_a_right_expression_in_another_order_scores_nothing(name):
    """A matrix that is transposed or upside down, or turned in its sign, is another answer."""
    stage = EXPRESSIONS[name].stage()

    def share(change):
        return run_stage(stage, lambda values: change(stage.reference(values)), COURSE).share

    assert share(as_it_is) == 1
    assert share(lambda value: -value) == 0
    shape = shape_of(name)
    if len(shape) == 2 and shape[0] != shape[1]:
        assert share(np.transpose) == 0
    if len(shape) == 2 and shape[0] > 1:
        assert share(np.flipud) == 0


def as_it_is(value):
    """Return the value as it is."""
    return value
