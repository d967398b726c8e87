"""What of a submission's outputs is kept: text and pictures, nothing that a browser would run."""

from __future__ import annotations

import base64
import binascii
import re
from html import unescape
from typing import Any

import bleach
from nbformat.v4 import new_output

MAX_CHARACTERS = 4_000_000
MAX_NOTEBOOK = 32_000_000  # characters of all outputs of a notebook; a tag of HTML counts as so many:
TAG = 400
MAX_TAGS = 10_000  # in one output: to clean them takes the square of it where they are nested
TAGS = frozenset(
    [
        "b",
        "blockquote",
        "br",
        "caption",
        "code",
        "dd",
        "div",
        "dl",
        "dt",
        "em",
        "h1",
        "h2",
        "h3",
        "h4",
        "h5",
        "h6",
        "hr",
        "i",
        "kbd",
        "li",
        "ol",
        "p",
        "pre",
        "s",
        "small",
        "span",
        "strong",
        "sub",
        "sup",
        "table",
        "tbody",
        "td",
        "tfoot",
        "th",
        "thead",
        "tr",
        "u",
        "ul",
        "var",
    ]
)
_PICTURES = {"image/png": b"\x89PNG", "image/jpeg": b"\xff\xd8\xff"}
# The backslash of commands of TeX with which MathJax reaches outside mathematics.
TEX_REACHES_OUT = re.compile(r"\\(?=(?:href|require|class|cssId|style|unicode|include|url|mmlToken|bbox)\b)")
_ENTITY = re.compile(r"&#?\w{1,32};?", re.ASCII)
_ANSI = re.compile(r"\x1b\[[0-9;]*[A-Za-z]")


def clean(outputs: object) -> list[Any]:
    """Return the outputs of a cell that may be shown.

    Parameters
    ----------
    outputs : object
        What the worker sent: supposed to be outputs in the notebook format, believed to be nothing.

    Returns
    -------
    list of nbformat.NotebookNode
        Valid outputs: streams, errors, and displays of text, cleaned HTML, TeX and pictures.

    Examples
    --------
    >>> clean([{"output_type": "display_data", "data": {"text/html": "<b onclick='f()'>3 m</b>"}}])
    [{'output_type': 'display_data', 'metadata': {}, 'data': {'text/html': '<b>3 m</b>'}}]
    """
    return [kept for output in outputs if (kept := _one(output)) is not None] if type(outputs) is list else []


def tame_formulas(html: str) -> str:
    r"""Return clean HTML in whose formulas no command reaches outside mathematics.

    Parameters
    ----------
    html : str
        Whose markup is harmless.

    Returns
    -------
    str
        The same; characters that need no entity stand as themselves.

    Examples
    --------
    >>> tame_formulas(r"<p>$\frac{1}{2}$ &lt; $&#92;&#104;ref{x}{y}$</p>")
    '<p>$\\frac{1}{2}$ &lt; $href{x}{y}$</p>'
    """

    def plain(entity: re.Match) -> str:
        character = unescape(entity[0])
        return entity[0] if set(character) & set("<>&\"'") else character

    return TEX_REACHES_OUT.sub("", _ENTITY.sub(plain, html))


def weight(outputs: object) -> int:
    """Return what it takes to keep outputs as they come.

    Parameters
    ----------
    outputs : object
        What the worker sent.

    Returns
    -------
    int
        Characters of text, markup and pictures; a tag counts as many, since it is to be cleaned.

    Examples
    --------
    >>> weight([{"output_type": "stream", "text": "3 m"}])
    9
    """
    if type(outputs) is str:
        return len(outputs) + TAG * outputs.count("<")
    if type(outputs) is dict:
        outputs = list(outputs.values())
    return sum(map(weight, outputs)) if type(outputs) is list else 0


def error(ename: str, evalue: str) -> Any:
    """Return an error output.

    Parameters
    ----------
    ename, evalue : str
        What a notebook shows as class and text of an exception.

    Returns
    -------
    nbformat.NotebookNode
        The output.
    """
    return new_output("error", ename=ename, evalue=evalue, traceback=f"{ename}: {evalue}".split("\n"))


def _one(output: object) -> Any:
    if type(output) is not dict:
        return None
    kind = output.get("output_type")
    if kind == "stream" and output.get("name") in ("stdout", "stderr"):
        return new_output("stream", name=output["name"], text=_text(output.get("text")))
    if kind == "error":
        lines = output.get("traceback")
        shown = [_ANSI.sub("", _text(line)) for line in lines] if type(lines) is list else []
        return new_output(
            "error", ename=_text(output.get("ename")), evalue=_text(output.get("evalue")), traceback=shown
        )
    if kind in ("display_data", "execute_result") and type(output.get("data")) is dict:
        data = _data(output["data"])
        more = {"execution_count": None} if kind == "execute_result" else {}
        return new_output(kind, data=data, **more) if data else None
    return None


def _data(data: dict) -> dict[str, str]:
    kept = {}
    for mime, value in data.items():
        if type(value) is not str or len(value) > MAX_CHARACTERS:
            continue
        if mime == "text/plain":
            kept[mime] = _text(value)
        elif mime == "text/html" and value.count("<") <= MAX_TAGS:
            shown = bleach.clean(value, tags=TAGS, attributes={}, strip=True, strip_comments=True)
            kept[mime] = tame_formulas(shown)
        elif (
            mime == "text/latex" and not re.search("[<>]", value) and not TEX_REACHES_OUT.search(value)
        ) or (mime in _PICTURES and _is_picture(value, _PICTURES[mime])):
            kept[mime] = value
    return kept


def _is_picture(value: str, signature: bytes) -> bool:
    try:
        return (
            base64.b64decode(value, validate=False).startswith(signature)
            and '"' not in value
            and "<" not in value
        )
    except (binascii.Error, ValueError):
        return False


def _text(value: object) -> str:
    """Return text that is valid in a file: without lone surrogates and control characters."""
    if type(value) is not str:
        return ""
    plain = value.encode("utf-8", "replace").decode("utf-8")
    return "".join(c for c in plain if c in "\n\t\r\b\x1b" or ord(c) >= 32)
