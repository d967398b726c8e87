"""Make the folder of third-party browser files that the book needs, so that no page asks the network for them.

The files come from the npm packages of `package.json`, whose contents `package-lock.json` fixes by hash:
`npm ci` installs them in `node_modules/`, and the few that the book uses are copied to `build/vendor/`. The book's
Sphinx extension copies that folder into the built book. A second run finds both folders as they should be and
does nothing.

Usage: python tools/vendor.py [--check]

With `--check` nothing is made; the exit status says whether both folders are as they should be.
"""

import hashlib
import json
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
MODULES = ROOT / "node_modules"
VENDOR = ROOT / "build" / "vendor"

# Target below build/vendor: (npm package, what to copy from it, relative to the package).
SOURCES = {
    "mathjax": (
        "mathjax",
        ["LICENSE", "es5/tex-chtml.js", "es5/input/tex/extensions", "es5/output/chtml/fonts/woff-v2"],
    ),
    "requirejs": ("requirejs", ["require.js"]),
    "html-manager": ("@jupyter-widgets/html-manager", ["dist"]),
}
# Source maps, a second bundle of the widget manager, and fonts for browsers of the past.
LEFT_OUT = shutil.ignore_patterns("*.map", "embed.js*", "*.eot", "*.svg")


def main():
    """Install the packages and copy the files, each only where it is missing or out of date."""
    lock = (ROOT / "package-lock.json").read_bytes()
    wanted = hashlib.sha256(lock + Path(__file__).read_bytes()).hexdigest()
    locked = json.loads(lock)["packages"]
    stamp = VENDOR / ".stamp"
    installed = _is_installed(locked)
    copied = stamp.is_file() and stamp.read_text() == wanted
    if "--check" in sys.argv[1:]:
        sys.exit(not (installed and copied))
    if not installed:
        _install()
    if not (installed and copied):
        _copy(locked)
        stamp.write_text(wanted)
    print(f"vendor: browser files of the book in {VENDOR.relative_to(ROOT)}")


def _is_installed(locked):
    """Say whether every package that package.json names is there in its locked version."""
    root = locked[""]
    for name in [*root["dependencies"], *root["devDependencies"]]:
        manifest = MODULES / name / "package.json"
        if (
            not manifest.is_file()
            or json.loads(manifest.read_text())["version"] != locked[f"node_modules/{name}"]["version"]
        ):
            return False
    return True


def _install():
    """Install the locked npm packages; none of them needs its install script."""
    npm = shutil.which("npm")
    if npm is None:
        sys.exit(
            "vendor: npm is not on the path; install Node.js 18 or later (on Debian: apt-get install npm)"
        )
    command = [npm, "ci", "--ignore-scripts", "--no-audit", "--no-fund", "--loglevel=error"]
    if subprocess.run(command, cwd=ROOT, check=False).returncode:
        sys.exit(f"vendor: `{' '.join(['npm', *command[1:]])}` failed; its message is above")


def _copy(locked):
    """Copy the files of `SOURCES` into a new vendor folder and note the versions beside them."""
    fresh = VENDOR.with_name("vendor.new")
    shutil.rmtree(fresh, ignore_errors=True)
    versions = {}
    for target, (package, parts) in SOURCES.items():
        versions[target] = locked[f"node_modules/{package}"]["version"]
        for part in parts:
            source = MODULES / package / part
            # The folders es5/ and dist/ are build details of the packages: the vendor folder leaves them out.
            destination = fresh / target / part.removeprefix("es5/").removeprefix("dist")
            destination.parent.mkdir(parents=True, exist_ok=True)
            if source.is_dir():
                shutil.copytree(source, destination, ignore=LEFT_OUT, dirs_exist_ok=True)
            else:
                shutil.copyfile(source, destination)
    (fresh / "versions.json").write_text(json.dumps(versions, indent=1) + "\n")
    shutil.rmtree(VENDOR, ignore_errors=True)
    fresh.rename(VENDOR)


if __name__ == "__main__":
    main()
