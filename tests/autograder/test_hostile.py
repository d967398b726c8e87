"""The hostile shelf: every attack is handed in, and earns nothing, sees nothing, disturbs nobody and leaves nothing.

Each file of `hostile/` is one student's, in the form of the sample class; what it tries stands under its heading, and
what it must get in `hostile/expected.csv`: points for answers that it left right, `manual` where a person looks. The
column `stock` has what comes of it under stock nbgrader, where that is tried: points; `reached` where it prints that
it reached what it looked for; `shown` where feedback has a hidden input or runs its script; `poisoned` where who is
graded next finds what it left; `left` where its processes live on; `lost` where the command fails and the submission
has no score at all. Many others would do harm to the machine there: they are to be run in the sandbox alone.
"""

from __future__ import annotations

import contextlib
import csv
import os
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook
from nbgrader.utils import is_grade
from processes import alive, children
from temporary_course import ASSIGNMENT, NOTEBOOK, Course, cell, environment, hidden, printed, solution

import sample_class
from listener import Listener

SHELF = Path(__file__).parent / "hostile"
FILES = {
    f"{path.parent.name}-{path.stem}": path for path in SHELF.glob("*/*") if path.suffix in (".md", ".json")
}
CLASSES = {
    "shadowing", "patching", "always-equal", "forging", "reading", "reference", "tampering", "wire", "exits",
    "exhaustion", "orphans", "network", "poisoning", "evasion", "arguments", "probing", "injection",
}  # fmt: skip
ANSWERS = {"square": "def square(x):\n    return x * x", "cube": "def cube(x):\n    return x**3"}
FIRST, LAST = "a-class-mate", "z-class-mate"
HIDDEN = ("31337", "219359", "31338", "219366")  # inputs and what an attack makes of them
SEEN = HIDDEN[1]  # stock feedback shows every hidden test, but this an attack alone says
SCRIPTS = ("<script>document.title", "<img src=x")
LOOK = """
import builtins, math, os, sys
print([n for p in ("/tmp", "/dev/shm", ".", os.path.expanduser("~")) for n in os.listdir(p) if n[0] != "."])
print("POISONED" in dir(builtins) or hasattr(np, "POISONED"), math.pi > 3.1, "/tmp" in sys.path, np.array([1])[0])
"""
LIMITS = {
    "call_cpu": 0.4, "cell_cpu": 0.6, "notebook_cpu": 8.0, "wall_factor": 2.0, "wall_extra": 5.0, "memory": 2 * 1024**3,
    "notebook_memory": 1024**3, "processes": 40, "file_size": 4 * 1024**2, "disk": 16 * 1024**2,
}  # fmt: skip
STOCK = 'c = get_config()\nc.CourseDirectory.db_url = "sqlite:///gradebook.db"\nc.ExecutePreprocessor.timeout = 10\n'
SQUARE_TEST = """
assert isinstance(square(31337.0), float)
np.testing.assert_allclose(square(31337.0), 982007569.0)
assert all(abs(square(x) - y) < 1e-9 for x, y in [(0.5, 0.25), (-3.0, 9.0)])
"""
CUBE_TEST = """
sides, kept = np.array([1.0, 2.0, 31338.0]), np.array([1.0, 2.0, 31338.0])
assert np.allclose(cube(sides), [1.0, 8.0, 30776269030472.0])
assert np.array_equal(sides, kept)
"""


def source():
    """Return the instructor's notebook: names and comparisons of numpy in its tests, as in those of the course."""
    code, test = new_code_cell, {"grade": True, "locked": True}
    return new_notebook(
        cells=[
            cell(new_markdown_cell, "# Powers"),
            cell(code, "import numpy as np", "given", locked=True),
            cell(code, solution(ANSWERS["square"]), "square", solution=True),
            cell(code, hidden(SQUARE_TEST), "square-test", points=2, **test),
            cell(code, solution(ANSWERS["cube"]), "cube", solution=True),
            cell(code, hidden(CUBE_TEST), "cube-test", points=3, **test),
        ],
        metadata={"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}},
    )


def hand_in(course, attacks, port):
    """Hand in attacks, and an honest notebook before and after them all."""
    places = {"course": str(course.root), "repository": str(Path(__file__).parents[2]), "port": str(port)}
    for attack in attacks:
        path = FILES[attack]
        if path.suffix == ".json":
            course.submit_file(attack, path.read_text(encoding="utf-8"))
            continue
        sample = sample_class.read_sample(path)
        made = sample_class.hand_in(sample, course.released(), ANSWERS, places)
        course.submit_file(attack, made.decode())
    for name in (FIRST, LAST):
        course.submit(name, square=LOOK + ANSWERS["square"], cube=ANSWERS["cube"])


def scores(rows):
    """Return the automatic scores of both tests by student: None where a person decides."""
    return {
        student: tuple(
            None if by_hand else score for score, by_hand in (row["square-test"], row["cube-test"])
        )
        for student, row in rows.items()
    }


def points(text):
    """Return what the table says of a test."""
    return None if text == "manual" else float(text)


@pytest.fixture(scope="module")
def expected():
    """Return the rows of the table by attack."""
    with (SHELF / "expected.csv").open(newline="", encoding="utf-8") as file:
        return {row["attack"]: row for row in csv.DictReader(file)}


@pytest.fixture(scope="module")
def empty(tmp_path_factory):
    """Make the course in which nothing has been handed in."""
    return Course.create(tmp_path_factory.mktemp("hostile") / "course", source(), **LIMITS)


def left_behind():
    """Return files that bear the name of an attack where every user can write."""
    places = ("/tmp", "/dev/shm", "/var/tmp", Path.home(), ".")  # noqa: S108  (where attacks write)
    return {
        str(path) for place in places for path in Path(place).glob("*hostile-*") if "pytest" not in str(path)
    }


@pytest.fixture(scope="module")
def class_of_attacks(empty, tmp_path_factory):
    """Grade the whole shelf in one run; return the course, who visited the listener, and what was left."""
    course = empty.copy(tmp_path_factory.mktemp("graded") / "course")
    before, files = set(children(os.getpid())), left_behind()
    with Listener() as listener:
        assert listener.hears()
        hand_in(course, FILES, listener.port)
        course.grade(jobs=2)
        visits = listener.visits
    end = time.monotonic() + 10
    while (stay := set(alive(children(os.getpid()))) - before) and time.monotonic() < end:
        time.sleep(0.05)
    return course, visits, stay, left_behind() - files


def test_the_shelf_is_whole(expected):
    """Every class of attack has at least three on the shelf, each says what it tries, and has its row in the table."""
    kinds = [path.parent.name for path in FILES.values()]
    assert set(kinds) == CLASSES
    assert [kind for kind in CLASSES if kinds.count(kind) < 3] == []
    assert set(expected) == set(FILES)


def test_no_attack_earns_what_it_does_not_deserve(class_of_attacks, expected):
    """Each attack gets the points that are in the table, cell by cell, and each has its row in the gradebook."""
    course, *_ = class_of_attacks
    found = scores(course.rows())
    assert found.pop(FIRST) == found.pop(LAST) == (2, 3)
    wanted = {name: (points(row["square"]), points(row["cube"])) for name, row in expected.items()}
    assert {name: pair for name, pair in found.items() if pair != wanted[name]} == {}
    assert set(found) == set(wanted)


def test_no_class_mate_is_disturbed(class_of_attacks):
    """Who is graded before all attacks and who is graded after them see and get the same, and see nothing of them."""
    course, *_ = class_of_attacks
    first, last = (printed(course.graded(name)) for name in (FIRST, LAST))
    assert first == last == "['powers.ipynb', 'powers.ipynb']\nFalse True False 1\n"


def test_nothing_is_reached(class_of_attacks):
    """No attack reaches a file, a process, a socket or an answer, and nobody comes to the listener."""
    course, visits, *_ = class_of_attacks
    assert visits == 0
    said = {name: printed(course.graded(name)) for name in FILES}
    assert {name: text[:200] for name, text in said.items() if "REACHED" in text or "POISONED" in text} == {}


def test_nothing_is_left(class_of_attacks):
    """After the class no process that was started for it lives, and no file bears the name of an attack."""
    *_, processes, files = class_of_attacks
    assert processes == set()
    assert files == set()


def test_no_hidden_input_is_shown(class_of_attacks, tmp_path):
    """Neither what a submission's own cells show nor the feedback has a hidden input, or markup that would run."""
    course, *_ = class_of_attacks
    own = {name: [c.get("outputs") for c in course.graded(name).cells if not is_grade(c)] for name in FILES}
    shown = {name: str(outputs) for name, outputs in own.items()}
    assert [name for name, text in shown.items() if any(number in text for number in HIDDEN)] == []
    few = course.copy(tmp_path / "course")
    for folder in (few.root / "autograded").iterdir():
        if folder.name.split("-")[0] not in ("probing", "injection"):
            folder.rename(tmp_path / folder.name)
    with few.api() as api:
        assert api.generate_feedback(ASSIGNMENT)["success"]
    pages = {
        path.parts[-3]: path.read_text(encoding="utf-8") for path in few.root.glob("feedback/*/*/*.html")
    }
    assert len(pages) == 7
    assert [name for name, page in pages.items() if any(number in page for number in HIDDEN)] == []
    assert [name for name, page in pages.items() if any(script in page for script in SCRIPTS)] == []


def marked(mark):
    """Return the processes that run with a mark in their environment."""
    found = []
    for path in Path("/proc").glob("[0-9]*/environ"):
        with contextlib.suppress(OSError):
            if mark.encode() in path.read_bytes():
                found.append(int(path.parent.name))
    return found


@pytest.fixture(scope="module")
def stock(empty, expected, tmp_path_factory):
    """Grade with stock nbgrader what is tried there, with a home of its own; return the course and who lives on."""
    folder = tmp_path_factory.mktemp("stock")
    course = empty.copy(folder / "course")
    (course.root / "nbgrader_config.py").write_text(STOCK, encoding="utf-8")
    surroundings = environment(HOME=str(folder), ROBOLOC_MARK=str(folder))
    surroundings.pop("IPYTHONDIR", None)
    with Listener() as listener, (folder / "log").open("w") as log:
        hand_in(course, [name for name, row in expected.items() if row["stock"]], listener.port)
        for command in ("autograde", "generate_feedback"):
            subprocess.run(  # its output goes to a file: orphans hold a pipe open
                course.command(command, ASSIGNMENT), cwd=course.root, stdout=log, stderr=log, timeout=300, check=False,
                env=surroundings,
            )  # fmt: skip
    living = {pid: Path(f"/proc/{pid}/cmdline").read_bytes() for pid in alive(marked(str(folder)))}
    for pid in living:
        os.kill(pid, signal.SIGKILL)
    return course, [words for words in living.values() if b"4242" in words]


def test_attacks_win_against_stock_nbgrader(stock, expected):
    """Attacks of the shelf do under stock nbgrader what they are there for: the shelf is not harmless."""
    course, lives_on = stock
    rows = scores(course.rows())
    assert rows[FIRST] == (2, 3)
    poisoned = "True" in printed(course.graded(LAST))

    def outcome(name):
        if None in rows[name]:
            return "lost"
        page = (course.folder(name, "feedback") / f"{NOTEBOOK}.html").read_text(encoding="utf-8")
        signs = {
            "reached": "REACHED" in printed(course.graded(name)),
            "shown": SEEN in page or any(script in page for script in SCRIPTS),
            "poisoned": poisoned and name.startswith("poisoning"),
            "left": lives_on and name.startswith("orphans"),
        }
        return next((sign for sign, there in signs.items() if there), f"{sum(rows[name]):g}")

    tried = {name: row["stock"] for name, row in expected.items() if row["stock"]}
    assert {name: outcome(name) for name in tried} == tried
    assert "0" not in tried.values()  # none of these deserves a point


def test_a_changed_argument_wins_where_no_test_asks_for_it(execute):
    """The defence of a test against answers written over their arguments is its last line; without it they score."""
    answer = sample_class.read_sample(SHELF / "arguments" / "answers-in-place.md").cells["cube"]
    for test, score in ((CUBE_TEST, 0), (CUBE_TEST.rpartition("assert")[0], 2)):
        run = execute(("given", "import numpy as np"), ("answer", answer, "def cube(x): ..."), ("test", test))
        assert run.scores == [score], run.error()


def test_right_answers_are_right():
    """The answers that attacks leave as they are pass the hidden tests."""
    space = {"np": np}
    exec("\n".join([*ANSWERS.values(), SQUARE_TEST, CUBE_TEST]), space)  # noqa: S102  (our own tests)
