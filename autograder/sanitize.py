"""HTML for the pages that people read: feedback, and the formgrader, where a script would act as the instructor.

`HTMLExporter.sanitize_html` alone does not keep a submission's scripts out: nbgrader's templates put Markdown cells
into the page past it, and what it does clean loses its tables and headings. The two filters here take the places of
those of the same names in nbconvert, which the templates call.
"""

from __future__ import annotations

import re
from typing import Any

import bleach
from jinja2 import pass_context
from nbconvert.filters.markdown_mistune import IPythonRenderer, MarkdownWithMath

from .outputs import TAGS

_TAGS = TAGS | {"a", "del", "img"}
_ATTRIBUTES = {"a": {"title"}, "th": {"align"}, "td": {"align"}}
_LINK = re.compile(r"(https?://|mailto:|#)", re.IGNORECASE)
_PICTURE = re.compile(r"data:image/(png|jpeg);base64,[A-Za-z0-9+/=\s]*")
_COLOUR = re.compile(
    r"(highlight( hl-\w+)?|[a-z][a-z0-9]{0,2}|ansi-[a-z-]+)( ansi-[a-z-]+)*"
)  # classes of highlighting
# Commands of TeX with which MathJax reaches outside mathematics.
_TEX_REACHES_OUT = re.compile(r"\\(?=(?:href|require|class|cssId|style|unicode|include|url)\b)")


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
    return bleach.clean(text, tags=_TAGS, attributes=_allowed, strip=True, strip_comments=True)


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
    '<p><em>Because</em> $href{javascript:f()}{x}$ <img></p>'
    """
    cell = context.get("cell") or {}
    renderer = IPythonRenderer(
        escape=False, attachments=cell.get("attachments", {}), exclude_anchor_links=True
    )
    return clean_html(MarkdownWithMath(renderer=renderer).render(_TEX_REACHES_OUT.sub("", source)))
