"""The line that says how far a class is."""

import time

import pytest

from autograder.progress import Progress


@pytest.fixture
def clock(monkeypatch):
    """Have a clock that is moved by hand."""
    now = [100.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    return now


def test_it_says_how_many_how_long_and_whose(clock, capsys):
    """It has the count, the time so far, the time left at this pace, and what the last one took."""
    progress = Progress(4, shown=True)
    clock[0] += 10.0
    progress.step("ada", 1.25)
    assert (
        capsys.readouterr().err.rstrip()
        == "\r[#######.......................] 1/4  10 s, 30 s left  ada: 1.2 s"
    )
    clock[0] += 2.0
    progress.step("bob")
    assert capsys.readouterr().err.rstrip(" ").endswith(" 2/4  12 s, 12 s left  bob")
    progress.step("eve", 0.0)
    progress.step("a-name-that-is-longer-than-its-place", 61.0)
    last = capsys.readouterr().err.split("\r")[-1]
    assert last == f"[{'#' * 30}] 4/4  12 s, 0 s left  a-name-that-is-longer-th: 61.0 s \n"


def test_a_line_covers_the_one_before(clock, capsys):
    """No line is shorter than the one that it replaces, so that nothing of a name stays."""
    progress = Progress(2, shown=True)
    progress.step("a-name-that-is-longer-than-its-place", 61.0)
    progress.step("x")
    first, second = capsys.readouterr().err.split("\r")[1:]
    assert len(second.rstrip("\n")) >= len(first)


def test_where_there_is_no_terminal_nothing_is_said(clock, capsys):
    """Without a terminal it counts and is silent."""
    progress = Progress(2, shown=False)
    progress.step("ada", 1.0)
    assert progress.done == 1
    assert capsys.readouterr() == ("", "")
