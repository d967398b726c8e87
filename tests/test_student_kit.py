"""The student kit of a small course made here, and of this repository when it has released notebooks."""

import os
import sys
import zipfile
from importlib import import_module
from pathlib import Path

import pytest
from small_repository import git, notebook

ROOT = Path(__file__).resolve().parents[1]

sys.path.insert(0, str(ROOT / "tools"))
kit_answers, student_kit, release_notebooks = map(import_module, ("kit_answers", "student_kit", "notebooks"))
sys.path.remove(str(ROOT / "tools"))

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
    half = total + a * b + a * c - b / c + a * a
    return half


def steps(a):
    """Return the answer, in small steps."""
    one = a.sum()
    two = one + 1
    return two - one


def short(a, b):
    """Return the answer, of which no expression is long."""
    half = a / 2
    return [x * half if x > b else -x for x in range(int(half))]
'''

PROBLEM = """\
# First

```{code-cell}
### BEGIN SOLUTION
def twice(value):
    total = value * 2
    rest = total - value
    return rest + value
### END SOLUTION
```

```{code-cell}
### BEGIN HIDDEN TESTS
assert twice(31337) == 62674, "twice a hidden number"
### END HIDDEN TESTS
```

### BEGIN SOLUTION
The answer is that a straight line has no centre, and so no radius.
### END SOLUTION

### BEGIN MARK SCHEME
Two points for who names the centre of the circle.
### END MARK SCHEME
"""

CHECKS = """\
def inputs(rng):
    speeds = rng.uniform(0.3, 1.7, 12)
    turns = rng.choice([-1.0, 1.0], 12)
    return speeds, turns, speeds * turns
"""


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
            "autograder/checks/first.py": CHECKS,
            "solutions/one/first.md": PROBLEM,
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
            "one = a.sum()\ntwo = one+1  # add\nreturn two - one\n",
            "an expression of the reference",
        ),
        (
            "src/roboloc/world.py",
            'def g(p, q):\n    """Go."""\n    r: float = p/2\n    return [k*r if k>q else -k for k in range(int(r))]\n',
            "the body of short",
        ),
        (
            "src/roboloc/world.py",
            "def f(p, q, r):\n    return p*q + p*r - q/r + p*q + p*r\n",
            "under other names",
        ),
        (
            "notebooks/one/first.ipynb",
            notebook("total = value*2\nrest = total-value\nreturn rest + value"),
            "solutions/one/first.md",
        ),
        (
            "notebooks/one/hint.md",
            "The answer is that a straight\nline has no centre, and so no radius.",
            "first.md",
        ),
        (
            "notebooks/one/first.ipynb",
            notebook('assert twice(31337)==62674, "twice a hidden number"'),
            "first.md",
        ),
        ("notebooks/one/hint.md", "* Two points for who names the centre of the circle.", "first.md"),
        (
            "src/roboloc/world.py",
            "def f(g):\n    a = g.uniform(0.3, 1.7, 12)\n    b = g.choice([-1.0, 1.0], 12)\n    return a, b, a * b\n",
            "the body of inputs",
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
        "renamed-body",
        "renamed-expression",
        "solution-cell",
        "written-solution",
        "hidden-line",
        "mark-scheme",
        "hidden-inputs",
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
