"""Filter shells: they hold a belief and call the stages, which somebody else supplies.

A shell unpacks its state, calls a stage, checks that the stage gave something usable, and stores it. It
contains no mathematics, so a filter built from a student's stages works only if the stages do: one that is
missing is an error that names it, never replaced by another.

:class:`Ekf` predicts with controls and corrects with any innovation; :class:`EkfLocalization` corrects with
the lines of a scan and a map, :class:`EkfSlam` makes the map as well. :class:`ParticleFilter` and
:class:`MonteCarloLocalization` do with a cloud of poses what the first two do with mean and covariance.
:func:`run` takes a filter through a recorded run.

Source of constructors and method names: Stanford AA274A (2021), problem set 4.
"""

from roboloc.filters.ekf import Ekf
from roboloc.filters.localization import EkfLocalization
from roboloc.filters.monte_carlo import MonteCarloLocalization
from roboloc.filters.particle import ParticleFilter
from roboloc.filters.recorded import Run, run
from roboloc.filters.shell import MissingStageError
from roboloc.filters.slam import EkfSlam

__all__ = [
    "Ekf",
    "EkfLocalization",
    "EkfSlam",
    "MissingStageError",
    "MonteCarloLocalization",
    "ParticleFilter",
    "Run",
    "run",
]
