"""What turns isolation on in a course: two lines in its `nbgrader_config.py`.

>>> from autograder.plugin import configure        # doctest: +SKIP
>>> configure(c)                                   # doctest: +SKIP
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from traitlets.config import Config

SANITIZE = (
    "autograder.repair.RepairNotebook",  # first: what follows expects a valid notebook
    "nbgrader.preprocessors.ClearOutput",
    "nbgrader.preprocessors.DeduplicateIds",
    "nbgrader.preprocessors.OverwriteKernelspec",
)  # OverwriteCells and CheckCellMetadata are left out: RepairNotebook wrote locked cells and metadata from the release
AUTOGRADE = (
    "autograder.isolated.IsolatedExecute",  # in the place of nbgrader's Execute
    "nbgrader.preprocessors.IgnorePattern",
    "nbgrader.preprocessors.LimitOutput",
    "autograder.grades.SaveGrades",  # nbgrader's SaveAutoGrades, all cells at once
    "autograder.isolated.FlagForReview",  # after the grades are saved: takes back what a person must decide
    "autograder.versions.FlagNewCells",  # likewise, for cells that the student was never given
    "nbgrader.preprocessors.AssignLatePenalties",
)
RELEASE = (
    "nbgrader.preprocessors.IncludeHeaderFooter",
    "nbgrader.preprocessors.InstantiateTests",
    "nbgrader.preprocessors.LockCells",
    "nbgrader.preprocessors.ClearSolutions",
    "nbgrader.preprocessors.ClearOutput",
    "nbgrader.preprocessors.CheckCellMetadata",
    "nbgrader.preprocessors.ComputeChecksums",
    "nbgrader.preprocessors.SaveCells",
    "nbgrader.preprocessors.ClearHiddenTests",
    "nbgrader.preprocessors.ClearMarkScheme",
    "nbgrader.preprocessors.ComputeChecksums",
    "nbgrader.preprocessors.CheckCellMetadata",  # so far nbgrader's own list
    "autograder.versions.RecordVersion",
)
FEEDBACK = (
    "nbgrader.preprocessors.GetGrades",
    "autograder.feedback.LeakFreeFeedback",
    "nbconvert.preprocessors.CSSHTMLHeaderPreprocessor",
)
PAGES = ("markdown2html", "clean_html")  # filters of the pages' templates that `autograder.sanitize` replaces


def configure(c: Config) -> None:
    """Let stock nbgrader collect, isolate submissions and keep hidden tests hidden.

    Parameters
    ----------
    c : traitlets.config.Config
        The configuration object of `nbgrader_config.py`.
    """
    c.GenerateAssignment.preprocessors = [_load(name) for name in RELEASE]
    c.Autograde.sanitize_preprocessors = [_load(name) for name in SANITIZE]
    c.Autograde.autograde_preprocessors = [_load(name) for name in AUTOGRADE]
    c.GenerateFeedback.preprocessors = [_load(name) for name in FEEDBACK]
    if "collect" not in c.ExchangeFactory:  # an exchange of the course's own stays
        c.ExchangeFactory.collect = _load("autograder.collecting.Collect")
    c.HTMLExporter.sanitize_html = True  # nothing of a submission may run in a reader's browser
    c.HTMLExporter.filters = {name: _load(f"autograder.sanitize.{name}") for name in PAGES}
    use_parallel_autograde()
    use_feedback()


def use_parallel_autograde() -> None:
    """Put `ParallelAutograde` where the command line and the formgrader look for nbgrader's `Autograde`."""
    import nbgrader.apps.api  # noqa: PLC0415
    import nbgrader.apps.autogradeapp  # noqa: PLC0415

    from .parallel import ParallelAutograde  # noqa: PLC0415

    nbgrader.apps.api.Autograde = ParallelAutograde
    nbgrader.apps.autogradeapp.Autograde = ParallelAutograde


def use_feedback() -> None:
    """Put `Feedback` where the command line and the formgrader look for nbgrader's `GenerateFeedback`."""
    import nbgrader.apps.api  # noqa: PLC0415
    import nbgrader.apps.generatefeedbackapp  # noqa: PLC0415

    from .exporter import Feedback  # noqa: PLC0415

    nbgrader.apps.api.GenerateFeedback = Feedback
    nbgrader.apps.generatefeedbackapp.GenerateFeedback = Feedback


def _load(dotted: str) -> Any:
    import importlib  # noqa: PLC0415

    module, _, name = dotted.rpartition(".")
    return getattr(importlib.import_module(module), name)
