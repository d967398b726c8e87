"""What must hold for the repository as a whole: nothing of one machine, nothing unlocked, nothing untold."""

import ast
import json
import re
import subprocess
import sys
import tomllib
from importlib.metadata import version
from pathlib import Path

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = {
    "roboloc": "src/roboloc",
    "roboloc_reference": "src/roboloc_reference",
    "autograder": "autograder",
}
# What each package may import of the others.
MAY_IMPORT = {
    "roboloc": set(),
    "roboloc_reference": {"roboloc"},
    "autograder": {"roboloc", "roboloc_reference"},
}


def tracked():
    """Return the paths of the files that git tracks."""
    done = subprocess.run(
        ["git", "-C", str(ROOT), "ls-files", "-z"], check=True, capture_output=True, text=True
    )
    paths = [ROOT / name for name in done.stdout.split("\0") if name]
    return [path for path in paths if path.is_file()]


def texts():
    """Return the tracked text files as pairs of path below the root and content."""
    found = []
    for path in tracked():
        data = path.read_bytes()
        if b"\0" not in data:
            found.append((path.relative_to(ROOT).as_posix(), data.decode()))
    return found


def read(name):
    """Return the text of a file of the repository."""
    return (ROOT / name).read_text(encoding="utf-8")


def make_targets():
    """Return the targets of the Makefile with what `make help` says of each."""
    return dict(re.findall(r"^([a-z-]+):.*?## (.+)$", read("Makefile"), re.MULTILINE))


def locked(name):
    """Return the requirements of a lock file: name, version and number of hashes of each."""
    entries = re.split(r"\n(?=[A-Za-z0-9])", re.sub(r"(?m)^\s*#.*\n?", "", read(name)).strip())
    found = {}
    for entry in entries:
        pin = re.match(r"([A-Za-z0-9._-]+)==([^\s;\\]+)", entry)
        assert pin, f"{name}: {entry.splitlines()[0]} is not pinned"
        found[canonicalize_name(pin[1])] = (pin[2], len(re.findall(r"--hash=sha256:[0-9a-f]{64}\b", entry)))
    return found


# ---------------------------------------------------------------- no trace of one machine


def test_no_path_of_one_machine():
    """No tracked text names a home folder (but the sandbox's own) or the folder of this checkout."""
    folders = [r"/root/", r"/home/(?!student/)[a-z]\w*/", re.escape(f"{ROOT}/")]
    pattern = re.compile(rf"(?<![\w./~])(?:{'|'.join(folders)})")
    assert [
        name for name, text in texts() if name != "tests/test_repository.py" and pattern.search(text)
    ] == []


def test_no_address_of_a_registry():
    """No lock or requirements file says where packages come from: that is the business of each machine."""
    pattern = re.compile(r"--(?:extra-)?index-url|--find-links|^-i |\"resolved\"|https?://", re.MULTILINE)
    for name in ("requirements.lock", "requirements-uv.txt", "package.json"):
        assert not pattern.search(read(name)), name
    for name, entry in json.loads(read("package-lock.json"))["packages"].items():
        assert "resolved" not in entry, name


def test_no_second_lock_file():
    """One lock file rules: neither uv's project lock nor another manager's is tracked."""
    names = {path.name for path in tracked()}
    assert not names & {"uv.lock", "poetry.lock", "Pipfile.lock", "pdm.lock", "yarn.lock", "pnpm-lock.yaml"}


def test_nothing_large_is_tracked():
    """No tracked file is larger than 1.5 MB, and no picture of the README than 200 kB."""
    assert [path.name for path in tracked() if path.stat().st_size > 1_500_000] == []
    assert [
        path.name for path in tracked() if path.parent.name == "assets" and path.stat().st_size > 200_000
    ] == []


def test_nothing_private_is_tracked():
    """No gradebook, submission, feedback, grade list or course secret is tracked."""
    private = re.compile(
        r"^(submitted|autograded|feedback|release|downloaded)/|gradebook\.db|grades\.csv$|secret$"
    )
    names = [path.relative_to(ROOT).as_posix() for path in tracked()]
    assert [name for name in names if private.search(name)] == []


# ---------------------------------------------------------------- locks


@pytest.mark.parametrize("name", ["requirements.lock", "requirements-uv.txt"])
def test_every_locked_package_has_hashes(name):
    """Every package of a lock file is pinned to one version and has at least one SHA-256."""
    entries = locked(name)
    assert entries
    assert [package for package, (_, hashes) in entries.items() if hashes == 0] == []


def test_every_vendor_package_has_a_hash():
    """Every npm package is locked by its content."""
    packages = json.loads(read("package-lock.json"))["packages"]
    assert all(entry["integrity"].startswith("sha512-") for name, entry in packages.items() if name)
    manifest = json.loads(read("package.json"))
    wanted = {**manifest["dependencies"], **manifest["devDependencies"]}
    assert {name: packages[f"node_modules/{name}"]["version"] for name in wanted} == wanted


def test_the_lock_satisfies_the_project():
    """Every dependency of the project, extras and build included, is locked in a version that it accepts."""
    pyproject = tomllib.loads(read("pyproject.toml"))
    project = pyproject["project"]
    wanted = [*project["dependencies"], *pyproject["build-system"]["requires"]]
    wanted += [line for extra in project["optional-dependencies"].values() for line in extra]
    entries = locked("requirements.lock")
    for requirement in map(Requirement, wanted):
        pinned, _ = entries[canonicalize_name(requirement.name)]
        assert requirement.specifier.contains(pinned), f"{requirement} is locked as {pinned}"


def test_the_environment_is_the_locked_one():
    """The packages that the tests run with are those of the lock file."""
    entries = locked("requirements.lock")
    names = ["numpy", "scipy", "sympy", "matplotlib", "nbgrader", "jupyter-book", "sphinx", "ruff", "pytest"]
    assert {name: version(name) for name in names} == {name: entries[name][0] for name in names}


# ---------------------------------------------------------------- released notebooks


def released():
    """Return the released notebooks."""
    return [
        path
        for path in tracked()
        if path.suffix == ".ipynb" and path.relative_to(ROOT).parts[0] == "notebooks"
    ]


def test_released_notebooks_carry_no_output_and_no_answer():
    """A released notebook has no output, no execution count, no solution and no hidden test."""
    assert released()
    for path in released():
        text = path.read_text(encoding="utf-8")
        assert not re.search(r"(BEGIN|END) (SOLUTION|HIDDEN TESTS|MARK SCHEME)|roboloc_reference", text), (
            path.name
        )
        code = [cell for cell in json.loads(text)["cells"] if cell["cell_type"] == "code"]
        assert all(cell["outputs"] == [] and cell["execution_count"] is None for cell in code), path.name


def test_every_released_notebook_has_a_source():
    """A released notebook comes from a source in solutions/, and every source is released."""
    names = {path.relative_to(ROOT / "notebooks").with_suffix("") for path in released()}
    sources = {p.relative_to(ROOT / "solutions").with_suffix("") for p in (ROOT / "solutions").glob("*/*.md")}
    assert names == sources


# ---------------------------------------------------------------- code


def sources(folder):
    """Return the Python modules below a folder of the repository."""
    return [path for path in tracked() if path.suffix == ".py" and path.is_relative_to(ROOT / folder)]


def imported(path):
    """Return the top-level names that a module imports, wherever in the module it does."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            names.add(node.module.partition(".")[0])
    return names


@pytest.mark.parametrize("package", PACKAGES)
def test_imports_go_one_way(package):
    """The world knows no answer, the answers know no grader, and none of them the book or the tools."""
    forbidden = (
        {*PACKAGES, "book", "solutions", "tests", "tools", "benchmarks"} - MAY_IMPORT[package] - {package}
    )
    modules = sources(PACKAGES[package])
    assert modules
    assert {path.name: imported(path) & forbidden for path in modules if imported(path) & forbidden} == {}


def test_the_world_imports_without_plots():
    """Importing the package, its filters, simulation and checks loads no matplotlib and no ipywidgets."""
    modules = "roboloc, roboloc.angles, roboloc.se2, roboloc.simulation, roboloc.filters, roboloc.checks"
    script = f"import sys, {modules}; print(sorted({{'matplotlib', 'ipywidgets'}} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("folder", [*PACKAGES.values(), "tools", "benchmarks", "book"])
def test_a_module_fits_in_the_head(folder):
    """No module is longer than 400 lines; 300 is what we aim at."""
    lengths = {path.name: len(path.read_text(encoding="utf-8").splitlines()) for path in sources(folder)}
    assert {name: length for name, length in lengths.items() if length > 400} == {}


def test_every_test_says_what_it_tests():
    """Every test function has a docstring of one sentence, which may run over two lines."""
    faults = []
    for path in sources("tests"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
                doc = ast.get_docstring(node) or ""
                if not doc.endswith(".") or "\n\n" in doc:
                    faults.append(f"{path.name}: {node.name}")
    assert faults == []


# ---------------------------------------------------------------- papers


def test_every_make_target_of_the_papers_exists():
    """Each `make ...` that a paper or a page of the book names is a target of which `make help` tells."""
    targets = make_targets()
    phony = re.search(r"^\.PHONY: (.+)$", read("Makefile"), re.MULTILINE)[1].split()
    assert set(phony) == set(targets)
    papers = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"]
    pages = [
        path.relative_to(ROOT).as_posix()
        for path in tracked()
        if path.suffix == ".md" and "book" in path.parts
    ]
    named = {
        name
        for paper in papers + pages
        for name in re.findall(r"(?:`|^)make ([a-z-]+)", read(paper), re.MULTILINE)
    }
    assert {"course", "test", "student-kit"} <= named
    assert named - set(targets) == set()


@pytest.mark.parametrize("paper", ["README.md", "CONTRIBUTING.md"])
def test_every_path_of_the_papers_exists(paper):
    """Each link and each file or folder in code type that a paper names is in the repository."""
    text = read(paper)
    links = [link for link in re.findall(r"\]\(([^)#]+)\)", text) if "://" not in link]
    folders = [
        "src",
        "autograder",
        "book",
        "solutions",
        "notebooks",
        "tests",
        "tools",
        "benchmarks",
        "assets",
    ]
    named = re.findall(rf"`((?:{'|'.join(folders)})/[\w./-]*)`", text)
    named += re.findall(r"`([\w.-]+\.(?:md|toml|lock|yml|txt|cff|json))`", text)
    assert links
    assert named
    assert [path for path in links + named if not (ROOT / path).exists()] == []


def test_changelog_entries_are_one_sentence_each():
    """An entry of the changelog is one line: a capital or a name in code type, one sentence, a full stop."""
    lines = read("CHANGELOG.md").splitlines()
    entries = [line for line in lines if line.startswith(("- ", "* "))]
    assert entries
    for entry in entries:
        assert re.fullmatch(r"- [A-Z`].*\.", entry), entry
        assert not re.search(r"[.!?] +[A-Z]", entry), entry
    assert [line for line in lines if line.startswith("  ")] == []
    headings = [line for line in lines if line.startswith("## ")]
    assert all(re.fullmatch(r"## (Unreleased|\d+\.\d+\.\d+ \(\d{4}-\d\d-\d\d\))", line) for line in headings)


def test_version_and_licence_are_told_alike():
    """The project file and the citation name one version and one licence."""
    project = tomllib.loads(read("pyproject.toml"))["project"]
    citation = yaml.safe_load(read("CITATION.cff"))
    assert citation["version"] == project["version"]
    assert citation["license"] == project["license"] == "BSD-3-Clause"
    assert read("LICENSE").startswith("BSD 3-Clause License")
    assert "CC-BY-4.0" in read("LICENSE-text")
    assert version("roboloc") == project["version"]


def test_ci_runs_make_test():
    """What CI runs can be executed, stops at the first failure, and is `make test`."""
    done = subprocess.run(
        ["git", "-C", str(ROOT), "ls-files", "-s", ".ci/run"], check=True, capture_output=True, text=True
    )
    assert done.stdout.startswith("100755 ")
    assert "set -euo pipefail" in read(".ci/run")
    assert read(".ci/run").rstrip().endswith("\nmake test")
