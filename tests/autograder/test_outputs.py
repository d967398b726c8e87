"""What of a submission's outputs is kept: nothing that a browser would run or a file could not hold."""

# ruff: noqa: E501  (attacks are quoted whole)

from __future__ import annotations

import base64
import re
from html import unescape

import nbformat
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nbformat.v4 import new_code_cell, new_notebook

from autograder.outputs import MAX_TAGS, TAG, clean, error, weight

PNG = base64.b64encode(b"\x89PNG\r\n\x1a\n" + bytes(20)).decode()
JPEG = base64.b64encode(b"\xff\xd8\xff" + bytes(20)).decode()


def shown(mime, value, kind="display_data"):
    """Return what is kept of one display."""
    kept = clean([{"output_type": kind, "data": {mime: value}, "metadata": {"evil": 1}}])
    return kept[0].data.get(mime) if kept else None


def is_valid(outputs):
    """Return whether a notebook with these outputs is valid and can be written."""
    notebook = new_notebook(cells=[new_code_cell("", outputs=outputs, id="a")])
    nbformat.validate(notebook)
    nbformat.writes(notebook).encode()
    return True


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text() | st.binary(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner, max_size=4),
    max_leaves=10,
)
MIMES = st.sampled_from(
    ["text/plain", "text/html", "text/latex", "image/png", "image/svg+xml", "application/javascript", "x"]
)
OUTPUTS = st.fixed_dictionaries(
    {"output_type": st.sampled_from(["stream", "error", "display_data", "execute_result", "x"]) | JSON},
    optional={
        "name": st.sampled_from(["stdout", "stderr", "x"]) | JSON,
        "text": JSON,
        "data": st.dictionaries(MIMES, JSON, max_size=3) | JSON,
        "metadata": JSON,
        "ename": JSON,
        "evalue": JSON,
        "traceback": st.lists(JSON, max_size=3) | JSON,
        "execution_count": JSON,
    },
)


@settings(max_examples=80, deadline=None, derandomize=True)
@given(st.lists(OUTPUTS | JSON, max_size=4) | JSON)
def test_anything_becomes_valid_outputs(outputs):
    """Whatever a worker sends, what is kept is a valid notebook that can be written as a file."""
    assert is_valid(clean(outputs))


@pytest.mark.parametrize(
    "html",
    [
        "<script>alert(1)</script>", "<img src=x onerror=alert(1)>", "<a href='javascript:alert(1)'>x</a>",
        "<iframe src='//evil'></iframe>", "<b onmouseover='alert(1)'>x</b>", "<style>body{display:none}</style>",
        "<svg onload=alert(1)>", "<form action='//evil'><input></form>", "<div style='position:fixed'>score: 10/10</div>",
        "<link rel=stylesheet href='//evil'>", "<meta http-equiv=refresh content='0;//evil'>", "<!-- x -->",
        "<object data='//evil'>", "<math><mtext><table><mglyph><style><img src=x onerror=alert(1)>", "<b id='x' class='y'>",
        "<base href='//evil'>", "<video src='//evil'>", "<textarea><script>alert(1)</script>",
    ],
)  # fmt: skip
def test_html_is_harmless(html):
    """Of HTML, plain tags without any attribute are kept: no script, no address, no style, no picture."""
    kept = shown("text/html", html)
    tags = [part.partition(">")[0].strip("/ ").lower() for part in (kept or "").split("<")[1:]]
    assert all(tag.isalnum() for tag in tags), kept  # no attributes at all
    assert not {
        "script",
        "img",
        "iframe",
        "a",
        "style",
        "svg",
        "form",
        "link",
        "meta",
        "object",
        "base",
        "video",
    } & set(tags)


def test_a_table_stays_a_table():
    """The HTML of a table of numbers, as pandas or SymPy would show it, keeps its structure and its text."""
    table = "<table><thead><tr><th>x</th></tr></thead><tbody><tr><td>1 &lt; 2</td></tr></tbody></table>"
    assert shown("text/html", table) == table


@pytest.mark.parametrize(
    ("mime", "value", "kept"),
    [
        ("text/plain", "3.5", True),
        ("text/latex", r"$\frac{1}{2}$", True),
        ("text/latex", r"\href{javascript:alert(1)}{x}", False),
        ("text/latex", r"$x</script><script>$", False),
        ("text/latex", r"\require{html}", False),
        ("text/latex", r"\style{position:fixed}{x}", False),
        ("image/png", PNG, True),
        ("image/jpeg", JPEG, True),
        ("image/png", JPEG, False),
        ("image/png", PNG + '"onload="x', False),
        ("image/png", "<svg>", False),
        ("image/svg+xml", "<svg onload='x'/>", False),
        ("application/javascript", "alert(1)", False),
        ("text/markdown", "[x](javascript:alert(1))", False),
        ("application/vnd.jupyter.widget-view+json", {"model_id": "1"}, False),
        ("text/plain", "x" * 4_000_001, False),
        ("text/plain", 3, False),
    ],
    ids=lambda value: str(value)[:30],
)
def test_kinds_of_data(mime, value, kept):
    """Text, mathematics without commands that reach out, and true pictures are kept; nothing that runs."""
    assert shown(mime, value) == (value if kept else None)


def test_text_is_writable_and_metadata_is_dropped():
    """Lone surrogates and control characters go, colours of tracebacks too, and metadata is not kept."""
    stream, failure, display = clean(
        [
            {"output_type": "stream", "name": "stdout", "text": "a\ud800\x00\x07b\n\t"},
            {"output_type": "error", "ename": "E", "evalue": "v", "traceback": ["\x1b[31mred\x1b[0m", 5]},
            {"output_type": "display_data", "data": {"text/plain": "x"}, "metadata": {"evil": 1}},
        ]
    )
    assert stream.text == "a?b\n\t"
    assert failure.traceback == ["red", ""]
    assert display.metadata == {}
    assert is_valid([stream, failure, display])


def test_unknown_outputs_are_dropped():
    """An output of another kind, or a stream of another name, is not kept."""
    assert clean([{"output_type": "update_display_data", "data": {"text/plain": "x"}}, 5, None]) == []
    assert clean([{"output_type": "stream", "name": "stdlog", "text": "x"}]) == []
    assert clean("x") == clean(None) == clean({}) == []


def test_error():
    """An error output of the grader's own is valid and shows class and text."""
    made = error("ProcessDied", "it ended its own process")
    assert (made.ename, made.evalue) == ("ProcessDied", "it ended its own process")
    assert is_valid([made])


def test_markup_that_takes_long_to_clean_is_left_out():
    """To clean nested tags takes the square of their number: of very many, the text beside them is kept alone."""
    many = "<b>" * (MAX_TAGS + 1)
    data = {"text/html": many, "text/plain": "x"}
    (kept,) = clean([{"output_type": "display_data", "data": data}])
    assert kept.data == {"text/plain": "x"}
    assert weight([{"data": data}]) > TAG * MAX_TAGS


@pytest.mark.parametrize(
    "html", [r"$\href{javascript:f()}{x}$", r"$\<i></i>href{x}$", r"$&#92;require{HTML}$"]
)
def test_formulas_in_markup_do_not_reach_out(html):
    """A page's formulas are read after its markup: commands that reach out lose their backslash, however it is written."""
    assert not re.search(r"\\(href|require)", unescape(shown("text/html", f"<p>{html}</p>")))


def test_outputs_of_a_notebook_are_bounded_together(execute):
    """What comes after the bound is not kept, and says so; tests are not touched."""
    show = "from IPython.display import HTML, display\nfor _ in range(10): display(HTML('x' * 2_000_000))"
    run = execute(("plain", show), ("plain", show), ("plain", "print('after')"), ("test", "assert True"))
    assert [len(cell.outputs) for cell in run.cells] == [10, 1, 1, 0]
    assert [cell.outputs[0].get("ename") for cell in run.cells[1:3]] == ["OutputError"] * 2
    assert run.scores == [2]
