"""Wrong versions of `transform_line_to_scanner_frame`: faults of the sources (ERRATA A5), and what people write."""

from __future__ import annotations

import numpy as np

from autograder.misconceptions.model import Misconception
from roboloc_reference.lines import transform_line_to_scanner_frame

_STAGE = "lines.transform_line_to_scanner_frame"


def offset_ignored(line: np.ndarray, x: np.ndarray, tf_base_to_camera: np.ndarray) -> tuple:
    """Put the scanner at the robot's centre, and keep its heading."""
    return transform_line_to_scanner_frame(line, x, np.array([0.0, 0.0, tf_base_to_camera[2]]))


def offset_not_rotated(line: np.ndarray, x: np.ndarray, tf_base_to_camera: np.ndarray) -> tuple:
    """Add the scanner's place to the robot's as if both were in the world."""
    x_cam, y_cam, theta_cam = tf_base_to_camera
    there = np.array([x[0] + x_cam, x[1] + y_cam, x[2]])
    return transform_line_to_scanner_frame(line, there, np.array([0.0, 0.0, theta_cam]))


def x_cam_in_the_row_of_y(line: np.ndarray, x: np.ndarray, tf_base_to_camera: np.ndarray) -> tuple:
    """Write x_cam where y_cam belongs, in the scanner's y (ERRATA A5)."""
    h, Hx = transform_line_to_scanner_frame(line, x, tf_base_to_camera)
    wrong = (tf_base_to_camera[0] - tf_base_to_camera[1]) * np.sin(line[0])
    h[1] -= wrong * np.cos(x[2])
    Hx[1, 2] += wrong * np.sin(x[2])
    return h, Hx


def offset_subtracted(line: np.ndarray, x: np.ndarray, tf_base_to_camera: np.ndarray) -> tuple:
    """Put the scanner on the other side of the robot."""
    x_cam, y_cam, theta_cam = tf_base_to_camera
    return transform_line_to_scanner_frame(line, x, np.array([-x_cam, -y_cam, theta_cam]))


def mounting_heading_forgotten(line: np.ndarray, x: np.ndarray, tf_base_to_camera: np.ndarray) -> tuple:
    """Let the scanner look where the robot looks."""
    h, Hx = transform_line_to_scanner_frame(line, x, tf_base_to_camera)
    h[0] += tf_base_to_camera[2]
    return h, Hx


def mounting_heading_added(line: np.ndarray, x: np.ndarray, tf_base_to_camera: np.ndarray) -> tuple:
    """Turn the scanner the wrong way."""
    h, Hx = transform_line_to_scanner_frame(line, x, tf_base_to_camera)
    h[0] += 2 * tf_base_to_camera[2]
    return h, Hx


def world_heading_kept(line: np.ndarray, x: np.ndarray, tf_base_to_camera: np.ndarray) -> tuple:
    """Keep the angle that the line has in the world, but for the mounting."""
    h, Hx = transform_line_to_scanner_frame(line, x, tf_base_to_camera)
    h[0] += x[2]
    Hx[0, 2] = 0.0
    return h, Hx


def heading_added(line: np.ndarray, x: np.ndarray, tf_base_to_camera: np.ndarray) -> tuple:
    """Turn the line with the robot instead of against it."""
    h, Hx = transform_line_to_scanner_frame(line, x, tf_base_to_camera)
    h[0] += 2 * x[2]
    Hx[0, 2] = 1.0
    return h, Hx


def lever_forgotten(line: np.ndarray, x: np.ndarray, tf_base_to_camera: np.ndarray) -> tuple:
    """Differentiate the distance as if the scanner were at the robot's centre."""
    h, Hx = transform_line_to_scanner_frame(line, x, tf_base_to_camera)
    Hx[1, 2] = 0.0
    return h, Hx


def lever_sign(line: np.ndarray, x: np.ndarray, tf_base_to_camera: np.ndarray) -> tuple:
    """Differentiate alpha - theta by theta as if it were theta - alpha."""
    h, Hx = transform_line_to_scanner_frame(line, x, tf_base_to_camera)
    Hx[1, 2] = -Hx[1, 2]
    return h, Hx


def slope_sign(line: np.ndarray, x: np.ndarray, tf_base_to_camera: np.ndarray) -> tuple:
    """Differentiate the distance with the opposite sign."""
    h, Hx = transform_line_to_scanner_frame(line, x, tf_base_to_camera)
    Hx[1] = -Hx[1]
    return h, Hx


def distance_sign(line: np.ndarray, x: np.ndarray, tf_base_to_camera: np.ndarray) -> tuple:
    """Subtract the line's distance from the robot's, and not the other way round."""
    h, Hx = transform_line_to_scanner_frame(line, x, tf_base_to_camera)
    h[1] = -h[1]
    Hx[1] = -Hx[1]
    return h, Hx


def range_first(line: np.ndarray, x: np.ndarray, tf_base_to_camera: np.ndarray) -> tuple:
    """Return r, alpha instead of alpha, r."""
    h, Hx = transform_line_to_scanner_frame(line, x, tf_base_to_camera)
    return h[::-1], Hx[::-1]


def angles_in_degrees(line: np.ndarray, x: np.ndarray, tf_base_to_camera: np.ndarray) -> tuple:
    """Convert angles from degrees before taking a sine or cosine, and nothing else."""
    narrow = np.deg2rad([line[0], x[2], tf_base_to_camera[2]])
    there, mounted = np.array([x[0], x[1], narrow[1]]), np.array([*tf_base_to_camera[:2], narrow[2]])
    h, Hx = transform_line_to_scanner_frame(np.array([narrow[0], line[1]]), there, mounted)
    h[0] = line[0] - x[2] - tf_base_to_camera[2]
    return h, Hx


def normalized_early(line: np.ndarray, x: np.ndarray, tf_base_to_camera: np.ndarray) -> tuple:
    """Change the side of the line already here."""
    h, Hx = transform_line_to_scanner_frame(line, x, tf_base_to_camera)
    if h[1] < 0:
        h = np.array([h[0] + np.pi, -h[1]])
        Hx[1] = -Hx[1]
    return h, Hx


def line_overwritten(line: np.ndarray, x: np.ndarray, tf_base_to_camera: np.ndarray) -> tuple:
    """Write the result over the line of the map."""
    h, Hx = transform_line_to_scanner_frame(line, x, tf_base_to_camera)
    line[...] = h
    return line, Hx


_WHERE = (
    "Draw a robot that faces along y and a scanner 1 m in front of it: where is the scanner in the world?"
)
_ANGLE = "A robot turns to the left. Which way does a wall move in what it sees, and by how much?"
_NUDGE = "Turn or move the robot a little, call your function again, and compare the change of h with Hx."
_SIDE = "Take one point of the wall and test it: is x cos(alpha) + y sin(alpha) equal to r, before and after?"
_ARRAYS = "An array that is handed over is not copied; which operation makes a new one?"
MISCONCEPTIONS = (
    Misconception(
        "derivative by the heading without the lever arm",
        _STAGE,
        "The distance is taken to be independent of the heading. That holds for a scanner at the robot's "
        "centre; one that sits elsewhere is carried around when the robot turns on the spot.",
        _NUDGE,
        lever_forgotten,
    ),
    Misconception(
        "scanner taken to be at the robot's centre",
        _STAGE,
        "The place of the scanner on the robot is left out. A wall is then predicted as the robot's centre "
        "would see it, and every distance is off by up to the size of the mounting.",
        _WHERE,
        offset_ignored,
    ),
    Misconception(
        "mounting not turned with the robot",
        _STAGE,
        "The scanner's place is added to the robot's position as it stands. It is given in the frame of the "
        "robot, which has turned in the world; at heading 0 the two cannot be told apart, and a first test "
        "often has heading 0.",
        _WHERE,
        offset_not_rotated,
    ),
    Misconception(
        "x_cam in the row of y",
        _STAGE,
        "In the scanner's y coordinate x_cam stands where y_cam belongs. A worked solution that is passed "
        "around has this slip; with a scanner on the robot's axis it is easily missed.",
        "Let x_cam be 0: which of the two coordinates of the scanner may still depend on y_cam?",
        x_cam_in_the_row_of_y,
    ),
    Misconception(
        "mounting on the other side",
        _STAGE,
        "The scanner's place enters with the opposite sign: a scanner at the front is taken for one at the "
        "back.",
        _WHERE,
        offset_subtracted,
    ),
    Misconception(
        "heading of the mounting forgotten",
        _STAGE,
        "The scanner is taken to look where the robot looks. Two turns lie between the world and the "
        "scanner, and the second one, theta_cam, is missing from the angle.",
        "Which two headings lie between the x axis of the world and that of the scanner?",
        mounting_heading_forgotten,
    ),
    Misconception(
        "scanner turned the wrong way",
        _STAGE,
        "theta_cam enters the angle with the wrong sign. The mounting turns the scanner in the same sense in "
        "which the heading turns the robot.",
        _ANGLE,
        mounting_heading_added,
    ),
    Misconception(
        "heading of the robot not taken off",
        _STAGE,
        "The angle of the line is still that of the world: the robot's heading does not occur in it. A robot "
        "that turned on the spot would see the same wall in the same direction.",
        _ANGLE,
        world_heading_kept,
    ),
    Misconception(
        "heading added",
        _STAGE,
        "The heading enters the angle with the wrong sign: the walls turn with the robot instead of against "
        "it.",
        _ANGLE,
        heading_added,
    ),
    Misconception(
        "sign of the lever arm",
        _STAGE,
        "The derivative of the distance by the heading has the wrong sign, as if the scanner were carried "
        "around the other way.",
        _NUDGE,
        lever_sign,
    ),
    Misconception(
        "sign of the derivative of the distance",
        _STAGE,
        "Row 2 of Hx has the wrong sign: driving towards a wall would take it farther away. A filter with it "
        "moves away from the truth with every observation.",
        _NUDGE,
        slope_sign,
    ),
    Misconception(
        "sign of the distance",
        _STAGE,
        "r is the robot's distance less that of the line instead of the line's less the robot's. It is right "
        "in size, and the wall appears on the wrong side.",
        _SIDE,
        distance_sign,
    ),
    Misconception(
        "range before angle",
        _STAGE,
        "h and the rows of Hx are in the order r, alpha. A line of this course is a column [alpha, r].",
        "Read in the docstring in which order a line is given.",
        range_first,
    ),
    Misconception(
        "angles taken for degrees",
        _STAGE,
        "Angles are converted from degrees to radians before their sine is taken, but they are in radians "
        "already, like every angle of this course.",
        "What unit does the docstring give for alpha, and what unit does np.cos expect?",
        angles_in_degrees,
    ),
    Misconception(
        "normalised too early",
        _STAGE,
        "Where r is negative the line is turned to its other side here already. The line is the same, but "
        "this stage is to return the formula as it was differentiated; changing the side is the next stage.",
        "Read in the docstring what is said of the sign of r.",
        normalized_early,
    ),
    Misconception(
        "the caller's line overwritten",
        _STAGE,
        "The function writes the line as the scanner sees it into the line of the map. The map is wrong when "
        "the function returns, and every later prediction with it.",
        _ARRAYS,
        line_overwritten,
    ),
)
