"""The maze and the arena end to end: lines found in scans, matched, corrected.

Errors of lines that were fitted to points and chosen by a gate are not exactly Gaussian, so the NEES is held in
wide limits here; tests/roboloc_reference/test_consistency_line_ekf.py asks for more, of drawn observations.
"""

import numpy as np
import pytest

from roboloc import logs, worlds
from roboloc.filters import run
from roboloc.metrics import nees, pose_error
from roboloc_reference.ekf import EkfLocalization


@pytest.fixture(scope="module", params=["maze", "arena"])
def runs(request):
    """Return a log, the run of the filter and the open loop."""
    log = logs.load(request.param)
    map_lines = getattr(worlds, request.param)().map_lines
    found = []
    for correct in (True, False):
        ekf = EkfLocalization(log.x0, log.Sigma0, log.R, map_lines, log.tf_base_to_camera, 3.0)
        found.append(run(ekf, log, correct=correct))
    return log, *found


def errors(log, found):
    """Return the pose errors at the scans."""
    return pose_error(found.xs[found.scans], log.truth_at(log.scan_times))


def test_the_filter_stays_with_the_robot_and_the_open_loop_does_not(runs):
    """The filter ends within 2 cm and is never lost; adding up the controls is ten times as wrong in the mean."""
    log, corrected, open_loop = runs
    off, off_open = (np.hypot(*errors(log, found)[:, :2].T) for found in (corrected, open_loop))
    assert off[-1] < 0.02
    assert off.max() < 0.35
    assert off_open.mean() > 10 * off.mean()


def test_nearly_all_lines_are_matched(runs):
    """The gate of 3 standard deviations lets 98.9 percent of right pairs pass; at least 96 percent do."""
    _, corrected, _ = runs
    assert corrected.associated.sum() > 0.96 * corrected.observed.sum()


def test_the_filter_is_about_as_wrong_as_it_says(runs):
    """The NEES, 3 in the mean if all were Gaussian and independent, is between 2 and 4.5 over a run."""
    log, corrected, _ = runs
    mean = nees(errors(log, corrected), corrected.Sigmas[corrected.scans]).mean()
    assert 2 < mean < 4.5
    assert 0.85 < corrected.nis.sum() / (2 * corrected.associated.sum()) < 1.15


def test_along_a_single_wall_the_position_is_uncertain_along_it():
    """In the hall of the maze the deviation along the wall grows; the next wall across it ends that."""
    log = logs.load("maze")
    ekf = EkfLocalization(log.x0, log.Sigma0, log.R, worlds.maze().map_lines, log.tf_base_to_camera, 3.0)
    found = run(ekf, log)
    alone = next(k for k, z in enumerate(log.z_raw) if z.shape[1] > 1)
    along, across = np.sqrt(np.diagonal(found.Sigmas[found.scans], axis1=1, axis2=2)[:, :2]).T
    assert (np.diff(along[:alone]) > 0).all()
    assert along[alone - 1] > 1.5 * np.sqrt(log.Sigma0[0, 0])
    assert across[10:alone].max() < 0.01
    assert along[alone + 20] < 0.01
