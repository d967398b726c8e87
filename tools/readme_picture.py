"""Draw the README's picture, assets/figure-eight.png: a belief that grows, and whether it is honest.

The filter predicts along a figure-eight and measures nothing; at nine instants its 95 % ellipse stands beside
the places of 200 simulated robots that had the same commands and the same noise.

Usage: python tools/readme_picture.py [FILE]
"""

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from roboloc import plotting
from roboloc.simulation import figure_eight, simulate_motion
from roboloc_reference.ekf import Ekf

ROOT = Path(__file__).resolve().parents[1]
START = np.array([0.0, 0.0, np.pi / 2])
DT = 0.1
R = np.diag([0.012, 0.015])
RUNS = 200


def beliefs(us: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return the mean and the covariance of the filter before and after each control, starting certain."""
    ekf = Ekf(START, np.zeros((3, 3)), R)
    found = [(ekf.x, ekf.Sigma)]
    for u in us:
        ekf.transition_update(u, DT)
        found.append((ekf.x, ekf.Sigma))
    return found


def draw(target: Path) -> None:
    """Draw the picture and write it to `target`; the file holds no time and no version."""
    us = figure_eight(radius=1.0, speed=0.5, dt=DT)
    rng = np.random.default_rng(4)
    runs = np.array([simulate_motion(START, us, DT, R, rng) for _ in range(RUNS)])
    believed = beliefs(us)

    figure = Figure(figsize=(9, 5), layout="constrained")
    ax = figure.subplots()
    commanded = plotting.plot_trajectory(ax, simulate_motion(START, us, DT), color="0.65", lw=1)
    driven = plotting.plot_trajectory(ax, runs[0], color=plotting.COLORS["black"], lw=1.3, ls="--")
    for k in range(28, len(us) + 1, 28):
        (points,) = ax.plot(*runs[:, k, :2].T, ".", ms=3, color=plotting.COLORS["blue"], alpha=0.5)
        ellipse = plotting.plot_covariance_ellipse(ax, *believed[k], lw=1.6, zorder=3)
    plotting.plot_pose(ax, START, size=0.12, zorder=4)
    ax.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
    ax.spines[["top", "right"]].set_visible(False)
    labels = ["commanded", "one drive", f"{RUNS} drives at nine instants", "belief, 95 %"]
    figure.legend(
        [commanded, driven, points, ellipse], labels, loc="outside upper center", ncols=4, frameon=False
    )
    figure.savefig(target, dpi=110, metadata={"Software": None})


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "assets" / "figure-eight.png")
