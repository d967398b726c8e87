"""The built book in a browser: every page from the disk, in both themes, wide and narrow."""

import json
import os
import re
from pathlib import Path

import pytest
from browser.browser import locked, visit

ROOT = Path(__file__).resolve().parents[2]
# Where to put a picture of every visit, for people who want to look at all of them; none is made otherwise.
SCREENSHOTS = os.environ.get("ROBOLOC_SCREENSHOTS", "")
THEMES = ("light", "dark")
WIDTHS = (1280, 360)
# What axe-core asks that hangs on the width.
LAYOUT = [
    "scrollable-region-focusable",
    "link-name",
    "button-name",
    "aria-hidden-focus",
    "nested-interactive",
]
# A rule of axe-core that is not asked for, with the reason; empty, and to be kept so.
RULES_LEFT_OUT: dict[str, str] = {}
# Pages that Sphinx makes beside those of the table of contents.
GENERATED = ["search.html"]


def pages_of(html):
    """Return the addresses of all pages, relative to the built folder, the redirect at the root left out."""
    found = [path.relative_to(html) for path in sorted(html.rglob("*.html")) if "_static" not in path.parts]
    return [page.as_posix() for page in found if page.as_posix() != "index.html"]


def rules(page, theme, width):
    """Say what axe-core is asked for: a theme changes colours alone, and a width everything else."""
    if page == "book/index.html":
        return True
    if theme == "light":
        return True if width == max(WIDTHS) else LAYOUT
    return ["color-contrast"] if width == max(WIDTHS) else False


def picture(page, theme, width):
    """Say where the picture of a visit goes, if pictures are wanted."""
    if not SCREENSHOTS:
        return {}
    return {"full": True, "screenshot": str(Path(SCREENSHOTS) / f"{Path(page).stem}-{theme}-{width}.png")}


@pytest.fixture(scope="session")
def reports(html, tmp_path_factory):
    """Visit every page once in every theme and width, and share the reports among parallel test processes."""
    # Half of the pages are opened in the light theme and changed to the dark one, the others the other way round.
    views = {
        page: [(theme, width) for theme in THEMES[:: 1 - 2 * (number % 2)] for width in WIDTHS]
        for number, page in enumerate(pages_of(html))
    }
    cases = [(page, *view) for page, of in views.items() for view in of]
    with locked(tmp_path_factory, "visits") as folder:
        store = folder / "visits.json"
        if not store.exists():
            visits = [
                {
                    "url": (html / page).as_uri(),
                    "views": [
                        {
                            "theme": theme,
                            "width": width,
                            "axe": rules(page, theme, width),
                            "run": "return document.documentElement.dataset.theme",
                            **picture(page, theme, width),
                        }
                        for theme, width in of
                    ],
                }
                for page, of in views.items()
            ]
            store.write_text(json.dumps(visit(visits)))
        return dict(zip(cases, json.loads(store.read_text()), strict=True))


def test_every_page_was_visited(html, reports):
    """The book has its pages, each was opened in both themes at both widths, and shows the theme asked for."""
    pages = pages_of(html)
    sources = {f"book/{path.stem}.html" for path in (ROOT / "book").glob("*.md")}
    assert set(pages) == sources | set(GENERATED)
    assert len(reports) == len(pages) * 4
    assert all(report["value"] == theme for (_, theme, _), report in reports.items())


def test_no_page_asks_for_anything_outside_its_folder(html, reports):
    """Every request of every page goes to a file of the built folder and succeeds."""
    inside = html.as_uri() + "/"
    for case, report in reports.items():
        assert len(report["requests"]) > 5, case
        bad = [r for r in report["requests"] if not r["url"].startswith((inside, "data:")) or r["failure"]]
        assert not bad, case


def test_no_page_complains(reports):
    """No page logs a warning or an error or throws an exception."""
    for case, report in reports.items():
        assert not report["console"], case
        assert not report["errors"], case


def test_mathematics_is_rendered(html, reports):
    """Every formula of the sources is drawn, none is left as TeX, none is marked as an error."""
    for (page, theme, width), report in reports.items():
        text = (html / page).read_text(encoding="utf-8")
        expected = len(re.findall(r'<(?:span|div) class="(?:[\w-]+ )*math(?: [\w-]+)*"', text))
        math = report["math"]
        assert math["errors"] == 0, (page, theme, width)
        assert math["raw"] == 0, (page, theme, width)
        assert math["containers"] >= expected, (page, theme, width)
    assert reports["book/motion-and-the-limit.html", "light", 1280]["math"]["containers"] > 100


def test_no_page_scrolls_sideways(reports):
    """At 360 CSS pixels a page is no wider than its window; wide tables and formulas scroll in themselves."""
    for case, report in reports.items():
        assert report["width"]["page"] <= report["width"]["window"], (case, report["width"]["wider"])


def test_pages_are_accessible(reports):
    """The axe-core rules of WCAG 2.1 A and AA find nothing on any page, in either theme, wide or narrow."""
    for case, report in reports.items():
        assert (report["axe"] is None) == (not rules(*case)), case
        found = {v["id"]: [n["target"] for n in v["nodes"]] for v in report["axe"] or []}
        assert not {rule: nodes for rule, nodes in found.items() if rule not in RULES_LEFT_OUT}, case


def test_wide_formulas_can_be_reached_by_keyboard_and_scrolled_from_their_left_end(html):
    """On a narrow screen the box of a wide formula takes the focus and is cut off only at its right."""
    run = """
      const boxes = [...document.querySelectorAll("div.math")].filter((e) => e.scrollWidth > e.clientWidth + 1);
      return boxes.map((box) => ({
        focus: box.tabIndex,
        label: box.getAttribute("aria-label"),
        cut: box.getBoundingClientRect().left - box.querySelector("svg").getBoundingClientRect().left,
      }));
    """
    page = html / "book" / "motion-and-the-limit.html"
    (report,) = visit([{"url": page.as_uri(), "width": 360, "run": run}])
    assert len(report["value"]) > 5
    for box in report["value"]:
        assert box["focus"] == 0
        assert box["label"] == "Formula, scrolls sideways"
        assert box["cut"] <= 1


def test_first_page_leads_into_the_book(html):
    """The index.html that README names opens the landing page."""
    (report,) = visit([{"url": (html / "index.html").as_uri(), "wait": "article h1"}])
    assert report["title"].startswith("Robot localization")
    assert all(r["failure"] is None for r in report["requests"])


def test_search_finds_a_page_without_a_server(html):
    """The search page, opened from the disk with a query, lists the chapter that holds the word."""
    url = (html / "search.html").as_uri() + "?q=unicycle"
    (report,) = visit(
        [
            {
                "url": url,
                "wait": "#search-results li",
                "run": "return document.querySelector('#search-results').innerText",
            }
        ]
    )
    assert "Motion and the limit" in report["value"]
    assert not [r for r in report["requests"] if not r["url"].startswith(html.as_uri()) or r["failure"]]
    assert not report["console"]


def test_answers_are_folded_until_asked_for(html):
    """The answers to the questions of a chapter are closed when the page opens, and open at a click."""
    run = """
      const folds = [...document.querySelectorAll("details.sd-dropdown")];
      const closed = folds.filter((fold) => !fold.open).length;
      folds[0].querySelector("summary").click();
      return [folds.length, closed, folds[0].open];
    """
    page = html / "book" / "motion-and-the-limit.html"
    (report,) = visit([{"url": page.as_uri(), "run": run}])
    count, closed, opened = report["value"]
    assert count >= 6
    assert closed == count
    assert opened


def test_chapter_links_its_notebook_inside_the_folder(html):
    """The chapter's graded notebook is a file of the built folder, equal to the released one."""
    page = html / "book" / "motion-and-the-limit.html"
    link = re.search(
        r'<a class="reference download internal"[^>]*href="([^"]+)"', page.read_text(encoding="utf-8")
    )
    copy = (page.parent / link[1]).resolve()
    assert copy.is_relative_to(html.resolve())
    released = ROOT / "notebooks" / "ekf-localization" / "motion-model.ipynb"
    assert copy.read_bytes() == released.read_bytes()


def test_figures_have_alternative_text(html):
    """Every image of a page has an alternative text that says something."""
    count = 0
    for page in pages_of(html):
        for tag in re.findall(r"<img\b[^>]*>", (html / page).read_text(encoding="utf-8")):
            alt = re.search(r'alt="([^"]*)"', tag)
            assert alt, (page, tag)
            assert len(alt[1]) > 30, (page, tag)
            count += 1
    assert count >= 1


def test_pages_name_no_script_address_outside(html):
    """No script, style sheet, image or preload of a page has an address with a host, even one fetched on demand."""
    for page in pages_of(html):
        text = (html / page).read_text(encoding="utf-8")
        assert not re.search(r'<(?:script|link|img|iframe)\b[^>]*(?:src|href)="(?:https?:)?//', text), page
        scripts = re.findall(r"<script\b[^>]*>(.*?)</script>", text, re.DOTALL)
        assert not [s for s in scripts if re.search(r"https?://", s)], page


def test_no_built_page_shows_a_graded_stage(html):
    """No graded stage is defined in the built folder: not on a page, in a copied source or in the index."""
    for file in [*html.rglob("*.html"), *html.rglob("_sources/**/*.md"), html / "searchindex.js"]:
        text = re.sub(r"<[^>]+>", "", file.read_text(encoding="utf-8"))
        assert not re.search(r"def\s+(?:compute_dynamics|transition_update|measurement_update)\b", text), (
            file.name
        )
