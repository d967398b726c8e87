"""The robot's world: what a student of the course may import.

Frames and angles, simulated motion, plotting, the filter shells into which a student's own stages are
plugged, and public checks. The answers to the graded stages are not here: they are in another package,
which neither the student's installation nor the grading sandbox contains.

Importing :mod:`roboloc` or any of its modules other than :mod:`roboloc.plotting` loads neither matplotlib
nor ipywidgets.
"""
