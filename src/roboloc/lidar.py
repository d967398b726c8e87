r"""A planar lidar: rays from a scanner to the nearest wall.

With the scanner at the origin, a wall from a to b lies on the line n . p = r, where n = (b_y - a_y, a_x - b_x)
and r = n . a. A ray in the direction d meets that line at the distance rho, and it meets the wall itself if d
points between a and b:

.. math:: \frac{1}{\rho} = \frac{n \cdot d}{r}, \quad \frac{a \times d}{r} \ge 0, \quad \frac{d \times b}{r} \ge 0.

The division by r makes no difference between a wall whose b is to the left of a and one the other way round.
All three are linear in d: two numbers for each wall, and one product of matrices for all walls and rays. The
conditions multiplied by a large number, the least of the three is 1 / rho where the wall is met and not
positive elsewhere, and the largest over the walls belongs to the nearest. Walls out of reach are left out
before. A wall seen exactly edge-on has no width and is not seen.

Noise: the beam leaves at its nominal bearing plus an error, its range is read with an error, and now and then
nothing comes back. What is not seen is NaN.

Source: the model of the instrument is the usual one, S. Thrun, W. Burgard, D. Fox, *Probabilistic Robotics*,
section 6.3, without its short readings; the ray caster is our own.
"""

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import ArrayLike

from roboloc import se2
from roboloc.angles import TURN
from roboloc.validation import as_array, as_floats, as_number
from roboloc.worlds import World

# By this share of its length a wall is longer at either end than it is, so that no ray slips through a corner.
_LONGER = 1e-9

# What makes the two conditions larger than 1 / rho wherever they are above rounding.
_STEEP = 1e12


def cast_rays(segments: ArrayLike, pose: ArrayLike, bearings: ArrayLike, max_range: float) -> np.ndarray:
    """Return the distances from a scanner to the nearest wall along its rays.

    Parameters
    ----------
    segments : (S, 4) array_like
        Ends x1, y1, x2, y2 of the walls [m].
    pose : (3,) array_like
        Pose of the scanner [m, m, rad].
    bearings : (B,) array_like
        Directions of the rays in the frame of the scanner [rad].
    max_range : float
        How far the scanner sees [m], positive.

    Returns
    -------
    (B,) ndarray
        Distances [m]; NaN where there is no wall within `max_range`.

    Raises
    ------
    ValueError
        If an argument has another shape or is not finite, or if `max_range` is not positive.

    Notes
    -----
    All rays are one array operation. Source: our own; see the top of the module.

    Examples
    --------
    A wall 3 m ahead is 2 m ahead after driving 1 m; to the left there is none.

    >>> wall = [[3.0, -1.0, 3.0, 1.0]]
    >>> cast_rays(wall, [0.0, 0.0, 0.0], [0.0, np.pi / 2], 5.0).tolist()
    [3.0, nan]
    >>> cast_rays(wall, [1.0, 0.0, 0.0], [0.0, np.pi / 2], 5.0).tolist()
    [2.0, nan]
    """
    segments = as_array("segments", segments, ("S", 4))
    x, y, theta = as_floats("pose", pose, 3)
    bearings = as_array("bearings", bearings, ("B",))
    max_range = as_number("max_range", max_range)
    if max_range <= 0.0:
        raise ValueError(f"max_range: expected a positive number, got {max_range}")

    forms = _linear_forms(segments.tolist(), x, y, max_range)
    if not forms:
        return np.full(bearings.size, np.nan)
    phi = theta + bearings
    d = np.empty((2, bearings.size))
    np.cos(phi, out=d[0])
    np.sin(phi, out=d[1])
    values = np.array(forms).reshape(-1, 2) @ d
    inverse_rho, after_a, before_b = values.reshape(3, -1, bearings.size)
    np.minimum(inverse_rho, after_a, out=inverse_rho)
    np.minimum(inverse_rho, before_b, out=inverse_rho)
    nearest = np.maximum.reduce(inverse_rho, axis=0, initial=0.0)
    nearest[nearest < 1.0 / max_range] = np.nan
    return np.divide(1.0, nearest, out=nearest)


def _linear_forms(walls: list[list[float]], x: float, y: float, max_range: float) -> list[float]:
    """Return n / r of each wall in reach, as seen from (x, y), then the one condition of each, then the other.

    There are few walls and many rays: here a loop over floats is faster than arrays.
    """
    west, east, south, north = x - max_range, x + max_range, y - max_range, y + max_range
    inverse_rho, after_a, before_b = [], [], []
    for x1, y1, x2, y2 in walls:
        if (x1 < west and x2 < west) or (x1 > east and x2 > east):
            continue
        if (y1 < south and y2 < south) or (y1 > north and y2 > north):
            continue
        ax, ay, bx, by = x1 - x, y1 - y, x2 - x, y2 - y
        ex, ey = x2 - x1, y2 - y1
        r = ax * ey - ay * ex
        if r == 0.0:  # edge-on
            continue
        k = _STEEP / r
        inverse_rho += ey / r, -ex / r
        after_a += k * (_LONGER * ey - ay), k * (ax - _LONGER * ex)
        before_b += k * (_LONGER * ey + by), k * (-_LONGER * ex - bx)
    return inverse_rho + after_a + before_b


@dataclass(frozen=True, eq=False)
class Lidar:
    """A scanner on a robot: what it sees and how well.

    The defaults are those of the course's robot: 160 beams over 240 degrees, 3.5 m far, with errors of 1 cm
    and 0.1 degrees, one beam in a hundred lost; it sits ahead of the middle of the robot, a little to the
    left, and is turned a little to the left.

    Parameters
    ----------
    beams : int
        Number B of beams, at least 1.
    field_of_view : float
        Angle from the first beam to the last [rad], from right to left about the scanner's ahead; above 0, at
        most a whole turn. In a whole turn the last beam would be the first again and is left out.
    max_range : float
        How far the scanner sees [m], positive.
    sigma_range : float
        Standard deviation of a range [m], not negative.
    sigma_bearing : float
        Standard deviation of the direction of a beam [rad], not negative.
    dropout : float
        Probability that a beam does not come back, in [0, 1].
    tf_base_to_camera : (3,) array_like
        Pose of the scanner in the frame of the robot [m, m, rad].

    Raises
    ------
    ValueError
        If an argument is outside these limits.

    Examples
    --------
    A robot 1 m from a wall whose scanner sits 0.1 m ahead of its middle measures 0.9 m straight ahead.

    >>> from roboloc.worlds import World, lines_of
    >>> wall = [[1.0, -9.0, 1.0, 9.0]]
    >>> world = World("one wall", wall, lines_of(wall), [0.0, 0.0, 0.0])
    >>> lidar = Lidar(beams=3, tf_base_to_camera=[0.1, 0.0, 0.0])
    >>> lidar.scan(world, [0.0, 0.0, 0.0]).round(12).tolist()
    [nan, 0.9, nan]
    """

    beams: int = 160
    field_of_view: float = 4.0 * pi / 3.0
    max_range: float = 3.5
    sigma_range: float = 0.01
    sigma_bearing: float = pi / 1800.0
    dropout: float = 0.01
    tf_base_to_camera: np.ndarray = (0.1, 0.02, 0.05)

    def __post_init__(self) -> None:
        if not isinstance(self.beams, int | np.integer) or self.beams < 1:
            raise ValueError(f"beams: expected a whole number above 0, got {self.beams}")
        for name in ("sigma_range", "sigma_bearing", "dropout", "field_of_view", "max_range"):
            object.__setattr__(self, name, as_number(name, getattr(self, name), minimum=0.0))
        for name in ("field_of_view", "max_range"):
            if getattr(self, name) == 0.0:
                raise ValueError(f"{name}: expected a positive number, got 0.0")
        for name, limit in (("field_of_view", TURN), ("dropout", 1.0)):
            if getattr(self, name) > limit:
                raise ValueError(f"{name}: expected at most {limit}, got {getattr(self, name)}")
        tf = as_array("tf_base_to_camera", self.tf_base_to_camera, (3,)).copy()
        tf.flags.writeable = False
        object.__setattr__(self, "tf_base_to_camera", tf)

    @property
    def bearings(self) -> np.ndarray:
        """Directions of the beams in the frame of the scanner, (B,), increasing [rad]."""
        if self.beams == 1:
            return np.zeros(1)
        half = self.field_of_view / 2.0
        return np.linspace(-half, half, self.beams, endpoint=self.field_of_view < TURN)

    def scan(self, world: World, x: ArrayLike, rng: np.random.Generator | None = None) -> np.ndarray:
        """Return what the scanner reads at a pose of the robot.

        Parameters
        ----------
        world : World
            What there is to see.
        x : (3,) array_like
            Pose of the robot, not of the scanner [m, m, rad].
        rng : numpy.random.Generator, optional
            Source of the noise and of the lost beams; without it there are none. 3 B draws are taken.

        Returns
        -------
        rho : (B,) ndarray
            Ranges along `bearings` [m], in (0, `max_range`]; NaN where nothing is seen.

        Raises
        ------
        ValueError
            If `x` is not three finite numbers, or if `rng` is neither None nor a generator.
        """
        if rng is not None and not isinstance(rng, np.random.Generator):
            raise ValueError(f"rng: expected a numpy.random.Generator, got {type(rng).__name__}")
        bearings = self.bearings
        pose = se2.compose(x, self.tf_base_to_camera)
        if rng is None:
            return cast_rays(world.segments, pose, bearings, self.max_range)
        bearings = bearings + self.sigma_bearing * rng.standard_normal(self.beams)
        rho = cast_rays(world.segments, pose, bearings, self.max_range)
        rho += self.sigma_range * rng.standard_normal(self.beams)
        lost = rng.random(self.beams) < self.dropout
        rho[lost | (rho <= 0.0) | (rho > self.max_range)] = np.nan
        return rho
