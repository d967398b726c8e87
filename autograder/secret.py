"""The course's secret, and the hidden inputs that follow from it.

All hidden inputs of a course come from one secret: the same for every student, the same when a notebook is
graded again, different from every other course's. It is the environment variable ``ROBOLOC_SECRET`` or,
without one, the file ``.roboloc-secret`` in the course's root, which is made when it is first needed and
never committed.
"""

from __future__ import annotations

import hashlib
import os
import secrets
import tempfile
from pathlib import Path

import numpy as np

VARIABLE = "ROBOLOC_SECRET"
FILE = ".roboloc-secret"
_MARK = "nbgrader_config.py"


def course_root(start: Path | None = None) -> Path:
    """Find the course's root: the nearest folder at or above `start` that holds ``nbgrader_config.py``.

    Without one, the folder this package was cloned into if it is a course, else `start` itself.

    Parameters
    ----------
    start : Path, optional
        Where to begin; the working directory if not given.

    Returns
    -------
    Path
        An absolute folder.
    """
    start = (start or Path.cwd()).resolve()
    home = Path(__file__).resolve().parents[1]
    return next((folder for folder in (start, *start.parents, home) if (folder / _MARK).is_file()), start)


def course_secret(root: Path | None = None) -> str:
    """Return the course's secret, making it if there is none.

    Parameters
    ----------
    root : Path, optional
        The course's root; found from the working directory if not given.

    Returns
    -------
    str
        The secret; never empty.

    Raises
    ------
    ValueError
        If the file is there and empty.
    """
    if given := os.environ.get(VARIABLE, "").strip():
        return given
    path = (root or course_root()) / FILE
    if not path.exists():
        _make(path)
    secret = path.read_text(encoding="utf-8").strip()
    if not secret:
        raise ValueError(
            f"{FILE}: expected one line of text, got an empty file; delete it to have a new one made"
        )
    return secret


def _make(path: Path) -> None:
    """Write a new secret in one step, so that of two processes at the same time both read the same one."""
    handle, name = tempfile.mkstemp(prefix=FILE, dir=path.parent)  # readable by its owner alone
    draft = Path(name)
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            file.write(secrets.token_hex(32) + "\n")
        path.hardlink_to(draft)
    except FileExistsError:
        pass  # another process was first: its secret is the course's
    finally:
        draft.unlink()


def generator(secret: str, *names: str) -> np.random.Generator:
    """Return the random generator that belongs to a secret and a list of names.

    Parameters
    ----------
    secret : str
        The course's secret.
    *names : str
        What the numbers are for: a stage, a check.

    Returns
    -------
    numpy.random.Generator
        Seeded by the SHA-256 of all of them.

    Examples
    --------
    >>> same = generator("s", "stage", "check").random() == generator("s", "stage", "check").random()
    >>> same, generator("s", "stage", "check").random() == generator("t", "stage", "check").random()
    (True, False)
    """
    text = "".join(f"{len(part)}:{part}" for part in (secret, *names))  # ("ab", "c") is not ("a", "bc")
    return np.random.default_rng(int.from_bytes(hashlib.sha256(text.encode()).digest(), "big"))
