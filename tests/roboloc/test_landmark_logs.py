import dataclasses

import numpy as np
import pytest
from oracles import read_only

from roboloc import landmark_logs
from roboloc.landmark_logs import LandmarkLog, Truth

OBSERVATIONS = [[0.1, 2.0, -3.0, 4.0], [0.2, 1.5, -2.9, 4.5], [0.25, 1.0, -2.8, 5.0]]
CONTROLS = [[0.5, 0.0], [-0.5, 0.125]]
ROWS = ["0.1\t2\t-3\t4\t", "0.5\t0\t", "0.2\t1.5\t-2.9\t4.5\t", "-0.5\t0.125\t", "0.25\t1\t-2.8\t5\t"]


def written(tmp_path, rows):
    """Write rows to a file and return its path."""
    path = tmp_path / "log.txt"
    path.write_text("\n".join(rows), encoding="utf-8")
    return path


def assert_is_the_run(log, steps=2):
    """Compare a log with the one that the rows hold."""
    np.testing.assert_array_equal(log.observations, OBSERVATIONS[: steps + 1])
    np.testing.assert_array_equal(log.controls, np.reshape(CONTROLS[:steps], (-1, 2)))


@pytest.mark.parametrize(
    "change",
    [
        lambda rows: rows,
        lambda rows: [*rows, ""],
        lambda rows: ["", rows[0], "  ", *rows[1:], "\t", ""],
        lambda rows: [row.replace("\t", "  ") for row in rows],
        lambda rows: [row.rstrip() + "\r" for row in rows],
        lambda rows: ["\ufeff" + rows[0], *rows[1:]],
        lambda rows: [rows[0].replace("2", "2.000e0"), *rows[1:]],
    ],
)
def test_rows_are_observations_and_controls_in_turn(tmp_path, change):
    """Tabs at the end, blanks for tabs, empty rows, other line ends and a byte order mark make no difference."""
    assert_is_the_run(landmark_logs.read(written(tmp_path, change(ROWS))))


def test_the_last_control_may_lead_out_of_sight(tmp_path):
    """A log may end with a control, and one that ends with the first row has none."""
    log = landmark_logs.read(written(tmp_path, ROWS[:4]))
    assert log.observations.shape == (2, 4)
    np.testing.assert_array_equal(log.controls, CONTROLS)
    assert_is_the_run(landmark_logs.read(written(tmp_path, ROWS[:1])), steps=0)


def test_one_landmark_is_told_from_a_control_by_its_place(tmp_path):
    """With a single landmark all rows have two numbers."""
    log = landmark_logs.read(written(tmp_path, ["0.5 2", "1 0", "0.5 1"]))
    np.testing.assert_array_equal(log.observations, [[0.5, 2], [0.5, 1]])
    np.testing.assert_array_equal(log.controls, [[1, 0]])


@pytest.mark.parametrize("steps", [0, 1, 2])
@pytest.mark.parametrize("seen", [True, False])
def test_a_log_survives_its_file(tmp_path, steps, seen):
    """What is read is what was written, in rows with tabs and six digits, line ends the same everywhere."""
    log = LandmarkLog(
        OBSERVATIONS[: steps + 1 if seen else max(steps, 1)], CONTROLS[:steps] or np.zeros((0, 2))
    )
    log.write(tmp_path / "log.txt")
    again = landmark_logs.read(tmp_path / "log.txt")
    np.testing.assert_array_equal(again.observations, log.observations)
    np.testing.assert_array_equal(again.controls, log.controls)
    data = (tmp_path / "log.txt").read_bytes()
    assert data.startswith(b"0.100000\t2.000000\t-3.000000\t4.000000\n")
    assert b"\r" not in data


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ([], "observations in the first row of log.txt, got an empty file"),
        (["", "  "], "observations in the first row of log.txt, got an empty file"),
        (["0.1\t2\t0.3"], "pairs of bearing and range in line 1 of log.txt, got 3"),
        (["0.1\t2", "", "1"], "a control of 2 numbers in line 3 of log.txt, got 1"),
        ([*ROWS[:1], *ROWS[2:]], "a control of 2 numbers in line 2 of log.txt, got 4"),
        ([*ROWS[:2], "0.1\t2"], "observations of 4 numbers in line 3 of log.txt, got 2"),
        ([*ROWS[:2], "0.1\t2\t0.3\tfar"], "finite numbers in line 3 of log.txt, got 'far'"),
        ([*ROWS[:2], "0.1\t2\t0.3\tnan"], "finite numbers in line 3 of log.txt, got 'nan'"),
        ([*ROWS[:1], "inf\t0"], "finite numbers in line 2 of log.txt, got 'inf'"),
        (["0.1,2,0.3,4"], "finite numbers in line 1 of log.txt, got '0.1,2,0.3,4'"),
        ([*ROWS[:2], "0.1\t2\t0.3\t-4"], "no negative range in line 3 of log.txt, got -4.0"),
    ],
)
def test_a_wrong_row_is_named_with_its_line(tmp_path, rows, message):
    """The message says which line of which file, what was expected and what came."""
    with pytest.raises(ValueError, match=rf"^path: expected .*{message}$"):
        landmark_logs.read(written(tmp_path, rows))


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ([], "landmarks in the first row of log.txt, got an empty file"),
        (["1 2 3", "0 0 0"], "landmarks of pairs x and y in line 1 of log.txt, got 3"),
        (["1 2 3 4", "0 0 0", "", "1 2"], "a pose of 3 numbers in line 4 of log.txt, got 2"),
        (["1 2", "0 0 east"], "finite numbers in line 2 of log.txt, got 'east'"),
    ],
)
def test_a_wrong_row_of_the_truth_is_named_with_its_line(tmp_path, rows, message):
    """So it is for the file of the truth."""
    with pytest.raises(ValueError, match=rf"^path: expected {message}$"):
        landmark_logs.read_truth(written(tmp_path, rows))


def test_a_file_of_bytes_is_refused(tmp_path):
    """An archive in the place of a log is an error like the others."""
    path = tmp_path / "log.npz"
    path.write_bytes(b"PK\x03\x04\xff\xfe")
    with pytest.raises(ValueError, match=r"^path: expected a text file, got log\.npz"):
        landmark_logs.read(path)


def test_the_truth_survives_its_file(tmp_path):
    """Landmarks in the first row, then poses, of which there may be none."""
    for poses in (np.array([[0.0, 0.5, 7.0], [1.0, 0.25, -7.0]]), np.zeros((0, 3))):
        Truth([1.0, 2.0, -3.0, 4.0], poses).write(tmp_path / "truth.txt")
        again = landmark_logs.read_truth(tmp_path / "truth.txt")
        np.testing.assert_array_equal(again.landmarks, [1.0, 2.0, -3.0, 4.0])
        np.testing.assert_array_equal(again.poses, poses)


@pytest.mark.parametrize(
    ("what", "arrays", "message"),
    [
        (
            LandmarkLog,
            (np.zeros(4), CONTROLS),
            r"observations: expected shape \(T \+ 1, 2k\), got shape \(4,\)",
        ),
        (
            LandmarkLog,
            (np.zeros((3, 5)), CONTROLS),
            r"observations: expected shape \(T \+ 1, 2k\) with k > 0",
        ),
        (
            LandmarkLog,
            (np.zeros((3, 0)), CONTROLS),
            r"observations: expected shape \(T \+ 1, 2k\) with k > 0",
        ),
        (LandmarkLog, (OBSERVATIONS, np.zeros((2, 3))), r"controls: expected shape \(T, 2\)"),
        (LandmarkLog, (OBSERVATIONS[:1], CONTROLS), "controls: expected 0 or 1, .* got 2"),
        (LandmarkLog, (OBSERVATIONS, CONTROLS[:1]), "controls: expected 2 or 3, .* got 1"),
        (LandmarkLog, (np.zeros((0, 2)), np.zeros((0, 2))), "observations: expected a first row"),
        (LandmarkLog, (-np.ones((3, 4)), CONTROLS), "observations: expected no negative range, got -1"),
        (LandmarkLog, (np.full((3, 4), np.nan), CONTROLS), "observations: expected finite"),
        (Truth, (np.zeros(3), np.zeros((1, 3))), r"landmarks: expected shape \(2k,\), got shape \(3,\)"),
        (Truth, (np.zeros(4), np.zeros(3)), r"poses: expected shape \(T \+ 1, 3\)"),
    ],
)
def test_a_wrong_array_is_named(what, arrays, message):
    """A wrong argument is an error with its name, what was expected and what came."""
    with pytest.raises(ValueError, match=f"^{message}"):
        what(*arrays)


def test_a_log_cannot_be_changed():
    """Neither fields nor arrays can be written to, and the caller's arrays stay the caller's."""
    mine = np.array(CONTROLS)
    log, truth = LandmarkLog(*read_only(OBSERVATIONS), mine), Truth(np.zeros(4), np.zeros((3, 3)))
    mine[:] = 7.0
    assert_is_the_run(log)
    for array in (log.observations, log.controls, truth.landmarks, truth.poses, landmark_logs.CONTROL_COV):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        log.controls = mine
    assert repr(log) == "<LandmarkLog: 2 landmarks, 2 controls>"


def test_the_run_of_the_package_is_in_the_package():
    """Six landmarks, as many true poses as observations, bearings wrapped, no landmark nearer than a metre."""
    log, truth = landmark_logs.load(), landmark_logs.load_truth()
    assert log.observations.shape == (37, 12)
    assert (truth.landmarks.shape, truth.poses.shape) == ((12,), (37, 3))
    assert np.abs(log.observations[:, ::2]).max() <= np.pi
    assert log.observations[:, 1::2].min() > 1.0
