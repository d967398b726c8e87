"""The set-up script, with stand-ins for the commands that change a machine."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]

# What the script itself needs; everything else is there or not as a test wants it.
COREUTILS = ["bash", "cat", "dirname", "env", "flock", "grep", "ls", "mkdir", "rm", "sha256sum", "tr"]
ALL = ["bwrap", "chromium", "node", "npm", "initdb", "python3"]


@pytest.fixture
def machine(tmp_path):
    """Return a function that runs the script in an empty checkout on a machine with the given commands."""
    checkout = tmp_path / "checkout"
    (checkout / "tools").mkdir(parents=True)
    shutil.copy(ROOT / "tools/setup.sh", checkout / "tools")
    commands = tmp_path / "bin"
    commands.mkdir()
    for name in COREUTILS:
        (commands / name).symlink_to(shutil.which(name))

    def run(*steps, present=(), user=1000, **scripts):
        bodies = {**dict.fromkeys(present, "exit 0"), "id": f"echo {user}", **scripts}
        for name, body in bodies.items():
            command = commands / name.replace("_", "-")
            command.write_text(f"#!{commands / 'bash'}\n{body}\n")
            command.chmod(0o755)
        return subprocess.run(
            [commands / "bash", checkout / "tools/setup.sh", *steps],
            env={"PATH": str(commands), "LOG": str(tmp_path / "log")},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=False,
        )

    run.log = tmp_path / "log"
    return run


def test_a_machine_with_everything_is_left_alone(machine):
    """Where nothing is missing the package manager is not asked, not even by root."""
    done = machine("system", present=ALL, user=0, apt_get='echo "$@" >>"$LOG"')
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert not machine.log.exists()


@pytest.mark.parametrize("absent", [["bwrap"], ["chromium", "npm"], ["initdb"], ALL])
def test_an_ordinary_user_is_told_in_one_line(machine, absent):
    """Who may not install packages gets one line with exactly what is missing and the command for it."""
    done = machine("system", present=set(ALL) - set(absent), apt_get='echo "$@" >>"$LOG"')
    packages = {
        "bwrap": "bubblewrap", "node": "nodejs", "initdb": "postgresql", "python3": "python3 python3-venv",
    }  # fmt: skip
    names = " ".join(packages.get(name, name) for name in absent)
    assert done.returncode == 1
    assert (
        done.stderr
        == f"setup: missing on this machine: {names}. Install with: sudo apt-get install {names}\n"
    )
    assert not machine.log.exists()


def test_root_installs_what_is_missing(machine):
    """Root updates the lists once, then installs the missing packages and no other."""
    done = machine(
        "system",
        present=["chromium", "node", "initdb", "python3"],
        user=0,
        apt_get='echo "${@: -2}" >>"$LOG"',
    )
    assert done.returncode == 0
    update, install = machine.log.read_text().splitlines()
    assert update.endswith("update")
    assert install == "bubblewrap npm"


def test_a_failing_package_manager_is_reported(machine):
    """A package that cannot be installed stops the set-up, and the line says which were asked for."""
    done = machine(
        "system", present=["chromium", "node", "npm", "initdb", "python3"], user=0, apt_get="exit 100"
    )
    assert done.returncode == 1
    assert done.stderr == "setup: apt-get update failed; needed: bubblewrap\n"


def test_python_without_venv_names_the_package(machine):
    """A Python that cannot make an environment, as on a bare Debian, asks for the package of its version."""
    python = """
case "$2" in
  *version_info*">"*|*"sys.exit"*) exit 0 ;;
  *ensurepip*) exit 1 ;;
  *) echo 3.12 ;;
esac"""
    done = machine("system", present=["bwrap", "chromium", "node", "npm", "initdb"], python3=python)
    assert done.returncode == 1
    assert done.stderr.endswith("sudo apt-get install python3.12-venv\n")


def test_an_old_python_is_refused(machine):
    """A Python older than 3.11 is named with its version, and nothing is made."""
    python = 'if [ "$1" = --version ]; then echo Python 3.9.2; else exit 1; fi'
    done = machine("python", python3=python)
    assert done.returncode == 1
    assert done.stderr.startswith("setup: Python 3.11 or newer is needed, and Python 3.9.2 was found.")


def test_an_unknown_step_is_refused(machine):
    """A step that does not exist stops the set-up, and the line says which there are."""
    done = machine("pyhton")
    assert done.returncode == 1
    assert done.stderr == "setup: unknown step 'pyhton'; expected system, python, vendor or check\n"


def test_a_second_set_up_does_nothing():
    """Set-up of an environment that is complete prints nothing and leaves it untouched."""
    script = ROOT / "tools" / "setup.sh"
    check = subprocess.run([script, "check"], capture_output=True, text=True, check=False)
    assert check.returncode == 0, check.stderr
    stamp = ROOT / ".venv" / ".setup-stamp"
    before = stamp.stat().st_mtime_ns
    done = subprocess.run(
        [script], stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False, env=os.environ
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert stamp.stat().st_mtime_ns == before
