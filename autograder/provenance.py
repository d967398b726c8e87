"""Which versions a grade comes from: of what decides on it, and of the packages it was computed with.

The version of the checks of a stage is a hash of every file that has a part in its score: the checks and the wrong
versions of the stage, what these import of ours, the reference among it, and the tools that all checks share. A change
elsewhere leaves it as it is, so that it tells what has to be graded again.
"""

from __future__ import annotations

import ast
import functools
import hashlib
import re
import sys
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

_TOOLS = (
    "check", "compare", "diagnose", "grading", "lengths", "loops", "observe", "reading", "report", "secret", "symbolic",
    "vectorised", "checks.kinds",
)  # fmt: skip
_OURS = ("autograder.checks", "autograder.misconceptions", "roboloc", "roboloc_reference")
_NAMED = re.compile(r"""\bgrade(?:_expression|_vectorised)?\(\s*["']([\w.]+)["']""")


def stages_in(sources: Iterable[str]) -> tuple[str, ...]:
    """Return the stages and symbolic answers that test cells grade.

    Parameters
    ----------
    sources : iterable of str
        Of test cells.

    Returns
    -------
    tuple of str
        Their names, each once.

    Examples
    --------
    >>> stages_in(['grade("motion.compute_dynamics", compute_dynamics, points=10)', "assert f(2) == 4"])
    ('motion.compute_dynamics',)
    """
    return tuple(sorted({name for source in sources for name in _NAMED.findall(source)}))


def checks_version(*stages: str) -> str:
    """Return a short hash of all that decides on the score of some stages, and on what is said about it.

    Parameters
    ----------
    *stages : str
        Names of stages or symbolic answers; of all that there are, if none is given.

    Returns
    -------
    str
        Twelve hexadecimal digits.
    """
    from autograder.checks import SUBJECTS  # noqa: PLC0415  (a test cell of another course needs no check of ours)

    return _version(tuple(sorted(set(stages) or SUBJECTS)))


@functools.cache
def _version(stages: tuple[str, ...]) -> str:
    names = set().union(*(_behind(stage) for stage in stages)) | {f"autograder.{tool}" for tool in _TOOLS}
    digest = hashlib.sha256()
    for name in sorted(names):
        digest.update(name.encode() + b"\0" + _file(name).read_bytes() + b"\0")
    return digest.hexdigest()[:12]


@functools.cache
def _behind(stage: str) -> frozenset[str]:
    """Return our modules that decide on a stage; none for a name that is no stage of ours."""
    from autograder.checks import SUBJECTS  # noqa: PLC0415
    from autograder.misconceptions import of_stage  # noqa: PLC0415

    if stage not in SUBJECTS:
        return frozenset()
    listing = (
        name
        for name, module in sys.modules.items()
        if name.startswith("autograder.misconceptions.")
        and any(item.stage == stage for item in getattr(module, "MISCONCEPTIONS", ()))
    )
    found = {f"autograder.checks.{SUBJECTS[stage]}", *listing}
    todo = [*found, *(item.function.__module__ for item in of_stage(stage))]
    found.clear()
    while todo:
        name = todo.pop()
        if name not in found:
            found.add(name)
            todo.extend(_imports(name))
    return frozenset(found)


@functools.cache
def _imports(name: str) -> frozenset[str]:
    """Return the modules of ours that a module imports by name."""
    found = set()
    for node in ast.walk(ast.parse(_file(name).read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:  # of a package its own name is the base, of a module the name of its package
                package = name if _file(name).name == "__init__.py" else name.rpartition(".")[0]
                base = ".".join(
                    [*package.split(".")[: len(package.split(".")) - node.level + 1], *filter(None, [base])]
                )
            found.update((base, *(f"{base}.{alias.name}" for alias in node.names)))
    return frozenset(one for one in found if one.startswith(_OURS) and _is_module(one))


def _is_module(name: str) -> bool:
    try:
        spec = find_spec(name)
    except ModuleNotFoundError:  # a name in a module
        return False
    return spec is not None and spec.origin is not None


@functools.cache
def _file(name: str) -> Path:
    return Path(find_spec(name).origin)


@functools.cache
def environment_version() -> str:
    """Return the versions of the packages that a numerical result depends on."""
    found = []
    for package in ("roboloc", "numpy", "scipy", "sympy"):
        try:
            found.append(f"{package} {version(package)}")
        except PackageNotFoundError:
            found.append(f"{package} unknown")
    return ", ".join(found)


@functools.cache
def installation(packages: tuple[str, ...]) -> dict[str, str]:
    """Return what two machines must have in common to grade alike.

    Parameters
    ----------
    packages : tuple of str
        Distributions that submissions may import.

    Returns
    -------
    dict of str to str
        ``Python``, ``roboloc`` (a hash of all our code and data), and the version of each distribution with what it
        requires; of one that is not installed, ``none``.
    """
    from .sandbox import closure  # noqa: PLC0415

    digest = hashlib.sha256()
    for package in ("autograder", "roboloc", "roboloc_reference"):
        folder = _file(package).parent
        for path in sorted(path for path in folder.rglob("*.*") if path.suffix in {".py", ".npz", ".txt"}):
            name = f"{package}/{path.relative_to(folder).as_posix()}"
            digest.update(name.encode() + b"\0" + path.read_bytes())
    ours = {"Python": "{}.{}".format(*sys.version_info), "roboloc": digest.hexdigest()[:12]}
    found = {one.name: one.version for one in closure(packages)}
    return dict.fromkeys(packages, "none") | found | ours


def record(release: Mapping[str, str]) -> dict[str, str]:
    """Return what a notebook is graded with now: versions of the release, the checks and the packages.

    Parameters
    ----------
    release : mapping of str to str
        Released source by grade id, hidden tests included.

    Returns
    -------
    dict of str to str
        ``release``, ``checks``, ``environment``.
    """
    text = "\0".join(f"{name}\0{source}" for name, source in sorted(release.items()))
    stages = stages_in(release.values())
    return {
        "release": hashlib.sha256(text.encode()).hexdigest()[:12],
        "checks": checks_version(*stages) if stages else "none of ours",
        "environment": environment_version(),
    }
