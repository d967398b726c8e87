"""Sphinx extension of the book: local browser files, and pages that follow the code they run.

* The folder `build/vendor`, made by `tools/vendor.py`, is copied into the book's `_static`; without it the build
  stops before any page is run. MathJax, require.js and the widget manager are then loaded from there.
* What Jupyter Book's other extensions would load from the network on demand is taken out of the pages.
* The execution cache knows the cells of a page but not the packages they import. Its folder is therefore named
  by a hash of those packages, and a change of the hash makes Sphinx read every page again.
"""

import hashlib
import shutil
from pathlib import Path

from sphinx.errors import ExtensionError

# What must be in the vendor folder, by its use.
MATHJAX = "mathjax/tex-chtml.js"
REQUIRE = "requirejs/require.js"
WIDGETS = "html-manager/embed-amd.js"


def setup(app):
    """Register with Sphinx."""
    app.add_config_value("roboloc_vendor", "build/vendor", "html", [str])
    app.add_config_value("roboloc_code", ["src"], "html", [list])
    app.add_config_value("roboloc_code_hash", "", "env", [str])
    # Before MyST-NB reads its own settings, which it does at the default priority.
    app.connect("config-inited", _use_vendor_folder, priority=100)
    app.connect("config-inited", _follow_code, priority=101)
    app.connect("html-page-context", _drop_live_code, priority=900)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}


def _use_vendor_folder(app, config):
    """Point every browser library at the vendor folder, or stop the build with one line."""
    vendor = Path(app.srcdir, config.roboloc_vendor)
    missing = [name for name in (MATHJAX, REQUIRE, WIDGETS) if not (vendor / name).is_file()]
    if missing:
        raise ExtensionError(
            f"the book's browser files are missing ({config.roboloc_vendor}/{missing[0]}): run `make setup`, "
            "or `python tools/vendor.py`, and build again"
        )
    config.html_static_path = [*config.html_static_path, str(vendor)]
    config.mathjax_path = MATHJAX
    config.nb_ipywidgets_js = {REQUIRE: {}, WIDGETS: {"data-jupyter-widgets-cdn-only": ""}}


def _follow_code(app, config):
    """Name the execution cache by the code that pages import."""
    digest = hashlib.sha256()
    for folder in config.roboloc_code:
        for path in sorted(Path(app.srcdir, folder).rglob("*.py")):
            digest.update(
                path.relative_to(app.srcdir).as_posix().encode() + b"\0" + path.read_bytes() + b"\0"
            )
    config.roboloc_code_hash = digest.hexdigest()[:16]
    caches = Path(app.outdir).parent / ".jupyter_cache"
    for old in caches.glob("*"):
        if old.name != config.roboloc_code_hash:
            shutil.rmtree(old) if old.is_dir() else old.unlink()
    config.nb_execution_cache_path = str(caches / config.roboloc_code_hash)


def _drop_live_code(app, pagename, templatename, context, doctree):  # noqa: ARG001 - Sphinx's signature
    """Take sphinx-thebe's scripts off the page: they name an address outside and serve nothing here."""
    context["script_files"] = [
        script
        for script in context["script_files"]
        if "thebe" not in str(getattr(script, "filename", script) or "")
        and "THEBE_JS_URL" not in getattr(script, "attributes", {}).get("body", "")
    ]
    context["css_files"] = [
        sheet for sheet in context["css_files"] if "thebe" not in str(getattr(sheet, "filename", sheet) or "")
    ]
