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

    def step(self, name: str, used: float | None = None) -> None:
        """Say that one submission more is done.

        Parameters
        ----------
        name : str
            Whose.
        used : float, optional
            Processor time that it took [s]; None where it was not executed.
        """
        self.done += 1
        if self.shown:
            seconds = time.monotonic() - self.began
            filled = 30 * self.done // max(self.total, 1)
            left = seconds / self.done * (self.total - self.done)
            bar = "#" * filled + "." * (30 - filled)
            end = "\n" if self.done == self.total else ""
            last = name[:24] if used is None else f"{name[:24]}: {used:.1f} s"
            sys.stderr.write(
                f"\r[{bar}] {self.done}/{self.total}  {seconds:.0f} s, {left:.0f} s left  {last:33}{end}"
            )
            sys.stderr.flush()
