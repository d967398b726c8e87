"""The book's sources, before any is built: what must stand in them and what must not."""

import ast
import inspect
import re
import textwrap
from pathlib import Path

import jupytext
import pytest
import sympy as sp
import yaml

from autograder.checks import STAGES as GRADED

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted((ROOT / "book").glob("*.md"))
MOTION = ROOT / "book" / "motion-and-the-limit.md"
STAGES = [stage.reference for stage in GRADED.values()]
DERIVATION = ["derive-symbols", "derive-g", "derive-jacobians", "derive-limits"]


def code_cells(page):
    """Return the code cells of a page as (tags, source)."""
    cells = jupytext.read(page, fmt="md:myst").cells
    return [(c.metadata.get("tags", []), c.source) for c in cells if c.cell_type == "code"]


def reference_lines():
    """Return the lines of the graded stages and of their helpers that say how they work."""
    lines = set()
    for module in {inspect.getmodule(stage) for stage in STAGES}:
        for node in ast.walk(ast.parse(inspect.getsource(module))):
            if isinstance(node, ast.FunctionDef):
                body = node.body[1:] if ast.get_docstring(node) else node.body
                source = "\n".join(ast.unparse(statement) for statement in body)
                lines |= {normal(line) for line in source.splitlines()}
    # Short lines (`x = g`) are nobody's secret; checks of arguments are no answer.
    return {line for line in lines if len(line) >= 12 and "as_array" not in line and "as_number" not in line}


def normal(line):
    """Return a line of code without what a change of layout would change."""
    return re.sub(r"\s+", "", line.split("#")[0])


def test_every_page_is_in_the_table_of_contents():
    """A page that nobody can reach is a mistake, and so is an entry without a page."""
    toc = yaml.safe_load((ROOT / "_toc.yml").read_text())
    listed = [toc["root"], *(c["file"] for part in toc["parts"] for c in part["chapters"])]
    assert sorted(listed) == [f"book/{page.stem}" for page in PAGES]


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.stem)
def test_page_defines_no_graded_stage(page):
    """No page defines a function with the name of a graded stage, whatever is in it."""
    names = {stage.__name__ for stage in STAGES}
    for _, source in code_cells(page):
        defined = {n.name for n in ast.walk(ast.parse(source)) if isinstance(n, ast.FunctionDef)}
        assert not defined & names
    assert not re.findall(rf"def\s+(?:{'|'.join(names)})\b", page.read_text())


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.stem)
def test_page_prints_no_line_of_the_reference(page):
    """No line of a graded stage stands on a page, in a cell or in a block that is only shown."""
    shown = {normal(line) for line in page.read_text().splitlines()}
    shown |= {
        normal(s) for _, source in code_cells(page) for s in ast.unparse(ast.parse(source)).splitlines()
    }
    assert len(reference_lines()) > 20
    assert not shown & reference_lines()


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.stem)
def test_page_imports_no_answer_for_show(page):
    """A page may compute with the reference, but never display its source."""
    assert "getsource" not in page.read_text()
    assert "literalinclude" not in page.read_text()


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.stem)
def test_cells_fit_the_page(page):
    """A cell has at most ten lines of code, none so long that it scrolls on a wide screen."""
    for _, source in code_cells(page):
        lines = [line for line in source.splitlines() if line.strip()]
        assert len(lines) <= 10, source
        assert max(map(len, lines)) <= 79, source


def test_pages_with_mathematics_assert_it():
    """A page that displays a formula runs code that asserts something."""
    for page in PAGES:
        if "```{math}" in page.read_text():
            assert any("assert " in source for _, source in code_cells(page)), page.stem


def test_derivation_cells_bind_what_the_notebook_uses():
    """The tagged cells alone, in order, bind the names that the notebook builder promises, and are right."""
    space = {}
    tags = [tag for tags, _ in code_cells(MOTION) for tag in tags if tag.startswith("derive-")]
    assert list(dict.fromkeys(tags)) == DERIVATION
    for cell_tags, source in code_cells(MOTION):
        if set(cell_tags) & set(DERIVATION):
            exec(source, space)  # noqa: S102 - the book's own cells
    symbols = [space[name] for name in ("x", "y", "theta", "V", "omega", "dt", "tau")]
    assert [symbol.name for symbol in symbols] == ["x", "y", "theta", "V", "omega", "dt", "tau"]
    x, y, theta, V, omega, dt, _ = symbols
    assert (space["g"].shape, space["G_x"].shape, space["G_u"].shape) == ((3, 1), (3, 3), (3, 2))
    near = {
        x: 1,
        y: -2,
        theta: sp.Rational(3, 10),
        V: 2,
        omega: sp.Rational(1, 10**12),
        dt: sp.Rational(1, 2),
    }
    for matrix, limit in (("g", "g_0"), ("G_x", "G_x0"), ("G_u", "G_u0")):
        gap = (space[matrix] - space[limit]).subs(near).evalf(50)
        assert max(abs(entry) for entry in gap) < 1e-11


def test_derivation_cells_assert():
    """Each step of the derivation but the choice of symbols is followed by assertions."""
    for tag in DERIVATION[1:]:
        assert sum("assert " in source for tags, source in code_cells(MOTION) if tag in tags) >= 1


def test_sources_name_no_address_outside():
    """Pages, style sheet, script and configuration load nothing from the network."""
    files = [*PAGES, *(ROOT / "book" / "_static").iterdir(), ROOT / "_config.yml"]
    for file in files:
        assert not re.search(r"(?:https?:)?//[\w.-]+\.\w+/", file.read_text()), file.name


def test_normal_form_sees_through_layout():
    """The comparison with the reference ignores spaces and comments, so that a reformatted copy is found."""
    copied = textwrap.dedent("""\
        k = V * dt*dt / 2   # copied
        """)
    assert normal(copied) == normal("k = V * dt * dt / 2")
