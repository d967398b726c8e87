"""Searching files for answers: what students get must hold no graded stage, in whatever dress.

What must not be found is gathered from the reference, the solutions and hidden tests of every problem, the hidden
checks and the misconceptions; see :func:`gather`. It is looked for in two ways:

* as *text*: expressions and runs of statements with all white space, brackets and comments gone, so that it is found in
  prose, in a docstring or in a file of any kind;
* as a *shape*: the syntax tree of a function's body or of a long expression with its variables numbered, so that it is
  found under other names.
"""

from __future__ import annotations

import ast
import json
import re
from dataclasses import dataclass, field

# A word of the grading side has no business in the kit, not even in a comment.
MARKERS = (
    "roboloc_reference",
    "BEGIN SOLUTION",
    "END SOLUTION",
    "BEGIN HIDDEN TESTS",
    "END HIDDEN TESTS",
    "BEGIN MARK SCHEME",
    "END MARK SCHEME",
    "from autograder",
    "import autograder",
)
# An expression of the reference with this many operators is an answer wherever it stands, ...
OPERATORS = 4
# ... and one with this many under any names: rotating a vector takes one less, and everybody does it.
ANONYMOUS_OPERATORS = 5
# A function's body of fewer nodes of the syntax tree could be anybody's.
NODES = 25
# Characters of a hidden line or sentence that nobody writes by chance, with the white space gone.
CHARACTERS = 24
_SOLUTION = re.compile(r"^[^\n]*BEGIN SOLUTION[^\n]*\n(.*?)^[^\n]*END SOLUTION", re.MULTILINE | re.DOTALL)
_HIDDEN = re.compile(
    r"^[^\n]*BEGIN (HIDDEN TESTS|MARK SCHEME)[^\n]*\n(.*?)^[^\n]*END \1", re.MULTILINE | re.DOTALL
)


@dataclass(frozen=True)
class Answers:
    """What must not be found: pieces of text and shapes of code, each with where it comes from."""

    text: dict[str, str] = field(default_factory=dict)
    shapes: dict[str, str] = field(default_factory=dict)

    def add(self, other: Answers) -> None:
        """Take over all of another one."""
        self.text.update(other.text)
        self.shapes.update(other.shapes)


def squash(text: str) -> str:
    r"""Drop what does not tell one piece of code from another: white space, brackets and commas.

    >>> squash("a + (b\n   * c)") == squash("a+b*c")
    True
    """
    return re.sub(r"[\s()\[\],]+", "", text)


def without_comments(text: str) -> str:
    """Drop comments, and all else from a hash to the end of a line."""
    return re.sub(r"#.*", "", text)


# ------------------------------------------------------------------------------------------------ code


class _Numbered(ast.NodeTransformer):
    """Give names the number of their first occurrence, and take annotations away."""

    def __init__(self) -> None:
        self.names: dict[str, str] = {}

    def _number(self, name: str) -> str:
        return self.names.setdefault(name, f"v{len(self.names)}")

    def visit_Name(self, node: ast.Name) -> ast.Name:
        return ast.Name(self._number(node.id), node.ctx)

    def visit_arg(self, node: ast.arg) -> ast.arg:
        return ast.arg(self._number(node.arg))

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.AST:
        return self.generic_visit(ast.Assign([node.target], node.value or ast.Constant(None)))


def shape(nodes: list[ast.AST]) -> str:
    """Return a text that is the same for code that differs in its names alone.

    >>> one, two, other = (ast.parse(s).body for s in ("a = b * c", "x = y * z", "x = y * x"))
    >>> shape(one) == shape(two), shape(one) == shape(other)
    (True, False)
    """
    numbered = _Numbered()
    # Read again, not copied: see `student_source`.
    return "\n".join(ast.dump(numbered.visit(ast.parse(ast.unparse(node)))) for node in nodes)


def _body(function: ast.FunctionDef) -> list[ast.stmt]:
    """Return the statements of a function but its docstring and those that only check arguments."""
    return [s for s in function.body if not isinstance(s, ast.Expr) and "as_" not in ast.unparse(s)]


def _operators(node: ast.AST) -> int:
    return sum(isinstance(n, ast.BinOp) for n in ast.walk(node))


def shapes(source: str) -> dict[str, str]:
    """Return the shapes of a module's function bodies and long expressions, each with what it is."""
    found = {}
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.FunctionDef):
            body = _body(node)
            if sum(1 for statement in body for _ in ast.walk(statement)) >= NODES:
                found[shape(body)] = f"the body of {node.name}"
        elif isinstance(node, ast.BinOp) and _operators(node) >= ANONYMOUS_OPERATORS:
            found[shape([node])] = ast.unparse(node)
    return found


def expressions(source: str) -> dict[str, str]:
    """Return the squashed arithmetic expressions of at least `OPERATORS` operators."""
    nodes = [
        n for n in ast.walk(ast.parse(source)) if isinstance(n, ast.BinOp) and _operators(n) >= OPERATORS
    ]
    return {squash(ast.unparse(node)): ast.unparse(node) for node in nodes}


def runs(statements: list[ast.stmt]) -> dict[str, str]:
    """Return every three statements on end, squashed."""
    texts = list(map(ast.unparse, statements))
    joined = ["\n".join(three) for three in zip(texts, texts[1:], texts[2:], strict=False)]
    return {squash(text): text for text in joined if len(squash(text)) >= CHARACTERS}


def of_code(source: str, *, whole: bool = True) -> Answers:
    """Return what only someone who knows the answer writes.

    Parameters
    ----------
    source : str
        Python.
    whole : bool, optional
        Whether statements of a module count as those of a function do.

    Returns
    -------
    Answers
        Expressions, runs of statements, shapes.
    """
    tree = ast.parse(source)
    text = expressions(source)
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            text |= runs(_body(node))
    if whole:
        text |= runs([s for s in tree.body if not isinstance(s, (ast.Import, ast.ImportFrom))])
    return Answers(text, shapes(source))


# ------------------------------------------------------------------------------------------------ problems


def lines_of(text: str) -> dict[str, str]:
    """Return the squashed lines that nobody writes by chance."""
    return {squash(line): line.strip() for line in text.splitlines() if len(squash(line)) >= CHARACTERS}


def of_problem(text: str) -> Answers:
    """Return the solutions, hidden tests and mark schemes of a problem's source.

    Parameters
    ----------
    text : str
        A MyST notebook.

    Returns
    -------
    Answers
        A solution in Python counts as code does, any other by its lines, and so does what is hidden.
    """
    found = Answers()
    for match in _SOLUTION.finditer(text):
        try:
            found.add(of_code(match[1]))
        except SyntaxError:
            found.add(Answers(lines_of(match[1])))
    for match in _HIDDEN.finditer(text):
        found.add(Answers(lines_of(match[2])))
    return found


def gather(files: dict[str, bytes]) -> Answers:
    """Return what must not be found, from the files of the side that students do not see.

    Parameters
    ----------
    files : dict of str to bytes
        Python modules and the Markdown sources of problems, by path.

    Returns
    -------
    Answers
        With the path each comes from.
    """
    found = Answers()
    for path, data in sorted(files.items()):
        text = data.decode()
        if path.endswith(".py"):
            one = of_code(text, whole=False)
        elif path.endswith(".md"):
            one = of_problem(text)
        else:
            continue
        found.add(
            Answers(
                {k: f"{v} ({path})" for k, v in one.text.items()},
                {k: f"{v} ({path})" for k, v in one.shapes.items()},
            )
        )
    return found


# ------------------------------------------------------------------------------------------------ search


def cells_of(path: str, data: bytes) -> list[tuple[str, str]]:
    """Return kind and source of a notebook's cells; any other file is one cell of text or code."""
    text = data.decode(errors="replace")
    if path.endswith(".ipynb"):
        return [(cell["cell_type"], "".join(cell["source"])) for cell in json.loads(text)["cells"]]
    return [("code" if path.endswith(".py") else "text", text)]


def find_leaks(files: dict[str, bytes], answers: Answers, secrets: tuple[str, ...] = ()) -> list[str]:
    """Return one line for each trace of an answer, a marker or a secret in `files`."""
    leaks = []
    for path, data in sorted(files.items()):
        cells = cells_of(path, data)
        text = "\n".join([*(source for _, source in cells), data.decode(errors="replace")])
        leaks += [f"{path}: has the words '{marker}'" for marker in MARKERS if marker in text]
        leaks += [f"{path}: has the course secret" for secret in secrets if secret in text]
        squashed = squash(text), squash(without_comments(text))
        leaks += [
            f"{path}: has an expression of the reference: {where}"
            for piece, where in answers.text.items()
            if any(piece in one for one in squashed)
        ]
        for source in [source for kind, source in cells if kind == "code"]:
            try:
                own = shapes(source)
            except SyntaxError:  # a notebook's cell with a magic command
                continue
            leaks += [
                f"{path}: has {what}, which is {answers.shapes[one]} under other names"
                for one, what in own.items()
                if one in answers.shapes
            ]
    return leaks
