"""A line on a terminal that says how far a class is."""

from __future__ import annotations

import sys
import time


class Progress:
    """A line on a terminal that says how far the class is; nothing where there is no terminal.

    Parameters
    ----------
    total : int
        Submissions to grade.
    shown : bool
        Whether to show it.
    """

    def __init__(self, total: int, *, shown: bool) -> None:
        self.total, self.done, self.shown, self.began = total, 0, shown, time.monotonic()

    def step(self, name: str) -> None:
        """One submission more is done."""
        self.done += 1
        if self.shown:
            seconds = time.monotonic() - self.began
            filled = 30 * self.done // max(self.total, 1)
            left = seconds / self.done * (self.total - self.done)
            bar = "#" * filled + "." * (30 - filled)
            end = "\n" if self.done == self.total else ""
            sys.stderr.write(
                f"\r[{bar}] {self.done}/{self.total}  {seconds:.0f} s, {left:.0f} s left  {name[:24]:24}{end}"
            )
            sys.stderr.flush()
