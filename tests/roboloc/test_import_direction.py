import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
OUTSIDE = {"book", "solutions", "notebooks", "tests", "oracles", "conftest", "benchmarks"}
FORBIDDEN = {
    ROOT / "src/roboloc": OUTSIDE | {"roboloc_reference", "autograder"},
    ROOT / "src/roboloc_reference": OUTSIDE | {"autograder"},
    ROOT / "autograder": OUTSIDE,
}


def imported(source):
    """Return the top-level names that a module imports, by statement or by a constant string."""
    names = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and not node.level:
            names.add(node.module)
        elif isinstance(node, ast.Call) and node.args and isinstance(node.args[0], ast.Constant):
            function = (
                node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            )
            if function in {"import_module", "__import__"}:
                names.add(str(node.args[0].value))
    return {name.split(".")[0] for name in names}


@pytest.mark.parametrize("package", FORBIDDEN, ids=lambda path: path.name)
def test_imports_go_one_way(package):
    """A package imports only what stands before it: roboloc, roboloc_reference, autograder."""
    modules = sorted(package.rglob("*.py"))
    assert modules
    wrong = {
        str(path.relative_to(ROOT)): names
        for path in modules
        if (names := imported(path.read_text(encoding="utf-8")) & FORBIDDEN[package])
    }
    assert not wrong


@pytest.mark.parametrize(
    "source",
    [
        "import roboloc_reference",
        "import numpy, roboloc_reference.motion as motion",
        "from roboloc_reference import motion",
        "def f():\n    from roboloc_reference.motion import compute_dynamics",
        "import importlib\nimportlib.import_module('roboloc_reference.motion')",
        "__import__('roboloc_reference')",
    ],
)
def test_every_way_to_import_is_seen(source):
    """The scanner finds an import however it is written."""
    assert "roboloc_reference" in imported(source)


def loaded_by(module):
    """Return what a fresh interpreter has loaded after importing a module."""
    command = f"import sys, {module}; print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", command], capture_output=True, text=True, check=True)
    return set(run.stdout.split())


@pytest.mark.parametrize("module", ["roboloc", "roboloc.checks, roboloc.filters, roboloc.simulation"])
def test_roboloc_imports_without_drawing_libraries(module):
    """Neither matplotlib nor ipywidgets nor IPython is loaded by what is not about drawing."""
    assert not loaded_by(module) & {"matplotlib", "ipywidgets", "IPython", "scipy", "sympy"}


def test_plotting_is_what_loads_matplotlib():
    """The test above can fail: the same question about plotting finds matplotlib."""
    assert "matplotlib" in loaded_by("roboloc.plotting")
