"""The filter shells bound to the reference stages.

The same names as in :mod:`roboloc.filters`; a keyword `stages` still replaces what supplies the functions.
"""

from types import MappingProxyType
from typing import Any

from numpy.typing import ArrayLike

from roboloc import filters
from roboloc_reference.gaussian import measurement_update, transition_update
from roboloc_reference.motion import compute_dynamics

STAGES = MappingProxyType(
    {
        "compute_dynamics": compute_dynamics,
        "transition_update": transition_update,
        "measurement_update": measurement_update,
    }
)
"""The reference stages by name."""


class Ekf(filters.Ekf):
    """Extended Kalman filter with the reference stages; see :class:`roboloc.filters.Ekf`.

    Examples
    --------
    Half a second at 1 m/s, straight ahead, is half a metre.

    >>> import numpy as np
    >>> ekf = Ekf([0.0, 0.0, 0.0], np.zeros((3, 3)), np.diag([0.01, 0.01]))
    >>> ekf.transition_update([1.0, 0.0], 0.5)
    >>> ekf.x.tolist()
    [0.5, 0.0, 0.0]
    """

    def __init__(self, x0: ArrayLike, Sigma0: ArrayLike, R: ArrayLike, stages: Any = STAGES) -> None:
        super().__init__(x0, Sigma0, R, stages=stages)
