"""Our own student kit: it holds no answer, and runs on every machine with the oldest versions that it allows."""

import ast
import json
import os
import re
import subprocess
import sys
import tomllib
import zipfile
from importlib import import_module
from pathlib import Path

import pytest
from small_repository import git, notebook

from autograder.checks import STAGES
from autograder.misconceptions.scan_runs import cut_all, join_all
from autograder.roles import visible_part
from roboloc_reference.motion import compute_dynamics
from roboloc_reference.velocity import sightings

ROOT = Path(__file__).resolve().parents[1]

sys.path.insert(0, str(ROOT / "tools"))
kit_answers, student_kit, release_notebooks = map(import_module, ("kit_answers", "student_kit", "notebooks"))
sys.path.remove(str(ROOT / "tools"))


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


@pytest.fixture(scope="module")
def answers():
    """Return all that must not be found, from the files as they are."""
    paths = [path for folder in student_kit.ANSWERS for path in (ROOT / folder).rglob("*.*")]
    return kit_answers.gather(
        {str(path.relative_to(ROOT)): path.read_bytes() for path in paths if path.suffix in (".py", ".md")}
    )


@pytest.fixture(scope="module")
def kit_files(kit, tmp_path_factory):
    """Return every file of our kit: wheel, zip, and the student repository as it is cloned."""
    folder = tmp_path_factory.mktemp("clone")
    with zipfile.ZipFile(kit[0]) as wheel, zipfile.ZipFile(kit[1]) as notebooks:
        files = {
            f"{Path(z.filename).suffix}/{n}": z.read(n) for z in (wheel, notebooks) for n in z.namelist()
        }
    git(folder, "clone", "--quiet", str(kit[2]), "student")
    assert git(folder / "student", "rev-list", "--all", "--count").strip() == "1"
    for path in (folder / "student").rglob("*"):
        if path.is_file() and ".git" not in path.parts:
            files[f"repository/{path.relative_to(folder / 'student')}"] = path.read_bytes()
    return files


def test_no_graded_body_is_in_our_kit(kit_files, answers):
    """Nothing of reference, solutions, hidden tests, checks, known mistakes or the secret stands in our kit."""
    assert len(answers.text) >= 100
    assert len(answers.shapes) >= 50
    assert kit_answers.find_leaks(kit_files, answers, student_kit.course_secrets(ROOT)) == []
    text = "\n".join(data.decode(errors="replace") for data in kit_files.values())
    assert "def compute_dynamics" in text


class Rename(ast.NodeTransformer):
    """Call every local name of a function something else."""

    def __init__(self, function):
        names = {n.id for n in ast.walk(function) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
        self.names = {name: f"own_{name}" for name in names | {a.arg for a in function.args.args}}

    def visit_Name(self, node):
        """Rename a variable."""
        return ast.Name(self.names.get(node.id, node.id), node.ctx)

    def visit_arg(self, node):
        """Rename an argument."""
        return ast.arg(self.names.get(node.arg, node.arg), node.annotation)


# Stages that hand their arguments on to the function which holds the answer.
HANDED_ON = {
    "velocity.motion": compute_dynamics,
    "velocity.range_bearing": sightings,
    "extraction.split": cut_all,
    "extraction.merge": join_all,
}


@pytest.mark.parametrize("name", sorted(STAGES))
def test_every_graded_stage_would_be_found(name, answers):
    """The body of each graded stage is found in a kit, as it is and with every variable renamed."""
    reference = HANDED_ON.get(
        name, STAGES[name].reference
    )  # written where its stage's name says, or in a module beside
    tree = ast.parse(Path(import_module(reference.__module__).__file__).read_text(encoding="utf-8"))
    (found,) = [n for n in tree.body if isinstance(n, ast.FunctionDef) and n.name == reference.__name__]
    as_is, renamed = ast.unparse(found), ast.unparse(Rename(found).visit(found))
    assert as_is != renamed
    for source in (as_is, renamed):
        for data, kind in ((source.encode(), "world.py"), (notebook(source), "first.ipynb")):
            assert kit_answers.find_leaks({kind: data}, answers), (kind, source)


# ------------------------------------------------------------------------------------------------ any machine

# Modules of the standard library that Windows or a browser does not have, or that call machine code.
NOT_EVERYWHERE = {
    "ctypes", "fcntl", "grp", "posix", "pty", "pwd", "resource", "syslog", "termios", "tty", "winreg",
}  # fmt: skip
NAMES_OF_WINDOWS = {
    "con",
    "prn",
    "aux",
    "nul",
    *(f"{device}{n}" for device in ("com", "lpt") for n in range(1, 10)),
}
UV = [str(Path(sys.executable).with_name("uv"))]


def test_our_wheel_is_for_every_machine(kit):
    """The wheel is pure Python for any platform, and no module of it imports what a platform lacks."""
    assert kit[0].name.endswith("-py3-none-any.whl")
    with zipfile.ZipFile(kit[0]) as wheel:
        files = {name: wheel.read(name) for name in wheel.namelist()}
    tags = next(data for name, data in files.items() if name.endswith(".dist-info/WHEEL")).decode()
    assert "Root-Is-Purelib: true" in tags
    assert not [
        name for name in files if name.endswith((".so", ".pyd", ".dll", ".dylib", ".c", ".pyx", ".sh"))
    ]
    imported = set()
    for name, data in files.items():
        for node in ast.walk(ast.parse(data)) if name.endswith(".py") else ():
            if isinstance(node, ast.Import):
                imported |= {alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level:
                imported.add(node.module.partition(".")[0])
    required = {"roboloc", "numpy", "scipy", "sympy", "matplotlib", "ipywidgets", "IPython"}
    assert not imported & NOT_EVERYWHERE
    assert imported <= set(sys.stdlib_module_names) | required


def requirements(wheel):
    """Return what a wheel requires without any extra."""
    with zipfile.ZipFile(wheel) as opened:
        metadata = next(opened.read(name).decode() for name in opened.namelist() if name.endswith("METADATA"))
    lines = [line.partition(": ") for line in metadata.splitlines()]
    return [text for field, _, text in lines if field == "Requires-Dist" and "extra ==" not in text]


def test_our_dependencies_are_ranges(kit):
    """The wheel names oldest versions and pins none, so that it goes into an environment that is there already."""
    required = requirements(kit[0])
    assert len(required) >= 4
    assert all(re.fullmatch(r"[a-z]+>=[\d.]+", one) for one in required)


def test_file_names_are_for_every_machine(kit_files):
    """No file has a name that Windows refuses, and no two differ in capitals alone."""
    repository = [name for name in kit_files if name.startswith("repository/")]
    parts = {part for name in repository for part in name.split("/")}
    assert not [part for part in parts if set(part) & set('<>:"\\|?*') or part.endswith((" ", "."))]
    assert not [part for part in parts if part.partition(".")[0].lower() in NAMES_OF_WINDOWS]
    assert len({name.lower() for name in repository}) == len(repository)
    assert max(map(len, repository)) < 120


@pytest.mark.parametrize("resolution", ["lowest-direct", "highest"])
@pytest.mark.parametrize("platform", ["windows", "macos", "linux"])
def test_everything_it_needs_is_there_ready_made(kit, platform, resolution):
    """On each system our ranges can be had from ready-made packages, the oldest versions as well as the newest."""
    command = ["pip", "compile", "-", "--quiet", "--no-header", "--no-annotate", "--only-binary=:all:",
               f"--python-platform={platform}", "--python-version=3.11", f"--resolution={resolution}"]  # fmt: skip
    wanted = "\n".join([*requirements(kit[0]), "jupyterlab>=4"])  # directly, or the oldest are not taken
    done = subprocess.run([*UV, *command], input=wanted, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "numpy==" in done.stdout


# Everything is imported once, and each notebook runs in a fork of that.
ROUNDS = """
import json, os, sys
from pathlib import Path
import matplotlib
matplotlib.use("agg")
import matplotlib.pyplot, numpy, scipy.linalg, scipy.stats, sympy
from IPython.core.interactiveshell import InteractiveShell

InteractiveShell.enable_gui = lambda self, gui=None: None

def run(sources):
    shell = InteractiveShell.instance()
    errors = []
    for source in sources:
        result = shell.run_cell(source)
        error = result.error_before_exec or result.error_in_exec
        if error is not None:
            errors.append(type(error).__name__)
    versions = {n: sys.modules[n].__version__ for n in ("numpy", "scipy", "sympy", "matplotlib")}
    stray = [n for n in sys.modules if n.startswith(("autograder", "roboloc_reference", "nbgrader"))]
    return {"errors": errors, "versions": versions, "stray": stray}

for name, sources in json.loads(Path("notebooks.json").read_text(encoding="utf-8")).items():
    folder = Path(name)
    folder.mkdir()
    if os.fork() == 0:
        os.chdir(folder)
        for number in (1, 2):
            os.dup2(os.open("printed", os.O_WRONLY | os.O_CREAT | os.O_APPEND), number)
        Path("report.json").write_text(json.dumps(run(sources)))
        sys.stdout.flush()
        os._exit(0)
    os.wait()
"""


@pytest.fixture(scope="module")
def oldest(kit, tmp_path_factory):
    """Install our wheel with the oldest versions that it allows in an environment of its own; return its Python."""
    folder = tmp_path_factory.mktemp("oldest") / "venv"
    subprocess.run([*UV, "venv", "--quiet", f"--python={sys.executable}", str(folder)], check=True)
    python = folder / "bin" / "python"
    command = [*UV, "pip", "install", "--quiet", f"--python={python}", "--resolution=lowest-direct"]
    wanted = [*requirements(kit[0]), str(kit[0])]  # directly, or the oldest are not taken
    done = subprocess.run([*command, *wanted], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return python


@pytest.fixture(scope="module")
def rounds(oldest, tmp_path_factory):
    """Run every notebook, solved and as released, with the oldest versions; return its report and what it printed."""
    found = {}
    for path in (ROOT / "solutions").glob("*/*.md"):
        made = release_notebooks.splice(release_notebooks.read(path), ROOT)
        cells = [visible_part(cell.source) for cell in made.cells if cell.cell_type == "code"]
        found[f"{path.stem}-solved"] = cells
    for path in (ROOT / "notebooks").glob("*/*.ipynb"):
        cells = kit_answers.cells_of(path.name, path.read_bytes())
        found[f"{path.stem}-released"] = [source for kind, source in cells if kind == "code"]
    folder = tmp_path_factory.mktemp("rounds")
    (folder / "rounds.py").write_text(ROUNDS, encoding="utf-8")
    (folder / "notebooks.json").write_text(json.dumps(found), encoding="utf-8")
    places = dict.fromkeys(("HOME", "IPYTHONDIR", "MPLCONFIGDIR"), str(folder)) | {"PATH": os.defpath}
    places["OPENBLAS_NUM_THREADS"] = "1"
    command = [str(oldest), "-I", "rounds.py"]
    done = subprocess.run(command, cwd=folder, env=places, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return {
        name: (
            json.loads((folder / name / "report.json").read_text(encoding="utf-8")),
            (folder / name / "printed").read_text(encoding="utf-8"),
        )
        for name in found
    }


def test_oldest_versions_are_those_we_name(rounds):
    """The environment of the oldest versions has exactly the lower ends of our ranges."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    lowest = dict(requirement.split(">=") for requirement in project["dependencies"])
    for report, _ in rounds.values():
        assert {
            name: version.startswith(lowest[name]) for name, version in report["versions"].items()
        } == dict.fromkeys(("numpy", "scipy", "sympy", "matplotlib"), True)


@pytest.mark.parametrize("name", sorted(path.stem for path in (ROOT / "solutions").glob("*/*.md")))
def test_solved_notebook_runs_with_the_oldest_versions(rounds, name):
    """With the student wheel alone the solved notebook runs without an error, and every public check of it passes."""
    report, printed = rounds[f"{name}-solved"]
    assert report["errors"] == []
    assert report["stray"] == []
    assert "[right]" in printed
    assert "[not yet]" not in printed


@pytest.mark.parametrize("name", sorted(path.stem for path in (ROOT / "notebooks").glob("*/*.ipynb")))
def test_released_notebook_runs_with_the_oldest_versions(rounds, name):
    """A blank notebook fails where the student's work is missing, and nowhere else."""
    report, _ = rounds[f"{name}-released"]
    assert report["errors"]
    assert set(report["errors"]) <= {"NotImplementedError", "MissingStageError", "NameError"}
