import numpy as np
import pytest

from roboloc import logs


def test_the_beginning_of_a_run_is_the_run_until_then():
    """Controls and scans before the cut are kept as they are, those after it are gone, the truth stays."""
    log = logs.load("maze")
    begun = log.until(7.5)
    n, k = len(begun.controls), len(begun.scans)
    np.testing.assert_array_equal(begun.controls, log.controls[:n])
    assert begun.control_times[-1] < 7.5 <= log.control_times[n]
    assert begun.scan_times[-1] < 7.5 <= log.scan_times[k]
    assert len(begun.z_raw) == len(begun.Q_raw) == k
    np.testing.assert_array_equal(begun.truth, log.truth)
    assert begun.world == log.world


def test_a_cut_before_the_start_is_refused():
    """A run without a control is none."""
    with pytest.raises(ValueError, match="control_times"):
        logs.load("maze").until(-1.0)


def test_a_changed_run_is_another_and_the_old_one_stays():
    """One array is replaced, the others are equal, and the run it came from is untouched."""
    log = logs.load("maze")
    was = log.controls.copy()
    other = log.changed(controls=2 * log.controls)
    np.testing.assert_array_equal(other.controls, 2 * was)
    np.testing.assert_array_equal(log.controls, was)
    np.testing.assert_array_equal(other.scans, log.scans)
    with pytest.raises(ValueError, match="controls: expected shape"):
        log.changed(controls=np.zeros((3, 2)))
