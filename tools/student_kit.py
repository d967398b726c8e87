"""Make what students get, in dist/: a wheel, a zip of the notebooks and a repository without history.

The kit is made from one commit (``--ref``, HEAD unless told), never from the working tree, so that nothing
an instructor tried in a notebook or left beside it can slip in, and the same commit always gives the same
bytes (``SOURCE_DATE_EPOCH``, or else the time of that commit, stands in every file). It holds
``src/roboloc``, ``notebooks`` and the licences; before anything is written every file is searched for
answers (`kit_answers`), and a kit with one is refused.
"""

import argparse
import io
import json
import os
import subprocess
import sys
import tarfile
import tempfile
import time
import tomllib
import zipfile
from pathlib import Path

import kit_answers
from autograder import secret

ROOT = Path(__file__).resolve().parents[1]

PACKAGE = "src/roboloc"
NOTEBOOKS = "notebooks"
LICENCES = ("LICENSE", "LICENSE-text")
# Where answers are: the reference, the problems with their hidden tests, hidden checks and known mistakes.
ANSWERS = ("src/roboloc_reference", "solutions", "autograder/checks", "autograder/misconceptions")
README = "tools/student_kit_readme.md"

# A zip file cannot hold an earlier time than 1 January 1980.
EARLIEST = 315532800


class KitError(Exception):
    """The kit cannot be made; the message says why."""


def read_commit(root: Path, ref: str, *paths: str) -> dict[str, bytes]:
    """Read the files at or under `paths` as they are in the commit `ref`, by path."""
    command = ["git", "-C", str(root), "-c", "core.autocrlf=false", "archive", "--format=tar", ref]
    done = subprocess.run(command, capture_output=True, check=False)
    if done.returncode:
        raise KitError(f"git archive failed: {done.stderr.decode(errors='replace').strip()}")
    with tarfile.open(fileobj=io.BytesIO(done.stdout)) as archive:
        files = {m.name: archive.extractfile(m).read() for m in archive.getmembers() if m.isfile()}
    return {name: data for name, data in files.items() if any(f"{name}/".startswith(f"{p}/") for p in paths)}


def source_date(root: Path, ref: str) -> int:
    """Return the time that stands in every file of the kit, in seconds since 1970."""
    told = os.environ.get("SOURCE_DATE_EPOCH")
    if told is None:
        command = ["git", "-C", str(root), "log", "-1", "--format=%ct", ref]
        told = subprocess.run(command, capture_output=True, check=True, text=True).stdout
    return max(int(told), EARLIEST)


def course_secrets(root: Path) -> tuple[str, ...]:
    """Return the course secrets that this checkout knows of."""
    file = root / secret.FILE
    known = [os.environ.get(secret.VARIABLE, ""), file.read_text() if file.exists() else ""]
    return tuple(word.strip() for word in known if word.strip())


# ------------------------------------------------------------------------------------------------ the kit


def student_pyproject(project: dict) -> str:
    """Return the pyproject.toml of the student package: the project's own ranges, `roboloc` alone."""
    dependencies = "\n".join(f"  {json.dumps(d)}," for d in project["dependencies"])
    return f"""\
[build-system]
requires = ["setuptools>=77"]
build-backend = "setuptools.build_meta"

[project]
name = "roboloc"
version = {json.dumps(project["version"])}
description = "The robot's world of the roboloc course-book: simulation, plots, filter shells, checks"
readme = "README.md"
requires-python = {json.dumps(project["requires-python"])}
license = {json.dumps(project["license"])}
license-files = ["LICENSE"]
dependencies = [
{dependencies}
]

[project.optional-dependencies]
lab = ["jupyterlab"]

[tool.setuptools.packages.find]
where = ["src"]

[tool.setuptools.package-data]
"*" = ["**/*"]
"""


def collect(root: Path, ref: str) -> tuple[dict[str, bytes], str]:
    """Return the files of the student repository by path, and the version; refuse any answer."""
    files = read_commit(root, ref, PACKAGE, NOTEBOOKS, *LICENCES)
    if not any(path.startswith(f"{NOTEBOOKS}/") and path.endswith(".ipynb") for path in files):
        raise KitError(f"{ref} has no released notebook in {NOTEBOOKS}/; run `make notebooks` and commit it")
    project = tomllib.loads(read_commit(root, ref, "pyproject.toml")["pyproject.toml"].decode())["project"]
    files["pyproject.toml"] = student_pyproject(project).encode()
    files["README.md"] = (ROOT / README).read_bytes()
    files[".gitignore"] = b".venv/\n__pycache__/\n*.egg-info/\n.ipynb_checkpoints/\nbuild/\ndist/\n"
    answers = kit_answers.gather(read_commit(root, ref, *ANSWERS))
    leaks = kit_answers.find_leaks(files, answers, course_secrets(root))
    if leaks:
        raise KitError("the kit would give answers away:\n  " + "\n  ".join(leaks))
    return files, project["version"]


def stage(files: dict[str, bytes], folder: Path) -> None:
    """Write `files` under `folder`, readable by all whatever the umask."""
    for path, data in files.items():
        target = folder / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(data)
        target.chmod(0o644)


def build_wheel(files: dict[str, bytes], out: Path, epoch: int) -> Path:
    """Build the student wheel from the staged repository with the setuptools of this environment, offline."""
    with tempfile.TemporaryDirectory() as folder:
        staged = Path(folder) / "student"
        stage(files, staged)
        script = "import sys; from setuptools import build_meta; build_meta.build_wheel(sys.argv[1])"
        done = subprocess.run(
            [sys.executable, "-c", script, str(out)],
            cwd=staged,
            env={**os.environ, "SOURCE_DATE_EPOCH": str(epoch), "TZ": "UTC"},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            umask=0o022,
            check=False,
        )
    if done.returncode:
        raise KitError(f"the wheel could not be built:\n{done.stdout}")
    return next(out.glob("*.whl"))


def write_zip(files: dict[str, bytes], target: Path, epoch: int) -> Path:
    """Write `files` to a zip whose bytes depend on nothing else than them and `epoch`."""
    moment = zip_time(epoch)
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
        for path, data in sorted(files.items()):
            entry = zipfile.ZipInfo(path, moment)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o100644 << 16
            entry.create_system = 3
            archive.writestr(entry, data)
    return target


def zip_time(epoch: int) -> tuple[int, ...]:
    """Return `epoch` as the six numbers a zip entry holds, in UTC.

    >>> zip_time(EARLIEST)
    (1980, 1, 1, 0, 0, 0)
    """
    return time.gmtime(epoch)[:6]


def write_bundle(files: dict[str, bytes], target: Path, epoch: int, version: str) -> Path:
    """Write a git bundle of one commit; `git clone` makes the student repository of it."""
    settings = {
        "GIT_CONFIG_GLOBAL": os.devnull,
        "GIT_CONFIG_NOSYSTEM": "1",
        "GIT_AUTHOR_NAME": "The roboloc authors",
        "GIT_COMMITTER_NAME": "The roboloc authors",
        "GIT_AUTHOR_EMAIL": "roboloc@example.org",
        "GIT_COMMITTER_EMAIL": "roboloc@example.org",
        "GIT_AUTHOR_DATE": f"@{epoch} +0000",
        "GIT_COMMITTER_DATE": f"@{epoch} +0000",
    }
    outside = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    with tempfile.TemporaryDirectory() as folder:
        stage(files, Path(folder))

        def git(*arguments: str) -> None:
            command = ["git", "-c", "core.autocrlf=false", "-c", "pack.threads=1", *arguments]
            subprocess.run(
                command, cwd=folder, env={**outside, **settings}, check=True, stdin=subprocess.DEVNULL
            )

        git("init", "--quiet", "--initial-branch=main", "--template=")
        git("add", "--all", "--force")
        git("commit", "--quiet", "--message", f"roboloc {version}, student edition")
        git("bundle", "create", "--quiet", str(target), "HEAD", "main")
    return target


def build(root: Path, ref: str, out: Path) -> list[Path]:
    """Build the kit of the commit `ref` of `root` in the folder `out`, replacing an earlier one there.

    Returns
    -------
    list of Path
        The wheel, the zip of the notebooks and the bundle of the student repository.

    Raises
    ------
    KitError
        If there is no released notebook, or if the kit holds an answer, a marker or the secret.
    """
    files, version = collect(root, ref)
    epoch = source_date(root, ref)
    out = out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    for earlier in out.glob("roboloc-*"):
        earlier.unlink()
    notebooks = {path: data for path, data in files.items() if path.startswith(f"{NOTEBOOKS}/")}
    notebooks["notebooks/LICENSE-text"] = files["LICENSE-text"]
    return [
        build_wheel(files, out, epoch),
        write_zip(notebooks, out / f"roboloc-notebooks-{version}.zip", epoch),
        write_bundle(files, out / f"roboloc-student-{version}.bundle", epoch, version),
    ]


def main() -> None:
    """Build the kit and say what was made."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--ref", default="HEAD", help="the commit the kit is made from (HEAD)")
    parser.add_argument("--out", type=Path, default=ROOT / "dist", help="where it goes (dist/)")
    options = parser.parse_args()
    try:
        made = build(ROOT, options.ref, options.out)
    except KitError as error:
        sys.exit(f"student-kit: {error}")
    state = ["git", "-C", str(ROOT), "status", "--porcelain", "--", PACKAGE, NOTEBOOKS]
    if subprocess.run(state, capture_output=True, check=True).stdout:
        print(f"student-kit: {PACKAGE} or {NOTEBOOKS} has uncommitted changes; they are not in the kit")
    for path in made:
        print(f"{path.stat().st_size / 1000:9.1f} kB  {path}")


if __name__ == "__main__":
    main()
