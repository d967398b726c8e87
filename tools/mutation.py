"""Mutation testing: see whether the hidden checks notice a reference stage that is changed by one sign or number.

Each mutant of `tools/mutants.py` is handed in as a student's function, in a process of its own with limits of time and
memory: the changed module and what imports it are loaded anew, and the checks judge the result with the true stage as
the truth. A mutant is killed when a check fails with every secret; one that lives must stand in
`tools/mutation_survivors.toml` with the reason why nobody could tell it from the right one.

Usage: ``python tools/mutation.py [--stage NAME] [--jobs N] [--secrets N]``

The exit status is 0 if at least 95 % are killed, all that live are listed, and all that are listed live.
"""

from __future__ import annotations

import argparse
import dataclasses
import functools
import importlib.abc
import importlib.machinery
import importlib.util
import os
import pickle
import resource
import select
import signal
import sys
import time
import tomllib
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

import mutants as making
from autograder.check import run_stage
from autograder.checks import STAGES, SUBJECTS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from autograder.check import Stage

SURVIVORS = Path(__file__).with_name("mutation_survivors.toml")
WANTED = 0.95
_SLOWER, _LEAST_SECONDS, _WALL = 20, 2, 4
_MEMORY = 8 << 30


class Verdict(NamedTuple):
    """What became of a mutant of a stage: what killed it, or nothing."""

    stage: str
    mutant: making.Mutant
    killed: str

    @property
    def key(self) -> Key:
        """What names the mutant in the list of survivors."""
        return self.stage, *self.mutant.change


class _Changed(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Load one module from changed text."""

    def __init__(self, name: str, source: str) -> None:
        self.name, self.source = name, source

    def find_spec(self, name: str, *_: Any) -> importlib.machinery.ModuleSpec | None:
        """Claim the module."""
        return importlib.util.spec_from_loader(name, self) if name == self.name else None

    def exec_module(self, module: Any) -> None:
        """Run the changed text as the module."""
        exec(compile(self.source, f"<{self.name}>", "exec"), vars(module))  # noqa: S102 - our own text


def mutated(stage: str, module: str = "", source: str = "") -> Callable[..., Any]:
    """Load the references and the checks anew, one module changed, and return a stage's reference.

    It changes the modules of this process: the caller is a process that ends after it.
    """
    for name in list(sys.modules):
        if name.startswith(making.PACKAGES):
            package, _, short = name.rpartition(".")
            vars(sys.modules[package]).pop(short, None)
            del sys.modules[name]
    if module:
        sys.meta_path.insert(0, _Changed(module, source))
    checks = importlib.import_module(f"autograder.checks.{SUBJECTS[stage]}")
    return next(fresh.reference for fresh in checks.STAGES if fresh.name == stage)


def killer(stage: Stage, function: Callable[..., Any], secrets: list[str]) -> str:
    """Name the check that fails first, of the secret with which it fails last; "" if one lets the function live."""
    name = ""
    for secret in secrets:
        for check in stage.checks:
            if not run_stage(dataclasses.replace(stage, checks=(check,)), function, secret).results[0].passed:
                name = check.name
                break
        else:
            return ""
    return name


def _apart(work: Callable[[], Any], seconds: int) -> tuple[int, int]:
    """Start a process that does some work and writes its result; return its number and the end to read."""
    reading, writing = os.pipe()
    if process := os.fork():
        os.close(writing)
        return process, reading
    try:
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 1))
        resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
        warnings.simplefilter("ignore")
        np.seterr(all="ignore")
        try:
            result = work()
        except BaseException as error:  # noqa: BLE001 - a module that does not load is a mutant that is seen
            result = type(error).__name__
        os.write(writing, pickle.dumps(result))
    finally:
        os._exit(0)


def apart(jobs: int, tasks: Iterator[tuple[Any, Callable[[], Any], int]]) -> Iterator[tuple[Any, Any]]:
    """Do each task in a process of its own, some at a time; yield its key and result, "time" where it was too long."""
    running: dict[int, tuple[Any, int, float]] = {}
    tasks = iter(tasks)
    while True:
        while len(running) < jobs and (task := next(tasks, None)):
            key, work, seconds = task
            process, reading = _apart(work, seconds)
            running[reading] = key, process, time.monotonic() + _WALL * seconds
        if not running:
            return
        left = min(end for *_, end in running.values()) - time.monotonic()
        ready, _, _ = select.select(list(running), [], [], max(left, 0.0))
        late = [reading for reading, (*_, end) in running.items() if end < time.monotonic()]
        for reading in {*ready, *late}:
            key, process, _ = running.pop(reading)
            if reading not in ready:
                os.kill(process, signal.SIGKILL)
            with open(reading, "rb") as file:  # noqa: PTH123 - a pipe has no path
                said = file.read()
            os.waitpid(process, 0)
            yield key, pickle.loads(said) if said else "time"  # noqa: S301 - written by our own process


def judge(stage: Stage, secrets: list[str], jobs: int) -> Iterator[Verdict]:
    """Judge all mutants of a stage.

    Raises
    ------
    RuntimeError
        If the checks refuse the reference itself.
    """
    start = time.process_time()
    first = killer(stage, stage.reference, secrets)
    start, first = time.process_time(), first or killer(stage, stage.reference, secrets)
    seconds = int(max(_LEAST_SECONDS, _SLOWER * (time.process_time() - start)) + 1)

    def work(module: str, source: str) -> str:
        return killer(stage, mutated(stage.name, module, source), secrets)

    [(_, again)] = apart(1, iter([("", functools.partial(work, "", ""), seconds)]))
    if first or again:
        raise RuntimeError(f"{stage.name}: the reference itself fails the check {first or again}")
    tasks = (
        (mutant, functools.partial(work, mutant.module, mutant.source), seconds)
        for place in making.places(stage, STAGES.values())
        for mutant in making.mutants(place)
    )
    for mutant, killed in apart(jobs, tasks):
        yield Verdict(stage.name, mutant, killed)


class Known(NamedTuple):
    """Why a mutant may live; `counts` is false for code of a helper that serves another function, not the stage."""

    reason: str
    counts: bool


Key = tuple[str, str, str, str]
"""Stage, place, and the lines before and after."""


def listed(path: Path = SURVIVORS) -> dict[Key, Known]:
    """Read which mutants may live."""
    groups = tomllib.loads(path.read_text(encoding="utf-8"))
    return {
        (stage, group["place"], before, after): Known(group["reason"], kind == "equivalent")
        for kind in ("equivalent", "elsewhere")
        for group in groups.get(kind, ())
        for stage in group["stages"]
        for before, changed in group["changes"].items()
        for after in changed
    }


def faults(verdicts: list[Verdict], known: dict[Key, Known]) -> list[str]:
    """Say what does not hold of the list of survivors, for the stages that were judged."""
    judged = {verdict.stage for verdict in verdicts}
    every = {verdict.key for verdict in verdicts}
    living = {verdict.key for verdict in verdicts if not verdict.killed}
    found = [_told("lives and is not listed", key) for key in sorted(living - set(known))]
    stale = [key for key in sorted(set(known) - living) if key[0] in judged or key[0] not in STAGES]
    return found + [_told(f"is listed and is {'killed' if key in every else 'gone'}", key) for key in stale]


def _told(what: str, key: Key) -> str:
    stage, place, before, after = key
    return f"{stage}: a mutant of {place} {what}\n  - {before}\n  + {after}"


def share(verdicts: list[Verdict], known: dict[Key, Known]) -> float:
    """Return the part of the mutants that is killed, of those that belong to the stages."""
    counted = [one for one in verdicts if one.killed or known.get(one.key, Known("", True)).counts]
    return sum(bool(one.killed) for one in counted) / len(counted)


def _row(name: str, verdicts: list[Verdict], known: dict[Key, Known], seconds: float) -> str:
    living = [known.get(one.key) for one in verdicts if not one.killed]
    counts = [
        len(verdicts),
        len(verdicts) - len(living),
        sum(one is not None and one.counts for one in living),
        sum(one is not None and not one.counts for one in living),
        sum(one is None for one in living),
    ]
    return f"{name:42}" + "".join(f"{count:11}" for count in counts) + f"{seconds:9.1f}"


def main(arguments: list[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        description="Change the reference stages, and see whether the checks notice."
    )
    parser.add_argument(
        "--stage", action="append", choices=sorted(STAGES), help="one stage; all if not given"
    )
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="processes at a time")
    parser.add_argument(
        "--secrets", type=int, default=1, help="course secrets with each of which a check must fail"
    )
    options = parser.parse_args(arguments)
    secrets = [f"mutation-{number}" for number in range(options.secrets)]
    known = listed()
    verdicts: list[Verdict] = []
    columns = ("mutants", "killed", "equivalent", "elsewhere", "unlisted")
    print(f"{'stage':42}" + "".join(f"{column:>11}" for column in columns) + f"{'seconds':>9}", flush=True)
    began = time.monotonic()
    for name in options.stage or STAGES:
        start = time.monotonic()
        found = list(judge(STAGES[name], secrets, options.jobs))
        verdicts += found
        print(_row(name, found, known, time.monotonic() - start), flush=True)
    print(_row(f"{len(options.stage or STAGES)} stages", verdicts, known, time.monotonic() - began))
    wrong = faults(verdicts, known)
    part = share(verdicts, known)
    print(*wrong, sep="\n")
    print(
        f"{100 * part:.1f} % of the mutants of the stages are killed; at least {100 * WANTED:g} % are wanted."
    )
    return 0 if part >= WANTED and not wrong else 1


if __name__ == "__main__":
    sys.exit(main())
