"""What a notebook about the maze needs is there inside the sandbox: recorded runs, worlds, a lidar, plots."""

from roboloc import logs

RUN = """
import numpy as np
from roboloc import filters, lidar, logs, metrics, plotting, worlds
log = logs.load("maze")
ekf = filters.Ekf(log.x0, log.Sigma0, log.R, stages={
    "compute_dynamics": lambda x, u, dt: (x, np.eye(3), np.zeros((3, 2))),
    "transition_update": lambda g, Gx, Gu, Sigma, R, dt: (g, Sigma),
})
run = filters.run(ekf, log, correct=False)
rho = lidar.Lidar().scan(worlds.maze(), log.truth[0], np.random.default_rng(0))
print(len(run.xs), np.isfinite(rho).any(), round(metrics.chi2_band(3, 0.95)[1], 2))
"""
PLOT = """
import matplotlib.pyplot as plt
fig, ax = plt.subplots()
plotting.plot_world(ax, worlds.maze())
plotting.plot_run(ax, run, log.truth);
"""


def shown(result):
    """Return what a cell printed."""
    return "".join(o["text"] for o in result.outputs if o["output_type"] == "stream")


def test_a_notebook_in_the_sandbox_can_run_the_maze(open_session):
    """It reads the recorded run that comes with the package, takes a filter through it, and draws it."""
    session = open_session()
    result = session.cell(RUN)
    assert shown(result) == f"{1 + sum(1 for _ in logs.load('maze').events())} True 9.35\n", result.outputs
    drawn = session.cell(PLOT)
    assert any("image/png" in o.get("data", {}) for o in drawn.outputs), drawn.outputs
