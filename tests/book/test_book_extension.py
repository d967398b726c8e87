"""The book's Sphinx extension and the vendor folder it needs."""

import hashlib
import json
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from browser.browser import visit
from ipywidgets import IntSlider
from ipywidgets.embed import embed_minimal_html

ROOT = Path(__file__).resolve().parents[2]
VENDOR = ROOT / "build" / "vendor"


@pytest.fixture(scope="module")
def extension():
    """Import the extension as Sphinx does, from its folder."""
    sys.path.insert(0, str(ROOT / "book" / "_ext"))
    try:
        import roboloc_book  # noqa: PLC0415 - after the path is set
    finally:
        sys.path.pop(0)
    return roboloc_book


@pytest.fixture
def project(tmp_path):
    """Write the smallest Sphinx project that uses the extension."""
    (tmp_path / "src").mkdir()
    (tmp_path / "index.rst").write_text("Title\n=====\n\n.. math:: x\n")
    path = str(ROOT / "book" / "_ext")
    (tmp_path / "conf.py").write_text(
        f"import sys\nsys.path.insert(0, {path!r})\nextensions = ['roboloc_book']\n"
    )
    return tmp_path


def test_build_stops_with_one_line_without_the_vendor_folder(project):
    """Without the vendor folder no page is built, and the message says what is missing and what to do."""
    command = [sys.executable, "-m", "sphinx", "-b", "html", str(project), str(project / "out")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert not (project / "out" / "index.html").exists()
    lines = [line for line in done.stderr.splitlines() if "vendor" in line]
    assert len(lines) == 1
    assert "build/vendor/mathjax/tex-svg.js" in lines[0]
    assert "run `make setup`" in lines[0]
    assert "Traceback" not in done.stderr


def test_cache_follows_the_code(extension, project):
    """A change of the code that pages import gives the execution cache another name and removes the old one."""
    build = project / "_build"
    app = SimpleNamespace(srcdir=project, outdir=build / "html")
    config = SimpleNamespace(roboloc_code=["src"])
    module = project / "src" / "module.py"
    names = []
    for text in ("a = 1\n", "a = 1\n", "a = 2\n"):
        module.write_text(text)
        extension._follow_code(app, config)
        Path(config.nb_execution_cache_path).mkdir(parents=True, exist_ok=True)
        names.append(config.roboloc_code_hash)
    assert names[0] == names[1] != names[2]
    assert [path.name for path in (build / ".jupyter_cache").iterdir()] == [names[2]]


def test_icon_font_is_written_into_its_style_sheet(extension, tmp_path):
    """The sheet keeps the faces that pages use, as data, asks for no file, and stays as it is the second time."""
    import pydata_sphinx_theme  # noqa: PLC0415 - for its files alone

    theme = Path(pydata_sphinx_theme.__file__).parent / "theme" / "pydata_sphinx_theme" / "static"
    (original,) = theme.glob("vendor/fontawesome/*/css/all.min.css")
    fonts = tmp_path / "webfonts"
    fonts.mkdir()
    for font in (original.parent.parent / "webfonts").glob("*.woff2"):
        (fonts / font.name).write_bytes(font.read_bytes())
    (tmp_path / "css").mkdir()
    sheet = tmp_path / "css" / "all.min.css"
    sheet.write_text(original.read_text(encoding="utf-8"), encoding="utf-8")
    extension._write_font_into(sheet)
    once = sheet.read_text(encoding="utf-8")
    assert once.count("@font-face") == 2
    assert set(re.findall(r"url\((.{10})", once)) == {"data:font/"}
    extension._write_font_into(sheet)
    assert sheet.read_text(encoding="utf-8") == once


def test_vendor_folder_is_that_of_the_lock_file():
    """The vendor folder holds the locked versions, and the tool that made it agrees that it is current."""
    locked = json.loads((ROOT / "package-lock.json").read_text())["packages"]
    versions = json.loads((VENDOR / "versions.json").read_text())
    assert versions["mathjax"] == locked["node_modules/mathjax"]["version"]
    check = [sys.executable, str(ROOT / "tools" / "vendor.py"), "--check"]
    assert subprocess.run(check, check=False).returncode == 0


def test_lock_file_names_hashes_and_no_address():
    """Every npm package is fixed by its hash and found by its name alone."""
    packages = json.loads((ROOT / "package-lock.json").read_text())["packages"]
    assert len(packages) > 5
    for name, package in packages.items():
        assert "resolved" not in package, name
        assert not name or re.match(r"sha512-", package["integrity"]), name


def test_mathjax_is_copied_unchanged():
    """The copied MathJax is the package's file, byte for byte."""
    copy, original = (
        hashlib.sha256(path.read_bytes()).digest()
        for path in (
            VENDOR / "mathjax" / "tex-svg.js",
            ROOT / "node_modules" / "mathjax" / "es5" / "tex-svg.js",
        )
    )
    assert copy == original


def test_widgets_show_without_a_network(extension, tmp_path):
    """A page with a widget, opened from the disk, draws it from the vendor folder and asks for nothing else."""
    page = tmp_path / "widget.html"
    embed_minimal_html(page, views=[IntSlider(value=7, description="seven")], title="Widget")
    text = page.read_text(encoding="utf-8")
    loaders = re.findall(r'<script\s[^>]*src="https://[^"]+"[^>]*></script>', text)
    assert loaders
    for loader in loaders:
        text = text.replace(loader, "")
    scripts = f'<script src="{(VENDOR / extension.REQUIRE).as_uri()}"></script>'
    scripts += (
        f'<script data-jupyter-widgets-cdn-only src="{(VENDOR / extension.WIDGETS).as_uri()}"></script>'
    )
    page.write_text(text.replace("</head>", scripts + "</head>"), encoding="utf-8")
    run = "return document.querySelector('.widget-readout').textContent"
    (report,) = visit([{"url": page.as_uri(), "wait": ".widget-readout", "run": run}])
    assert report["value"] == "7"
    assert not report["errors"]
    for request in report["requests"]:
        assert request["failure"] is None, request
        assert request["url"].startswith(("file://", "data:", "blob:")), request
