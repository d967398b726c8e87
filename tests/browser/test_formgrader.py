"""nbgrader's formgrader opens on a class that our plug-in graded, and nothing of a student's runs in it."""

from __future__ import annotations

import json
import urllib.request

import pytest
from browser.browser import visit
from browser.formgrader import READY, SCREENSHOTS, TOKEN, local, page, serve, submission
from nbgrader.api import Gradebook
from temporary_course import ASSIGNMENT, NOTEBOOK, Course

STOLEN = "document.documentElement.dataset.stolen = 'yes'"
ATTACK = f"""The square grows with the **square**.

<script>{STOLEN}</script>
<img src="data:image/png;base64,AAAA" onerror="{STOLEN}">
<iframe srcdoc="<script>parent.{STOLEN}</script>"></iframe>
<svg onload="{STOLEN}"></svg>
<a href="javascript:{STOLEN}" id="trap">a link</a>
[another](javascript:{STOLEN.replace(" ", "")})
"""
OUTPUT = f"from IPython.display import HTML, display\ndisplay(HTML({ATTACK!r}))"
CLICK = """
const links = [...document.querySelectorAll("#notebook a[href]")];
for (const a of links) if (!/^(#|http)/.test(a.getAttribute("href"))) a.click();
await pause(300);
"""
SHOWN = """
const boxes = [...document.querySelectorAll("input.score")];
return {
  stolen: document.documentElement.dataset.stolen ?? null,
  text: document.querySelector("#notebook").innerText,
  scores: Object.fromEntries(boxes.map((e) => [e.id, e.value || e.placeholder])),
  parts: [...document.querySelectorAll("#notebook :is(script, iframe, svg, [onerror], [onload])")].length,
};
"""
TYPE = """
const box = document.querySelector("#why");
box.focus();
box.value = "3.5";
$(box).trigger("change");
await until(() => !formgrader.grades.any((g) => g.get("name") === "why" && g.get("manual_score") !== 3.5));
await pause(1000);
"""


@pytest.fixture(scope="module")
def course(tmp_path_factory):
    """Grade an honest student and one whose answer and outputs carry scripts."""
    made = Course.create(tmp_path_factory.mktemp("formgrader") / "course")
    made.submit("honest", why="Because a square has two sides: $x^2 = x \\cdot x$.")
    made.submit("attacker", square="def square(x):\n    return 2 * x", why=ATTACK, more=[OUTPUT])
    made.grade()
    return made


@pytest.fixture(scope="module")
def server(course, tmp_path_factory):
    """Serve the course."""
    with serve(course, tmp_path_factory.mktemp("jupyter")) as address:
        yield address


def test_list_of_assignments(server):
    """The list of assignments shows ours with both submissions."""
    SCREENSHOTS.mkdir(parents=True, exist_ok=True)
    rows = "return [...document.querySelectorAll('tbody tr')].map((r) => r.innerText.split(/\\s+/).filter(Boolean))"
    picture = str(SCREENSHOTS / "formgrader-assignments.png")
    (report,) = visit(
        [page(server, "manage_assignments", wait="td.name a", screenshot=picture, run=rows)], parallel=1
    )
    (row,) = report["value"]
    assert (row[0], row[-1]) == (ASSIGNMENT, "2")
    assert not report["errors"]
    assert not local(report)


def test_manual_grading(course, server):
    """The honest answer is shown with its scores; a score typed on the page is in the gradebook."""
    assert course.rows()["honest"]["why"] == (None, True)
    visits = [
        page(server, f"submissions/{submission(course, 'honest')}", wait="input#why", run=READY + CLICK + TYPE + SHOWN,
             screenshot=str(SCREENSHOTS / "formgrader-honest.png"), full=True),
    ]  # fmt: skip
    (report,) = visit(visits, parallel=1)
    assert report["value"]["scores"] == {"square-test": "2", "cube-test": "3", "why": "3.5"}
    assert "Because a square has two sides" in report["value"]["text"]
    assert not local(report)
    with Gradebook(course.db_url) as gradebook:
        grade = gradebook.find_grade("why", NOTEBOOK, ASSIGNMENT, "honest")
        assert (grade.manual_score, grade.score, grade.needs_manual_grade) == (3.5, 3.5, False)


def test_no_script_of_a_student_runs(course, server, tmp_path):
    """Scripts in a written answer and in an output stay dead in the formgrader; as a plain page the same text acts."""
    plain = tmp_path / "plain.html"
    plain.write_text(f"<!doctype html><html lang='en'><title>x</title><body>{ATTACK}", encoding="utf-8")
    visits = [
        page(server, f"submissions/{submission(course, 'attacker')}", wait="input#why", run=READY + CLICK + SHOWN,
             screenshot=str(SCREENSHOTS / "formgrader-attacker.png"), full=True),
        {"url": plain.as_uri(), "run": "return document.documentElement.dataset.stolen"},
    ]  # fmt: skip
    report, control = visit(visits)
    assert control["value"] == "yes"
    assert report["value"]["stolen"] is None
    assert report["value"]["parts"] == 0
    assert "The square grows with the square" in report["value"]["text"]
    assert report["value"]["scores"] == {"square-test": "0", "cube-test": "3", "why": ""}
    assert not local(report)


def test_the_button_that_grades(course, server):
    """What the button *autograde* asks of the server grades a new submission in the sandbox, as the command does."""
    course.submit("later")
    request = urllib.request.Request(  # noqa: S310  (our own server)
        f"{server}/formgrader/api/submission/{ASSIGNMENT}/later/autograde",
        method="POST",
        headers={"Authorization": f"token {TOKEN}"},
    )
    with urllib.request.urlopen(request, timeout=120) as answer:  # noqa: S310
        said = json.load(answer)
    assert said["success"], said
    assert course.rows()["later"] == {
        "square-test": (2, False), "cube-test": (3, False), "why": (None, True),
    }  # fmt: skip
    assert course.graded("later").metadata["grading"].keys() == {
        "run", "release", "checks", "environment", "seconds",
    }  # fmt: skip
