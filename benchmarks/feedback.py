"""Feedback of a class: `nbgrader generate_feedback` with our plug-in against the same command without it.

Both get the same autograded notebooks and the same gradebook; that every page shows the same scores of the same cells
is asserted before any time is used. The pages are not the same: ours takes out what hidden tests hold, and cleans what
a submission wrote. Times are wall times of the whole command, its start included, with as many processes as it takes by
itself.
"""

import re
import shutil
import tempfile
from pathlib import Path

from benchmarks.grading import ASSIGNMENT, OURS, STOCK, autograde, make_course, nbgrader
from benchmarks.harness import Result

ROUNDS = 2
_SCORE = re.compile(r'<a href="#([^"]+)">.*?\(Score: ([^<]*?)\)', re.DOTALL)


def shown(course: Path) -> dict[str, list[tuple[str, ...]]]:
    """Return the cells and scores that each student's page shows, its table of contents."""
    pages = sorted((course / "feedback").glob("*/*/*.html"))
    return {page.parents[1].name: _SCORE.findall(page.read_text(encoding="utf-8")) for page in pages}


def feedback() -> Result:
    """Write the feedback of a graded class in both ways, interleaved; compare the shortest times."""
    ways = {"stock": STOCK, "ours": OURS}
    with tempfile.TemporaryDirectory(prefix="feedback-") as name:
        folder = Path(name).resolve()
        count = len(make_course(folder / "course"))
        autograde(folder / "course", OURS)
        courses = {way: shutil.copytree(folder / "course", folder / way) for way in ways}
        times = dict.fromkeys(ways, float("inf"))
        for _ in range(ROUNDS):
            for way, config in ways.items():
                shutil.rmtree(courses[way] / "feedback", ignore_errors=True)
                times[way] = min(times[way], nbgrader(courses[way], config, "generate_feedback", ASSIGNMENT))
            expected, got = shown(courses["stock"]), shown(courses["ours"])
            if got != expected or len(got) != count or not all(got.values()):
                raise ArithmeticError(f"expected pages that show equal scores, got {expected} and {got}")
    print("        " + ", ".join(f"{way} {value:.3g}" for way, value in times.items()), flush=True)
    baseline = f"stock nbgrader generate_feedback of the same {count} submissions, same scores shown"
    return Result("feedback-vs-stock", times["stock"] / times["ours"], 3, baseline)


BENCHMARKS = (feedback,)
