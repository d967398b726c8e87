"""The course's secret: where it comes from, and that it is made once."""

from __future__ import annotations

import stat
from concurrent.futures import ThreadPoolExecutor

import pytest

from autograder import secret


@pytest.fixture(autouse=True)
def no_variable(monkeypatch):
    """Start without the environment variable."""
    monkeypatch.delenv(secret.VARIABLE, raising=False)


def test_the_variable_wins(tmp_path, monkeypatch):
    """The environment variable is used, and no file is made."""
    monkeypatch.setenv(secret.VARIABLE, " from outside ")
    assert secret.course_secret(tmp_path) == "from outside"
    assert list(tmp_path.iterdir()) == []


def test_a_file_is_made_once_and_read_again(tmp_path):
    """The first call makes a secret that only its owner can read, later calls return it."""
    first = secret.course_secret(tmp_path)
    path = tmp_path / secret.FILE
    assert len(first) == 64
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert secret.course_secret(tmp_path) == first
    assert list(tmp_path.iterdir()) == [path]


def test_another_course_has_another_secret(tmp_path):
    """Two courses on one machine do not share inputs."""
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
    assert secret.course_secret(tmp_path / "a") != secret.course_secret(tmp_path / "b")


def test_at_the_same_time_all_read_one_secret(tmp_path):
    """Of many that find no file, one makes it and all return the same."""
    with ThreadPoolExecutor(16) as pool:
        found = set(pool.map(lambda _: secret.course_secret(tmp_path), range(64)))
    assert len(found) == 1
    assert [path.name for path in tmp_path.iterdir()] == [secret.FILE]


def test_an_empty_file_is_refused(tmp_path):
    """An empty secret would be everybody's: the message says what to do."""
    (tmp_path / secret.FILE).write_text("\n")
    with pytest.raises(ValueError, match="expected one line of text, got an empty file"):
        secret.course_secret(tmp_path)


def test_an_empty_variable_is_none(tmp_path, monkeypatch):
    """A variable set to nothing does not count as a secret."""
    monkeypatch.setenv(secret.VARIABLE, " ")
    assert len(secret.course_secret(tmp_path)) == 64


def test_the_root_is_where_the_configuration_is(tmp_path):
    """From a folder deep inside a course its root is found."""
    (tmp_path / "nbgrader_config.py").touch()
    deep = tmp_path / "submitted" / "ada"
    deep.mkdir(parents=True)
    assert secret.course_root(deep) == tmp_path.resolve()


def test_names_are_kept_apart():
    """Neither the secret nor a name can run into the next one."""
    numbers = [
        secret.generator(*names).random() for names in (("s", "ab", "c"), ("s", "a", "bc"), ("sa", "b", "c"))
    ]
    assert len(set(numbers)) == 3
