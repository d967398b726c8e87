"""What handing in late costs."""

import pytest
from temporary_course import ASSIGNMENT, Course

from autograder.late import DAY, PenaltyPerDay, lost_share

NO_TIMES = {
    "words": b"not a time",
    "bytes": b"\xff\xfe\x00",
    "digits": b"9" * 5000,
    "late-year": b"99999-01-01 00:00:00 UTC",
    "early-year": b"0001-01-01 00:00:00 +1400",
}


@pytest.mark.parametrize(
    ("seconds", "share"),
    [(-5.0, 0.0), (0.0, 0.0), (1.0, 0.1), (DAY, 0.1), (DAY + 1.0, 0.2), (9.5 * DAY, 1.0), (1000 * DAY, 1.0)],
)
def test_each_day_that_has_begun_costs_a_tenth(seconds, share):
    """On time costs nothing, each begun day a tenth, and never more than everything."""
    assert lost_share(seconds) == pytest.approx(share, abs=1e-12)


def test_grace_and_limit():
    """Within the hours of grace lateness is free, the first day begins after them, and a limit is a limit."""
    assert lost_share(2 * 3600.0, grace_hours=2.0) == 0.0
    assert lost_share(2 * 3600.0 + 1.0, grace_hours=2.0) == 0.1
    assert lost_share(100 * DAY, per_day=0.2, most=0.5) == 0.5


def test_plugin_takes_its_share_of_the_earned_points():
    """The plug-in's penalty is in points: a quarter a day of eight points is two."""
    assert PenaltyPerDay(per_day=0.25).late_submission_penalty("somebody", 8.0, 60.0) == 2.0


def test_what_is_no_time_is_no_lateness(tmp_path):
    """A file of the time with anything else in it costs no row, no points and nobody's feedback, and is warned of."""
    course = Course.create(tmp_path / "course")
    for name, content in {"right": b"2030-01-01 00:00:00 UTC", **NO_TIMES}.items():
        course.submit(name)
        (course.folder(name) / "timestamp.txt").write_bytes(content)
    course.submit("folder")
    (course.folder("folder") / "timestamp.txt").mkdir()
    (course.folder("folder") / "timestamp.txt" / "x").write_text("x", encoding="utf-8")
    said = course.nbgrader("autograde", ASSIGNMENT).stderr
    rows = course.rows()
    assert rows == dict.fromkeys([*NO_TIMES, "folder", "right"], rows["right"])
    for name in (*NO_TIMES, "folder"):
        assert f"{course.folder(name) / 'timestamp.txt'}: expected a time such as" in said
    assert "not late" in said
    course.nbgrader("generate_feedback", ASSIGNMENT)
    assert len(list(course.root.glob("feedback/*/powers/powers.html"))) == len(rows)
