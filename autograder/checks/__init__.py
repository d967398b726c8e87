"""Hidden checks, one module per notebook, and the table of all graded stages.

``python tools/kill_matrix.py`` prints which wrong and which correct versions the checks tell apart.
"""

from autograder.checks import (
    association_and_update,
    correction,
    line_measurements,
    motion_model,
    single_wall,
    upside_down,
    wheel_speeds,
)

STAGES = {
    stage.name: stage
    for stage in (
        *motion_model.STAGES,
        *line_measurements.STAGES,
        *association_and_update.STAGES,
        *correction.STAGES,
    )
}
EXPRESSIONS = {
    expression.name: expression
    for expression in wheel_speeds.EXPRESSIONS + upside_down.EXPRESSIONS + single_wall.EXPRESSIONS
}

__all__ = ["EXPRESSIONS", "STAGES"]
