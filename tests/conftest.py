"""The order of the tests: what takes longest begins first, so that no process is left alone with it at the end."""

from __future__ import annotations

from pathlib import Path

import pytest

# Files by the time they take, the longest first; all others follow in their own order.
LONGEST = (
    "tests/book/test_book_pages.py",
    "tests/autograder/test_same_as_stock.py",
    "tests/test_our_student_kit.py",
    "tests/autograder/test_cluster.py",
    "tests/autograder/test_parallel.py",
    "tests/autograder/test_faults_kill.py",
    "tests/autograder/test_hostile.py",
    "tests/autograder/test_exchange.py",
    "tests/autograder/test_features_of_nbgrader.py",
    "tests/test_drop_in.py",
    "tests/autograder/test_postgres.py",
    "tests/browser/test_manual_grading.py",
)
ROOT = Path(__file__).resolve().parents[1]


def pytest_collection_modifyitems(items):
    """Put the longest files first, for `--dist loadfile --no-loadscope-reorder`, which deals files out in order."""
    order = {ROOT / name: i for i, name in enumerate(LONGEST)}
    if missing := [path.name for path in order if not path.is_file()]:
        raise pytest.UsageError(f"tests/conftest.py: expected the longest files, got none named {missing[0]}")
    items.sort(key=lambda item: order.get(item.path, len(order)))
