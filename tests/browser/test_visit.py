"""The browser helper sees what it is there to see: a page with a fault of each kind is reported with that fault."""

import http.server
import shutil
import threading

import pytest
from browser.browser import visit

GOOD = "<!doctype html><html lang='en'><title>Good</title><main><h1>Good</h1><p>Nothing to see.</p></main></html>"


@pytest.fixture
def page(tmp_path):
    """Write a page and give its address."""

    def write(body, name="page.html"):
        path = tmp_path / name
        path.write_text(body, encoding="utf-8")
        return path.as_uri()

    return write


def test_good_page_has_nothing_to_report(page):
    """A page without faults gets an empty report."""
    (report,) = visit([{"url": page(GOOD), "axe": True, "width": 360}])
    assert report["title"] == "Good"
    assert [r["failure"] for r in report["requests"]] == [None]
    assert not report["console"]
    assert not report["errors"]
    assert not report["axe"]
    assert report["width"]["page"] == report["width"]["window"] == 360
    assert report["math"] == {"containers": 0, "errors": 0, "raw": 0}


def test_requests_are_seen_whether_they_succeed_or_not(page):
    """A missing file, an address on the network and a page of a server that says 404 are all reported as failed."""

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_error(404)

        def log_message(self, *args):
            pass

    server = http.server.HTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    body = "<img alt='b' src='missing.png'><img alt='c' src='http://127.0.0.1:9/closed.png'>"
    try:
        served = {"url": f"http://127.0.0.1:{server.server_port}/nothing"}
        here, there = visit([{"url": page(GOOD + body)}, served])
    finally:
        server.shutdown()
        server.server_close()
    failures = {r["url"].rsplit("/", 1)[1]: r["failure"] for r in here["requests"] + there["requests"]}
    assert failures["page.html"] is None
    assert failures["missing.png"]
    assert failures["closed.png"]
    assert failures["nothing"] == "status 404"


def test_complaints_and_exceptions_are_seen(page):
    """What a page logs as an error, and what it throws, is in the report."""
    body = "<script>console.error('spilt milk'); throw new TypeError('no use crying')</script>"
    (report,) = visit([{"url": page(GOOD + body)}])
    assert [m["text"] for m in report["console"]] == ["spilt milk"]
    assert "no use crying" in report["errors"][0]


def test_wide_pages_are_seen_and_boxes_that_scroll_are_not_blamed(page):
    """What makes a page wider than its window is named, and a wide thing in a scrolling box is not."""
    wide = "<div id='wide' style='width: 500px'>wide</div>"
    scrolling = f"<div style='overflow-x: auto'>{wide}</div>"
    outside, inside = visit(
        [
            {"url": page(GOOD + wide, "outside.html"), "width": 360},
            {"url": page(GOOD + scrolling, "inside.html"), "width": 360},
        ]
    )
    assert outside["width"]["page"] > 360
    assert any("wide" in element for element in outside["width"]["wider"])
    assert inside["width"]["page"] == 360
    assert not inside["width"]["wider"]


def test_formulas_left_as_text_are_seen(page):
    """A formula that no script has drawn, and one that MathJax has marked as wrong, are counted."""
    drawn = "<mjx-container><mjx-merror>?</mjx-merror></mjx-container>"
    body = f"<span class='math'>\\(x\\)</span><div class='math'>{drawn}</div>"
    (report,) = visit([{"url": page(GOOD + body)}])
    assert report["math"] == {"containers": 1, "errors": 1, "raw": 1}


def test_accessibility_faults_are_seen(page):
    """A picture without alternative text, and grey on grey, are found by axe-core, and by the rule alone."""
    body = "<img src='data:image/gif;base64,R0lGODlhAQABAAAAACw='><p style='color: #999; background: #aaa'>faint</p>"
    url = page(GOOD.replace("</main>", body + "</main>"))
    every, one = visit([{"url": url, "axe": True}, {"url": url, "axe": ["color-contrast"]}])
    assert {v["id"] for v in every["axe"]} == {"image-alt", "color-contrast"}
    assert {v["id"] for v in one["axe"]} == {"color-contrast"}


def test_theme_is_the_one_asked_for(page):
    """A page sees the colour scheme of the visit, and finds it where the book's theme keeps it."""
    run = "return [matchMedia('(prefers-color-scheme: dark)').matches, localStorage.getItem('mode')]"
    url = page(GOOD)
    light, dark = visit([{"url": url, "run": run}, {"url": url, "run": run, "theme": "dark"}], parallel=1)
    assert light["value"] == [False, "light"]
    assert dark["value"] == [True, "dark"]


def test_views_show_one_page_in_turn(page):
    """A page that is loaded once is reported in each theme and width asked for, with what it asks for only then."""
    body = """<style>p { color: #000 } [data-theme=dark] p { color: #999; background: #aaa }</style><p>words</p><script>
      matchMedia("(max-width: 500px)").addEventListener("change", () => console.error("narrow"));
    </script>"""
    dark = "matchMedia('(prefers-color-scheme: dark)').matches"
    run = f"return [{dark}, innerWidth, document.documentElement.dataset.theme]"
    views = [
        {"run": run},
        {"run": run, "theme": "dark", "axe": ["color-contrast"]},
        {"run": run, "width": 360},
    ]
    first, dark, narrow, other = visit(
        [{"url": page(GOOD + body), "views": views}, {"url": page(GOOD, "other.html")}]
    )
    assert first["value"] == [False, 1280, None]
    assert dark["value"] == [True, 1280, "dark"]
    assert [v["id"] for v in dark["axe"]] == ["color-contrast"]
    assert narrow["value"] == [False, 360, "light"]
    assert [len(report["console"]) for report in (first, dark, narrow, other)] == [0, 0, 1, 0]


@pytest.mark.parametrize("missing", ["chromium", "node"])
def test_missing_program_is_a_failure(monkeypatch, missing):
    """Without Chromium or Node.js a visit fails and says what to do."""
    found = shutil.which
    monkeypatch.setattr(shutil, "which", lambda name: None if name == missing else found(name))
    with pytest.raises(RuntimeError, match=f"{missing} is not on the path; `make setup` installs it"):
        visit([])


def test_browser_that_does_not_start_is_a_failure(monkeypatch):
    """A program that is no browser is an error, and not an empty report."""
    found = shutil.which
    monkeypatch.setattr(shutil, "which", lambda name: found("false") if name == "chromium" else found(name))
    with pytest.raises(RuntimeError, match="the browser failed"):
        visit([{"url": "about:blank"}])
