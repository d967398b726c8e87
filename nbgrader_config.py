"""The course's configuration: the ordinary `nbgrader` commands read it from the repository's root."""

from autograder.plugin import configure

c = get_config()  # noqa: F821  (traitlets puts it there)

c.CourseDirectory.course_id = "robot-localization"
c.CourseDirectory.source_directory = "build/source"
c.CourseDirectory.release_directory = "notebooks"
# One cell of this course takes well under a second; a notebook a few.
c.IsolatedExecute.call_cpu = 3.0
c.IsolatedExecute.cell_cpu = 10.0
c.IsolatedExecute.notebook_cpu = 60.0

configure(c)
