import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.path import Path
from oracles import read_only

from roboloc import plotting


@pytest.fixture
def ax():
    """Axes of a figure that belongs to no window."""
    return Figure().subplots()


def test_trajectory_goes_through_the_positions(ax):
    """The line has the positions as its points and is on the axes."""
    (xs,) = read_only([[0, 0, 9], [1, 2, 9], [3, 1, 9]])
    line = plotting.plot_trajectory(ax, xs, linestyle="--", label="truth")
    np.testing.assert_array_equal(line.get_xydata(), xs[:, :2])
    assert line in ax.lines
    assert (line.get_linestyle(), line.get_label()) == ("--", "truth")


def test_pose_points_where_the_robot_faces(ax):
    """The nose is `size` ahead, and the robot is symmetric about its heading."""
    (x,) = read_only([1.0, 2.0, 0.7])
    robot = plotting.plot_pose(ax, x, size=0.5)
    ahead, left = np.array([np.cos(0.7), np.sin(0.7)]), np.array([-np.sin(0.7), np.cos(0.7)])
    corners = robot.get_xy() - x[:2]
    np.testing.assert_allclose(corners[0], 0.5 * ahead)
    assert (corners @ left).sum() == pytest.approx(0, abs=1e-12)
    assert (corners @ ahead).max() == pytest.approx(0.5)
    assert robot in ax.patches


@pytest.mark.parametrize("probability", [0.5, 0.95])
def test_ellipse_holds_the_probability(ax, probability):
    """Every point of the outline has the Mahalanobis distance that a fraction of samples stays within."""
    rng = np.random.default_rng(5)
    A = rng.normal(size=(3, 3))
    x, Sigma = read_only([1.0, -2.0, 0.3], A @ A.T)
    ellipse = plotting.plot_covariance_ellipse(ax, x, Sigma, probability=probability)
    path = ellipse.get_path()
    points = ellipse.get_patch_transform().transform(path.vertices[path.codes != Path.CLOSEPOLY])
    on_curve = points[::3] - x[:2]  # the ends of the Bezier arcs lie on the ellipse
    P = np.linalg.inv(Sigma[:2, :2])
    d2 = np.einsum("ni,ij,nj->n", on_curve, P, on_curve)
    np.testing.assert_allclose(d2, d2[0], rtol=1e-9)
    samples = rng.multivariate_normal(np.zeros(2), Sigma[:2, :2], size=20_000)
    inside = np.mean(np.einsum("ni,ij,nj->n", samples, P, samples) < d2[0])
    assert inside == pytest.approx(probability, abs=0.015)
    assert ellipse in ax.patches


def test_certain_position_is_a_point(ax):
    """A covariance of zero, or one that rounding made slightly negative, draws without complaint."""
    for variance in (0.0, -1e-18):
        ellipse = plotting.plot_covariance_ellipse(ax, np.zeros(3), variance * np.eye(3))
        assert ellipse.get_width() == ellipse.get_height() == 0.0


def test_style_overrides_the_default(ax):
    """A colour given under any of matplotlib's spellings wins over ours."""
    assert plotting.plot_trajectory(ax, np.zeros((2, 3)), c="k").get_color() == "k"
    robot = plotting.plot_pose(ax, np.zeros(3), fc=plotting.COLORS["green"])
    assert to_hex(robot.get_facecolor()).upper() == plotting.COLORS["green"]
    ellipse = plotting.plot_covariance_ellipse(ax, np.zeros(2), np.eye(2), color=plotting.COLORS["blue"])
    assert to_hex(ellipse.get_edgecolor()).upper() == plotting.COLORS["blue"]


def test_the_view_takes_in_what_is_drawn(ax):
    """A patch far away is not left outside the axes."""
    plotting.plot_pose(ax, [100.0, 50.0, 0.0])
    assert ax.get_xlim()[0] < 100 < ax.get_xlim()[1]
    plotting.plot_covariance_ellipse(ax, [-100.0, 0.0, 0.0], np.eye(3))
    assert ax.get_xlim()[0] < -100


def test_wrong_arguments_are_named(ax):
    """ValueError says which argument is wrong."""
    for call, name in (
        (lambda: plotting.plot_trajectory(ax, np.zeros((2, 2))), "xs"),
        (lambda: plotting.plot_pose(ax, np.zeros(2)), "x"),
        (lambda: plotting.plot_pose(ax, np.zeros(3), size=0), "size"),
        (lambda: plotting.plot_covariance_ellipse(ax, np.zeros(1), np.eye(1)), "x"),
        (lambda: plotting.plot_covariance_ellipse(ax, np.zeros(3), np.eye(2)), "Sigma"),
        (lambda: plotting.plot_covariance_ellipse(ax, np.zeros(3), np.eye(3), probability=1), "probability"),
    ):
        with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
            call()
    assert not ax.lines
    assert not ax.patches
