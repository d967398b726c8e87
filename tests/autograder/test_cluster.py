"""A class on the workers of a Dask scheduler: the gradebook is the one that processes here make, whatever dies."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import zipfile
from importlib.metadata import version
from pathlib import Path
from unittest import mock

import dask
import nbformat
import pytest
from cluster_workers import Workers
from distributed import Client, LocalCluster
from nbformat.v4 import new_code_cell
from nbgrader.converters.base import NbGraderException
from processes import alive, children, wait_for
from temporary_course import ASSIGNMENT, GRADED, Course, cell, environment, hidden, source_notebook

from autograder import cluster, provenance
from autograder.parallel import MARKER, ParallelAutograde
from autograder.roles import REVIEW
from autograder.sandbox import PACKAGES

ROOT = Path(__file__).resolve().parents[2]
GUIDE = ROOT / "book" / "instructor-guide.md"
SECRET = "of-the-instructor"  # noqa: S105
# A test cell is given the secret of the course, whoever executes it.
SAME_SECRET = f"""
from autograder import grading
from unittest import mock
with mock.patch.object(grading, "run_stage") as run:
    grading.outcome_of(None, None)
assert run.call_args.args[2] == "{SECRET}"
"""
FAILURES = 1  # deaths of a worker that Dask allows a notebook
FLAGGED = dict.fromkeys(GRADED | {"secret-test": 1.0}, (None, True))


@pytest.fixture(scope="module")
def workers(tmp_path_factory):
    """Start a scheduler and two workers in a folder that is not the course's."""
    folder = tmp_path_factory.mktemp("workers")
    made = Workers(folder)
    settings = {
        "distributed.admin.system-monitor.gil.enabled": False,
        "distributed.deploy.lost-worker-timeout": "10m",  # in which a nanny has started it again
        "distributed.scheduler.allowed-failures": FAILURES,
        "temporary-directory": str(folder),
    }
    with (
        dask.config.set(settings),
        LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=":0", preload=[str(made.preload)]
        ) as running,
    ):
        made.running, made.address = running, running.scheduler_address
        yield made
        below = [pid for nanny in running.workers.values() for pid in (nanny.pid, *children(nanny.pid))]
    assert below
    wait_for(lambda: not alive(below))


@pytest.fixture(autouse=True, scope="module")
def secret():
    """Give the grader a secret; workers have another one."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROBOLOC_SECRET", SECRET)
        yield


@pytest.fixture(scope="module")
def course(tmp_path_factory, workers, secret):
    """Hand in a small class."""
    notebook = source_notebook()
    test = cell(new_code_cell, hidden(SAME_SECRET), "secret-test", points=1, grade=True, locked=True)
    notebook.cells.insert(-1, test)
    made = Course.create(tmp_path_factory.mktemp("cluster") / "course", notebook)
    made.submit("exits", square="def square(x):\n    import os\n    os._exit(0)")
    made.submit("long")
    made.submit("right")
    made.submit("wrong", square="def square(x):\n    return 2 * x")
    made.submit_file("not-json", '{"cells": [')
    return made


@pytest.fixture(scope="module")
def here(course, tmp_path_factory):
    """Grade the class by processes here."""
    graded = course.copy(tmp_path_factory.mktemp("here") / "course")
    graded.grade(jobs=2)
    assert graded.rows()["right"]["secret-test"] == (1.0, False)
    return graded


def marked(course):
    """Return the submissions that are under way."""
    return list(course.root.glob(f"autograded/*/{ASSIGNMENT}/{MARKER}"))


def shown(course, student):
    """Return what is stored of a student's notebook, but for what differs from run to run."""
    notebook = course.graded(student)
    notebook.metadata["grading"] |= {"run": "", "seconds": 0}
    return re.sub(r"Cell In\[\d+\]", "Cell In[]", nbformat.writes(notebook))  # counted on in a process


@pytest.fixture(scope="module")
def graded(workers, course, tmp_path_factory):
    """Grade the class by the stock command on two workers: one is killed in mid-run, and one notebook kills any."""
    made = course.copy(tmp_path_factory.mktemp("graded") / "course")
    made.submit("kills")
    workers.hold()
    done = threading.Event()

    def kill():
        while not done.wait(0.05):
            workers.kill()

    thread = threading.Thread(target=kill)
    thread.start()
    try:
        made.nbgrader("autograde", ASSIGNMENT, f"--ParallelAutograde.scheduler={workers.address}")
    finally:
        done.set()
        thread.join()
    return made


def test_a_worker_killed_in_mid_run_changes_nothing(graded, here, workers):
    """With a worker killed while it has a notebook, everybody's rows and pages are those of a run by processes here."""
    assert "long" in workers.killed.values()
    wait_for(lambda: not alive([*workers.killed, *workers.below]))
    rows = here.rows()
    assert {student: graded.rows()[student] for student in rows} == rows
    for student in rows:
        assert shown(graded, student) == shown(here, student)
    assert not marked(graded)


def test_a_notebook_that_kills_workers_is_given_up(graded, workers):
    """After a bounded number of dead workers it has its rows and a reason, and no other notebook has one."""
    assert list(workers.killed.values()).count("kills") == 2 * (FAILURES + 1)
    assert graded.rows()["kills"] == FLAGGED
    reasons = [node.metadata.get(REVIEW) for node in graded.graded("kills").cells]
    assert reasons.count("2 workers died while they had this notebook and no other") == 3


def test_workers_are_left_nothing(graded, workers):
    """A worker makes no secret of its own, and no file of a run stays in its folder."""
    kept = {path.name for path in workers.folder.rglob("*") if path.is_file()}
    assert not [name for name in kept if "secret" in name or name.endswith((".db", ".ipynb"))]


# ---------------------------------------------------------------- runs that end early


def scores(course):
    """Return what the gradebook has of those who have a score."""
    return {
        who: row for who, row in course.rows().items() if any(score is not None for score, _ in row.values())
    }


def log_of(course, **options):
    """Grade a class that cannot be graded; return the one error of the log."""
    with course.api(**options) as api:
        grader = ParallelAutograde(coursedir=api.coursedir, parent=api)
        with pytest.raises(NbGraderException) as error, mock.patch.object(grader.log, "error") as log:
            grader.start()
    assert [str(call.args[1]) for call in log.call_args_list] == [str(error.value)]
    return str(error.value)


def test_ctrl_c_leaves_what_the_next_run_goes_on_from(workers, course, here, tmp_path):
    """What came back before Ctrl-C is stored and stays, all else has its marker, and the next run does the rest."""
    made = course.copy(tmp_path / "course")
    workers.running.wait_for_workers(2, timeout=60)
    workers.hold()
    command = made.command("autograde", ASSIGNMENT)
    heard = (
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"  # ignored in the background
    )
    start = f"{heard}; import runpy; runpy.run_module('nbgrader', run_name='__main__')"
    grader = subprocess.Popen(
        [sys.executable, "-c", start, *command[3:], f"--ParallelAutograde.scheduler={workers.address}"],
        cwd=made.root,
        env=environment(),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        wait_for(lambda: [path.parts[-3] for path in marked(made)] == ["long"])
        grader.send_signal(signal.SIGINT)
        _, said = grader.communicate(timeout=60)
    finally:
        grader.kill()
        grader.wait()
        workers.go()
    assert grader.returncode != 0
    assert said
    stored = {path: path.stat().st_mtime_ns for path in made.root.glob("autograded/*/*/*.ipynb")}
    made.grade(scheduler=workers.address)
    assert made.rows() == here.rows()
    assert {path for path in stored if path.stat().st_mtime_ns != stored[path]} == {
        made.folder("long", "autograded") / "powers.ipynb"
    }
    assert not marked(made)


def test_a_worker_that_is_installed_otherwise_does_not_grade(workers, course, tmp_path, monkeypatch):
    """Where a worker has other checks or packages than the grader, the run ends, names it and what differs."""
    made = course.copy(tmp_path / "course")
    have = cluster.installation(PACKAGES)
    with monkeypatch.context() as patch:
        patch.setattr(cluster, "installation", lambda _: have | {"roboloc": "mended", "numpy": "0.1"})
        said = log_of(made, scheduler=workers.address)
    different = f"numpy {have['numpy']}, not 0.1; roboloc {have['roboloc']}, not mended"
    assert re.fullmatch(rf"the worker tcp://127.0.0.1:\d+ does not grade: .*: {re.escape(different)}", said)
    assert not scores(made)


def test_installations_differ_by_code_and_by_packages(tmp_path, monkeypatch):
    """A change of any file of ours, and a package that is missing or of another version, is another installation."""
    monkeypatch.setattr(provenance, "_file", lambda name: tmp_path / name / "__init__.py")
    file = tmp_path / "autograder" / "checks" / "motion.py"
    file.parent.mkdir(parents=True)
    file.write_text("TOLERANCE = 1e-9", encoding="utf-8")
    first = provenance.installation.__wrapped__(("numpy", "no-such-package"))
    assert first["numpy"] == version("numpy")
    assert first["no-such-package"] == "none"
    file.write_text("TOLERANCE = 1e-8", encoding="utf-8")
    second = provenance.installation.__wrapped__(("numpy", "no-such-package"))
    assert {name for name in first if first[name] != second[name]} == {"roboloc"}


@pytest.mark.parametrize(
    ("scheduler", "expected"),
    [
        ("tcp://127.0.0.1:9", "no scheduler at tcp://127.0.0.1:9: OSError"),
        ("nonsense://x", "no scheduler at nonsense://x: ValueError"),
        ("empty", "no workers at tcp://127.0.0.1:"),
    ],
)
def test_without_workers_nothing_is_touched(course, tmp_path, scheduler, expected):
    """Where there is no scheduler, or none with workers, the run ends with one line before it changes anything."""
    made = course.copy(tmp_path / "course")
    timeouts = {"distributed.comm.timeouts.connect": "1s", "distributed.scheduler.no-workers-timeout": "1s"}
    with (
        dask.config.set(timeouts),
        LocalCluster(n_workers=0, processes=False, dashboard_address=":0", protocol="tcp") as empty,
    ):
        said = log_of(made, scheduler=empty.scheduler_address if scheduler == "empty" else scheduler)
    assert said.startswith(expected)
    assert not made.rows()
    assert not (made.root / "autograded").exists()


def test_without_dask(course, tmp_path, monkeypatch):
    """Where Dask is not installed, the run says what to install."""
    made = course.copy(tmp_path / "course")
    monkeypatch.delitem(sys.modules, "autograder.cluster")
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert "pip install 'roboloc[grader,cluster]'" in log_of(made, scheduler="tcp://127.0.0.1:9")
    assert not made.rows()
    assert not (made.root / "autograded").exists()


@pytest.fixture
def commands(tmp_path):
    """Start processes by Dask's own commands, as the guide says; they are killed in the end."""
    made = Workers(tmp_path)
    started = []

    def start(kind, *options, within=(), **variables):
        where = tmp_path / "scheduler.json"
        command = [*within, sys.executable, "-m", "dask", kind, "--scheduler-file", where]
        places = environment(DASK_TEMPORARY_DIRECTORY=str(tmp_path), **variables)
        started.append(
            subprocess.Popen(
                [*command, "--dashboard-address", ":0", *options],
                cwd=tmp_path, env=places, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            )
        )  # fmt: skip
        if kind == "scheduler":
            wait_for(lambda: where.exists() and where.read_text().endswith("\n}"))  # it is made empty
            made.address = json.loads(where.read_text())["address"]
        return started[-1]

    yield made, start
    made.go()
    for process in started:
        process.kill()
        process.wait()


def test_a_lost_cluster_ends_the_run_and_loses_nothing(commands, course, here, tmp_path):
    """With its last worker killed, then with its scheduler, a run ends with one line, and the next run goes on."""
    workers, start = commands
    made = course.copy(tmp_path / "course")
    scheduler = start("scheduler", "--host", "127.0.0.1", "--port", "0")
    expected = (f"no workers at {workers.address} for 1 s", f"the scheduler {workers.address} is lost")
    kept = {}
    for said in expected:
        worker = start("worker", "--no-nanny", "--nthreads", "1", "--preload", str(workers.preload))
        with Client(workers.address, set_as_default=False) as client:
            client.wait_for_workers(1, timeout=60)
        workers.hold()

        def kill(which=worker if said is expected[0] else scheduler):
            wait_for(workers.held)
            which.kill()

        thread = threading.Thread(target=kill)
        thread.start()
        with dask.config.set({"distributed.scheduler.no-workers-timeout": "1s"}):
            assert log_of(made, scheduler=workers.address) == said
        thread.join()
        assert scores(made).items() >= kept.items()
        kept = scores(made)
        assert kept
    made.grade()
    assert made.rows() == here.rows()


def test_encrypted_by_the_configuration_of_dask(commands, course, here, tmp_path):
    """With the configuration of the guide the class is graded over TLS; without certificates nobody is let in."""
    workers, start = commands
    folder = tmp_path / "dask"
    folder.mkdir()
    (settings,) = re.findall(r"```yaml\n(.*?)```", GUIDE.read_text(encoding="utf-8"), re.DOTALL)
    for name in ("ca", "certificate", "key"):
        file = "key" if name == "key" else "certificate"  # which vouches for itself
        settings = settings.replace(f"/etc/roboloc/{name}.pem", str(folder / f"{file}.pem"))
    (folder / "tls.yaml").write_text(settings, encoding="utf-8")
    request = ["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes"]
    subprocess.run(
        [*request, "-days", "1", "-subj", "/CN=us", "-keyout", "key.pem", "-out", "certificate.pem"],
        cwd=folder, check=True, capture_output=True,
    )  # fmt: skip
    start("scheduler", "--host", "127.0.0.1", "--port", "0", DASK_CONFIG=str(folder))
    preload = ("--preload", str(workers.preload))
    start("worker", "--no-nanny", "--nthreads", "1", *preload, DASK_CONFIG=str(folder))
    assert workers.address.startswith("tls://127.0.0.1:")
    made = course.copy(tmp_path / "course")
    with dask.config.set({"distributed.comm.timeouts.connect": "1s"}):
        assert "TLS expects" in log_of(made, scheduler=workers.address)
        plain = workers.address.replace("tls:", "tcp:")
        assert log_of(made, scheduler=plain).startswith(f"no scheduler at {plain}: ")
    assert not made.rows()
    address = f"--ParallelAutograde.scheduler={workers.address}"
    made.nbgrader("autograde", ASSIGNMENT, address, DASK_CONFIG=str(folder))
    assert made.rows() == here.rows()


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """Unpack the wheel of the package in a folder of its own."""
    folder = tmp_path_factory.mktemp("wheel")
    for name in ("pyproject.toml", "README.md", "LICENSE", "src", "autograder"):
        copy = shutil.copytree if (ROOT / name).is_dir() else shutil.copy
        copy(ROOT / name, folder / name)
    script = "import sys; from setuptools import build_meta; build_meta.build_wheel(sys.argv[1])"
    command = [sys.executable, "-c", script, str(folder)]
    subprocess.run(command, cwd=folder, check=True, capture_output=True)
    (made,) = folder.glob("*.whl")
    with zipfile.ZipFile(made) as opened:
        opened.extractall(folder / "site")
    return folder / "site"


def test_a_worker_needs_the_package_and_bubblewrap_alone(commands, course, here, wheel, tmp_path):
    """A worker that has our wheel, but neither repository, course nor shared files, grades like a process here."""
    workers, start = commands
    made = course.copy(tmp_path / "course")
    start("scheduler", "--host", "127.0.0.1", "--port", "0")
    hidden_from_it = [option for path in (ROOT, made.root, course.root) for option in ("--tmpfs", str(path))]
    prefix = ("--ro-bind", sys.prefix, sys.prefix)  # which may lie in the repository
    within = (shutil.which("bwrap"), "--dev-bind", "/", "/", *hidden_from_it, *prefix, "--die-with-parent")
    start("worker", "--no-nanny", "--nthreads", "1", within=within, PYTHONPATH=str(wheel))
    with Client(workers.address, set_as_default=False) as client:
        client.wait_for_workers(1, timeout=60)
        (file,) = client.run(eval, "__import__('autograder').__file__").values()
        assert file == str(wheel / "autograder" / "__init__.py")
        for path in (ROOT / "autograder", made.root / "gradebook.db", course.root / "source"):
            assert path.exists()
            assert list(client.run(os.path.exists, str(path)).values()) == [False]
    made.nbgrader("autograde", ASSIGNMENT, f"--ParallelAutograde.scheduler={workers.address}")
    assert made.rows() == here.rows()
