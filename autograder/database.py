"""One database engine for a whole run.

nbgrader opens the gradebook anew for every step of every notebook, each time with an engine that has to compile all
its SQL again, and asks for each table and for the course whether they are there. Within :func:`one_engine` the engines
are shared, and tables and course are looked for once; connections and sessions stay nbgrader's.
"""

from __future__ import annotations

import functools
from contextlib import contextmanager
from typing import TYPE_CHECKING

import nbgrader.api
from nbgrader.api import Gradebook

if TYPE_CHECKING:
    from collections.abc import Iterator


@contextmanager
def one_engine() -> Iterator[None]:
    """Let all gradebooks that are opened within use one engine for each database."""
    create, metadata = nbgrader.api.create_engine, nbgrader.api.Base.metadata
    nbgrader.api.create_engine = functools.cache(create)
    metadata.create_all = functools.cache(metadata.create_all)
    check = Gradebook.check_course
    checked = set()

    def check_once(gradebook: Gradebook, course_id: str = "default_course") -> None:
        if (gradebook.engine, course_id) not in checked:
            check(gradebook, course_id)
            checked.add((gradebook.engine, course_id))

    Gradebook.check_course = check_once
    try:
        yield
    finally:
        nbgrader.api.create_engine = create
        del metadata.create_all
        Gradebook.check_course = check
