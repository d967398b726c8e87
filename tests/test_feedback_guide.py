"""How feedback reads: every message that the student guide quotes is the grader's, and none is missing."""

import ast
import re
from pathlib import Path

import numpy as np
import pytest

from autograder import observe, remote
from autograder.checks import STAGES
from autograder.grading import grade, grading_run

ROOT = Path(__file__).resolve().parents[1]
GUIDE = (ROOT / "book" / "student-guide.md").read_text(encoding="utf-8")
DYNAMICS, TRANSITION = "motion.compute_dynamics", "gaussian.transition_update"
LINES, WORDS, SEEN, NOTES, EXTRA = (
    "| a line begins with | and says |",
    "| the feedback says | it means |",
    "| what can be seen | look for |",
    "| the note says | it means |",
    "| of extra credit it says | it means |",
)


def quoted(head):
    """Return what the first column of a table of the guide quotes."""
    rows = GUIDE.split(head)[1].split("\n\n")[0].splitlines()[2:]
    assert len(rows) > 3
    return [phrase for row in rows for phrase in re.findall(r"\*(.+?)\*", row.split(" | ")[0])]


def changed(stage, index, how):
    """Make the right function of a stage, with one output changed."""

    def function(*args):
        outputs = list(STAGES[stage].reference(*args))
        outputs[index] = how(outputs[index], *args)
        return tuple(outputs)

    return function


def raising(error):
    """Make a function that raises."""

    def function(*_):
        raise error

    return function


def overwrites(xvec, u, dt):
    """Move a pose, and write to it."""
    result = STAGES[DYNAMICS].reference(xvec, u, dt)
    xvec += 1.0
    return result


def remembers():
    """Make a motion that is right the first time and for every argument once."""
    calls = []

    def function(*args):
        again = any(np.array_equal(args[0], call) for call in calls)
        calls.append(args[0].copy())
        g, *rest = STAGES[DYNAMICS].reference(*args)
        return g + 0.1 * again, *rest

    return function


def misspelt(*_):
    """Call what there is not."""
    error = TypeError("x")
    error.line = 3
    raise error


PYTHON = "name 'compute_dynamics' is not defined"  # what Python says of a missing name
SIGN, DEGREES = np.array([[1, -1], [1, -1], [1, 1]]), np.array([1, 1, 180 / np.pi])
WRONG = [
    (DYNAMICS, lambda *_: None),
    (DYNAMICS, lambda *_: (1, 2, 3)),
    (DYNAMICS, lambda *_: ("a", "b", "c")),
    (DYNAMICS, raising(NotImplementedError())),
    (DYNAMICS, misspelt),
    (DYNAMICS, raising(remote.LimitExceeded("x"))),
    (DYNAMICS, raising(remote.ProcessDied("x"))),
    (DYNAMICS, raising(remote.MemoryExceeded("x"))),
    (DYNAMICS, changed(DYNAMICS, 0, lambda g, *_: np.add(g, [0, 0, 0.1]))),
    (DYNAMICS, changed(DYNAMICS, 0, lambda g, *_: g * np.nan)),
    (DYNAMICS, overwrites),
    (DYNAMICS, remembers()),
    (DYNAMICS, changed(DYNAMICS, 2, lambda Gu, *_: Gu * SIGN)),
    (DYNAMICS, changed(DYNAMICS, 2, lambda Gu, *_: 2 * Gu)),
    (DYNAMICS, changed(DYNAMICS, 2, lambda Gu, _x, _u, dt: dt * Gu)),
    (DYNAMICS, changed(DYNAMICS, 2, lambda Gu, _x, _u, dt: Gu / dt)),
    (DYNAMICS, changed(DYNAMICS, 2, lambda Gu, *_: Gu * [0, 1])),
    (DYNAMICS, changed(DYNAMICS, 0, lambda g, *_: g * DEGREES)),
    (DYNAMICS, changed(DYNAMICS, 0, lambda g, *_: g * [1e3, 1e3, 1])),
    (DYNAMICS, changed(DYNAMICS, 0, lambda g, *_: np.add(g, [0, 0, 2 * np.pi]))),
    (DYNAMICS, changed(DYNAMICS, 2, lambda Gu, *_: Gu.T)),
    (DYNAMICS, changed(DYNAMICS, 2, lambda Gu, *_: Gu.ravel())),
    (DYNAMICS, changed(DYNAMICS, 2, lambda Gu, *_: Gu.astype(np.float32))),
    (DYNAMICS, changed(DYNAMICS, 2, lambda Gu, _x, u, _dt: Gu * [1, 1.5 if u[0] < 0 else 1])),
    (TRANSITION, changed(TRANSITION, 1, lambda S, *_: S + np.triu(S, 1))),
    (TRANSITION, changed(TRANSITION, 1, lambda S, *_: S - np.trace(S) * np.eye(len(S)))),
    (TRANSITION, changed(TRANSITION, 1, lambda S, *_: -S)),
]


@pytest.fixture(scope="module")
def reports():
    """Grade what is wrong in every way that the guide tells of."""
    shown = []
    with grading_run(secret="any", run_id="r", publish=shown.append):  # noqa: S106  (of no course)
        for stage, function in WRONG:
            grade(stage, function, 10)
    return [one["text/plain"] for one in shown]


def said(phrase, texts):
    """Whether a phrase, a dash of dots standing for anything and names of matrices for each other, is said."""
    pattern = r"[^\n]*?".join(re.escape(part) for part in re.split(r" ?… ?", phrase))
    pattern = re.sub(r"\b(Gx|Gu|g|Sigma)\b", r"(?:Gx|Gu|g|Sigma)", pattern)
    return any(re.search(pattern, text, re.IGNORECASE) for text in texts)


def constants():
    """Return the texts in the sources of the grader, with dots for what is filled in."""
    found = []
    for path in sorted((ROOT / "autograder").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.JoinedStr):
                found.append("".join(p.value if isinstance(p, ast.Constant) else "…" for p in node.values))
            elif isinstance(node, ast.Constant) and isinstance(node.value, str):
                found.append(node.value)
    return found


@pytest.mark.parametrize("head", [LINES, SEEN])
def test_what_the_guide_quotes_is_said(head, reports):
    """Each kind of line, and each thing that can be seen, stands in a real report."""
    right = (GUIDE.split("```text\n")[1],)  # itself held against the grader
    assert [phrase for phrase in quoted(head) if not said(phrase, [*reports, *right])] == []


@pytest.mark.parametrize("head", [WORDS, NOTES, EXTRA])
def test_messages_are_the_graders(head, reports):
    """Each message that the guide explains is one of a real report, or a text of the grader's source."""
    texts = [*reports, *constants(), PYTHON]
    assert [phrase for phrase in quoted(head) if not said(phrase, texts)] == []


def test_everything_that_can_be_seen_is_listed(reports):
    """Each sentence that a report says of unknown mistakes, and each text it can be made of, is in the guide."""
    seen = [line for report in reports for line in re.findall(r"What can be seen \(\w+\):\n    (.+)", report)]
    assert len(seen) >= 14
    listed = quoted(SEEN)
    assert [line for line in seen if not any(said(phrase, [line]) for phrase in listed)] == []
    assert {text for _, text in observe.UNITS if "meant" in text} <= set(listed)


def test_there_is_no_second_meaning():
    """No message is explained twice."""
    phrases = [phrase for head in (LINES, WORDS, SEEN, NOTES, EXTRA) for phrase in quoted(head)]
    assert len(set(phrases)) == len(phrases)
