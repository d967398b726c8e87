"""One database engine for a whole run.

nbgrader opens the gradebook anew for every step of every notebook, each time with an engine that has to compile all
its SQL again, and asks for each table whether it is there. Within :func:`one_engine` the engines are shared, and tables
are looked for once; connections and sessions stay nbgrader's.
"""

from __future__ import annotations

import functools
from contextlib import contextmanager
from typing import TYPE_CHECKING

import nbgrader.api

if TYPE_CHECKING:
    from collections.abc import Iterator


@contextmanager
def one_engine() -> Iterator[None]:
    """Let all gradebooks that are opened within use one engine for each database."""
    create, metadata = nbgrader.api.create_engine, nbgrader.api.Base.metadata
    nbgrader.api.create_engine = functools.cache(create)
    metadata.create_all = functools.cache(metadata.create_all)
    try:
        yield
    finally:
        nbgrader.api.create_engine = create
        del metadata.create_all
