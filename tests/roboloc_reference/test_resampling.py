from fractions import Fraction
from math import ceil, floor, inf, nan, nextafter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import read_only

from roboloc_reference.resampling import systematic_resample

law = settings(deadline=None, derandomize=True, max_examples=200)
weight = st.one_of(st.just(0.0), st.floats(0, 1), st.integers(0, 4).map(float), st.floats(0, 1e-12))
weights = st.lists(weight, min_size=1, max_size=40).filter(lambda ws: sum(ws) > 1e-300)

# Flinders tutorial 6: the running sum of its ten weights, rounded as it prints them, and its random number.
FLINDERS_SUMS = [0.1775, 0.1855, 0.2551, 0.2667, 0.2911, 0.4981, 0.6728, 0.7525, 0.9914, 1.0]
FLINDERS_OFFSET = 0.0097


def slowly(ws, offset):
    """Walk along the comb and the ruler, as every textbook writes it; c is the running sum."""
    c, total = [], 0.0
    for w in ws:
        total += w
        c.append(total)
    ancestors, i = [], 0
    for m in range(len(ws)):
        u = min((offset + m / len(ws)) * total, nextafter(total, 0.0))
        while not c[i] > u:
            i += 1
        ancestors.append(i)
    return ancestors


@law
@given(weights, st.floats(0, 1, exclude_max=True))
def test_it_is_the_textbooks_walk_to_the_last_digit(ws, share):
    """For weights with zeros, ties and tiny numbers the ancestors are those of the plain loop, exactly."""
    offset = min(share / len(ws), nextafter(1 / len(ws), 0.0))
    assert systematic_resample(ws, offset).tolist() == slowly(ws, offset)


@pytest.mark.parametrize("count", [1000, 30_000])
def test_a_large_set_is_the_textbooks_walk(count):
    """For thousands of particles, sharp weights and every kind of offset the result is the plain loop's."""
    rng = np.random.default_rng(count)
    for power in (1, 8):
        ws = rng.random(count) ** power
        for offset in (0.0, nextafter(1 / count, 0.0), rng.uniform(0, 1 / count)):
            np.testing.assert_array_equal(systematic_resample(ws, offset), slowly(ws.tolist(), offset))


@law
@given(weights, st.floats(0, 1, exclude_max=True))
def test_every_particle_gets_its_share_rounded_down_or_up(ws, share):
    """A particle is taken floor(M w) to ceil(M w) times, up to rounding, one of weight 0 never."""
    M = len(ws)
    ancestors = systematic_resample(ws, min(share / M, nextafter(1 / M, 0.0)))
    assert ancestors.shape == (M,)
    assert (np.diff(ancestors) >= 0).all()
    total, slack = sum(map(Fraction, ws)), Fraction(1, 10**9)
    for w, taken in zip(ws, np.bincount(ancestors, minlength=M).tolist(), strict=True):
        part = Fraction(w) / total * M
        assert floor(part - slack) <= taken <= ceil(part + slack)
        assert w or not taken


def test_the_tutorials_worked_example_with_its_slip_corrected():
    """The tutorial's sums and its 0.0097 take 1 1 3 6 6 7 7 8 9 9, where it ends with 8 8 (ERRATA F10)."""
    ancestors = systematic_resample(np.diff(FLINDERS_SUMS, prepend=0.0), FLINDERS_OFFSET) + 1
    assert ancestors.tolist() == [1, 1, 3, 6, 6, 7, 7, 8, 9, 9]


def test_copies_come_from_the_old_set():
    """Weights .5 .3 .2 and the offset .1 take x1 x1 x2; copied in place it would be x1 x1 x1 (ERRATA F11)."""
    xs = np.array(["x1", "x2", "x3"])
    ancestors = systematic_resample([0.5, 0.3, 0.2], 0.1)
    assert xs[ancestors].tolist() == ["x1", "x1", "x2"]
    for m, i in enumerate(ancestors):  # what the tutorial's pseudo-code does
        xs[m] = xs[i]
    assert xs.tolist() == ["x1", "x1", "x1"]


def test_the_sum_of_all_and_the_last_running_sum_differ():
    """With weights whose pairwise sum exceeds their running sum the last tooth still points at a particle."""
    rng = np.random.default_rng(3)
    found = 0
    for _ in range(200):
        ws = rng.random(1001)
        ws /= ws.sum()
        found += ws.sum() > np.cumsum(ws)[-1]
        assert systematic_resample(ws, nextafter(1 / 1001, 0.0))[-1] == 1000
    assert found


@pytest.mark.parametrize("count", [1, 2, 3, 10, 49, 1000])
def test_the_largest_offset_stays_inside(count):
    """With equal weights the largest offset takes the last particle last, and one in the middle takes each once."""
    largest = nextafter(1 / count, 0.0)
    ws = np.full(count, 1 / count)
    assert systematic_resample(ws, largest)[-1] == count - 1
    assert systematic_resample(ws, 0.5 / count).tolist() == list(range(count))


@pytest.mark.parametrize("winner", [0, 4, 9])
def test_one_weight_of_one_takes_every_place(winner):
    """If one particle has all the weight, all places are its own, for every offset."""
    ws = np.zeros(10)
    ws[winner] = 1.0
    for offset in (0.0, 0.05, nextafter(0.1, 0.0)):
        assert systematic_resample(ws, offset).tolist() == [winner] * 10


def test_one_particle_is_its_own_ancestor():
    """A set of one is unchanged, whatever its weight, down to the smallest number there is."""
    for w in (5e-324, 1e-300, 1.0, 1e300):
        assert systematic_resample([w], 0.0).tolist() == [0]
        assert systematic_resample([w], nextafter(1.0, 0.0)).tolist() == [0]


def test_weights_in_single_precision_are_summed_in_double():
    """Weights of type float32 give what the same numbers give as float64."""
    ws = np.random.default_rng(4).random(5000).astype(np.float32)
    offset = nextafter(1 / 5000, 0.0)
    np.testing.assert_array_equal(systematic_resample(ws, offset), slowly(ws.tolist(), offset))


def test_the_scale_of_the_weights_does_not_matter():
    """Weights multiplied by a power of two give the same ancestors."""
    ws = np.random.default_rng(5).random(100)
    for scale in (2.0**-900, 2.0**900):
        np.testing.assert_array_equal(systematic_resample(scale * ws, 0.004), systematic_resample(ws, 0.004))


def test_places_are_given_in_proportion():
    """Over evenly spread offsets a particle's average number of places is M w, to the spacing of the offsets."""
    rng = np.random.default_rng(6)
    ws = rng.dirichlet(np.ones(12))
    offsets = (np.arange(1000) + 0.5) / 1000 / 12
    taken = sum(np.bincount(systematic_resample(ws, o), minlength=12) for o in offsets) / 1000
    np.testing.assert_allclose(taken, 12 * ws, atol=2e-3)


def test_weights_are_only_read():
    """A read-only array is accepted, and stays as it was."""
    (ws,) = read_only(np.array([0.2, 0.8]))
    assert systematic_resample(ws, 0.25).tolist() == [1, 1]
    assert ws.tolist() == [0.2, 0.8]


@pytest.mark.parametrize(
    ("ws", "offset", "message"),
    [
        ([], 0.0, "ws: expected at least one weight"),
        ([[0.5, 0.5]], 0.0, r"ws: expected shape \(M,\)"),
        ([0.5, nan], 0.0, "ws: expected finite"),
        ([1.5, -0.5], 0.0, "ws: expected no negative weight, got -0.5"),
        ([0.0, 0.0], 0.0, "ws: expected a positive, finite total, got 0.0"),
        ([1e308, 1e308], 0.0, "ws: expected a positive, finite total, got inf"),
        ([0.5, 0.5], -0.1, "offset: expected a number not below 0.0"),
        ([0.5, 0.5], 0.5, "offset: expected a number below 1/M = 0.5, got 0.5"),
        ([0.5, 0.5], inf, "offset: expected a finite number"),
    ],
)
def test_wrong_arguments_are_named(ws, offset, message):
    """A wrong argument is an error with its name, what was expected and what came."""
    with pytest.raises(ValueError, match=message):
        systematic_resample(ws, offset)
