"""The filter shells bound to the reference stages.

The same names as in :mod:`roboloc.filters`; a keyword `stages` still replaces what supplies the functions.
"""

from types import MappingProxyType
from typing import Any

from numpy.typing import ArrayLike

from roboloc import filters
from roboloc_reference.association import compute_innovations, measurement_model
from roboloc_reference.gaussian import measurement_update, transition_update
from roboloc_reference.lines import compute_predicted_measurements
from roboloc_reference.motion import compute_dynamics

STAGES = MappingProxyType(
    {
        "compute_dynamics": compute_dynamics,
        "transition_update": transition_update,
        "compute_predicted_measurements": compute_predicted_measurements,
        "compute_innovations": compute_innovations,
        "measurement_model": measurement_model,
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


class EkfLocalization(filters.EkfLocalization):
    """EKF localization with the reference stages; see :class:`roboloc.filters.EkfLocalization`.

    Examples
    --------
    A robot that believes itself 2 m from a wall and sees it 1.9 m ahead, both give or take 10 cm, moves half way.

    >>> import numpy as np
    >>> Sigma0, Q = np.diag([0.01, 0.0, 0.0]), np.diag([0.01, 0.01])
    >>> ekf = EkfLocalization([0.0, 0.0, 0.0], Sigma0, np.eye(2), [[0.0], [2.0]], [0.0, 0.0, 0.0], 3.0)
    >>> ekf.measurement_update([[0.0], [1.9]], [Q])
    >>> ekf.x.round(12).tolist()
    [0.05, 0.0, 0.0]
    """

    def __init__(
        self,
        x0: ArrayLike,
        Sigma0: ArrayLike,
        R: ArrayLike,
        map_lines: ArrayLike,
        tf_base_to_camera: ArrayLike,
        g: float,
        stages: Any = STAGES,
    ) -> None:
        super().__init__(x0, Sigma0, R, map_lines, tf_base_to_camera, g, stages=stages)
