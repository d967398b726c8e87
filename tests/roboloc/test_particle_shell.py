from math import nextafter, pi
from types import MappingProxyType, SimpleNamespace

import numpy as np
import pytest
from oracles import read_only

from roboloc.filters import MissingStageError, MonteCarloLocalization, ParticleFilter

X0 = np.array([[1.0, 2.0, 3.0], [3.0, 4.0, -3.0], [5.0, 6.0, 0.0]])
MAP, TF = np.array([[0.1, 0.2], [3.0, 4.0]]), np.array([0.01, 0.02, 0.03])
Z, Q = np.array([[0.5], [1.0]]), 0.1 * np.eye(2)[None]
MOVED = np.array([1.0, 0.0, 0.5])  # by drift, in half a second
NO_OPTIONS = MappingProxyType({})


def drift(xs, us, dt):
    """Move by the control in x and heading; not a robot, only something to tell arguments apart."""
    return xs + dt * us[:, [0, 0, 1]] * [1, 0, 1]


def predict(xs, map_lines, tf):
    """Shift the map by all that was given, so that a wrong argument shows."""
    return map_lines + xs[:, :2, None] + tf[:2, None]


def match(z_raw, Q_raw, hs):
    """Give the one observation to the first line."""
    return z_raw[:, 0] - hs[:, :, 0] + Q_raw[0, 0, 0]


def weigh(vs, Q_raw, ws):
    """Combine all arguments, so that a wrong one shows."""
    ws = ws * vs[:, 0] ** 2 * Q_raw[0, 0, 0]
    return ws / ws.sum()


def choose(ws, offset):
    """Take the heaviest for every place."""
    return np.full(len(ws), ws.argmax())


STAGES = {
    "transition_model": drift,
    "compute_predicted_measurements": predict,
    "compute_innovations": match,
    "measurement_weights": weigh,
    "systematic_resample": choose,
}


def make(options=NO_OPTIONS, **changes):
    """Return a filter with the stages above, some replaced."""
    rng = np.random.default_rng(0)
    stages = {**STAGES, **changes}
    return MonteCarloLocalization(X0, 0 * np.eye(2), MAP, TF, 3.0, rng, stages=stages, **options)


def test_the_shell_calls_the_stages_with_its_belief():
    """Each stage gets the right arguments; what is not resampled keeps its place and gets its weight."""
    pf = make({"threshold": 0.0})
    pf.transition_update([2.0, 1.0], 0.5)
    np.testing.assert_allclose(pf.xs, X0 + MOVED)
    hs = pf.compute_predicted_measurements()
    np.testing.assert_allclose(hs[1], [[4.11, 4.21], [7.02, 8.02]])
    vs = pf.compute_innovations(Z, Q)
    np.testing.assert_allclose(vs, 0.1 + Z[:, 0] - hs[:, :, 0])
    for got, right in zip(pf.measurement_model(Z, list(Q)), (vs, Q), strict=True):
        np.testing.assert_array_equal(got, right)
    for power in (1, 2):
        pf.measurement_update(Z, Q)
        np.testing.assert_allclose(pf.ws, vs[:, 0] ** (2 * power) / np.sum(vs[:, 0] ** (2 * power)))
    np.testing.assert_allclose(pf.xs, X0 + MOVED)


def test_stages_may_come_from_an_object():
    """What works for a mapping works for a module or a namespace."""
    pf = ParticleFilter(X0, np.eye(2), np.random.default_rng(0), stages=SimpleNamespace(**STAGES))
    pf.transition_update([1.0, 0.0], 0.1)
    assert (pf.xs != X0)[:, 0].all()


def test_controls_are_drawn_about_the_command_with_covariance_dt_r():
    """Mean and covariance of 20,000 drawn controls are u and dt R, each within 6 standard errors."""
    M, R, dt = 20_000, np.array([[0.04, 0.01], [0.01, 0.09]]), 0.25
    taken = []

    def note(xs, us, dt):
        taken.append(us)
        return xs

    rng = np.random.default_rng(1)
    ParticleFilter(np.zeros((M, 3)), R, rng, stages={"transition_model": note}).transition_update([1, 2], dt)
    us = taken[0]
    assert (np.abs(us.mean(axis=0) - [1, 2]) < 6 * np.sqrt(np.diag(dt * R) / M)).all()
    assert np.abs(np.cov(us.T) - dt * R).max() < 6 * dt * 0.09 * np.sqrt(2 / M)


def test_mean_and_covariance_go_across_the_cut():
    """Headings on both sides of pi have their mean at pi; weights count, and so do turns that were driven."""
    pf = make()
    pf.xs = np.array([[0.0, 0.0, pi - 0.1], [2.0, 0.0, -pi + 0.1], [1.0, 3.0, 5 * pi]])
    pf.ws = np.array([0.25, 0.25, 0.5])
    np.testing.assert_allclose(pf.x[:2], [1.0, 1.5])
    assert abs(abs(pf.x[2]) - pi) < 1e-12
    right = np.array([[0.5, 0.0, 0.05], [0.0, 2.25, 0.0], [0.05, 0.0, 0.005]])
    np.testing.assert_allclose(pf.Sigma, right, atol=1e-12)


def test_resampling_takes_ancestors_and_makes_weights_equal():
    """Particles are copied from the old set in the order of the ancestors, and afterwards all weigh 1/M."""
    pf = make(systematic_resample=lambda *_: [2, 0, 2])
    pf.ws = np.array([0.2, 0.0, 0.8])
    pf.resample()
    np.testing.assert_array_equal(pf.xs, X0[[2, 0, 2]])
    np.testing.assert_array_equal(pf.ws, np.full(3, 1 / 3))


@pytest.mark.parametrize(("threshold", "resampled"), [(0.0, False), (0.59, False), (0.61, True), (1.0, True)])
def test_the_effective_sample_size_says_when_to_resample(threshold, resampled):
    """Weights of 2/3, 1/3 and 0 are worth 60 percent of three particles: above that threshold they are resampled."""
    pf = make({"threshold": threshold}, measurement_weights=lambda *_: [2 / 3, 1 / 3, 0])
    pf.measurement_update(Z, Q)
    assert (pf.ws[0] == 1 / 3) == resampled


def test_one_weight_of_one_leaves_copies_of_one_particle():
    """If one particle has all the weight, the others become it."""
    pf = make(measurement_weights=lambda *_: [0.0, 1.0, 0.0])
    pf.measurement_update(Z, Q)
    np.testing.assert_array_equal(pf.xs, np.tile(X0[1], (3, 1)))


def test_the_offset_is_always_below_the_spacing_of_the_comb():
    """Also for the largest number that a generator returns, and for every count, the offset is below 1/M."""

    class Largest(np.random.Generator):
        def random(self):
            return nextafter(1.0, 0.0)

    offsets = []

    def note(ws, offset):
        offsets.append((offset, len(ws)))
        return np.arange(len(ws))

    for M in (1, 3, 7, 49, 98, 1000):
        rng = Largest(np.random.PCG64(0))
        ParticleFilter(np.zeros((M, 3)), np.eye(2), rng, stages={"systematic_resample": note}).resample()
    assert all(0.0 < offset < 1 / M for offset, M in offsets)


def test_fresh_particles_come_before_the_correction_and_inherit_the_weights():
    """With a share of 1 all particles are replaced before they are judged, with a share of 0 none, with half some."""
    asked = []

    def fresh(count, rng):
        asked.append(count)
        return np.full((count, 3), 9.0)

    seen = []

    def note(xs, map_lines, tf):
        seen.append(xs)
        return predict(xs, map_lines, tf)

    pf = make({"fresh": fresh, "share": 1.0, "threshold": 0.0}, compute_predicted_measurements=note)
    pf.ws = np.array([0.2, 0.3, 0.5])
    pf.measurement_update(Z, Q)
    np.testing.assert_array_equal(seen[0], np.full((3, 3), 9.0))
    np.testing.assert_allclose(pf.ws, [0.2, 0.3, 0.5])
    pf = make({"fresh": fresh, "share": 0.0}, compute_predicted_measurements=note)
    pf.measurement_update(Z, Q)
    np.testing.assert_array_equal(seen[1], X0)
    assert asked == [3, 0]

    rng = np.random.default_rng(2)
    many = MonteCarloLocalization(
        np.zeros((10_000, 3)), np.eye(2), MAP, TF, 3.0, rng, stages=STAGES, fresh=fresh, share=0.1
    )
    many.compute_innovations = lambda *_: np.ones((10_000, 2))
    many.measurement_update(Z, Q)
    assert abs(asked[2] - 1000) < 6 * np.sqrt(900)


def test_one_particle_and_a_map_without_lines():
    """M = 1 and J = 0 go through all stages with arrays of the right shapes."""
    shapes = []

    def nothing(z_raw, Q_raw, hs):
        shapes.append((z_raw.shape, Q_raw.shape, hs.shape))
        return np.zeros((len(hs), 2 * z_raw.shape[1]))

    stages = {
        **STAGES,
        "compute_innovations": nothing,
        "measurement_weights": lambda *arguments: arguments[2],
    }
    stages["compute_predicted_measurements"] = lambda *_: np.zeros((1, 2, 0))
    pf = MonteCarloLocalization(
        X0[:1], np.eye(2), np.zeros((2, 0)), TF, 3.0, np.random.default_rng(0), stages=stages
    )
    pf.measurement_update(Z, Q)
    pf.measurement_update(np.zeros((2, 0)), [])
    assert shapes == [((2, 1), (1, 2, 2), (1, 2, 0)), ((2, 0), (0, 2, 2), (1, 2, 0))]
    np.testing.assert_allclose(pf.x, X0[0])


def unwritten(*arguments):
    """Stand for a cell that was released and never filled in."""
    raise NotImplementedError


WRITTEN = r" \(it is written in the notebook monte-carlo-localization\)"


@pytest.mark.parametrize(
    ("stage", "why"),
    [
        (None, "not supplied$"),
        (unwritten, f"not written yet{WRITTEN}$"),
        (lambda *_: None, f"returns None: not written yet, or without return{WRITTEN}$"),
    ],
)
@pytest.mark.parametrize("name", list(STAGES))
def test_a_missing_stage_is_named_and_its_result_is_not_replaced(name, stage, why):
    """A stage that is absent, unwritten or silent is an error with its name, and with that of its notebook."""
    pf = make(**{name: stage})
    with pytest.raises(MissingStageError, match=f"^stage {name}: {why}"):
        pf.transition_update([1.0, 0.0], 0.1) if name == "transition_model" else pf.measurement_update(Z, Q)
    np.testing.assert_array_equal(pf.xs, X0)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("transition_model", X0.T[:2], r"xs: expected shape \(3, 3\)"),
        ("compute_predicted_measurements", np.zeros((3, 2, 3)), r"hs: expected shape \(3, 2, 2\)"),
        ("compute_innovations", (np.zeros((3, 2)), Q), r"vs: expected "),
        ("compute_innovations", np.zeros((3, 4)), r"vs: expected shape \(3, 2\)"),
        ("measurement_weights", [1.0, 0.0], r"ws: expected shape \(3,\)"),
        ("measurement_weights", [1.0, np.nan, 0.0], r"ws: expected finite"),
        ("systematic_resample", [0, 1], r"ancestors: expected shape \(3,\)"),
        ("systematic_resample", [0, 1, 3], r"ancestors: expected indices below 3"),
        ("systematic_resample", [0, 1, -1], r"ancestors: expected indices below 3"),
        ("systematic_resample", [0, 1, 1.5], r"ancestors: expected indices below 3"),
    ],
)
def test_an_unusable_result_names_the_stage(name, value, message):
    """A stage that returns something of another shape is told so by name."""
    pf = make(**{name: lambda *_: value})
    with pytest.raises(ValueError, match=f"^stage {name}: {message}.*, got "):
        pf.transition_update([1.0, 0.0], 0.1) if name == "transition_model" else pf.measurement_update(Z, Q)


def test_stages_that_write_to_their_arguments_change_nothing_else():
    """Every stage gets copies: of the cloud, of its weights, of the map and of the observation."""

    def vandal(stage):
        def spoil(*arguments):
            result = np.array(stage(*arguments))
            for argument in arguments:
                if isinstance(argument, np.ndarray):
                    argument[:] = 99
            return result

        return spoil

    x0, u, z, q, map_lines = read_only(X0, [1.0, 0.5], Z, Q, MAP)
    rngs = [np.random.default_rng(0) for _ in range(2)]
    honest, spoilt = (
        MonteCarloLocalization(x0, np.eye(2), map_lines, TF, 3.0, rng, stages=stages)
        for rng, stages in zip(rngs, (STAGES, {k: vandal(v) for k, v in STAGES.items()}), strict=True)
    )
    for pf in (honest, spoilt):
        for _ in range(2):
            pf.transition_update(u, 0.1)
            pf.measurement_update(z, q)
    np.testing.assert_array_equal(honest.xs, spoilt.xs)
    np.testing.assert_array_equal(spoilt.map_lines, MAP)


@pytest.mark.parametrize(
    ("changes", "name"),
    [
        ({"x0": np.zeros(3)}, "x0"),
        ({"x0": np.zeros((0, 3))}, "x0"),
        ({"R": -np.eye(2)}, "R"),
        ({"map_lines": MAP[:1]}, "map_lines"),
        ({"tf_base_to_camera": [0, 0]}, "tf_base_to_camera"),
        ({"g": -1}, "g"),
        ({"rng": 7}, "rng"),
        ({"threshold": 1.1}, "threshold"),
        ({"share": -0.1}, "share"),
        ({"share": 2.0}, "share"),
    ],
)
def test_a_wrong_start_is_named(changes, name):
    """ValueError says which argument is wrong, what was expected and what came."""
    right = {"x0": X0, "R": np.eye(2), "map_lines": MAP, "rng": np.random.default_rng(0)}
    with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
        MonteCarloLocalization(**{**right, "tf_base_to_camera": TF, "g": 3.0, **changes})


@pytest.mark.parametrize(
    ("method", "arguments", "name"),
    [
        ("transition_update", ([1.0], 0.1), "u"),
        ("transition_update", ([1.0, 0.0], -0.1), "dt"),
        ("transition_model", (np.ones((2, 2)), 0.1), "us"),
        ("measurement_update", (Z.T, Q), "z_raw"),
        ("measurement_update", (Z, []), "Q_raw"),
    ],
)
def test_a_wrong_control_or_observation_is_named(method, arguments, name):
    """ValueError says which argument is wrong, what was expected and what came."""
    with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
        getattr(make(), method)(*arguments)


def test_fresh_particles_of_a_wrong_shape_are_named():
    """What supplies fresh particles must supply as many as it is asked for."""
    with pytest.raises(ValueError, match=r"^fresh: expected shape \(3, 3\), got "):
        make({"fresh": lambda count, _: np.zeros((count, 2)), "share": 1.0}).measurement_update(Z, Q)
