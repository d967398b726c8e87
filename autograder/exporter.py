"""Feedback pages for a class, without doing for each student what is the same for all.

Most cells of a class are the instructor's: their highlighted code and their Markdown are made once in a run. nbconvert
goes over each finished page once more with a parser, for the one thing that is left to do here, alternative texts of
pictures, which takes as long as all the rest; `feedback` and `sanitize` write those where the pictures are written.
"""

from __future__ import annotations

import multiprocessing
import os
from pathlib import Path
from threading import active_count as threads
from typing import TYPE_CHECKING, Any

from nbconvert.exporters import HTMLExporter
from nbconvert.exporters.templateexporter import TemplateExporter
from nbconvert.filters.highlight import Highlight2HTML
from nbconvert.filters.widgetsdatatypefilter import WidgetsDataTypeFilter
from nbgrader.converters import GenerateFeedback
from nbgrader.converters.base import NbGraderException
from traitlets import Integer, default

from .database import one_engine
from .interrupted import is_interrupted
from .sanitize import remembered

if TYPE_CHECKING:
    from nbformat import NotebookNode

_highlighter = Highlight2HTML(pygments_lexer="ipython3")


@remembered
def _highlighted(source: str) -> str:
    return _highlighter(source)


def highlight(source: str, language: str | None = None, metadata: Any = None) -> str:
    """Return code as highlighted HTML.

    Parameters
    ----------
    source : str
        Code.
    language : str, optional
        Its language, where it is not IPython.
    metadata : dict, optional
        The cell's; a language named there counts.

    Returns
    -------
    str
        HTML.

    Examples
    --------
    >>> "<pre>" in highlight("v = 0.5")
    True
    """
    if language or (metadata and "magics_language" in metadata):
        return _highlighter(source, language, metadata)
    return _highlighted(source)


class FeedbackExporter(HTMLExporter):
    """nbconvert's export to HTML, the last pass over the page left out."""

    def from_notebook_node(
        self, nb: NotebookNode, resources: dict[str, Any] | None = None, **kw: Any
    ) -> tuple[str, dict[str, Any]]:
        """Return the page of a notebook, and the resources."""
        resources = self._init_resources(resources)
        self.register_filter("highlight_code", highlight)
        widgets = WidgetsDataTypeFilter(notebook_metadata=self._nb_metadata, parent=self, resources=resources)
        self.register_filter("filter_data_type", widgets)
        return TemplateExporter.from_notebook_node(self, nb, resources, **kw)


class Feedback(GenerateFeedback):
    """nbgrader's step that writes the feedback of a class."""

    @default("exporter_class")
    def _exporter_class_default(self) -> type:
        return FeedbackExporter

    jobs = Integer(0, help="How many processes write feedback; 0 for one per processor.").tag(config=True)

    def convert_notebooks(self) -> None:
        """Write the feedback of all submissions that need it, each process for its part of the class."""
        jobs = self.jobs or os.cpu_count() or 1
        names = []
        for name in sorted(self.assignments):
            if is_interrupted(Path(name)):
                self.log.warning("%s is not graded to its end and gets no feedback yet: autograde it", name)
            else:
                names.append(name)
        # A fork takes this thread alone along, so a server, which has others, does without.
        if min(jobs, len(names)) < 2 or threads() > 1:
            self._convert(names)
            return
        fork = multiprocessing.get_context("fork")
        parts = [names[start::jobs] for start in range(jobs)]
        processes = [fork.Process(target=self._convert, args=(part,)) for part in parts if part]
        for process in processes:
            process.start()
        for process in processes:
            process.join()
        if any(process.exitcode for process in processes):
            raise NbGraderException("some feedback could not be written; the log says why")

    def _convert(self, names: list[str]) -> None:
        self.assignments = {name: self.assignments[name] for name in names}
        with one_engine():
            super().convert_notebooks()
