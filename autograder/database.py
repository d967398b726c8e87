"""One database engine for a whole run.

nbgrader opens the gradebook anew for every step of every notebook, each time with an engine that has to compile all
its SQL again, and asks for each table and for the course whether they are there. Within :func:`one_engine` the engines
are shared, and tables and course are looked for once; connections and sessions stay nbgrader's.
"""

from __future__ import annotations

import functools
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import nbgrader.api
from nbgrader.api import Gradebook
from sqlalchemy.engine import make_url

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sqlalchemy.engine import Engine

PATIENCE = 30.0  # seconds to wait for a gradebook of SQLite that another program has locked


@contextmanager
def one_engine() -> Iterator[None]:
    """Let all gradebooks that are opened within use one engine for each database."""
    create, metadata = nbgrader.api.create_engine, nbgrader.api.Base.metadata

    @functools.cache
    def create_patient(url: str, **options: Any) -> Engine:
        if make_url(url).get_backend_name() == "sqlite":
            options["connect_args"] = {"timeout": PATIENCE}
        return create(url, **options)

    nbgrader.api.create_engine = create_patient
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
