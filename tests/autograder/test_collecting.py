"""Links in what students hand in: stock nbgrader follows them with the instructor's rights, ours does not."""

from __future__ import annotations

import os
import pwd
import shutil

import pytest
from temporary_course import ASSIGNMENT, GRADED, HIDDEN, NOTEBOOK, Course, printed

from autograder import collecting, repair

COURSE = "robots"
SETTINGS = """\
c = get_config()
c.CourseDirectory.course_id = {course!r}
c.Exchange.root = {root!r}
c.ExchangeCollect.check_owner = False
c.CourseDirectory.max_dir_size = 1000
"""
LARGE = 1_000_000  # of which the setting above is the thousandth part
OWN = "own.txt"
POINTS = {"square-test": GRADED["square-test"], "cube-test": GRADED["cube-test"]}
LOOK = f"import os\nprint(sorted(n for n in os.listdir('.') if n[0] != '.'), open('{OWN}').read())"


@pytest.fixture(scope="module")
def term(tmp_path_factory):
    """Make a course with an exchange; a thief hands in links, an honest student a folder."""
    root = tmp_path_factory.mktemp("links")
    course = Course.create(root / "course")
    inbound = root / "exchange" / COURSE / "inbound"
    inbound.mkdir(parents=True)
    for path in (root / "exchange", inbound):
        os.chmod(path, 0o777)  # noqa: S103, PTH101  (nbgrader wants it; the folders are the test's own)
    config = course.root / "nbgrader_config.py"
    settings = SETTINGS.format(course=COURSE, root=str(root / "exchange"))
    config.write_text(settings + config.read_text(encoding="utf-8"), encoding="utf-8")
    source = course.root / "source" / ASSIGNMENT
    course.submit("honest")
    handed = {
        name: inbound / f"{name}+{ASSIGNMENT}+2030-01-01 00:00:00 UTC+x"
        for name in ("honest", "large", "thief", "whole")
    }
    shutil.copytree(course.root / "submitted" / "honest" / ASSIGNMENT, handed["honest"])
    shutil.rmtree(course.root / "submitted")
    handed["thief"].mkdir()
    (handed["thief"] / f"{NOTEBOOK}.ipynb").symlink_to(source / f"{NOTEBOOK}.ipynb")
    (handed["thief"] / "data.db").symlink_to(course.root / "gradebook.db")
    (handed["thief"] / "folder").symlink_to(source)
    (handed["thief"] / OWN).write_text("own", encoding="utf-8")
    handed["whole"].symlink_to(source)
    (handed["large"] / "deep").mkdir(parents=True)
    (handed["large"] / "deep" / "data").write_bytes(bytes(LARGE + 1))
    for folder in handed.values():
        if not folder.is_symlink():
            year = 2020 if folder == handed["thief"] else 2030
            (folder / "timestamp.txt").write_text(f"{year}-01-01 00:00:00 UTC", encoding="utf-8")
    return course


def has_hidden(folder):
    """Whether a hidden test, or the gradebook, is below a folder."""
    texts = [path.read_bytes() for path in folder.rglob("*") if path.is_file()]
    return any(text.startswith(b"SQLite") or any(w.encode() in text for w in HIDDEN) for text in texts)


def test_stock_collect_follows_links(term, tmp_path):
    """What the thief links to is in the thief's submission after stock `nbgrader collect`."""
    course = term.copy(tmp_path / "course")
    config = course.root / "nbgrader_config.py"
    kept = [line for line in config.read_text(encoding="utf-8").splitlines() if "configure" not in line]
    config.write_text("\n".join(kept).replace("max_dir_size = 1000", "max_dir_size = 2000"), encoding="utf-8")
    course.nbgrader("collect", ASSIGNMENT)
    for name in ("thief", "whole"):
        assert has_hidden(course.root / "submitted" / name)


def test_collected_is_what_is_the_students_own(term, tmp_path):
    """No link comes through: its place is a notebook that was not handed in, and the honest student has all points."""
    course = term.copy(tmp_path / "course")
    said = course.nbgrader("collect", ASSIGNMENT).stderr
    assert "UTC+x is not collected: it is larger than" in said
    for name in (f"{NOTEBOOK}.ipynb", "data.db", "folder"):
        assert f"{name} is a link" in said
    (forged,) = [line for line in said.splitlines() if "says it is of" in line]
    assert "thief+" in forged
    assert "says it is of 2020-01-01 00:00:00 UTC, and was written at 20" in forged
    submitted = course.root / "submitted"
    assert not (submitted / "large" / ASSIGNMENT).exists()
    assert (submitted / "thief" / ASSIGNMENT / OWN).read_text(encoding="utf-8") == "own"
    assert not [path for path in submitted.rglob("*") if path.is_symlink()]
    assert not any(has_hidden(submitted / name) for name in ("honest", "thief", "whole"))
    course.nbgrader("autograde", ASSIGNMENT)
    rows = course.rows()
    for name, points in (
        ("honest", POINTS),
        ("thief", dict.fromkeys(POINTS, 0)),
        ("whole", dict.fromkeys(POINTS, 0)),
    ):
        assert {key: score for key, (score, _) in rows[name].items() if key in POINTS} == points


def test_links_that_another_way_brought_are_not_followed(term, tmp_path):
    """In the folder of submissions too a link is no notebook, and no file beside one."""
    course = term.copy(tmp_path / "course")
    source = course.root / "source" / ASSIGNMENT
    course.submit("beside", square=LOOK)
    folder = course.root / "submitted"
    (folder / "beside" / ASSIGNMENT / OWN).write_text("own", encoding="utf-8")
    (folder / "beside" / ASSIGNMENT / "data.ipynb.txt").symlink_to(source / f"{NOTEBOOK}.ipynb")
    (folder / "notebook" / ASSIGNMENT).mkdir(parents=True)
    (folder / "notebook" / ASSIGNMENT / f"{NOTEBOOK}.ipynb").symlink_to(source / f"{NOTEBOOK}.ipynb")
    (folder / "whole").mkdir()
    (folder / "whole" / ASSIGNMENT).symlink_to(source)
    course.grade()
    assert printed(course.graded("beside")) == f"['{OWN}', '{NOTEBOOK}.ipynb'] own\n"
    rows = course.rows()
    for name in ("notebook", "whole"):
        assert {score for score, _ in rows[name].values() if score is not None} == {0.0}
        assert "links are not followed" in str(course.graded(name))


def test_what_stock_stops_at_stops_nobody_else(term, tmp_path):
    """A folder under no name of a submission, and a time that is none, cost nobody else anything."""
    course = term.copy(tmp_path / "course")
    inbound = tmp_path / "exchange" / COURSE / "inbound"
    shutil.copytree(term.root.parent / "exchange" / COURSE / "inbound", inbound, symlinks=True)
    config = course.root / "nbgrader_config.py"
    moved = config.read_text(encoding="utf-8").replace(str(term.root.parent), str(tmp_path))
    config.write_text(moved, encoding="utf-8")
    honest = next(inbound.glob("honest+*"))
    for name in (f"odd+{ASSIGNMENT}+no time+x", f"short+{ASSIGNMENT}+"):
        shutil.copytree(honest, inbound / name)
    timeless = shutil.copytree(honest, inbound / honest.name.replace("honest", "timeless"))
    (timeless / "timestamp.txt").write_text("no time", encoding="utf-8")
    said = course.nbgrader("collect", ASSIGNMENT).stderr
    assert said.count("is not collected: no student and time in its name") == 2
    assert "got 'no time'" in said
    assert {path.name for path in (course.root / "submitted").iterdir()} >= {"honest", "thief", "timeless"}
    assert not (course.folder("timeless") / "timestamp.txt").exists()
    assert course.nbgrader("collect", ASSIGNMENT, "--update").returncode == 0


def test_what_somebody_else_put_there_is_not_collected(term, tmp_path):
    """Nobody hands in for another student: a later folder of somebody else's does not take the place of their own."""
    course = term.copy(tmp_path / "course")
    said = course.nbgrader("collect", ASSIGNMENT, "--ExchangeCollect.check_owner=True").stderr
    me = pwd.getpwuid(os.getuid()).pw_name
    assert said.count(f"is not collected: {me} put it there") == 4
    assert not (course.root / "submitted").exists()


def test_neither_pipes_nor_too_much_is_copied(tmp_path):
    """A pipe does not hold up the copy, and it ends where the bytes do."""
    source = tmp_path / "source"
    (source / "deep" / "er").mkdir(parents=True)
    os.mkfifo(source / "deep" / "pipe")
    (source / "deep" / "er" / "file").write_bytes(b"x" * 1000)
    assert collecting.copy_files(source, tmp_path / "target", 1000) == ["deep/pipe"]
    assert (tmp_path / "target" / "deep" / "er" / "file").read_bytes() == b"x" * 1000
    with pytest.raises(ValueError, match="larger than"):
        collecting.copy_files(source, tmp_path / "other", 999)


def test_an_exchange_of_the_courses_own_stays():
    """Where the course has its own way to collect, it keeps it."""
    from traitlets.config import Config  # noqa: PLC0415

    from autograder.plugin import configure  # noqa: PLC0415

    mine, other = Config(), Config()
    other.ExchangeFactory.collect = "some.plugin"
    for config in (mine, other):
        configure(config)
    assert mine.ExchangeFactory.collect is collecting.Collect
    assert other.ExchangeFactory.collect == "some.plugin"


def test_a_link_is_no_notebook(tmp_path):
    """Reading a submission does not follow a link, whether it is the file or its folder."""
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "n.ipynb").write_text('{"cells": []}', encoding="utf-8")
    (tmp_path / "b").symlink_to("a")
    (tmp_path / "a" / "link.ipynb").symlink_to("n.ipynb")
    assert repair.read_submission(tmp_path / "a" / "n.ipynb")[1] == ""
    for path in (tmp_path / "b" / "n.ipynb", tmp_path / "a" / "link.ipynb"):
        assert repair.read_submission(path) == (None, "the file is a link, and links are not followed")
