"""When a submission was handed in, and a penalty for handing in late, by the day.

nbgrader knows when a submission was handed in and when it was due, and asks a plug-in what that costs; its own answers
are nothing or everything. This one takes a share of the earned points for each day that has begun. In
`nbgrader_config.py`::

    c.AssignLatePenalties.plugin_class = "autograder.late.PenaltyPerDay"
    c.PenaltyPerDay.per_day = 0.2
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

from nbgrader.coursedir import CourseDirectory
from nbgrader.plugins import LateSubmissionPlugin
from traitlets import Float

if TYPE_CHECKING:
    from datetime import datetime

DAY = 24 * 3600.0
STAMP = "timestamp.txt"


def submitted_at(coursedir: CourseDirectory, folder: str) -> datetime | None:
    """Return when a submission was handed in, by the file in its folder, which a student may have written.

    Parameters
    ----------
    coursedir : nbgrader.coursedir.CourseDirectory
        Whose log says what is wrong with the file.
    folder : str
        The submission.

    Returns
    -------
    datetime.datetime or None
        In UTC and without a zone. None where there is no file, or none with a time.
    """
    try:
        return CourseDirectory.get_existing_timestamp(coursedir, folder)
    except Exception:  # noqa: BLE001  (nbgrader's own way to fail among them: it calls what is not there)
        path = Path(folder, STAMP)
        coursedir.log.warning(
            "%s: expected a time such as 2026-12-05 00:30:00 UTC, got %s: it counts as handed in when the gradebook "
            "says, and where that knows no time, as not late", path, _beginning(path),
        )  # fmt: skip
        return None


def _beginning(path: Path) -> str:
    """Return how a file begins, for a message."""
    try:
        with path.open("rb") as file:
            return repr(file.read(40).decode(errors="replace"))
    except OSError as error:
        return str(error.strerror)


def lost_share(
    seconds_late: float, per_day: float = 0.1, grace_hours: float = 0.0, most: float = 1.0
) -> float:
    """Return the share of the earned points that lateness costs.

    Parameters
    ----------
    seconds_late : float
        Time after the due date [s].
    per_day : float, optional
        Share for each day that has begun.
    grace_hours : float, optional
        This late costs nothing; the first day begins after it [h].
    most : float, optional
        It never costs more than this share.

    Returns
    -------
    float
        0 to `most`.

    Examples
    --------
    A tenth a day: an hour late costs a tenth, twenty-five hours two tenths.

    >>> lost_share(3600.0), lost_share(25 * 3600.0)
    (0.1, 0.2)
    """
    days = math.ceil(max(seconds_late - 3600.0 * grace_hours, 0.0) / DAY)
    return min(days * per_day, most)


class PenaltyPerDay(LateSubmissionPlugin):
    """nbgrader's hook for late submissions, as :func:`lost_share`."""

    per_day = Float(0.1, help="Share of the earned points that each day that has begun costs.").tag(
        config=True
    )
    grace_hours = Float(0.0, help="Hours after the due date that cost nothing.").tag(config=True)
    most = Float(1.0, help="The largest share that lateness costs.").tag(config=True)

    def late_submission_penalty(self, student_id: str, score: float, total_seconds_late: float) -> float:  # noqa: ARG002
        """Return the points that a notebook loses."""
        return score * lost_share(total_seconds_late, self.per_day, self.grace_hours, self.most)
