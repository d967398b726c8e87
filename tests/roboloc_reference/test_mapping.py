"""A new line enters when it is sure that it is there, with all that is known of it, and only once."""

import numpy as np
import pytest
from oracles import read_only

from roboloc.angles import wrap
from roboloc.filters import MissingStageError
from roboloc.worlds import arena
from roboloc_reference import lines, slam
from roboloc_reference.association import measurement_model
from roboloc_reference.mapping import EkfMapping
from roboloc_reference.slam import STAGES, EkfSlam

MAP, TF, DT = arena().map_lines, np.array([0.12, -0.05, 0.2]), 0.1
R, Q = np.diag([0.01, 0.01]), np.diag([0.01, 0.02]) ** 2
START, CERTAIN = np.array([0.2, 0.0, 0.0]), np.zeros((3, 3))


def mapping(x0=START, Sigma0=CERTAIN, **options):
    """Return a filter that knows where it is and nothing else, or something else."""
    return EkfMapping(x0, Sigma0, R, TF, 3.0, **options)


def seen(pose, walls, rng=None):
    """Return some walls of the arena as a robot sees them, with noise or without, and the covariances."""
    z_raw = lines.compute_predicted_measurements(pose, MAP, TF)[0][:, walls]
    noise = 0.0 if rng is None else rng.multivariate_normal(np.zeros(2), Q, len(walls)).T
    return z_raw + noise, np.tile(Q, (len(walls), 1, 1))


def drives(count, seed):
    """Yield controls, true poses and a generator for noise: an arc in the arena."""
    rng, pose = np.random.default_rng(seed), START
    for _ in range(count):
        u = np.array([0.3, 0.4])
        pose = slam.transition_model(pose, u + rng.multivariate_normal(np.zeros(2), DT * R), DT)[0]
        yield u, pose, rng


def walls_of(ekf):
    """Return which wall of the arena each line of the map is nearest to."""
    off = ekf.map_lines.T[:, None] - MAP.T
    return np.argmin(np.hypot(3 * wrap(off[..., 0]), off[..., 1]), axis=1).tolist()


# ---------------------------------------------------------------- is it there at all?


@pytest.mark.parametrize("sightings", [1, 2, 5])
def test_a_line_enters_when_it_has_been_seen_often_enough(sightings):
    """Until then the map is empty; from then on it has the line, once however often the line is seen again."""
    ekf = mapping(sightings=sightings)
    for k in range(1, 12):
        ekf.measurement_update(*seen(START, [2]))
        assert ekf.known == (k >= sightings)
        assert ekf.map_lines.shape == (2, ekf.known)
        assert ekf.x.size == 5
    np.testing.assert_allclose(ekf.map_lines, MAP[:, [2]], atol=1e-12)


def test_two_observations_in_one_scan_are_one_sighting():
    """Two pieces of a new wall in a scan make one passenger, and count once."""
    ekf = mapping(sightings=2)
    for known in (0, 1, 1):
        ekf.measurement_update(*seen(START, [2, 2]))
        assert (ekf.known, ekf.x.size) == (known, 5)


def test_a_line_that_is_not_seen_again_is_forgotten():
    """After as many scans as there is patience, and no sooner; the state is then what it was before, bit by bit."""
    ekf = mapping(patience=4)
    ekf.measurement_update(*seen(START, [2]))
    for _ in range(3):
        ekf.measurement_update(np.zeros((2, 0)), [])
        assert ekf.x.size == 5
    ekf.measurement_update(*seen(START, [2]))  # patience begins anew
    for size in (5, 5, 5, 3):
        ekf.measurement_update(np.zeros((2, 0)), [])
        assert ekf.x.size == size
    np.testing.assert_array_equal(ekf.x, START)
    np.testing.assert_array_equal(ekf.Sigma, CERTAIN)
    for known in (0, 0, 1):  # and a line that comes back begins anew
        ekf.measurement_update(*seen(START, [2]))
        assert ekf.known == known


def test_passengers_do_no_harm():
    """However often unconfirmed lines are seen, pose and map are those of a filter that knows none, to 1e-12."""
    # The map has two walls, the scans show four; without confirmation two of them ride along for ever.
    x0, Sigma0 = np.concatenate([START, MAP[:, :2].T.ravel()]), np.diag([1e-4] * 7)
    ekf, other = mapping(x0, Sigma0, sightings=1000), EkfSlam(x0, Sigma0, R, TF, 3.0, fixed=0)
    for u, pose, rng in drives(40, seed=1):
        z_raw, Q_raw = seen(pose, [0, 3, 1, 4], rng)
        for one in (ekf, other):
            one.transition_update(u, DT)
            one.measurement_update(z_raw, Q_raw)
        np.testing.assert_allclose(ekf.x[:7], other.x, rtol=0, atol=1e-12)
        np.testing.assert_allclose(ekf.Sigma[:7, :7], other.Sigma, rtol=0, atol=1e-12)
    assert (ekf.known, ekf.x.size) == (2, 11)
    assert np.abs(other.x[:2] - START[:2]).max() > 0.5  # they were corrected on the way


# ---------------------------------------------------------------- where is it?


def test_a_line_enters_with_all_that_is_known_of_it():
    """It is the line of `augment` at its first sighting, carried along by the stages with all its covariances."""
    # By hand: the first sighting of wall 4 enters, those until it is confirmed are not used, those after it are.
    x0, Sigma0 = np.concatenate([START, MAP[:, :2].T.ravel()]), np.diag([1e-4] * 7)
    ekf, hand = mapping(x0, Sigma0), EkfSlam(x0, Sigma0, R, TF, 3.0, fixed=0)
    for k, (u, pose, rng) in enumerate(drives(10, seed=2), 1):
        z_raw, Q_raw = seen(pose, [0, 1, 4], rng)
        for one in (ekf, hand):
            one.transition_update(u, DT)
        ekf.measurement_update(z_raw, Q_raw)
        used = [0, 1, 2] if k > 3 else [0, 1]
        hs, Hs = hand.compute_predicted_measurements()
        v = (z_raw[:, used] - hs[:, used]).T
        v[:, 0] = wrap(v[:, 0])
        stacked = measurement_model(v, Q_raw[used], Hs[used])
        hand.x, hand.Sigma = STAGES["measurement_update"](hand.x, hand.Sigma, *stacked)
        if k == 1:
            hand.x, hand.Sigma = slam.augment(hand.x, hand.Sigma, z_raw[:, 2], Q, TF)
            assert np.abs(hand.Sigma[7:, :7]).max() > 1e-5
        np.testing.assert_allclose(ekf.x, hand.x, rtol=0, atol=1e-12)
        np.testing.assert_allclose(ekf.Sigma, hand.Sigma, rtol=0, atol=1e-14)
    assert walls_of(ekf) == [0, 1, 4]


def test_lines_keep_their_places():
    """The map is in the order of confirmation, and what enters or leaves later moves none of it."""
    # Wall 1 is seen first, but so rarely that wall 3 and wall 5 are confirmed before it; wall 2 rides and leaves.
    ekf, orders = mapping(patience=5), []
    scans = {1: [1], 2: [3], 3: [3, 2], 4: [1, 3], 5: [5], 6: [5], 7: [5], 8: [1, 3, 5]}
    for k, (u, pose, rng) in enumerate(drives(12, seed=3), 1):
        ekf.transition_update(u, DT)
        ekf.measurement_update(*seen(pose, scans.get(k, []), rng))
        orders.append(walls_of(ekf))
    assert orders == 3 * [[]] + 3 * [[3]] + [[3, 5]] + 5 * [[3, 5, 1]]
    assert ekf.x.size == 9
    off = np.array([wrap(ekf.map_lines[0] - MAP[0, [3, 5, 1]]), ekf.map_lines[1] - MAP[1, [3, 5, 1]]])
    assert np.abs(off).max() < 0.1
    eigenvalues = np.linalg.eigvalsh(ekf.Sigma)
    assert eigenvalues[0] > 0


# ---------------------------------------------------------------- is it new?


def stand_before_a_wall(scans, **gates):
    """Return how many lines the map has, and the state, after a robot that stands has seen one wall in many scans."""
    rng = np.random.default_rng(4)
    ekf = EkfMapping(START, CERTAIN, R, TF, patience=30, **gates)
    for _ in range(scans):
        ekf.measurement_update(*seen(START, [2], rng))
    return ekf.known, (ekf.x.size - 3) // 2


def test_one_wall_stays_one_line():
    """Of 600 observations seven or so are outside the gate, and make no second line; a single narrow gate does."""
    assert stand_before_a_wall(600, g=3.0) == (1, 1)
    assert stand_before_a_wall(300, g=1.0, newness=1.0)[0] > 1


def test_between_the_gates_nothing_happens():
    """An observation that is neither a known line nor surely a new one changes nothing and does not enter."""
    x0 = np.concatenate([START, MAP[:, 2]])
    for known in (True, False):  # in doubt about a line of the map, or about a passenger
        ekf = mapping(x0, np.zeros((5, 5))) if known else mapping(sightings=9)
        ekf.measurement_update(*seen(START, [2]))
        x, Sigma, count = ekf.x, ekf.Sigma, ekf.known
        (z_raw, Q_raw), deviation = seen(START, [2]), 0.02 if known else 0.02 * np.sqrt(2)
        for deviations, size in ((4, 5), (6, 7)):
            ekf.measurement_update(z_raw + np.array([[0.0], [deviations * deviation]]), Q_raw)
            np.testing.assert_array_equal(ekf.x[:5], x)
            np.testing.assert_array_equal(ekf.Sigma[:5, :5], Sigma)
            assert (ekf.known, ekf.x.size) == (count, size)


def test_a_line_through_the_scanner_is_asked_for_both_ways():
    """A known wall 1 mm ahead of the scanner that is seen 1 mm behind it, half a turn round, is no new wall."""
    ekf = EkfMapping([1.0, 2.0, 0.0, 0.0, 1.001], np.diag([0.0, 0, 0, 1e-6, 1e-6]), R, [0, 0, 0], 3.0)
    for z in ([0.0, 0.001], [-np.pi, 0.001], [np.pi - 1e-3, 0.0]):
        ekf.measurement_update(np.array([z]).T, [Q])
        assert ekf.x.size == 5


def test_a_wall_behind_is_not_the_one_ahead():
    """In the middle of a corridor both walls are equally far away, and the second is new."""
    ekf = EkfMapping([1.0, 2.0, 0.0, 0.0, 1.5], np.zeros((5, 5)), R, [0, 0, 0], 3.0)
    ekf.measurement_update([[0.0, -np.pi], [0.5, 0.5]], [Q, Q])
    assert ekf.x.size == 7


def test_fixed_lines_stay_where_they_are():
    """Two certain walls hold the map; the other four enter, and are where they are."""
    x0 = np.concatenate([START, MAP[:, :2].T.ravel()])
    ekf = mapping(x0, np.zeros((7, 7)), fixed=2)
    for u, pose, rng in drives(60, seed=5):
        ekf.transition_update(u, DT)
        ekf.measurement_update(*seen(pose, range(6), rng))
    np.testing.assert_array_equal(ekf.x[3:7], x0[3:])
    np.testing.assert_array_equal(ekf.Sigma[3:7], 0.0)
    assert sorted(walls_of(ekf)) == list(range(6))
    error = ekf.map_lines - MAP[:, walls_of(ekf)]
    assert np.hypot(wrap(error[0]), error[1]).max() < 0.03


# ---------------------------------------------------------------- border


def test_nothing_observed_changes_nothing():
    """An empty scan, as arrays or as a list, leaves a filter without a map as it is."""
    for nothing in ([], np.zeros((0, 2, 2))):
        ekf = mapping()
        ekf.measurement_update(np.zeros((2, 0)), nothing)
        np.testing.assert_array_equal(ekf.x, START)
        assert (ekf.known, ekf.map_lines.shape) == (0, (2, 0))


def test_arguments_are_read_only():
    """Read-only arrays and lists of matrices are accepted, and no array of the caller is kept."""
    x0, Sigma0, R_, TF_, u = read_only(START, CERTAIN, R, TF, [0.5, 0.1])
    z_raw, Q_raw = read_only(*seen(START, [1, 2]))
    ekf = EkfMapping(x0, Sigma0, R_, TF_, 3.0)
    for given in (Q_raw, list(Q_raw), Q_raw.tolist(), Q_raw):
        ekf.transition_update(u, 0.0)
        ekf.measurement_update(z_raw, given)
    assert ekf.known == 2
    ekf.map_lines[:] = 9.0
    assert ekf.map_lines.max() < 9.0


def test_the_stages_may_be_others():
    """The keyword replaces what supplies the functions; without one that enters lines, it is named."""
    calls = []

    def counting(*arguments):
        calls.append(arguments)
        return slam.augment(*arguments)

    ekf = mapping(stages={**STAGES, "augment": counting})
    ekf.measurement_update(*seen(START, [1, 2]))
    assert len(calls) == 2
    with pytest.raises(MissingStageError, match=r"^stage augment: not supplied"):
        mapping(stages={**STAGES, "augment": None}).measurement_update(*seen(START, [1]))


@pytest.mark.parametrize(
    ("options", "name"),
    [
        ({"x0": np.zeros(4)}, "x0"),
        ({"Sigma0": np.eye(5)}, "Sigma0"),
        ({"fixed": 1}, "fixed"),
        ({"fixed": -1}, "fixed"),
        ({"newness": 2.9}, "newness"),
        ({"newness": np.nan}, "newness"),
        ({"sightings": 0}, "sightings"),
        ({"patience": 0.5}, "patience"),
        ({"patience": "long"}, "patience"),
    ],
)
def test_a_wrong_start_is_named(options, name):
    """ValueError says which argument is wrong, what was expected and what came."""
    with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
        mapping(**options)


@pytest.mark.parametrize(
    ("z", "q", "name"),
    [([[0.0], [1.0], [2.0]], [Q], "z_raw"), ([[0.0], [np.inf]], [Q], "z_raw"), ([[0.0], [1.0]], [], "Q_raw")],
)
def test_a_wrong_observation_is_named_and_nothing_enters(z, q, name):
    """ValueError says which argument is wrong, what was expected and what came."""
    ekf = mapping()
    with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
        ekf.measurement_update(z, q)
    assert ekf.x.size == 3
