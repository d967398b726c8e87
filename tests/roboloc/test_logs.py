import dataclasses

import numpy as np
import pytest

from roboloc import logs, worlds
from roboloc.logs import Log

FIELDS = {
    "control_times": [0.0, 1.0, 2.0],
    "controls": [[1.0, 0.0], [2.0, 0.0], [3.0, 0.0]],
    "scan_times": [0.5, 1.0, 2.5],
    "bearings": [-0.1, 0.1],
    "scans": [[1.0, np.nan], [2.0, 3.0], [np.nan, np.nan]],
    "z_raw": [np.ones((2, 2)), np.ones((2, 1)), np.ones((2, 0))],
    "Q_raw": [np.ones((2, 2, 2)), np.ones((1, 2, 2)), np.ones((0, 2, 2))],
    "truth_times": [0.0, 1.0, 3.0],
    "truth": [[0.0, 0.0, 3.0], [1.0, 0.0, 3.5], [3.0, 2.0, 3.5]],
    "x0": [0.1, 0.2, 0.3],
    "Sigma0": np.eye(3),
    "R": np.eye(2),
    "tf_base_to_camera": [0.1, 0.0, 0.0],
    "world": "nowhere",
}


def assert_same(one, other):
    """Compare two logs field by field, bit by bit."""
    for field in dataclasses.fields(Log):
        a, b = getattr(one, field.name), getattr(other, field.name)
        if isinstance(a, tuple):
            assert len(a) == len(b)
            for x, y in zip(a, b, strict=True):
                np.testing.assert_array_equal(x, y)
        else:
            np.testing.assert_array_equal(a, b)


def events(**changes):
    """Return the events of the small log as (time, dt, V, scan)."""
    log = Log(**{**FIELDS, **changes})
    return [(event.time, event.dt, event.u[0], event.scan) for event in log.events()]


def test_a_control_holds_until_the_next_and_intervals_are_cut_at_scans():
    """A scan between two controls cuts the interval; one at the time of a control comes before it."""
    assert events() == [(0.5, 0.5, 1.0, 0), (1.0, 0.5, 1.0, 1), (2.0, 1.0, 2.0, None), (2.5, 0.5, 3.0, 2)]


def test_a_scan_at_the_very_start_moves_nothing():
    """Its interval has no length."""
    assert events(scan_times=[0.0, 0.5, 1.5])[0] == (0.0, 0.0, 1.0, 0)


def test_a_control_after_the_last_scan_moves_nothing():
    """It ends the interval of the one before it."""
    found = events(scan_times=[0.1, 0.2, 0.3])
    assert found[-1] == (2.0, 1.0, 2.0, None)
    assert sum(dt for _, dt, _, _ in found) == pytest.approx(2)


def test_a_run_without_scans_has_its_controls():
    """Whoever has no scanner can still add up what he was told."""
    empty = {"scan_times": [], "scans": np.zeros((0, 2)), "z_raw": [], "Q_raw": []}
    assert events(**empty) == [(1.0, 1.0, 1.0, None), (2.0, 1.0, 2.0, None)]


def test_truth_between_its_times_is_interpolated():
    """At the recorded times it is as recorded; half way it is half way; outside it is refused."""
    log = Log(**FIELDS)
    np.testing.assert_allclose(log.truth_at([0.0, 0.5, 2.0]), [[0, 0, 3], [0.5, 0, 3.25], [2, 1, 3.5]])
    with pytest.raises(ValueError, match=r"^times: expected within 0.0 and 3.0, got "):
        log.truth_at([3.1])


def test_a_log_survives_its_file(tmp_path):
    """What is read is what was written, bit by bit, and the same log makes the same bytes."""
    log = Log(**FIELDS)
    for name in ("one.npz", "two.npz"):
        log.write(tmp_path / name)
    assert_same(logs.read(tmp_path / "one.npz"), log)
    assert (tmp_path / "one.npz").read_bytes() == (tmp_path / "two.npz").read_bytes()


@pytest.mark.parametrize("kind", ["text", "other arrays", "pickle", "one array"])
def test_a_file_that_is_no_log_is_refused(tmp_path, kind):
    """Text, an archive of something else and a pickled object are not read."""
    path = tmp_path / "no.npz"
    if kind == "text":
        path.write_text("no log", encoding="utf-8")
    elif kind == "other arrays":
        np.savez(path, controls=np.zeros(3))
    elif kind == "one array":
        with path.open("wb") as file:
            np.save(file, np.zeros(3))
    else:
        np.savez(path, **{name: np.array([{}], dtype=object) for name in logs._ARRAYS})
    with pytest.raises(ValueError, match=r"^path: expected a log, got no.npz"):
        logs.read(path)


@pytest.mark.parametrize("name", ["maze", "arena"])
def test_a_shipped_run_fits_its_world(name):
    """Inside the walls, near 30 controls and 6 scans a second, not at the same times, in a small file."""
    log, world = logs.load(name), getattr(worlds, name)()
    assert log.world == name
    seconds = log.scan_times[-1] - log.start_time
    assert 25 < len(log.controls) / seconds < 35
    assert 5 < len(log.scans) / seconds < 7
    assert len(np.intersect1d(log.control_times, log.scan_times)) < 0.02 * len(log.scans)
    low = np.minimum(world.segments[:, :2], world.segments[:, 2:]).min(axis=0)
    high = np.maximum(world.segments[:, :2], world.segments[:, 2:]).max(axis=0)
    assert (log.truth[:, :2] > low + 0.3).all()
    assert (log.truth[:, :2] < high - 0.3).all()
    assert np.isin(log.scan_times, log.truth_times).all()
    assert (logs._DATA / f"{name}.npz").stat().st_size < 300_000


def test_the_maze_has_a_long_stretch_with_a_single_wall():
    """At the start the robot sees one line in every scan for more than 10 seconds and 5 metres."""
    log = logs.load("maze")
    first = next(k for k, z in enumerate(log.z_raw) if z.shape[1] != 1)
    assert log.scan_times[first] > 10
    assert np.ptp(log.truth_at(log.scan_times[:first])[:, 0]) > 5


def test_a_log_is_shown_in_one_line():
    """Whoever types its name in a notebook does not get ten thousand numbers."""
    assert repr(Log(**FIELDS)) == "<Log of nowhere: 3 controls, 3 scans>"


def test_an_unknown_run_is_refused():
    """The message names those that there are."""
    with pytest.raises(ValueError, match=r"^name: expected one of arena, maze, got nowhere"):
        logs.load("nowhere")


def test_a_log_cannot_be_changed():
    """Neither its fields nor its arrays can be written to, and the caller's arrays stay the caller's."""
    truth = np.array(FIELDS["truth"])
    log = Log(**{**FIELDS, "truth": truth})
    truth[:] = 7
    assert log.truth[0, 0] == 0
    for array in (log.truth, log.scans, log.z_raw[0], log.Q_raw[0]):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    with pytest.raises(dataclasses.FrozenInstanceError):
        log.world = "other"


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("control_times", [0, 2, 1]),
        ("control_times", [0.7, 1.0, 2.0]),
        ("controls", np.zeros((2, 2))),
        ("scan_times", [0.5, 0.5, 2.5]),
        ("bearings", [[0, 0]]),
        ("scans", np.zeros((3, 3))),
        ("scans", np.full((3, 2), np.inf)),
        ("z_raw", [np.ones((2, 2))]),
        ("Q_raw", [np.ones((2, 2, 2))] * 2),
        ("truth_times", [0, 1, 1]),
        ("truth", np.zeros((3, 2))),
        ("x0", [0, 0]),
        ("Sigma0", -np.eye(3)),
        ("R", np.eye(3)),
        ("tf_base_to_camera", [0, np.nan, 0]),
    ],
)
def test_a_wrong_field_is_named(name, value):
    """ValueError says which field is wrong, what was expected and what came."""
    with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
        Log(**{**FIELDS, name: value})


@pytest.mark.parametrize("name", ["z_raw", "Q_raw"])
def test_wrong_lines_of_a_scan_are_named_with_its_number(name):
    """The lines of scan 1 have another shape than they should."""
    wrong = [*FIELDS[name]]
    wrong[1] = np.ones((3, 3))
    with pytest.raises(ValueError, match=rf"^{name}\[1\]: expected .*, got "):
        Log(**{**FIELDS, name: wrong})
