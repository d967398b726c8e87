"""Draw worlds, scans, poses, trajectories and beliefs on given axes.

Every function takes the axes first, adds one artist, returns it, and does nothing else: figures, labels and
limits belong to the caller; only `plot_run` adds several. Keywords in `style` go to the artist and override
what is set here. The colours are those of Okabe and Ito, which remain distinct for colour-blind readers; a
figure should still not rely on colour alone, so give line styles or markers too.

Source of the colours: M. Okabe and K. Ito, *Color Universal Design* (2008).
"""

from math import cos, sin
from types import MappingProxyType
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Ellipse, Patch, Polygon
from numpy.typing import ArrayLike

from roboloc import se2
from roboloc.filters import Run
from roboloc.metrics import credible_ellipse
from roboloc.validation import as_array, as_floats, as_number
from roboloc.worlds import World

COLORS = MappingProxyType(
    {
        "black": "#000000",
        "orange": "#E69F00",
        "sky_blue": "#56B4E9",
        "green": "#009E73",
        "yellow": "#F0E442",
        "blue": "#0072B2",
        "vermillion": "#D55E00",
        "purple": "#CC79A7",
    }
)
"""Okabe-Ito colours by name."""

# A robot seen from above in its own frame, x ahead: nose, left corner, notch, right corner.
_ROBOT = ((1.0, 0.0), (-0.7, 0.6), (-0.35, 0.0), (-0.7, -0.6))


def plot_trajectory(ax: Axes, xs: ArrayLike, **style: Any) -> Line2D:
    """Draw the path through a sequence of poses.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
        Axes to draw on.
    xs : (N, 3) array_like
        Poses [m, m, rad]; the headings are not shown.
    **style
        Keywords of `matplotlib.lines.Line2D`.

    Returns
    -------
    matplotlib.lines.Line2D
        The path.

    Raises
    ------
    ValueError
        If `xs` has another shape or is not finite.
    """
    xs = as_array("xs", xs, ("N", 3))
    (line,) = ax.plot(xs[:, 0], xs[:, 1], **_styled(style, "color", COLORS["blue"]))
    return line


def plot_pose(ax: Axes, x: ArrayLike, size: float = 0.15, **style: Any) -> Polygon:
    """Draw a robot as an arrowhead that points where it faces.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
        Axes to draw on.
    x : (3,) array_like
        Pose [m, m, rad].
    size : float
        Distance from the position to the nose [m], positive.
    **style
        Keywords of `matplotlib.patches.Polygon`.

    Returns
    -------
    matplotlib.patches.Polygon
        The robot.

    Raises
    ------
    ValueError
        If `x` has another shape or is not finite, or if `size` is not positive.
    """
    x, y, theta = as_floats("x", x, 3)
    size = as_number("size", size)
    if size <= 0.0:
        raise ValueError(f"size: expected a positive number, got {size}")
    c, s = cos(theta), sin(theta)
    corners = [(x + size * (c * a - s * b), y + size * (s * a + c * b)) for a, b in _ROBOT]
    style = _styled(style, "facecolor", COLORS["orange"])
    robot = Polygon(corners, closed=True, **_styled(style, "edgecolor", COLORS["black"]))
    return _added(ax, robot)


def plot_covariance_ellipse(
    ax: Axes, x: ArrayLike, Sigma: ArrayLike, probability: float = 0.95, **style: Any
) -> Ellipse:
    """Draw the ellipse that holds the position with a given probability; see `metrics.credible_ellipse`.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
        Axes to draw on.
    x : (n,) array_like
        Mean; its first two entries are the position [m].
    Sigma : (n, n) array_like
        Covariance; its upper left block is that of the position [m^2].
    probability : float
        Between 0 and 1, both excluded.
    **style
        Keywords of `matplotlib.patches.Ellipse`.

    Returns
    -------
    matplotlib.patches.Ellipse
        The ellipse, not filled unless `style` says so.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, or if the probability is not between 0 and 1.
    """
    x = as_array("x", x, ("n",))
    if x.size < 2:
        raise ValueError(f"x: expected at least 2 entries, got {x.size}")
    Sigma = as_array("Sigma", Sigma, (x.size, x.size))
    half_axes, angle = credible_ellipse(Sigma[:2, :2], probability)
    style = _styled(style, "edgecolor", COLORS["vermillion"])
    style = _styled(style, "facecolor", "none")
    ellipse = Ellipse(x[:2], *(2.0 * half_axes), angle=np.degrees(angle), **style)
    return _added(ax, ellipse)


def plot_world(ax: Axes, world: World, **style: Any) -> LineCollection:
    """Draw the walls of a world.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
        Axes to draw on.
    world : World
        What to draw.
    **style
        Keywords of `matplotlib.collections.LineCollection`.

    Returns
    -------
    matplotlib.collections.LineCollection
        The walls.
    """
    style = _styled(style, "color", COLORS["black"])
    walls = LineCollection(world.segments.reshape(-1, 2, 2), **_styled(style, "linewidth", 2.0))
    ax.add_collection(walls)
    ax.autoscale_view()
    return walls


def plot_scan(
    ax: Axes,
    x: ArrayLike,
    bearings: ArrayLike,
    rho: ArrayLike,
    tf_base_to_camera: ArrayLike = (0.0, 0.0, 0.0),
    **style: Any,
) -> Line2D:
    """Draw the points that a scan sees, as they lie in the world if the robot is at `x`.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
        Axes to draw on.
    x : (3,) array_like
        Pose of the robot [m, m, rad].
    bearings : (B,) array_like
        Directions of the beams in the frame of the scanner [rad].
    rho : (B,) array_like
        Ranges [m]; what is NaN is not drawn.
    tf_base_to_camera : (3,) array_like
        Pose of the scanner in the frame of the robot [m, m, rad].
    **style
        Keywords of `matplotlib.lines.Line2D`.

    Returns
    -------
    matplotlib.lines.Line2D
        The points.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, NaN in `rho` excepted.
    """
    bearings = as_array("bearings", bearings, ("B",))
    seen = ~np.isnan(rho)
    rho = as_array("rho", np.where(seen, rho, 0.0), bearings.shape)[seen]
    x_cam, y_cam, theta_cam = se2.compose(x, as_array("tf_base_to_camera", tf_base_to_camera, (3,)))
    phi = theta_cam + bearings[seen]
    style = {"marker": ".", "linestyle": "none", **_styled(style, "color", COLORS["green"])}
    (points,) = ax.plot(x_cam + rho * np.cos(phi), y_cam + rho * np.sin(phi), **style)
    return points


def plot_run(
    ax: Axes,
    run: Run,
    truth: ArrayLike | None = None,
    open_loop: Run | None = None,
    ellipses: int = 12,
    probability: float = 0.95,
) -> dict[str, list[Line2D] | list[Ellipse]]:
    """Draw what a filter believed beside the truth and beside what the controls alone say.

    Paths differ in line style and colour and are labelled for a legend; each belief has ellipses at instants
    that are evenly spaced, the last one at the end.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
        Axes to draw on.
    run : Run
        Beliefs of the filter.
    truth : (T, 3) array_like, optional
        True poses [m, m, rad].
    open_loop : Run, optional
        Beliefs of a filter that only predicts.
    ellipses : int
        Number of ellipses of each belief; 0 for none.
    probability : float
        Probability that an ellipse holds the position.

    Returns
    -------
    dict
        The artists: ``"truth"``, ``"open loop"`` and ``"EKF"`` as far as they are drawn, a list of one path
        each; ``"open loop ellipses"`` and ``"EKF ellipses"``, lists of ellipses.

    Raises
    ------
    ValueError
        If `truth` has another shape, or if the probability is not between 0 and 1.
    """
    drawn: dict[str, list] = {}
    if truth is not None:
        style = {"color": COLORS["sky_blue"], "linewidth": 4.0, "label": "truth"}
        drawn["truth"] = [plot_trajectory(ax, truth, **style)]
    for name, beliefs, color, linestyle in (
        ("open loop", open_loop, COLORS["vermillion"], "--"),
        ("EKF", run, COLORS["blue"], "-"),
    ):
        if beliefs is None:
            continue
        style = {"color": color, "linestyle": linestyle, "linewidth": 1.2, "label": name}
        drawn[name] = [plot_trajectory(ax, beliefs.xs, **style)]
        instants = np.linspace(0, len(beliefs.xs) - 1, ellipses + 1).round().astype(int)[1:]
        drawn[f"{name} ellipses"] = [
            plot_covariance_ellipse(
                ax, beliefs.xs[k], beliefs.Sigmas[k], probability, edgecolor=color, linestyle=linestyle
            )
            for k in instants
        ]
    return drawn


# Other spellings by which matplotlib lets a caller set the same thing.
_SPELLINGS = {
    "color": ("color", "c", "colors", "edgecolor"),
    "linewidth": ("linewidth", "linewidths", "lw"),
    "facecolor": ("facecolor", "fc", "color"),
    "edgecolor": ("edgecolor", "ec", "color"),
}


def _styled(style: dict[str, Any], key: str, value: Any) -> dict[str, Any]:
    """Return `style` with a default added, unless the caller set it under any spelling."""
    return style if any(spelling in style for spelling in _SPELLINGS[key]) else {**style, key: value}


def _added(ax: Axes, patch: Patch) -> Patch:
    ax.add_patch(patch)
    ax.autoscale_view()
    return patch
