"""Make the folder of third-party browser files that the book needs, so that no page needs the network.

The files come from the npm packages of `package.json`, whose contents `package-lock.json` fixes by hash:
`npm ci` installs them in `node_modules/`, and the few that the book uses are copied to `build/vendor/`. The
book's Sphinx extension copies that folder into the built book. A second run finds both folders as they should
be and does nothing.

A browser that has opened a page from a disk refuses to load fonts beside it. So mathematics is drawn as SVG,
which needs none, and the fonts of the widget manager are written into its script.

Usage: python tools/vendor.py [--check]

With `--check` nothing is made; the exit status says whether both folders are as they should be.
"""

import base64
import hashlib
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
MODULES = ROOT / "node_modules"
VENDOR = ROOT / "build" / "vendor"

# Target below build/vendor: (npm package, what to copy from it, relative to the package).
SOURCES = {
    "mathjax": ("mathjax", ["LICENSE", "es5/tex-svg.js", "es5/input/tex/extensions"]),
    "requirejs": ("requirejs", ["require.js"]),
    "html-manager": ("@jupyter-widgets/html-manager", ["dist/embed-amd.js"]),
}


def main() -> None:
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


def _is_installed(locked: dict) -> bool:
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


def _install() -> None:
    """Install the locked npm packages; none of them needs its install script."""
    npm = shutil.which("npm")
    if npm is None:
        sys.exit(
            "vendor: npm is not on the path; install Node.js 18 or later (on Debian: apt-get install npm)"
        )
    command = [npm, "ci", "--ignore-scripts", "--no-audit", "--no-fund", "--loglevel=error"]
    if subprocess.run(command, cwd=ROOT, check=False).returncode:
        sys.exit(f"vendor: `{' '.join(['npm', *command[1:]])}` failed; its message is above")


def _copy(locked: dict) -> None:
    """Copy the files of `SOURCES` into a new vendor folder and note the versions beside them."""
    fresh = VENDOR.with_name("vendor.new")
    shutil.rmtree(fresh, ignore_errors=True)
    versions = {}
    for target, (package, parts) in SOURCES.items():
        versions[target] = locked[f"node_modules/{package}"]["version"]
        for part in parts:
            source = MODULES / package / part
            # The folders es5/ and dist/ are build details of the packages: the vendor folder leaves them out.
            destination = fresh / target / part.removeprefix("es5/").removeprefix("dist/")
            destination.parent.mkdir(parents=True, exist_ok=True)
            if source.is_dir():
                shutil.copytree(source, destination)
            else:
                shutil.copyfile(source, destination)
    _write_fonts_into(fresh / "html-manager" / "embed-amd.js", MODULES / "@jupyter-widgets/html-manager/dist")
    (fresh / "versions.json").write_text(json.dumps(versions, indent=1) + "\n")
    shutil.rmtree(VENDOR, ignore_errors=True)
    fresh.rename(VENDOR)


def _write_fonts_into(script: Path, folder: Path) -> None:
    """Replace the script's addresses of WOFF2 fonts by the fonts themselves, as data addresses."""

    def data_address(match: re.Match) -> str:
        content = base64.b64encode((folder / match[1]).read_bytes()).decode()
        return f'"data:font/woff2;base64,{content}"'

    text, count = re.subn(r'\b\w\.p\+"(\w+\.woff2)"', data_address, script.read_text(encoding="utf-8"))
    if not count:
        sys.exit(f"vendor: no font address found in {script.name}; has its build changed?")
    script.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
