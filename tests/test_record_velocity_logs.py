from dataclasses import fields

import numpy as np
import pytest
from scipy.stats import chi2

import record_velocity_logs as tool
from roboloc import velocity_logs
from roboloc.angles import wrap
from roboloc_reference import velocity


@pytest.mark.parametrize("name", velocity_logs.NAMES)
def test_recording_again_gives_the_shipped_runs(name):
    """Every number is that of the file, to 1e-8."""
    again, shipped = tool.record(name), velocity_logs.load(name)
    assert len(again) == len(shipped)
    for one, other in zip(again, shipped, strict=True):
        for field in fields(one):
            mine, theirs = (getattr(log, field.name) for log in (one, other))
            np.testing.assert_allclose(mine, theirs, rtol=0, atol=1e-8)


def test_the_script_writes_both_sets(tmp_path, monkeypatch, capsys):
    """Into the folder that it is given, and it says so; the same runs give the same bytes."""
    monkeypatch.setattr(tool, "RUNS", 1)
    tool.main([str(tmp_path / "data")])
    said = capsys.readouterr().out
    for name in velocity_logs.NAMES:
        assert len(velocity_logs.read(tmp_path / "data" / f"{name}.npz")) == 1
        assert f"{name}.npz: " in said
    tool.main([str(tmp_path / "again")])
    assert (tmp_path / "again" / "eight.npz").read_bytes() == (tmp_path / "data" / "eight.npz").read_bytes()


@pytest.mark.parametrize("name", velocity_logs.NAMES)
def test_without_noise_the_robot_does_as_told_and_sees_what_there_is(name):
    """Every pose is the motion of the one before, every observation leads to its landmark."""
    log = tool.SETS[name](None)
    np.testing.assert_array_equal(log.truth[0], log.x0)
    for before, step in zip(log.truth, log.steps(), strict=False):
        np.testing.assert_allclose(velocity.motion(before, step.u, log.dt), step.truth, atol=1e-8)
        beta, r = step.z[::2] + step.truth[2], step.z[1::2]
        places = step.truth[:2] + (r * [np.cos(beta), np.sin(beta)]).T
        np.testing.assert_allclose(places, step.landmarks, atol=1e-7)


@pytest.mark.parametrize("name", velocity_logs.NAMES)
def test_the_shipped_runs_are_as_noisy_as_they_say(name):
    """Squared errors of starts and sightings, in units of their covariance, are chi-square, each sum with 1e-3."""
    starts, looks = [], []
    for log in velocity_logs.load(name):
        starts.append((log.truth[0] - log.x0) / np.sqrt(np.diag(log.Sigma0)))
        for step in log.steps():
            h = velocity.range_bearings(step.truth[None], step.landmarks).reshape(-1, 2)
            error = step.z.reshape(-1, 2) - h
            error[:, 0] = wrap(error[:, 0])
            looks.append(error / np.sqrt(np.diag(log.Q)))
    for errors in (np.array(starts), np.concatenate(looks)):
        assert chi2.ppf(5e-4, errors.size) < np.sum(errors**2) < chi2.ppf(1 - 5e-4, errors.size)
