import numpy as np
import pytest

import record_logs as tool
from roboloc import logs


@pytest.mark.parametrize("name", ["maze", "arena"])
def test_recording_again_gives_the_shipped_run(name):
    """Every number is that of the file, to 1e-12, and the same beams saw nothing."""
    again, shipped = tool.record(tool.RECORDINGS[name]), logs.load(name)
    assert again.world == shipped.world
    for field in logs._ARRAYS:
        np.testing.assert_allclose(getattr(again, field), getattr(shipped, field), rtol=1e-12, atol=1e-12)
    for field in ("z_raw", "Q_raw"):
        pairs = zip(getattr(again, field), getattr(shipped, field), strict=True)
        for found, expected in pairs:
            np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)


def test_the_script_writes_the_runs(tmp_path, monkeypatch, capsys):
    """Into the folder that it is given, one file for each recording, and it says so."""
    recording = tool.RECORDINGS["arena"]
    short = tool.Recording(recording.world, recording.route[:2], recording.lidar, recording.seed)
    monkeypatch.setattr(tool, "RECORDINGS", {"arena": short})
    tool.main([str(tmp_path / "data")])
    log = logs.read(tmp_path / "data" / "arena.npz")
    assert f"arena.npz: {log.scan_times[-1]:.1f} s" in capsys.readouterr().out
    np.testing.assert_allclose(log.truth[-1, :2], recording.route[1], atol=0.3)


def test_the_driver_follows_the_route():
    """The true path stays within 30 cm of it, and the headings scatter as R says (within 5 standard deviations)."""
    log, driver = logs.load("maze"), tool.Driver(tool.RECORDINGS["maze"].route)
    off = np.hypot(*(log.truth[:, None, :2] - driver.points).transpose(2, 0, 1)).min(axis=1)
    assert off.max() < 0.3
    turned, variance, scaled = 0.0, 0.0, []
    before = log.truth[0, 2]
    for event in log.events():
        if event.time > log.scan_times[-1]:
            break
        turned += event.dt * event.u[1]
        variance += event.dt**3 * log.R[1, 1]
        if event.scan is not None:
            after = log.truth[event.scan + 1, 2]
            scaled.append((after - before - turned) / np.sqrt(variance))
            before, turned, variance = after, 0.0, 0.0
    n = len(scaled)
    assert abs(np.mean(np.square(scaled)) - 1) < 5 * np.sqrt(2 / n)
