"""Hidden checks, one module per notebook, and the table of all graded stages.

``python tools/kill_matrix.py`` prints which wrong and which correct versions the checks tell apart.
"""

from autograder.checks import motion_model, wheel_speeds

STAGES = {stage.name: stage for stage in motion_model.STAGES}
EXPRESSIONS = {expression.name: expression for expression in wheel_speeds.EXPRESSIONS}

__all__ = ["EXPRESSIONS", "STAGES"]
