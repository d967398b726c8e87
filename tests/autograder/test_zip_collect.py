"""`nbgrader zip_collect` of what Canvas lets an instructor download, graded to the end."""

from __future__ import annotations

import csv
import zipfile

import pytest
from temporary_course import ASSIGNMENT, GRADED, NOTEBOOK, SQUARE, Course

COLLECTOR = 'c = get_config()\nc.ZipCollectApp.collector_plugin = "autograder.canvas.CanvasCollector"\n'
WRONG = "def square(x):\n    return 2 * x"
UPLOADS = {
    f"doejane_LATE_111_67890_{NOTEBOOK}.ipynb": SQUARE,
    f"doejane_222_67899_{NOTEBOOK}-1.ipynb": WRONG,
    f"roejohn_333_70010_{NOTEBOOK} (1).ipynb": SQUARE,
    f"roejohn_333_70009_{NOTEBOOK}.ipynb": WRONG,
}


def nested(folder, name, text):
    """Return the bytes of a zip file with one file."""
    path = folder / "inside.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(name, text)
    return path.read_bytes()


@pytest.fixture(scope="module")
def collected(tmp_path_factory):
    """Collect a download: two students of one name, one late, one with two uploads, one who plays another."""
    course = Course.create(tmp_path_factory.mktemp("canvas") / "course")
    config = course.root / "nbgrader_config.py"
    config.write_text(COLLECTOR + config.read_text(encoding="utf-8"), encoding="utf-8")
    texts = {}
    for square in (SQUARE, WRONG):
        course.submit("nobody", square=square)
        texts[square] = (course.folder("nobody") / f"{NOTEBOOK}.ipynb").read_text(encoding="utf-8")
        for path in sorted(course.folder("nobody").parent.rglob("*"), reverse=True):
            path.rmdir() if path.is_dir() else path.unlink()
    course.folder("nobody").parent.rmdir()
    folder = course.root / "downloaded" / ASSIGNMENT / "archive"
    folder.mkdir(parents=True)
    forged = f"doejane_111_99999_{NOTEBOOK}.ipynb"
    with zipfile.ZipFile(folder / "submissions.zip", "w") as archive:
        for name, square in UPLOADS.items():
            archive.writestr(name, texts[square])
        archive.writestr("mallory_444_70011_work.zip", nested(course.root, forged, texts[WRONG]))
        archive.writestr("poejim_555_70012_essay.pdf", "%PDF")
    log = course.nbgrader("zip_collect", ASSIGNMENT).stderr
    course.nbgrader("autograde", ASSIGNMENT, "--create")
    return course, log


def test_every_student_has_their_own_file(collected):
    """Each upload is graded for the student whose number it has, and the last upload of a student counts."""
    course, _ = collected
    scores = {student: row["square-test"][0] for student, row in course.rows().items()}
    assert scores == {"111": 2.0, "222": 0.0, "333": 2.0, "444": 0.0}


def test_forged_name_harms_nobody(collected):
    """A file named as a class-mate's is a file of no released name to the student who uploaded it: no points, a row."""
    course, _ = collected
    assert course.rows()["444"] == dict.fromkeys(GRADED, (0.0, False))
    assert course.rows()["111"]["cube-test"] == (3.0, False)


def test_what_was_left_out_is_said(collected):
    """The log names the upload that does not count and the file that is no notebook."""
    _, log = collected
    assert "a later upload of powers by 333 counts" in log
    assert "poejim_555_70012_essay.pdf" in log


def test_numbers_stand_in_the_export(collected):
    """The exported grades go by Canvas's numbers, one row for each student."""
    course, _ = collected
    course.nbgrader("export")
    with (course.root / "grades.csv").open(newline="", encoding="utf-8") as file:
        rows = {row["student_id"]: float(row["raw_score"]) for row in csv.DictReader(file)}
    assert rows == {"111": 5.0, "222": 3.0, "333": 5.0, "444": 0.0}


def test_second_download_replaces_the_first(collected, tmp_path):
    """With `--force` a later download is collected over the first, and without it nothing is touched."""
    course = collected[0].copy(tmp_path / "course")
    folder = course.root / "downloaded" / ASSIGNMENT / "archive"
    (folder / "submissions.zip").unlink()
    good = (course.folder("333") / f"{NOTEBOOK}.ipynb").read_bytes()
    bad = (course.folder("222") / f"{NOTEBOOK}.ipynb").read_bytes()
    (folder / f"doejane_222_80000_{NOTEBOOK}-2.ipynb").write_bytes(good)
    assert course.nbgrader("zip_collect", ASSIGNMENT, check=False).returncode != 0
    assert (course.folder("222") / f"{NOTEBOOK}.ipynb").read_bytes() == bad
    course.nbgrader("zip_collect", ASSIGNMENT, "--force")
    assert (course.folder("222") / f"{NOTEBOOK}.ipynb").read_bytes() == good
