"""The student kit of a small course made here, and of this repository when it has released notebooks."""

import importlib.util
import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]

specification = importlib.util.spec_from_file_location("student_kit", ROOT / "tools" / "student_kit.py")
student_kit = importlib.util.module_from_spec(specification)
specification.loader.exec_module(student_kit)

PYPROJECT = """\
[project]
name = "roboloc"
version = "1.2.3"
requires-python = ">=3.11"
license = "BSD-3-Clause"
dependencies = ["numpy>=2.0"]
"""

REFERENCE = '''\
"""The answers."""


def stage(a, b, c):
    """Return the answer."""
    total = a * b + a * c - b / c  # the point of it all
    half = total / 2
    return half


def steps(a):
    """Return the answer, in small steps."""
    one = a.sum()
    two = one + 1
    return two
'''


def notebook(*sources):
    """Return the bytes of a notebook with these code cells."""
    cells = [
        {
            "cell_type": "code",
            "metadata": {},
            "execution_count": None,
            "outputs": [],
            "source": source.splitlines(True),
        }
        for source in sources
    ]
    return json.dumps({"cells": cells, "metadata": {}, "nbformat": 4, "nbformat_minor": 5}).encode()


def git(folder, *arguments):
    """Run git with a name of its own, whatever the machine's settings are."""
    names = ["-c", "user.name=Test", "-c", "user.email=test@example.org"]
    done = subprocess.run(["git", *names, *arguments], cwd=folder, check=True, capture_output=True, text=True)
    return done.stdout


@pytest.fixture
def course(tmp_path):
    """Return a committed course with one stage and one released notebook, and its commit function."""
    root = tmp_path / "course"

    def commit(**files):
        for name, data in files.items():
            path = root / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data if isinstance(data, bytes) else data.encode())
        git(root, "add", "--all")
        git(root, "commit", "--quiet", "--allow-empty", "--message", "A course")
        return root

    root.mkdir()
    git(root, "init", "--quiet", "--initial-branch=main")
    commit(
        **{
            "pyproject.toml": PYPROJECT,
            "LICENSE": "Code.\n",
            "LICENSE-text": "Text.\n",
            "src/roboloc/world.py": '"""A world."""\n\nWIDTH = 3.0\n',
            "src/roboloc/logs/drive.csv": "0,1\n",
            "src/roboloc/__init__.py": '"""The robot\'s world."""\n',
            "src/roboloc_reference/stages.py": REFERENCE,
            "autograder/checks.py": "SECRET_TOLERANCE = 1\n",
            "notebooks/one/first.ipynb": notebook(
                "def stage(a, b, c):\n    # YOUR CODE HERE\n    raise NotImplementedError"
            ),
        }
    )
    return root, commit


def test_the_kit_is_a_wheel_a_zip_and_a_repository(course, tmp_path):
    """The kit holds the package, its data and the notebooks, and nothing of the reference or the grader."""
    root, _ = course
    wheel, archive, bundle = student_kit.build(root, "HEAD", tmp_path / "dist")
    assert wheel.name == "roboloc-1.2.3-py3-none-any.whl"
    with zipfile.ZipFile(wheel) as opened:
        names = set(opened.namelist())
        metadata = opened.read("roboloc-1.2.3.dist-info/METADATA").decode()
    package = {name for name in names if not name.startswith("roboloc-1.2.3.dist-info/")}
    assert package == {"roboloc/__init__.py", "roboloc/world.py", "roboloc/logs/drive.csv"}
    assert "Requires-Dist: numpy>=2.0" in metadata
    with zipfile.ZipFile(archive) as opened:
        assert opened.namelist() == ["notebooks/LICENSE-text", "notebooks/one/first.ipynb"]
    git(tmp_path, "clone", "--quiet", str(bundle), "student")
    assert git(tmp_path / "student", "rev-list", "--all", "--count").strip() == "1"
    assert set(git(tmp_path / "student", "ls-files").split()) == {
        ".gitignore",
        "LICENSE",
        "LICENSE-text",
        "README.md",
        "notebooks/one/first.ipynb",
        "pyproject.toml",
        "src/roboloc/__init__.py",
        "src/roboloc/logs/drive.csv",
        "src/roboloc/world.py",
    }


def test_the_same_commit_gives_the_same_bytes(course, tmp_path, monkeypatch):
    """Two builds are equal byte for byte whatever the umask, the time zone and the git settings."""
    root, _ = course
    first = [path.read_bytes() for path in student_kit.build(root, "HEAD", tmp_path / "one")]
    settings = tmp_path / "gitconfig"
    settings.write_text("[user]\nname = Somebody\nemail = else@example.org\n[core]\nautocrlf = true\n")
    monkeypatch.setenv("GIT_CONFIG_GLOBAL", str(settings))
    monkeypatch.setenv("TZ", "Pacific/Chatham")
    monkeypatch.delenv("SOURCE_DATE_EPOCH", raising=False)
    before = os.umask(0o077)
    try:
        second = [path.read_bytes() for path in student_kit.build(root, "HEAD", tmp_path / "two")]
    finally:
        os.umask(before)
    assert first == second


def test_the_working_tree_stays_out(course, tmp_path):
    """What an instructor tried in a notebook or left beside it, uncommitted, is not in the kit."""
    root, _ = course
    (root / "notebooks/one/first.ipynb").write_bytes(notebook("answer = 42"))
    (root / "notebooks/one/solved.ipynb").write_bytes(notebook("answer = 42"))
    (root / "src/roboloc/draft.py").write_text("answer = 42\n")
    kit = student_kit.build(root, "HEAD", tmp_path / "dist")
    for path in kit[:2]:
        with zipfile.ZipFile(path) as opened:
            assert not any(b"answer = 42" in opened.read(name) for name in opened.namelist())
    git(tmp_path, "clone", "--quiet", str(kit[2]), "student")
    assert not (tmp_path / "student/src/roboloc/draft.py").exists()


@pytest.mark.parametrize(
    ("path", "data", "reason"),
    [
        ("src/roboloc/world.py", "from roboloc_reference import stages\n", "roboloc_reference"),
        ("src/roboloc/world.py", "from autograder import grade\n", "from autograder"),
        (
            "notebooks/one/first.ipynb",
            notebook("### BEGIN SOLUTION\nx = 1\n### END SOLUTION"),
            "BEGIN SOLUTION",
        ),
        ("notebooks/one/first.ipynb", notebook("### BEGIN HIDDEN TESTS\npass"), "BEGIN HIDDEN TESTS"),
        (
            "src/roboloc/world.py",
            "def f(a, b, c):\n    return (a*b + a*c) - (b/c)\n",
            "an expression of the reference",
        ),
        (
            "notebooks/one/first.ipynb",
            notebook("w = (a * b  # one\n  + a * c\n  - b / c)"),
            "an expression of the reference",
        ),
        ("notebooks/one/hint.md", "Try `a * b + a * c - b / c`.\n", "an expression of the reference"),
        (
            "src/roboloc/world.py",
            "one = a.sum()\ntwo = one+1  # add\nreturn two\n",
            "an expression of the reference",
        ),
        ("notebooks/one/data.txt", "key: c0ffee0123\n", "the course secret"),
    ],
    ids=[
        "imports-reference",
        "imports-grader",
        "solution",
        "hidden-test",
        "formula",
        "cell",
        "prose",
        "steps",
        "secret",
    ],
)
def test_a_kit_with_an_answer_is_refused(course, tmp_path, path, data, reason):
    """An answer, a word of the grading side or the secret stops the kit, and nothing is written."""
    root, commit = course
    (root / ".gitignore").write_text(".roboloc-secret\n")
    (root / ".roboloc-secret").write_text("c0ffee0123\n")
    commit(**{path: data})
    with pytest.raises(student_kit.KitError, match=reason):
        student_kit.build(root, "HEAD", tmp_path / "dist")
    assert not (tmp_path / "dist").exists()


def test_a_course_without_notebooks_is_refused(course, tmp_path):
    """A kit without one released notebook is no kit."""
    root, commit = course
    (root / "notebooks/one/first.ipynb").unlink()
    commit()
    with pytest.raises(student_kit.KitError, match="no released notebook"):
        student_kit.build(root, "HEAD", tmp_path / "dist")


@pytest.fixture(scope="module")
def kit(tmp_path_factory):
    """Return the kit of this repository's last commit."""
    return student_kit.build(ROOT, "HEAD", tmp_path_factory.mktemp("dist"))


def test_our_wheel_imports_without_the_reference(kit, tmp_path):
    """Every module of our wheel imports where neither the reference nor the grader can be had."""
    script = """
import importlib, pkgutil, sys
sys.path.insert(0, sys.argv[1])
for name in ("roboloc_reference", "autograder"):
    sys.modules[name] = None  # an import of it fails
import roboloc
assert roboloc.__file__.startswith(sys.argv[1]), roboloc.__file__
names = [module.name for module in pkgutil.walk_packages(roboloc.__path__, "roboloc.")]
for name in names:
    importlib.import_module(name)
print(len(names))
"""
    command = [sys.executable, "-I", "-c", script, str(kit[0])]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=False)
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) >= 5


def test_no_graded_body_is_in_our_kit(kit, tmp_path):
    """No line of a graded stage that computes something stands anywhere in our kit, to the last file."""
    with zipfile.ZipFile(kit[0]) as wheel, zipfile.ZipFile(kit[1]) as notebooks:
        files = {f"{z.filename}/{n}": z.read(n) for z in (wheel, notebooks) for n in z.namelist()}
    git(tmp_path, "clone", "--quiet", str(kit[2]), "student")
    for path in (tmp_path / "student").rglob("*"):
        if path.is_file() and ".git" not in path.parts:
            files[str(path)] = path.read_bytes()
    modules = sorted((ROOT / "src/roboloc_reference").glob("*.py"))
    answers = set().union(*(student_kit.answers(module.read_text()) for module in modules))
    assert len(answers) >= 10
    assert student_kit.find_leaks(files, answers) == []
    text = "\n".join(data.decode(errors="replace") for data in files.values())
    assert "def compute_dynamics" in text


def test_every_reference_stage_has_an_answer_to_look_for():
    """The search would find each graded stage: it knows at least one piece of every module that has one."""
    for module in sorted((ROOT / "src/roboloc_reference").glob("*.py")):
        source = module.read_text()
        if "\ndef " in source:
            assert student_kit.answers(source), module.name
