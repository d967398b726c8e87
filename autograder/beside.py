"""The instructor's files beside a notebook, for the test cells: they run elsewhere than the submission."""

from __future__ import annotations

import importlib
import sys
import tempfile
from contextlib import chdir, contextmanager
from pathlib import Path, PurePath
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from nbgrader.coursedir import CourseDirectory


def released_files(
    coursedir: CourseDirectory, assignment: str, kept: Mapping[str, list[str]]
) -> frozenset[str]:
    """Return the files that every submission of an assignment gets from its source, by relative name.

    Parameters
    ----------
    coursedir : nbgrader.coursedir.CourseDirectory
        The course.
    assignment : str
        Which assignment.
    kept : mapping of str to list of str
        What of a submission stays as it is; see `Autograde.exclude_overwriting`.
    """
    from nbgrader.utils import find_all_files  # noqa: PLC0415  (where tests run, nothing else of nbgrader is needed)

    source = coursedir.format_path(coursedir.source_directory, ".", assignment)
    files = find_all_files(source, [*coursedir.ignore, "*.ipynb"])
    return frozenset(str(PurePath(file).relative_to(source)) for file in files) - set(
        kept.get(assignment, [])
    )


def modules_of(files: frozenset[str]) -> frozenset[str]:
    """Return the modules that can be imported from files beside a notebook.

    Examples
    --------
    >>> sorted(modules_of(frozenset({"maze.csv", "helpers.py", "tools/__init__.py", "tools/draw.py"})))
    ['helpers', 'tools']
    """
    return frozenset(PurePath(file).parts[0].removesuffix(".py") for file in files if file.endswith(".py"))


@contextmanager
def beside_tests(files: Mapping[str, tuple[bytes, int]], given: frozenset[str]) -> Iterator[None]:
    """Let test cells read and import files of the instructor's as the submission does.

    Parameters
    ----------
    files : mapping of str to tuple of (bytes, int)
        The notebook's folder; see `isolated.read_folder`.
    given : frozenset of str
        Those that are there. A submission's own are not: they would be run outside the sandbox.
    """
    there = sorted(given & files.keys())
    if not there:
        yield
        return
    with tempfile.TemporaryDirectory(prefix="tests-") as folder, chdir(folder):
        for name in there:
            path = Path(folder, name)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(files[name][0])
        sys.path.append(folder)
        importlib.invalidate_caches()
        try:
            yield
        finally:
            sys.path.remove(folder)
            for name, module in list(sys.modules.items()):
                if str(getattr(module, "__file__", None)).startswith(folder):
                    del sys.modules[name]
