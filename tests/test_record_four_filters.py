"""The recorded estimates of four filters: they come out again, and what is read is what was recorded."""

from dataclasses import fields

import numpy as np
import pytest

import record_four_filters as tool
from roboloc import velocity_logs
from roboloc.four_filters import FILTERS, SETS, load
from roboloc.metrics import nees, pose_error


@pytest.fixture(scope="module")
def again():
    """Record the first run of each set again."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(tool, "RUNS", 1)
        return {name: tool.record(name) for name in SETS}


@pytest.mark.parametrize("name", SETS)
def test_recording_again_gives_the_shipped_estimates(name, again):
    """The first run of every filter is that of the file, to the digits of the file."""
    for i, (key, found) in enumerate(load(name).items()):
        arrays = {part: again[name][f"{name}_{part}"] for part in ("times", "poses", "covs", "nees")}
        assert found.name == key == FILTERS[i]
        np.testing.assert_array_equal(found.times, arrays["times"])
        np.testing.assert_allclose(found.poses[0], arrays["poses"][i, 0], rtol=1e-5, atol=1e-5)
        np.testing.assert_allclose(found.nees[0], arrays["nees"][i, 0], rtol=1e-3, atol=1e-4)
        upper = found.covs[0][..., *np.triu_indices(3)]
        np.testing.assert_allclose(upper, arrays["covs"][i, 0], rtol=1e-4, atol=1e-6)


def test_the_command_writes_the_file(tmp_path, monkeypatch, capsys):
    """Into the folder that it is given, every array, and the same bytes for the same arrays."""
    monkeypatch.setattr(tool, "record", lambda name: {f"{name}_times": np.arange(3.0)})
    for folder in ("one", "other"):
        tool.main([str(tmp_path / folder)])
    assert "four-filters.npz: " in capsys.readouterr().out
    one, other = ((tmp_path / folder / tool.FILE).read_bytes() for folder in ("one", "other"))
    assert one == other
    with np.load(tmp_path / "one" / tool.FILE) as arrays:
        assert sorted(arrays) == ["eight_times", "unsure_times"]


@pytest.mark.parametrize("name", SETS)
def test_estimates_fit_their_truth_and_cannot_be_written_to(name):
    """The truth is the recorded one; where coordinates are x, y, theta the squared errors are those of the claims."""
    logs = velocity_logs.load(name)
    for key, found in load(name).items():
        runs, instants = found.nees.shape
        assert (runs, found.covs.shape) == (len(logs), (runs, instants, 3, 3))
        assert repr(found) == f"<Estimates of {key}: {runs} runs, {instants} instants>"
        last = round(found.times[-1] / logs[0].dt)
        np.testing.assert_array_equal(found.truth[3, -1], logs[3].truth[last])
        assert np.linalg.eigvalsh(found.covs).min() > 0
        if key != "InEKF":
            errors = pose_error(found.poses.reshape(-1, 3), found.truth.reshape(-1, 3))
            squares = nees(errors, found.covs.reshape(-1, 3, 3)).reshape(runs, instants)
            np.testing.assert_allclose(np.median(squares), np.median(found.nees), rtol=1e-2)
        arrays = [getattr(found, field.name) for field in fields(found) if field.name != "name"]
        assert not any(array.flags.writeable for array in arrays)


def test_an_unknown_set_is_refused():
    """The message names the sets that there are."""
    with pytest.raises(ValueError, match="name: expected one of eight, unsure, got 'nine'"):
        load("nine")
