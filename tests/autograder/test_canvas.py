"""Whose a file of Canvas's download is."""

from pathlib import PurePath

import pytest

from autograder.canvas import newest, parse


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("doejane_12345_67890_motion-model.ipynb", ("12345", 67890, "motion-model")),
        ("doejane_LATE_12345_67890_motion-model.ipynb", ("12345", 67890, "motion-model")),
        ("doejane_12345_67890_motion-model-2.ipynb", ("12345", 67890, "motion-model")),
        ("doejane_12345_67890_motion-model (1).ipynb", ("12345", 67890, "motion-model")),
        ("doejane_12345_67890_motion-model (1)-3.ipynb", ("12345", 67890, "motion-model")),
        ("o'neil-smithmaría_1_2_line_measurements.ipynb", ("1", 2, "line_measurements")),
        ("doejane_12345_67890_motion-model.pdf", None),
        ("motion-model.ipynb", None),
        ("._doejane_12345_67890_motion-model.ipynb", None),
        ("anon_a1B2c_67890_motion-model.ipynb", None),
    ],
)
def test_names_of_canvas(name, expected):
    """Student, upload and notebook are read from a name; what is no notebook of somebody's is left out."""
    assert parse(PurePath("submissions", name)) == expected


def test_name_inside_an_uploaded_archive_counts_for_nothing():
    """In an archive that a student uploaded, a file named as another student's is the uploader's."""
    inside = PurePath("submissions", "roejohn_222_3_work", "doejane_111_4_motion-model.ipynb")
    assert parse(inside).student == "222"
    assert parse(PurePath("roejohn_222_3_work", "motion-model.ipynb")) == ("222", 3, "motion-model")


def test_last_upload_counts():
    """Of two uploads of a notebook the one with the larger number counts, not the one that sorts last."""
    first, second = PurePath("doe_1_9_a.ipynb"), PurePath("doe_1_10_a (1).ipynb")
    other = PurePath("doe_1_3_b.ipynb")
    assert newest([first, second, other, PurePath("notes.txt")]) == {second, other}
