"""One database engine for a whole run.

nbgrader opens the gradebook anew for every step of every notebook, each time with an engine that has to compile all
its SQL again. Within :func:`one_engine` the engines are shared; connections and sessions stay nbgrader's.
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
    create = nbgrader.api.create_engine
    nbgrader.api.create_engine = functools.cache(create)
    try:
        yield
    finally:
        nbgrader.api.create_engine = create
