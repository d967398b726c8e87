import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.path import Path
from oracles import read_only

from roboloc import plotting
from roboloc.filters import Run
from roboloc.worlds import arena


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
        (lambda: plotting.plot_scan(ax, np.zeros(3), [[0.0]], [1.0]), "bearings"),
        (lambda: plotting.plot_scan(ax, np.zeros(3), [0.0], [1.0, 2.0]), "rho"),
        (lambda: plotting.plot_scan(ax, np.zeros(3), [0.0], [np.inf]), "rho"),
        (lambda: plotting.plot_scan(ax, np.zeros(3), [0.0], [1.0], np.zeros(2)), "tf_base_to_camera"),
        (lambda: plotting.plot_run(ax, None, np.zeros((3, 2))), "xs"),
        (lambda: plotting.plot_covariance_ellipse(ax, np.zeros(3), np.eye(2)), "Sigma"),
        (lambda: plotting.plot_covariance_ellipse(ax, np.zeros(3), np.eye(3), probability=1), "probability"),
    ):
        with pytest.raises(ValueError, match=rf"^{name}: expected .*, got "):
            call()
    assert not ax.lines
    assert not ax.patches


def test_world_shows_every_wall(ax):
    """Each wall is drawn from end to end, and all of them are in view."""
    walls = plotting.plot_world(ax, arena(), label="walls")
    np.testing.assert_array_equal(np.array(walls.get_segments()).reshape(-1, 4), arena().segments)
    assert walls in ax.collections
    assert ax.get_xlim()[0] <= arena().segments[:, ::2].min()
    assert plotting.plot_world(ax, arena(), color="0.5", lw=7).get_linewidth() == [7]


def test_scan_lies_where_it_was_seen(ax):
    """Through the offset of the scanner, and without the beams that saw nothing."""
    x, tf, bearings, rho = read_only(
        [1.0, 2.0, np.pi / 2], [0.5, 0.0, np.pi / 2], [0.0, 0.1, np.pi / 2], [1.0, np.nan, 3.0]
    )
    points = plotting.plot_scan(ax, x, bearings, rho, tf)
    np.testing.assert_allclose(points.get_xydata(), [[0, 2.5], [1, -0.5]], atol=1e-12)
    assert (points.get_marker(), points.get_linestyle()) == (".", "None")
    assert plotting.plot_scan(ax, x, bearings, rho, marker="x", c="k").get_color() == "k"


def believed(y):
    """Return a run along a line, ever less certain."""
    xs = np.array([[k, y, 0.0] for k in range(11)])
    Sigmas = np.array([0.1 * k * np.eye(3) for k in range(11)])
    none = np.zeros(0, dtype=int)
    return Run(np.arange(11.0), xs, Sigmas, none, none, none, (), ())


def test_run_shows_truth_open_loop_and_filter(ax):
    """Three paths that differ in more than colour, labelled, and ellipses up to the end of each belief."""
    truth = np.zeros((5, 3))
    drawn = plotting.plot_run(ax, believed(0.0), truth, believed(1.0), ellipses=5)
    assert [line.get_label() for line in ax.lines] == ["truth", "open loop", "EKF"]
    assert len({(line.get_linestyle(), line.get_linewidth()) for line in ax.lines}) == 3
    np.testing.assert_array_equal(drawn["truth"][0].get_xydata(), truth[:, :2])
    for name, y in (("EKF", 0.0), ("open loop", 1.0)):
        np.testing.assert_array_equal(drawn[name][0].get_xydata()[:, 1], y)
        centers = [ellipse.get_center() for ellipse in drawn[f"{name} ellipses"]]
        np.testing.assert_array_equal(centers, [[k, y] for k in (2, 4, 6, 8, 10)])
    assert len(ax.patches) == 10


def test_run_alone(ax):
    """Without truth and open loop the filter is drawn, and no ellipses if none are asked for."""
    drawn = plotting.plot_run(ax, believed(0.0), ellipses=0)
    assert set(drawn) == {"EKF", "EKF ellipses"}
    assert len(ax.lines) == 1
    assert not ax.patches
