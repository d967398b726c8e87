"""The tool that grades the sample class notices what is not as it must be. The real run is `make course`."""

import socket
from pathlib import Path

import nbformat
import pytest
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook, new_output

import course
import course_report as report
import course_results
import inputs
import sample_class

ROOT = Path(__file__).resolve().parents[1]


Result = course_results.Result
NUMBERS = report.hidden_numbers("a course")


@pytest.fixture
def table():
    """Return what must come out of a class of two."""
    return {
        "ada": Result({"a": "2", "b": "manual"}, "Euler step"),
        "bob": Result({"a": "0.3", "b": "0"}),
    }


def test_nothing_to_say_about_a_class_as_expected(table):
    """Equal results give no line, and a score is a number however it is written."""
    found = {**table, "bob": Result({"a": "0.30", "b": "0.0"})}
    assert course_results.differences(table, found) == []


@pytest.mark.parametrize(
    ("student", "result", "line"),
    [
        ("bob", Result({"a": "0.31", "b": "0"}), "bob, a: expected 0.3, got 0.31"),
        ("bob", Result({"a": "0.3"}), "bob, b: expected 0, got no row"),
        ("bob", Result({"a": "0.3", "b": "no row"}), "bob, b: expected 0, got no row"),
        ("bob", Result({"a": "0.3", "b": "manual"}), "bob, b: expected 0, got manual"),
        ("bob", Result({"a": "0.3", "b": "0", "c": "1"}), "bob, c: expected no row, got 1"),
        ("ada", Result({"a": "2", "b": "5"}, "Euler step"), "ada, b: expected manual, got 5"),
        ("ada", Result({"a": "2", "b": "manual"}), "ada: expected the diagnosis 'Euler step', got ''"),
        ("eve", Result(), "eve: in the gradebook, but not in the table"),
        ("ada", None, "ada: expected in the gradebook, got no such student"),
    ],
)
def test_each_difference_is_named(table, student, result, line):
    """A wrong score, a missing row, a wrong diagnosis, a missing and an unknown student each give their line."""
    found = {**table, student: result}
    assert course_results.differences(table, {k: v for k, v in found.items() if v is not None}) == [line]


def test_diagnosis_is_read_from_the_reports_of_test_cells(tmp_path):
    """Recognised mistakes are read in order and once; what a student prints in a cell of his own is not one."""

    def cell(text, **meta):
        shown = new_output("display_data", data={"text/plain": text})
        return new_code_cell("pass", metadata={"nbgrader": meta}, outputs=[shown])

    text = "stage: 1 of 2 points\n  Recognised mistake: {} (Gx, Gu).\n    Why (it is so)."
    cells = [cell(text.format(name), grade=True) for name in ("sign (of it)", "dt", "sign (of it)")]
    cells.insert(0, cell(text.format("forged"), grade=False))
    path = tmp_path / "graded.ipynb"
    nbformat.write(new_notebook(cells=cells), path)
    assert report.diagnosis(path) == "sign (of it); dt"
    assert report.diagnosis(tmp_path / "none.ipynb") == ""


def test_listener_hears():
    """The listener counts connections, so that a count of 0 means that there was none."""
    with course.Listener() as listener:
        assert listener.hears()
        assert listener.visits == 0
        with socket.create_connection(("127.0.0.1", listener.port)) as connection:
            connection.recv(1)
        assert not listener.hears()
    with pytest.raises(OSError, match=r".+"):
        socket.create_connection(("127.0.0.1", listener.port), timeout=1).close()


@pytest.mark.parametrize(
    "html",
    [
        "<script>steal()</script>",
        "<script src='https://example.org/x.js'></script>",
        "<b onclick='steal()'>b</b>",
        "<img src='x' onerror='steal()'>",
        "<a href=' JavaScript:steal()'>a</a>",
        "<iframe srcdoc='x'></iframe>",
    ],
)
def test_everything_that_would_run_is_seen(html):
    """Scripts, event handlers, script links and frames are found; the same as text is none."""
    assert report.scripts(f"<p>{html}</p>")
    assert not report.scripts(html.replace("<", "&lt;"))


def test_hidden_numbers_are_recognised_as_they_are_printed():
    """A number is found in what print, repr and numpy show of it, and short numbers are not looked for."""
    for value in (0.123456789012, -12.3456789012, 1.23456789012e-7, 0.00123456789012):
        text = report._printed(value)
        assert sum(c.isdigit() for c in text.lstrip("0.")) == 6
        assert text in repr(value)
    assert report._printed(0.5) == report._printed(1e-12) == report._printed(12345.0) == ""
    assert len(report.hidden_numbers("a course")) > 300
    assert not {"3.14159", "1.57079", "6.28318"} & report.hidden_numbers("a course")
    one, other = report.hidden_numbers("a course"), report.hidden_numbers("another")
    assert len(one & other) < len(one) / 20


@pytest.fixture
def graded(tmp_path):
    """Make a small graded course and return its folder, source and a function that writes a feedback page."""
    source = new_notebook(
        cells=[
            new_code_cell("# seen\n### BEGIN HIDDEN TESTS\nassert answer == 42\n### END HIDDEN TESTS"),
            new_markdown_cell(
                "Why is\nit so?\n=== BEGIN MARK SCHEME ===\n* 2 points for *why*\n=== END MARK SCHEME ==="
            ),
        ]
    )

    def write(student, html, printed="fine"):
        for kind, suffix in (("feedback", "html"), ("autograded", "ipynb")):
            (tmp_path / kind / student / "set").mkdir(parents=True)
            path = tmp_path / kind / student / "set" / f"one.{suffix}"
            if kind == "feedback":
                path.write_text(html)
            else:
                cell = new_code_cell(outputs=[new_output("stream", text=printed)])
                nbformat.write(new_notebook(cells=[cell]), path)

    write("perfect", "<script>usual()</script>")
    return tmp_path, source, write


@pytest.mark.parametrize(
    ("html", "printed", "words"),
    [
        ("<code>assert answer == 42</code>", "fine", "the hidden line 'assert answer 42'"),
        ("<b>assert</b> <i>answer</i> <b>==</b> <i>42</i>", "fine", "the hidden line 'assert answer 42'"),
        ("<p>=== MARK SCHEME ===</p>", "fine", "the hidden line 'MARK SCHEME'"),
        ("<li>2 points\nfor <em>why</em></li>", "fine", "the hidden line '2 points for why'"),
        ("<script>steal()</script>", "fine", "would run 'steal()'"),
        ("{number}", "fine", "the hidden number"),
        ("fine", "REACHED the gradebook\n", "REACHED the gradebook"),
    ],
)
def test_each_leak_is_named(graded, html, printed, words):
    """Hidden tests or numbers in feedback, a script of a student's and a place reached give a line each."""
    folder, source, write = graded
    write("eve", html.format(number=max(NUMBERS) + "12"), printed)
    (line,) = report.leaks(folder, "set", "one", ["perfect", "eve"], source, NUMBERS)
    assert line.startswith("eve: ")
    assert words in line


def test_no_leak_and_no_feedback_are_told_apart(graded):
    """Harmless feedback gives no line; a student without any gives one, and so does nothing to look for."""
    folder, source, write = graded
    write("bob", "<script>usual()</script><code># seen</code><p>Why is\nit so?</p>")
    assert report.leaks(folder, "set", "one", ["perfect", "bob"], source, NUMBERS) == []
    assert report.leaks(folder, "set", "one", ["perfect", "eve"], source, NUMBERS) == [
        "eve: expected feedback, got none"
    ]
    assert report.leaks(folder, "set", "one", ["perfect"], new_notebook(), NUMBERS) == [
        "there is nothing hidden to look for"
    ]


def test_exported_grades_hold_everyone_once(tmp_path):
    """A student without a line in the exported grades, or with two, is named."""
    path = tmp_path / "grades.csv"
    path.write_text("assignment,student_id\nset,ada\nset,bob\nset,bob\n")
    assert report.exported(path, [("set", "ada")]) == []
    assert report.exported(path, [("set", "bob"), ("set", "eve"), ("next", "ada")]) == [
        "bob, set: expected one line of grades.csv, got 2",
        "eve, set: expected one line of grades.csv, got 0",
        "ada, next: expected one line of grades.csv, got 0",
    ]


def test_processor_time_is_held_against_the_limit(tmp_path):
    """A notebook that took longer than its limit, or has no record, is named; the slack is not counted."""
    for name, record in (("ada", {"seconds": 65.0}), ("bob", {"seconds": 65.1}), ("eve", {"run": "1"})):
        folder = tmp_path / "autograded" / name / "set"
        folder.mkdir(parents=True)
        nbformat.write(new_notebook(metadata={"grading": record}), folder / "one.ipynb")
    students = ["ada", "bob", "eve", "tom"]
    took = report.seconds(tmp_path, "set", "one", students)
    assert took == {"ada": 65.0, "bob": 65.1}
    assert report.overruns(took, students, 60.0) == [
        "eve: expected processor seconds, got none",
        "tom: expected processor seconds, got none",
        "bob: expected at most 60 + 5 processor seconds, got 65.1",
    ]


def test_the_limit_is_that_of_the_configuration():
    """The limit is a number of the repository's configuration, which a course can change."""
    assert f"notebook_cpu = {course.processor_limit()}" in (ROOT / "nbgrader_config.py").read_text()


def test_commands_run_beside_the_body_and_are_waited_for(tmp_path):
    """What a command says is in its file when the body and the command are through; a command that fails is named."""
    with course.running(tmp_path, ["--version"]):
        log = tmp_path / "--version-0.log"
        assert log.exists()
    assert "nbgrader version" in log.read_text()
    with (
        pytest.raises(RuntimeError, match="nbgrader generate_assignment nothing failed"),
        course.running(tmp_path, ["generate_assignment", "nothing"]),
    ):
        pass


def test_results_are_compared_with_the_table_of_each_notebook(monkeypatch):
    """Each notebook has its own table; who handed in nothing of one must have rows there, of no points."""
    sample = sample_class.Sample
    students = {
        "ada": {"one": sample("ada", ""), "two": sample("eve", "")},
        "bob": {"one": sample("bob", "")},
    }
    assignment = course_results.Assignment("set", dict.fromkeys(["one", "two"]), students)
    tables = {
        "one": {"ada": Result({"a": "1"}), "bob": Result({"a": "2"})},
        "two": {"eve": Result({"b": "3"})},
    }
    monkeypatch.setattr(course_results, "read_expected", lambda path: dict(tables[path.parent.name]))
    found = {
        "one": {"ada": Result({"a": "1"}), "bob": Result({"a": "2"})},
        "two": {"eve": Result({"b": "3"}), "bob": Result({"b": "0"})},
    }
    assert course_results.compare(assignment, found) == []
    found["two"]["bob"] = Result({"b": "1"})
    found["one"]["ada"] = Result({"a": "0"})
    assert course_results.compare(assignment, found) == [
        "one: ada, a: expected 1, got 0",
        "two: bob, b: expected 0, got 1",
    ]
    del found["two"]["bob"]
    assert "two: bob: expected in the gradebook, got no such student" in course_results.compare(
        assignment, found
    )


def test_a_change_of_anything_the_class_is_made_from_is_seen(tmp_path, monkeypatch):
    """A changed, a new and a renamed file change the hash; byte code and check points do not."""
    monkeypatch.setattr(inputs, "ROOT", tmp_path)
    for name in inputs.FILES:
        (tmp_path / name).write_text("")
    (tmp_path / "samples").mkdir()
    hashes = [inputs.fingerprint(), inputs.fingerprint("more")]
    (tmp_path / "samples" / "a.md").write_text("1")
    hashes.append(inputs.fingerprint())
    (tmp_path / "samples" / "a.md").write_text("2")
    hashes.append(inputs.fingerprint())
    (tmp_path / "samples" / "a.md").rename(tmp_path / "samples" / "b.md")
    hashes.append(inputs.fingerprint())
    assert len(set(hashes)) == 5
    (tmp_path / "samples" / "__pycache__").mkdir()
    (tmp_path / "samples" / "__pycache__" / "x.pyc").write_text("3")
    assert inputs.fingerprint() == hashes[-1]


def test_every_folder_the_class_is_made_from_is_there():
    """The list of folders and files names none that has moved."""
    assert all((ROOT / name).exists() for name in (*inputs.FOLDERS, *inputs.FILES))
