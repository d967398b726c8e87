import dataclasses

import numpy as np
import pytest
from oracles import read_only

from roboloc import velocity_logs
from roboloc.velocity_logs import VelocityLog

PARTS = {
    "dt": 0.5,
    "us": np.array([[1.0, 0.1, 0.0], [1.0, -0.1, 0.0]]),
    "alphas": np.arange(6.0),
    "landmarks": np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]]),
    "seen": np.array([[-1, 2], [1, 0]]),
    "zs": np.array([[9.0, 9.0, 0.1, 2.0], [0.2, 3.0, 0.3, 4.0]]),
    "Q": np.diag([0.01, 0.04]),
    "x0": np.zeros(3),
    "Sigma0": np.eye(3),
    "truth": np.arange(9.0).reshape(3, 3),
}


def test_steps_hold_what_was_seen_alone():
    """Of a step with one landmark less, only the other's bearing and range come."""
    first, second = VelocityLog(**PARTS).steps()
    assert (first.z.tolist(), first.landmarks.tolist()) == ([0.1, 2.0], [[5.0, 6.0]])
    assert (second.z.tolist(), second.landmarks.tolist()) == ([0.2, 3.0, 0.3, 4.0], [[3.0, 4.0], [1.0, 2.0]])
    assert (second.u.tolist(), second.truth.tolist()) == ([1.0, -0.1, 0.0], [6.0, 7.0, 8.0])


def test_a_file_holds_several_runs(tmp_path):
    """Observations and truth of a file have the runs as their first axis, all else is theirs together."""
    many = {name: np.stack([PARTS[name], 2.0 * PARTS[name]]) for name in ("zs", "truth")}
    np.savez(tmp_path / "runs.npz", **PARTS | many)
    first, second = velocity_logs.read(tmp_path / "runs.npz")
    np.testing.assert_array_equal(second.zs, 2.0 * first.zs)
    np.testing.assert_array_equal(second.truth, 2.0 * PARTS["truth"])
    for field in dataclasses.fields(VelocityLog):
        np.testing.assert_array_equal(getattr(first, field.name), PARTS[field.name])


def test_what_cannot_be_read_is_named(tmp_path):
    """A file that holds no runs and a name that is none are errors."""
    np.savez(tmp_path / "other.npz", us=np.zeros(3))
    with pytest.raises(ValueError, match=r"^path: expected runs, got other\.npz"):
        velocity_logs.read(tmp_path / "other.npz")
    with pytest.raises(ValueError, match=r"^name: expected one of eight, unsure, got 'nine'"):
        velocity_logs.load("nine")


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"us": np.zeros((2, 2))}, r"us: expected shape \(N, 3\)"),
        ({"seen": [[0, 3], [0, 1]]}, "seen: expected whole numbers from -1 to 2"),
        ({"seen": [[0, -2], [0, 1]]}, "seen: expected whole numbers from -1 to 2"),
        ({"seen": [[0, 0.5], [0, 1]]}, "seen: expected whole numbers from -1 to 2"),
        ({"zs": np.zeros((2, 3))}, r"zs: expected shape \(2, 4\)"),
        ({"truth": np.zeros((2, 3))}, r"truth: expected shape \(3, 3\)"),
        ({"Q": np.ones((2, 3))}, "Q: "),
        ({"alphas": np.full(6, np.nan)}, "alphas: expected finite"),
    ],
)
def test_a_wrong_part_is_named(changed, message):
    """A wrong argument is an error with its name."""
    with pytest.raises(ValueError, match=f"^{message}"):
        VelocityLog(**PARTS | changed)


def test_a_log_cannot_be_changed():
    """Neither fields nor arrays can be written to, and the caller's arrays stay the caller's."""
    mine = PARTS["us"].copy()
    log = VelocityLog(PARTS["dt"], mine, *read_only(*list(PARTS.values())[2:]))
    mine[:] = 7.0
    np.testing.assert_array_equal(log.us, PARTS["us"])
    with pytest.raises(ValueError, match="read-only"):
        log.truth[0] = 0.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        log.us = mine


@pytest.mark.parametrize(("name", "steps", "sights"), [("eight", 126, 252), ("unsure", 48, 64)])
def test_the_runs_of_the_package(name, steps, sights):
    """Twenty runs of one course; every run has its own truth."""
    logs = velocity_logs.load(name)
    assert len(logs) == 20
    assert len({log.truth[-1, 0] for log in logs}) == 20
    for log in logs:
        assert len(log.us) == steps
        assert sum(len(step.landmarks) for step in log.steps()) == sights
        assert not log.us[:, 2].any()
