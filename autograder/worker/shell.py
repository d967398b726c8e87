"""A notebook shell without a kernel: runs one cell and returns what a notebook would show under it."""

from __future__ import annotations

import contextlib
import io
import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

from IPython.core.displayhook import DisplayHook
from IPython.core.displaypub import DisplayPublisher
from IPython.core.interactiveshell import InteractiveShell
from traitlets import Type
from traitlets.config import Config

if TYPE_CHECKING:
    from collections.abc import Iterator

MAX_TEXT = 200_000  # characters of one cell's printed output
MAX_OUTPUTS = 200  # pictures, tables and printed stretches of one cell
MAX_MEDIA = 4_000_000  # characters of one output's data
TRUNCATED = "\n[output truncated]\n"


class Recorder:
    """Collects the outputs of a cell in the notebook format, within limits."""

    def __init__(self) -> None:
        self.outputs: list[dict[str, Any]] = []
        self._text = 0

    def stream(self, name: str, text: str) -> None:
        """Add printed text; neighbours of one stream are joined."""
        if self._text > MAX_TEXT or not text:
            return
        self._text += len(text)
        if self._text > MAX_TEXT:
            text = text[: MAX_TEXT - self._text] + TRUNCATED
        last = self.outputs[-1] if self.outputs else {}
        if last.get("output_type") == "stream" and last["name"] == name:
            last["text"].append(text)
        else:
            self._add({"output_type": "stream", "name": name, "text": [text]})

    def data(self, kind: str, data: dict, metadata: dict, **more: Any) -> None:
        """Add a display or a result."""
        small = {mime: value for mime, value in data.items() if len(str(value)) <= MAX_MEDIA}
        self._add({"output_type": kind, "data": small, "metadata": metadata or {}, **more})

    def error(self, ename: str, evalue: str, traceback: list[str]) -> None:
        """Add an exception. It is never dropped: a cell that failed must show it."""
        shown = [line[:MAX_TEXT] for line in traceback[-50:]]
        self.outputs.append(
            {"output_type": "error", "ename": ename, "evalue": evalue[:MAX_TEXT], "traceback": shown}
        )

    def _add(self, output: dict[str, Any]) -> None:
        if len(self.outputs) < MAX_OUTPUTS:
            self.outputs.append(output)

    def finish(self) -> list[dict[str, Any]]:
        """Return the outputs and start anew."""
        outputs, self.outputs, self._text = self.outputs, [], 0
        for output in outputs:
            if output["output_type"] == "stream":
                output["text"] = "".join(output["text"])
        return outputs


class _Stream(io.TextIOBase):
    """A `sys.stdout` or `sys.stderr` that writes to the recorder."""

    encoding = "utf-8"

    def __init__(self, recorder: Recorder, name: str) -> None:
        self._recorder, self._name = recorder, name

    def writable(self) -> bool:
        return True

    def write(self, text: str) -> int:
        if not isinstance(text, str):
            raise TypeError(f"write() argument must be str, not {type(text).__name__}")
        self._recorder.stream(self._name, text)
        return len(text)


class _Publisher(DisplayPublisher):
    recorder: Recorder

    def publish(self, data: dict, metadata: dict | None = None, **_: Any) -> None:
        self.recorder.data("display_data", data, metadata or {})

    def clear_output(self, wait: bool = False) -> None:  # noqa: ARG002
        self.recorder.finish()


class _Hook(DisplayHook):
    recorder: Recorder

    def write_output_prompt(self) -> None:
        pass

    def write_format_data(self, format_dict: dict, md_dict: dict | None = None) -> None:
        self.recorder.data("execute_result", format_dict, md_dict or {}, execution_count=None)

    def finish_displayhook(self) -> None:
        pass


class NotebookShell(InteractiveShell):
    """IPython as a notebook kernel presents it, in this process."""

    failure: BaseException | None = None  # what ended the last cell
    displayhook_class = Type(_Hook)
    display_pub_class = Type(_Publisher)

    def enable_gui(self, gui: str | None = None) -> None:
        """Accept any `%matplotlib` back end: figures are shown inline."""

    def _showtraceback(self, etype: type, evalue: BaseException, stb: list[str]) -> None:
        try:
            text = str(evalue)
        except Exception:  # noqa: BLE001  (a submission's __str__ may raise anything)
            text = "<no text>"
        self.recorder.error(etype.__name__, text, list(stb))

    def ask_exit(self) -> None:
        """Ignore `exit()` and `quit()`: a notebook goes on with its next cell."""

    def system(self, cmd: str) -> None:
        """Run a shell command and show what it prints; without a terminal, which would take a session of its own."""
        import subprocess  # noqa: PLC0415

        command = self.var_expand(cmd, depth=1)
        done = subprocess.run(  # noqa: S602  (the submission's own, where it runs)
            command,
            shell=True,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            check=False,
        )
        sys.stdout.write(done.stdout.decode("utf-8", "replace"))
        self.user_ns["_exit_code"] = done.returncode


def make_shell(name: str = "__main__") -> NotebookShell:
    """Return a shell with an empty namespace; one per process.

    Parameters
    ----------
    name : str, optional
        `__name__` of the code it runs.

    Returns
    -------
    NotebookShell
        Its `recorder` collects outputs.
    """
    config = Config()
    config.HistoryManager.enabled = False
    config.InteractiveShell.colors = "nocolor"
    config.InteractiveShell.xmode = "Context"
    config.InteractiveShell.enable_html_pager = False
    config.InteractiveShell.autocall = 0
    module = ModuleType(name)
    shell = NotebookShell.instance(config=config, user_module=module)
    shell.recorder = Recorder()
    shell.displayhook.recorder = shell.recorder
    shell.display_pub.recorder = shell.recorder
    return shell


def fresh_namespace(shell: NotebookShell, name: str) -> dict[str, Any]:
    """Give the shell an empty namespace and return it."""
    module = ModuleType(name)
    shell.user_module = module
    shell.user_ns = module.__dict__
    shell.init_user_ns()
    return shell.user_ns


@contextlib.contextmanager
def recording(shell: NotebookShell) -> Iterator[Recorder]:
    """Send what is printed to the shell's recorder."""
    before = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = _Stream(shell.recorder, "stdout"), _Stream(shell.recorder, "stderr")
    try:
        yield shell.recorder
    finally:
        sys.stdout, sys.stderr = before


def run_cell(shell: NotebookShell, source: str) -> tuple[list[dict[str, Any]], bool]:
    """Run one cell.

    Parameters
    ----------
    shell : NotebookShell
        From :func:`make_shell`.
    source : str
        Python with IPython's magics.

    Returns
    -------
    outputs : list of dict
        In the notebook format, plain data.
    succeeded : bool
        Whether it ended without an exception.
    """
    with recording(shell) as recorder:
        try:
            result = shell.run_cell(source, store_history=True)
            succeeded = bool(result.success)
            shell.failure = result.error_before_exec or result.error_in_exec
        except BaseException as error:  # noqa: BLE001  (KeyboardInterrupt and SystemExit pass IPython's own net)
            shell.failure = error
            recorder.error(type(error).__name__, str(error), [f"{type(error).__name__}: {error}"])
            succeeded = False
    return recorder.finish(), succeeded
