import importlib
import inspect
import pkgutil

import numpy as np
import pytest
from example_calls import ALLOWED, AX, EXAMPLES, RNG, UNCHECKED
from matplotlib.figure import Figure

import roboloc
import roboloc_reference


def public_functions(package):
    """Return the public functions of a package's public modules by full name, each where it is defined."""
    found = {}
    for entry in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
        if "._" in entry.name:
            continue
        module = importlib.import_module(entry.name)
        for name, value in vars(module).items():
            if inspect.isfunction(value) and value.__module__ == entry.name and not name.startswith("_"):
                found[f"{entry.name}.{name}"] = value
    return found


FUNCTIONS = public_functions(roboloc) | public_functions(roboloc_reference)
CALLS = sorted(FUNCTIONS.keys() & EXAMPLES.keys())
CHECKED = [name for name in CALLS if name.startswith("roboloc_reference.") and name not in UNCHECKED]


def fresh(value):
    """Return an argument as a call gets it: arrays as copies that cannot be written to."""
    if isinstance(value, np.ndarray):
        value = value.copy()
        value.flags.writeable = False
    elif isinstance(value, tuple | list):
        value = type(value)(fresh(part) for part in value)
    elif value is RNG:
        value = np.random.default_rng(0)
    elif value is AX:
        value = Figure().add_subplot()
    return value


def arrays_in(value):
    """Return the arrays among a value and its parts."""
    if isinstance(value, np.ndarray):
        return [value]
    return [array for part in value for array in arrays_in(part)] if isinstance(value, tuple | list) else []


def test_every_public_function_has_an_example():
    """Each public function of both packages has an example call, and no example is of a function that is gone."""
    assert FUNCTIONS.keys() - EXAMPLES.keys() == set()
    assert EXAMPLES.keys() - FUNCTIONS.keys() == set()
    assert UNCHECKED.keys() - EXAMPLES.keys() == set()
    assert {name for name, *_ in ALLOWED} - EXAMPLES.keys() == set()


@pytest.mark.parametrize("name", CALLS)
def test_no_argument_is_changed(name):
    """Called with arrays that cannot be written to, a function works, and every array is what it was."""
    arguments = fresh(EXAMPLES[name])
    FUNCTIONS[name](*arguments)
    for before, after in zip(arrays_in(EXAMPLES[name]), arrays_in(arguments), strict=True):
        np.testing.assert_array_equal(after, before)


@pytest.mark.parametrize("name", CHECKED)
def test_results_are_the_callers_own(name):
    """An array that a stage returns shares no memory with an argument, and may be written to."""
    arguments = fresh(EXAMPLES[name])
    for result in arrays_in(FUNCTIONS[name](*arguments)):
        assert result.flags.writeable
        assert not any(np.may_share_memory(result, argument) for argument in arrays_in(arguments))


def spoilt(value):
    """Yield what is wrong with each bad variant of an array or a float, and the variant."""
    array = np.array(value, dtype=float)
    yield "shape", array[None]
    yield "NaN", np.where(np.arange(array.size).reshape(array.shape) == array.size - 1, np.nan, array)
    yield "infinity", np.full(array.shape, np.inf)
    yield "text", "text"
    yield "None", None
    yield "objects", np.full(array.shape, None, dtype=object)
    yield "complex", array + 1j


def places():
    """Return where an array or a float stands: the function, the place, the name, and its value in the example."""
    return [
        pytest.param(name, place, argument, EXAMPLES[name][place], id=f"{name}-{argument}")
        for name in CHECKED
        for place, argument in enumerate(list(inspect.signature(FUNCTIONS[name]).parameters))
        if place < len(EXAMPLES[name]) and isinstance(EXAMPLES[name][place], np.ndarray | float)
    ]


@pytest.mark.parametrize(("name", "place", "argument", "value"), places())
def test_every_bad_array_is_named(name, place, argument, value):
    """An array or number of a wrong shape or type, or not finite, is a ValueError: name, expected, got."""
    for fault, bad in spoilt(value):
        arguments = list(fresh(EXAMPLES[name]))
        arguments[place] = bad
        if (name, argument, fault) in ALLOWED:
            FUNCTIONS[name](*arguments)
            continue
        with pytest.raises(ValueError, match=rf"(?s)^{argument}: expected .*, got "):
            FUNCTIONS[name](*arguments)
