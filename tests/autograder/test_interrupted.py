"""Ctrl-C ends a run also where Python loses it, and what is no fault of a submission ends it with a line."""

import errno
import os
import signal
import threading
from pathlib import Path

import pytest

from autograder.interrupted import hearing_ctrl_c, of_the_machine


@pytest.fixture(autouse=True)
def pythons_own():
    """Give the handler that a command has."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


class Finalizer:
    """Is told to stop while it is taken away: Python prints that and goes on."""

    def __del__(self):
        """Be told."""
        os.kill(os.getpid(), signal.SIGINT)
        for _ in range(100):
            pass


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_lost_ctrl_c_is_heard_at_the_next_look():
    """A Ctrl-C in a finalizer is lost to Python's own handler and not to ours."""
    with hearing_ctrl_c() as check:
        check()
        Finalizer()
        with pytest.raises(KeyboardInterrupt):
            check()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_ctrl_c_comes_at_once_where_nothing_loses_it():
    """Otherwise it is what it is everywhere."""
    with pytest.raises(KeyboardInterrupt), hearing_ctrl_c():
        signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_another_handler_and_another_thread_keep_theirs():
    """A program around the grader, a server for instance, keeps its own way with Ctrl-C."""

    def own(*_):
        """Do nothing."""

    signal.signal(signal.SIGINT, own)
    with hearing_ctrl_c() as check:
        assert signal.getsignal(signal.SIGINT) is own
        check()
    signal.signal(signal.SIGINT, signal.default_int_handler)
    seen = []

    def elsewhere():
        with hearing_ctrl_c():
            seen.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=elsewhere)
    thread.start()
    thread.join()
    assert seen == [signal.default_int_handler]


@pytest.mark.parametrize(
    ("path", "machine"), [("autograded", True), ("autograded/ada/hw/x", True), ("submitted/ada/hw/x", False)]
)
def test_a_folder_that_the_grader_may_not_write_is_of_the_machine(path, machine):
    """Then every submission fails alike, and the run ends with one line; a file that is not to be read is one's own."""
    error = PermissionError(errno.EACCES, "Permission denied", path)
    text = of_the_machine(error, Path("autograded", "ada", "hw"), "")
    assert text == (f"{path} cannot be written: Permission denied" if machine else "")
