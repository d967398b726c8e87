"""Sphinx extension of the book: pages that need nothing from outside, and that follow the code they run.

* The folder `build/vendor`, made by `tools/vendor.py`, is copied into the book's `_static`; without it the
  build stops before any page is run. MathJax, require.js and the widget manager are loaded from there.
* A browser refuses to load fonts for a page opened from a disk. The theme's icon font is therefore written
  into its style sheet, and the pages no longer ask for it separately.
* What Jupyter Book's other extensions would load from the network on demand is taken out of the pages.
* Markup that screen readers stumble over is put right (`MARKUP`).
* The execution cache knows the cells of a page but not the packages they import. Its folder is therefore
  named by a hash of those packages, and a change of the hash makes Sphinx read every page again.
"""

# ruff: noqa: INP001 - Sphinx imports this file by its folder

from __future__ import annotations

import base64
import hashlib
import re
import shutil
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sphinx.application import Sphinx
    from sphinx.config import Config

# What must be in the vendor folder, by its use.
MATHJAX = "mathjax/tex-svg.js"
REQUIRE = "requirejs/require.js"
WIDGETS = "html-manager/embed-amd.js"

# Replacements in every page: (pattern, replacement). Each repairs output of the theme or of an extension.
MARKUP = [
    # The icon font is in the style sheet; asking for it beforehand would fail.
    (r'<link rel="preload" as="font"[^>]*>\s*', ""),
    # WAI-ARIA 1.2 deprecates this role, and the parent is a list.
    (r'role="doc-biblioentry"', 'role="listitem"'),
    # A name that differs from the text in view is useless to those who speak to their browser.
    (r'<summary aria-label="Toggle hidden content">', "<summary>"),
    (r'(<button class="btn search-button-field[^>]*?)\s*aria-label="[^"]*"', r"\1"),
]


def setup(app: Sphinx) -> dict[str, Any]:
    """Register with Sphinx."""
    app.add_config_value("roboloc_vendor", "build/vendor", "html", [str])
    app.add_config_value("roboloc_code", ["src"], "html", [list])
    app.add_config_value("roboloc_code_hash", "", "env", [str])
    # Before MyST-NB reads its own settings, which it does at the default priority.
    app.connect("config-inited", _use_vendor_folder, priority=100)
    app.connect("config-inited", _follow_code, priority=101)
    app.connect("html-page-context", _drop_live_code, priority=900)
    app.connect("build-finished", _finish_pages, priority=900)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}


def _use_vendor_folder(app: Sphinx, config: Config) -> None:
    """Point every browser library at the vendor folder, or stop the build with one line."""
    vendor = Path(app.srcdir, config.roboloc_vendor)
    missing = [name for name in (MATHJAX, REQUIRE, WIDGETS) if not (vendor / name).is_file()]
    if missing:
        # An ordinary error would be buried under Jupyter Book's own traceback.
        sys.exit(
            f"book: browser files are missing ({config.roboloc_vendor}/{missing[0]}): "
            "run `make setup`, or `python tools/vendor.py`, and build again"
        )
    config.html_static_path = [*config.html_static_path, str(vendor)]
    config.mathjax_path = MATHJAX
    config.nb_ipywidgets_js = {REQUIRE: {}, WIDGETS: {"data-jupyter-widgets-cdn-only": ""}}


def _follow_code(app: Sphinx, config: Config) -> None:
    """Name the execution cache by the code that pages import, and remove caches of other code."""
    digest = hashlib.sha256()
    for folder in config.roboloc_code:
        for path in sorted(Path(app.srcdir, folder).rglob("*.py")):
            name = path.relative_to(app.srcdir).as_posix().encode()
            digest.update(name + b"\0" + path.read_bytes() + b"\0")
    config.roboloc_code_hash = digest.hexdigest()[:16]
    caches = Path(app.outdir).parent / ".jupyter_cache"
    for old in caches.glob("*"):
        if old.name != config.roboloc_code_hash:
            shutil.rmtree(old) if old.is_dir() else old.unlink()
    config.nb_execution_cache_path = str(caches / config.roboloc_code_hash)


def _drop_live_code(_app: Sphinx, _page: str, _template: str, context: dict, _doctree: object) -> None:
    """Take sphinx-thebe's files off the page: they name an address outside and serve nothing here."""

    def is_kept(asset: Any) -> bool:
        name = str(getattr(asset, "filename", asset) or "")
        body = getattr(asset, "attributes", {}).get("body") or ""
        return "thebe" not in name and "THEBE_JS_URL" not in body

    for kind in ("script_files", "css_files"):
        context[kind] = [asset for asset in context[kind] if is_kept(asset)]


def _finish_pages(app: Sphinx, exception: Exception | None) -> None:
    """Repair the built pages and write the icon font into its style sheet."""
    if exception is not None or app.builder.format != "html":
        return
    outdir = Path(app.outdir)
    for page in outdir.rglob("*.html"):
        if "_static" in page.relative_to(outdir).parts:
            continue
        old = new = page.read_text(encoding="utf-8")
        for pattern, replacement in MARKUP:
            new = re.sub(pattern, replacement, new)
        if new != old:
            page.write_text(new, encoding="utf-8")
    for sheet in outdir.glob("_static/vendor/fontawesome/*/css/all.min.css"):
        _write_font_into(sheet)


def _write_font_into(sheet: Path) -> None:
    """Keep the two faces of Font Awesome 6 Free, as data addresses, and drop the others, which no page uses."""

    def face(match: re.Match) -> str:
        family, file = (
            re.search(r"font-family:([^;]*)", match[0]),
            re.search(r"url\(([^)]*\.woff2)\)", match[0]),
        )
        if not (family and file) or family[1] != r"Font Awesome\ 6 Free":
            return ""
        content = base64.b64encode((sheet.parent / file[1]).read_bytes()).decode()
        return re.sub(r"src:[^;}]*", f'src:url(data:font/woff2;base64,{content}) format("woff2")', match[0])

    text = sheet.read_text(encoding="utf-8")
    if "base64" not in text:
        sheet.write_text(re.sub(r"@font-face\{[^}]*\}", face, text), encoding="utf-8")
