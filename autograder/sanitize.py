"""HTML for the pages that people read: feedback, and the formgrader, where a script would act as the instructor.

`HTMLExporter.sanitize_html` alone does not keep a submission's scripts out: nbgrader's templates put Markdown cells
into the page past it, and what it does clean loses its tables and headings. The two filters here take the places of
those of the same names in nbconvert, which the templates call.
"""

from __future__ import annotations

import functools
import re
from html import escape
from typing import TYPE_CHECKING, Any

import bleach
from jinja2 import pass_context
from nbconvert.filters.markdown_mistune import IPythonRenderer, MarkdownWithMath

from .outputs import MAX_TAGS, TAGS, TEX_REACHES_OUT, tame_formulas

if TYPE_CHECKING:
    from collections.abc import Callable

_TAGS = TAGS | {"a", "del", "img"}
_ATTRIBUTES = {"a": {"title"}, "th": {"align"}, "td": {"align"}}
_LINK = re.compile(r"(https?://|mailto:|#)", re.IGNORECASE)
_PICTURE = re.compile(r"data:image/(png|jpeg);base64,[A-Za-z0-9+/=\s]*")
_PROTOCOLS = bleach.ALLOWED_PROTOCOLS | {"data"}  # of pictures alone: see `_allowed`
_COLOUR = re.compile(
    r"(highlight( hl-\w+)?|[a-z][a-z0-9]{0,2}|ansi-[a-z-]+)( ansi-[a-z-]+)*"
)  # classes of highlighting
_NO_TEXT = re.compile(
    r"<img(?![^>]*\salt=)"
)  # in clean HTML: no sign of `>` stands before an alternative text
SHORT = 20_000  # characters


def remembered(function: Callable[[str], str]) -> Callable[[str], str]:
    """Return the function, which remembers what it made of short texts: those of the instructor's cells come again.

    Parameters
    ----------
    function : callable
        Of a text alone.

    Returns
    -------
    callable
        The same function.
    """
    cached = functools.lru_cache(maxsize=512)(function)

    @functools.wraps(function)
    def call(text: str) -> str:
        return cached(text) if len(text) <= SHORT else function(text)

    return call


def _allowed(tag: str, name: str, value: str) -> bool:
    if tag == "a" and name == "href":
        return _LINK.match(value) is not None
    if tag == "img":
        return name == "alt" or (name == "src" and _PICTURE.fullmatch(value) is not None)
    if name == "class":
        return _COLOUR.fullmatch(value) is not None
    return name in _ATTRIBUTES.get(tag, ())


def clean_html(element: Any) -> str:
    """Return HTML without anything that a browser would run, load or take for a part of the page.

    Parameters
    ----------
    element : object
        HTML; what is not text is made text.

    Returns
    -------
    str
        The same with the tags of plain text, tables, links, highlighted code and embedded pictures only.

    Examples
    --------
    >>> clean_html('<p id="x" onclick="f()">3 m<script>f()</script></p>')
    '<p>3 mf()</p>'
    """
    text = element.decode("utf-8", "replace") if isinstance(element, bytes) else str(element)
    return _clean(text)


@remembered
def _clean(text: str) -> str:
    clean = bleach.clean(
        text, tags=_TAGS, attributes=_allowed, protocols=_PROTOCOLS, strip=True, strip_comments=True
    )
    return _NO_TEXT.sub('<img alt="picture without a description"', clean)


@pass_context
def markdown2html(context: Any, source: str) -> str:
    r"""Return Markdown as clean HTML, formulas included.

    Parameters
    ----------
    context : jinja2.runtime.Context
        The template's; a cell of it may have attachments.
    source : str
        Markdown.

    Returns
    -------
    str
        HTML.

    Examples
    --------
    >>> markdown2html({}, r"*Because* $\href{javascript:f()}{x}$ <img src=x onerror=f()>").strip()
    '<p><em>Because</em> $href{javascript:f()}{x}$ <img alt="picture without a description"></p>'
    """
    if source.count("<") > MAX_TAGS:
        return f"<pre>{escape(source)}</pre>"
    cell = context.get("cell") or {}
    attachments = cell.get("attachments", {})
    return _from_markdown(source, attachments) if attachments else _markdown(source)


@remembered
def _markdown(source: str) -> str:
    return _from_markdown(source, {})


class _Attached(dict):
    """Attachments of a cell; one that is missing is an empty picture: nbconvert would give up the page for it."""

    def __contains__(self, name: object) -> bool:
        return True

    def __missing__(self, name: str) -> dict[str, str]:
        return {"image/png": ""}


def _from_markdown(source: str, attachments: dict[str, Any]) -> str:
    renderer = IPythonRenderer(escape=False, attachments=_Attached(attachments), exclude_anchor_links=True)
    # Before, since a formula is not Markdown; and after, since Markdown can write a backslash in other ways.
    html = MarkdownWithMath(renderer=renderer).render(TEX_REACHES_OUT.sub("", source))
    return tame_formulas(clean_html(html))
