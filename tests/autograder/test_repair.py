"""Whatever was handed in becomes a valid notebook with every graded cell of the release exactly once."""

# ruff: noqa: E501, PT018  (docstrings; names are found, and all of them)

from __future__ import annotations

import json

import nbformat
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook

from autograder.repair import MAX_BYTES, NOTICE, Released, read_submission, repair


def released(
    name, source, *, locked=False, grade=False, solution=False, cell_type="code", points=0.0, task=False
):
    """Return a cell of a release."""
    return Released(name, cell_type, source, f"sum-{name}", locked, grade, solution, task, points)


RELEASE = [
    released("given", "import numpy as np", locked=True),
    released("answer", "def f(x): ...", solution=True),
    released("test", "assert f(3) == 9", locked=True, grade=True, points=2.0),
    released("essay", "Your answer", grade=True, solution=True, cell_type="markdown", points=3.0),
    released("test-2", "assert f(4) == 16", locked=True, grade=True, points=1.0),
]
GRADED = ["test", "essay", "test-2"]


def names(notebook):
    """Return the grade ids of a notebook in order."""
    found = [cell.metadata.get("nbgrader", {}).get("grade_id") for cell in notebook.cells]
    return [name for name in found if name]


def cell(name, source, kind="code", **info):
    """Return a submitted cell."""
    make = {"code": new_code_cell, "markdown": new_markdown_cell}[kind]
    return make(source, metadata={"nbgrader": {"grade_id": name, **info}} if name else {})


def submitted():
    """Return the cells of a proper submission."""
    return [
        cell("given", "import numpy as np"),
        cell(None, "print(1)"),
        cell("answer", "def f(x): return x * x"),
        cell("test", "assert f(3) == 9"),
        cell("essay", "Because.", "markdown"),
        cell("test-2", "assert f(4) == 16"),
    ]


def check(notebook):
    """Hold what every repaired notebook must be, and return it."""
    nbformat.validate(notebook)
    nbformat.writes(notebook).encode()
    found = names(notebook)
    assert len(found) == len(set(found))
    assert [name for name in found if name in GRADED] and set(GRADED) <= set(found)
    by_name = {c.metadata.nbgrader.grade_id: c for c in notebook.cells if "nbgrader" in c.metadata}
    for known in RELEASE:
        if known.name in by_name:
            mended = by_name[known.name]
            assert dict(mended.metadata.nbgrader) == known.metadata()
            assert mended.cell_type == known.cell_type
            if known.locked:
                assert mended.source == known.source
    assert len({c.id for c in notebook.cells}) == len(notebook.cells)
    return notebook


def test_a_proper_submission_keeps_its_sources_and_order():
    """A submission without faults comes through with its cells, its order and no notice."""
    notebook = check(repair(new_notebook(cells=submitted()), RELEASE))
    assert [c.source for c in notebook.cells] == [c.source for c in submitted()]
    assert NOTICE not in notebook.metadata


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=5), inner, max_size=4),
    max_leaves=8,
)
GRADE_IDS = st.sampled_from([known.name for known in RELEASE] + ["other", ""]) | JSON
METADATA = JSON | st.fixed_dictionaries(
    {
        "nbgrader": JSON
        | st.fixed_dictionaries({"grade_id": GRADE_IDS}, optional={"points": JSON, "grade": JSON})
    }
)
CELLS = JSON | st.fixed_dictionaries(
    {},
    optional={
        "cell_type": st.sampled_from(["code", "markdown", "raw", "x"]) | JSON,
        "source": st.text(max_size=9) | st.lists(st.text(max_size=4), max_size=3) | JSON,
        "metadata": METADATA,
        "outputs": JSON,
        "id": JSON,
        "attachments": JSON,
    },
)
NOTEBOOKS = st.fixed_dictionaries(
    {"cells": st.lists(CELLS, max_size=8) | JSON},
    optional={"metadata": JSON, "nbformat": JSON, "nbformat_minor": JSON},
)


@settings(max_examples=80, deadline=None, derandomize=True)
@given(NOTEBOOKS | JSON)
def test_any_json_becomes_a_valid_notebook(tmp_path_factory, raw):
    """Any JSON at all, read and repaired, gives a valid notebook with every graded cell once."""
    path = tmp_path_factory.getbasetemp() / "any.ipynb"
    path.write_text(json.dumps(raw), encoding="utf-8")
    notebook, reason = read_submission(path)
    assert (notebook is None) == bool(reason)
    check(repair(notebook, RELEASE, reason))


@settings(max_examples=40, deadline=None, derandomize=True)
@given(st.binary(max_size=40))
def test_any_bytes_become_a_valid_notebook(tmp_path_factory, content):
    """Any file at all, read and repaired, gives a valid notebook with every graded cell once."""
    path = tmp_path_factory.getbasetemp() / "bytes.ipynb"
    path.write_bytes(content)
    notebook, reason = read_submission(path)
    check(repair(notebook, RELEASE, reason))


def test_duplicated_test_cell():
    """Of a test cell that was copied the last counts, and the copies no longer run as tests."""
    cells = submitted()
    cells.insert(0, cell("test", "assert True"))
    notebook = check(repair(new_notebook(cells=cells), RELEASE))
    assert notebook.cells[0].source == ""
    assert "more than once" in notebook.metadata[NOTICE][0]


def test_duplicated_answer_cell():
    """Of an answer cell that was copied the last has the name, and the other stays as the student's own code."""
    cells = submitted()
    cells.insert(1, cell("answer", "helper = 1"))
    notebook = check(repair(new_notebook(cells=cells), RELEASE))
    sources = [c.source for c in notebook.cells]
    assert "helper = 1" in sources
    assert "def f(x): return x * x" in sources


@pytest.mark.parametrize("gone", [[2], [3], [4], [5], [3, 5], [0], [0, 2, 3, 4, 5], list(range(6))])
def test_deleted_cells_come_back_in_their_place(gone):
    """Deleted locked and graded cells are put back after the one they followed; nothing overwrites the student's code."""
    cells = [c for i, c in enumerate(submitted()) if i not in gone]
    notebook = check(repair(new_notebook(cells=cells), RELEASE))
    found = names(notebook)
    assert [n for n in found if n != "answer"] == [k.name for k in RELEASE if k.name != "answer"]
    assert ("answer" in found) == (2 not in gone)
    assert all(c.source in [n.source for n in notebook.cells] for c in cells)


def test_renamed_cell():
    """A test cell under another name is taken as the student's own, and the true one is put back."""
    cells = submitted()
    cells[3] = cell("tset", "assert f(3) == 9", points=100, grade=True, locked=True)
    notebook = check(repair(new_notebook(cells=cells), RELEASE))
    assert "tset" not in names(notebook)
    assert any("unknown name" in notice for notice in notebook.metadata[NOTICE])


def test_changed_metadata_points_and_source_of_a_test():
    """Points, locks and checksums are the gradebook's, whatever the file says, and a test's source is the release's."""
    cells = submitted()
    cells[3] = cell(
        "test", "pass", points=100, grade=False, locked=False, solution=True, checksum="x", task=True
    )
    check(repair(new_notebook(cells=cells), RELEASE))


def test_retyped_cells():
    """A test turned into text is a test again; text turned into code is text with what was written."""
    cells = submitted()
    cells[3] = cell("test", "assert f(3) == 9", "markdown")
    cells[4] = cell("essay", "Because.", "code")
    notebook = check(repair(new_notebook(cells=cells), RELEASE))
    assert [
        c.source for c in notebook.cells if c.metadata.get("nbgrader", {}).get("grade_id") == "essay"
    ] == ["Because."]


def test_outputs_and_foreign_metadata_are_dropped():
    """Outputs, attachments, tags and any metadata but the grade id are not taken over."""
    notebook = new_notebook(cells=submitted())
    notebook.cells[1]["outputs"] = [{"output_type": "x"}]
    notebook.cells[1]["metadata"] = {"tags": ["parameters"], "nbgrader": 5, "deep": [[[]]]}
    notebook.metadata["kernelspec"] = {"name": "evil", "display_name": "x"}
    repaired = check(repair(notebook, RELEASE))
    assert repaired.cells[1].outputs == []
    assert repaired.cells[1].metadata == {}
    assert repaired.metadata.kernelspec.name == "python3"


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "not JSON from line 1"), (b"not json {", "not JSON"), (b"\xff\xfe\x00", "cannot be read"),
        (b"[1, 2]", "no list of cells"), (b"{}", "no list of cells"), (b'{"cells": 5}', "no list of cells"),
        (b"[" * 100_000 + b"]" * 100_000, "nested too deeply"), (b'{"cells": ' + b"[" * 100_000, "nested"),
        (b'{"nbformat": 3, "worksheets": 7}', "not a notebook"), (b"null", "no list"), (b'{"cells": [', "not JSON"),
    ],
    ids=["empty", "text", "bytes", "list", "no cells", "cells", "deep", "deep cells", "old", "null", "cut"],
)  # fmt: skip
def test_unreadable_files(tmp_path, content, reason):
    """A file that is no notebook becomes the release with the reason on top, so that every cell is graded 0."""
    path = tmp_path / "n.ipynb"
    path.write_bytes(content)
    notebook, said = read_submission(path)
    assert notebook is None
    assert reason in said
    repaired = check(repair(notebook, RELEASE, said))
    assert names(repaired) == [known.name for known in RELEASE]
    assert said in repaired.cells[0].source
    assert repaired.metadata[NOTICE] == [said]


def test_no_file_and_a_huge_one(tmp_path):
    """A missing file and one above the bound say so without being read."""
    assert "no file n.ipynb" in read_submission(tmp_path / "n.ipynb")[1]
    path = tmp_path / "huge.ipynb"
    with path.open("wb") as file:
        file.truncate(MAX_BYTES + 1)
    assert "larger than" in read_submission(path)[1]


def test_an_old_notebook_is_brought_up_to_date(tmp_path):
    """A notebook of format 3 keeps its code."""
    path = tmp_path / "old.ipynb"
    path.write_text(
        json.dumps({
            "nbformat": 3, "nbformat_minor": 0, "metadata": {},
            "worksheets": [{"metadata": {}, "cells": [
                {"cell_type": "code", "language": "python", "input": ["x = 1"], "outputs": [], "metadata": {},
                 "collapsed": False},
            ]}],
        })
    )  # fmt: skip
    notebook, reason = read_submission(path)
    assert reason == ""
    assert "x = 1" in [c.source for c in check(repair(notebook, RELEASE)).cells]


def test_a_photo_in_an_answer_stays():
    """A picture that was pasted into a written answer is there for the person who marks it; other files are not."""
    answer = {
        "cell_type": "markdown",
        "source": "![](a.png)",
        "metadata": {"nbgrader": {"grade_id": "answer"}},
    }
    answer["attachments"] = {
        "a.png": {"image/png": ["iVBO", "Rw0K"]},
        "b.svg": {"image/svg+xml": "<svg/>"},
        "c": 3,
    }
    released = Released("answer", "markdown", "Your answer", "", False, True, True, False, 1.0)
    (cell,) = repair({"cells": [answer]}, [released]).cells
    assert cell.attachments == {"a.png": {"image/png": "iVBORw0K"}}


def test_put_back_after_code_that_stands_for_a_deleted_answer():
    """Where answer and test were deleted and the answer written into a cell of one's own, the test comes after it."""
    cells = submitted()
    cells[2:4] = [cell(None, "def f(x): return x * x")]
    notebook = check(repair(new_notebook(cells=cells), RELEASE))
    sources = [c.source for c in notebook.cells]
    assert sources.index("assert f(3) == 9") > sources.index("def f(x): return x * x")
    assert names(notebook) == ["given", "test", "essay", "test-2"]


def test_pictures_of_the_instructors_stay():
    """The gradebook has no attachments: those of a locked cell are the ones that came back with it."""
    locked = {"cell_type": "markdown", "source": "x", "metadata": {"nbgrader": {"grade_id": "look"}}}
    locked["attachments"] = {"map.png": {"image/png": "iVBORw0K"}}
    released = Released("look", "markdown", "![](attachment:map.png)", "", True, False, False, False, 0.0)
    (mended,) = repair({"cells": [locked]}, [released]).cells
    assert mended.source == released.source
    assert mended.attachments == locked["attachments"]


def test_a_mark_of_the_byte_order_is_no_fault(tmp_path):
    """Some editors put one at the beginning of a file."""
    path = tmp_path / "x.ipynb"
    path.write_text('{"cells": [], "nbformat": 4}', encoding="utf-8-sig")
    assert read_submission(path)[1] == ""
