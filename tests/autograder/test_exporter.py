"""Pages of feedback are those of nbconvert, made faster."""

from __future__ import annotations

import os
import threading
from html import unescape

import nbformat
import pytest
from bs4 import BeautifulSoup
from nbconvert.exporters import HTMLExporter
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook, new_output
from nbgrader.converters import GenerateFeedback
from nbgrader.converters.base import NbGraderException
from nbgrader.coursedir import CourseDirectory
from temporary_course import ASSIGNMENT, Course

from autograder.exporter import Feedback, FeedbackExporter, highlight
from autograder.feedback import LeakFreeFeedback
from autograder.interrupted import begin
from autograder.outputs import MAX_TAGS
from autograder.sanitize import clean_html, markdown2html, remembered

PIXEL = "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="


def notebook():
    """Return a notebook with a picture, a table and code."""
    picture = new_output("display_data", data={"image/png": PIXEL, "text/plain": "<Figure>"})
    table = new_output(
        "display_data", data={"text/html": "<table><tr><td>1</td></tr></table>", "text/plain": "t"}
    )
    cells = [
        new_markdown_cell("# *Motion*\n\n$x < y$"),
        new_code_cell("v = 0.5  # m/s\nx = v * 2", outputs=[picture, table]),
        new_code_cell(""),
    ]
    return new_notebook(cells=cells)


def test_page_is_that_of_nbconvert():
    """Without the last pass over it, the page is the same but for the ids that are new each time."""
    shown, _ = LeakFreeFeedback().preprocess(notebook(), {})
    options = {"template_name": "classic", "exclude_anchor_links": True}
    theirs, _ = HTMLExporter(**options).from_notebook_node(nbformat.from_dict(shown))
    ours, _ = FeedbackExporter(**options).from_notebook_node(nbformat.from_dict(shown))
    assert 'alt="figure that this cell drew"' in ours
    assert str(BeautifulSoup(ours, "html.parser")) == theirs


def test_every_picture_has_an_alternative_text():
    """One that a student wrote without gets a word for it; one with keeps it."""
    assert clean_html(f'<img src="data:image/png;base64,{PIXEL}">').count("alt=") == 1
    assert clean_html('<img alt="a > b">') == '<img alt="a > b">'
    assert markdown2html({}, "![plot](x.png)").count("alt=") == 1


def test_what_is_remembered_is_the_same():
    """A second call gives what the first one gave, for short texts without calling the function."""
    calls = []
    function = remembered(lambda text: calls.append(text) or text.upper())
    assert [function("a"), function("a"), function("b"), function("c" * 20_001), function("c" * 20_001)] == [
        "A", "A", "B", "C" * 20_001, "C" * 20_001,
    ]  # fmt: skip
    assert [text[0] for text in calls] == ["a", "b", "c", "c"]


def test_other_languages_are_highlighted_as_such():
    """A cell of another language is not taken for Python."""
    assert "hl-bash" in highlight("ls", "bash")
    assert 'class="nt">p<' in highlight("<p>", metadata={"magics_language": "html"})
    assert "hl-ipython3" in highlight("ls")


@pytest.fixture
def feedback(tmp_path, monkeypatch):
    """Return a step that only notes which process writes whose feedback, and a function that reads the notes."""

    def convert(self):
        for name in self.assignments:
            if name == "bad":
                raise ValueError(name)
            with (tmp_path / name).open("a") as file:
                file.write(f"{os.getpid()} ")

    monkeypatch.setattr(GenerateFeedback, "convert_notebooks", convert)
    monkeypatch.setattr("autograder.exporter.threads", lambda: 1)  # another test may have left some
    step = Feedback(coursedir=CourseDirectory(root=str(tmp_path)), jobs=2)
    return step, lambda: {path.name: path.read_text().split() for path in tmp_path.iterdir()}


def test_feedback_is_written_by_several_processes(feedback):
    """Each student's feedback is written once, by one of two processes that are not this one."""
    step, written = feedback
    step.assignments = {name: [] for name in "abcde"}
    step.convert_notebooks()
    assert {name: len(pids) for name, pids in written().items()} == dict.fromkeys("abcde", 1)
    pids = {pid for pids in written().values() for pid in pids}
    assert len(pids) == 2
    assert str(os.getpid()) not in pids


def test_feedback_that_fails_is_an_error(feedback, capfd):
    """Where one process fails, the others finish, and the command says so."""
    step, written = feedback
    step.assignments = {name: [] for name in ("a", "b", "bad", "c")}
    with pytest.raises(NbGraderException, match="some feedback could not be written"):
        step.convert_notebooks()
    assert {"b", "c"} <= set(written())
    assert "ValueError: bad" in capfd.readouterr().err


def test_what_is_graded_half_gets_no_page(tmp_path):
    """Where grading was broken off, feedback waits for the run that finishes it, and the log says so."""
    course = Course.create(tmp_path / "course")
    for student in ("ada", "bob"):
        course.submit(student)
    course.grade()
    begin(course.folder("bob", "autograded"))
    said = course.nbgrader("generate_feedback", ASSIGNMENT).stderr
    assert f"{course.folder('bob', 'autograded')} is not graded to its end" in said
    pages = [course.folder(student, "feedback") / "powers.html" for student in ("ada", "bob")]
    assert [page.exists() for page in pages] == [True, False]
    course.grade()
    course.nbgrader("generate_feedback", ASSIGNMENT)
    assert pages[1].exists()


def test_feedback_in_a_server_is_written_by_one_process(feedback, monkeypatch):
    """Beside other threads nothing is forked."""
    monkeypatch.setattr("autograder.exporter.threads", threading.active_count)
    step, written = feedback
    step.assignments = {"a": [], "b": []}
    stop = threading.Event()
    thread = threading.Thread(target=stop.wait)
    thread.start()
    step.convert_notebooks()
    stop.set()
    thread.join()
    assert written() == {name: [str(os.getpid())] for name in "ab"}


@pytest.mark.parametrize(
    "source", ["![a](attachment:gone.png)", "![a](attachment:)", "![](attachment:a.png) ![](attachment:b)"]
)
def test_a_picture_that_is_missing_costs_no_page(source):
    """Nbconvert gives up the page of a student, or of a class, for an attachment that is not there."""
    html = markdown2html({"cell": {"attachments": {"a.png": {"image/png": PIXEL}}}}, source)
    assert "<img" in html
    assert html.count(PIXEL) == source.count("a.png")  # and one that is there is shown
    assert "<img" in markdown2html({}, source)


def test_markdown_that_takes_long_is_shown_as_it_is():
    """Very much markup is not read as such."""
    html = markdown2html({}, "<b>" * (MAX_TAGS + 1))
    assert html.startswith("<pre>&lt;b&gt;")


def test_formulas_in_markdown_do_not_reach_out():
    """Entities are no way to write a command that reaches out of a formula."""
    for source in (
        r"$\href{javascript:f()}{x}$",
        "<div>&#36;&#92;href{javascript:f()}{x}$ $\\&#104;ref{x}$</div>",
    ):
        assert "\\href" not in unescape(markdown2html({}, source))
