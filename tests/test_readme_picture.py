"""The README's picture is what its script draws, and what the README says of it is true."""

from pathlib import Path

import numpy as np
from matplotlib.image import imread

import readme_picture
from roboloc.simulation import figure_eight, simulate_motion

ROOT = Path(__file__).resolve().parents[1]


def test_the_picture_is_what_the_script_draws(tmp_path):
    """The committed picture is the drawn one up to what another processor's rounding may do to its edges."""
    readme_picture.draw(tmp_path / "drawn.png")
    drawn, committed = imread(tmp_path / "drawn.png"), imread(ROOT / "assets" / "figure-eight.png")
    assert drawn.shape == committed.shape
    assert np.abs(drawn - committed).mean() < 1e-3


def test_the_robots_are_where_the_filter_believes_them_to_be():
    """At each of the nine instants about 95 % of other drives are within the ellipse drawn there."""
    us = figure_eight(radius=1.0, speed=0.5, dt=readme_picture.DT)
    rng = np.random.default_rng(5)
    start, R = readme_picture.START, readme_picture.R
    runs = np.array([simulate_motion(start, us, readme_picture.DT, R, rng) for _ in range(250)])
    believed = readme_picture.beliefs(us)
    inside = []
    for k in range(28, len(us) + 1, 28):
        x, Sigma = believed[k]
        e = runs[:, k, :2] - x[:2]
        d2 = np.einsum("ni,ij,nj->n", e, np.linalg.inv(Sigma[:2, :2]), e)
        inside.append((d2 < -2 * np.log(0.05)).mean())
    assert len(inside) == 9
    assert np.all(np.abs(np.array(inside) - 0.95) < 0.05), inside
