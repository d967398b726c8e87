#!/usr/bin/env bash
# Sets up everything the project needs, from a bare checkout; `make setup` calls it, and so does every other target.
#
#   1. system packages   bubblewrap (sandbox), chromium (browser tests), node and npm (files the book ships),
#                        postgresql (tests start a server of their own);
#                        libseccomp2, which the sandbox needs too, is there wherever apt is: apt requires it
#   2. .venv             requirements.lock, installed by uv, every file checked against its hash
#   3. vendor files      package-lock.json, installed by npm (tools/vendor.py)
#
# .venv carries a stamp, made of the hashes of its inputs and a list of what stands in it, so a second run does nothing,
# and an environment that was left incomplete or damaged is made anew.
#
#   tools/setup.sh [system] [python] [vendor]      all three by default
#   tools/setup.sh check                           only says whether .venv is complete
#   PYTHON=python3.12 tools/setup.sh               makes .venv with that interpreter
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

oldest_python="3.11"
stamp=".venv/.setup-stamp"

# An activated .venv must not be the interpreter that makes .venv anew.
PATH=":$PATH:"
PATH=${PATH//":$PWD/.venv/bin:"/:}
PATH=${PATH#:}
PATH=${PATH%:}

say() { printf 'setup: %s\n' "$*"; }
fail() {
  printf 'setup: %s\n' "$*" >&2
  exit 1
}

# One hash of the named files (a missing file counts as such) and of where the checkout stands.
fingerprint() {
  { pwd && sha256sum "$@" 2>&1; } | sha256sum
}

# ---------------------------------------------------------------- system packages

# The first interpreter that is new enough; empty if there is none.
find_python() {
  local candidate
  for candidate in ${PYTHON:-} python3 python3.14 python3.13 python3.12 python3.11; do
    if "$candidate" -c "import sys; sys.exit(sys.version_info < (${oldest_python/./, }))" 2>/dev/null; then
      command -v "$candidate"
      return
    fi
  done
}

missing_packages() {
  local python version
  command -v bwrap >/dev/null || echo bubblewrap
  command -v chromium >/dev/null || echo chromium
  command -v node >/dev/null || echo nodejs
  command -v npm >/dev/null || echo npm
  # Debian keeps the server's own commands off the path, and pg_ctlcluster on it.
  command -v initdb >/dev/null || command -v pg_ctlcluster >/dev/null || echo postgresql
  [ -e "$stamp" ] && [ -x .venv/bin/python ] && return
  python=$(find_python)
  if [ -z "$python" ]; then
    command -v python3 >/dev/null || printf '%s\n' python3 python3-venv
  elif ! "$python" -c 'import ensurepip, venv' 2>/dev/null; then
    version=$("$python" -c 'import sys; print("%d.%d" % sys.version_info[:2])')
    echo "python$version-venv"
  fi
}

set_up_system() {
  local missing
  missing=$(missing_packages | tr '\n' ' ')
  missing=${missing% }
  [ -z "$missing" ] && return
  if [ "$(id -u)" != 0 ] || ! command -v apt-get >/dev/null; then
    fail "missing on this machine: $missing. Install with: sudo apt-get install $missing"
  fi
  say "installing system packages: $missing"
  local apt=(apt-get -q -y -o DPkg::Lock::Timeout=600 -o Dpkg::Use-Pty=0)
  DEBIAN_FRONTEND=noninteractive "${apt[@]}" update </dev/null >/dev/null ||
    fail "apt-get update failed; needed: $missing"
  # shellcheck disable=SC2086  # one word for each package
  DEBIAN_FRONTEND=noninteractive "${apt[@]}" install --no-install-recommends $missing </dev/null >/dev/null ||
    fail "apt-get could not install: $missing"
}

# ---------------------------------------------------------------- Python

inputs_of_python() {
  fingerprint requirements.lock requirements-uv.txt pyproject.toml tools/setup.sh
}

# What stands in .venv, by name: a package that was removed, added or half installed changes it.
contents_of_python() {
  LC_ALL=C ls -1 .venv/bin .venv/lib/python3.*/site-packages 2>&1 | grep -v __pycache__ | sha256sum
}

python_is_set_up() {
  [ -e "$stamp" ] && [ -x .venv/bin/python ] &&
    [ "$(cat "$stamp")" = "$(inputs_of_python)$(contents_of_python)" ]
}

set_up_python() {
  python_is_set_up && return

  local python
  python=$(find_python)
  if [ -z "$python" ]; then
    fail "Python $oldest_python or newer is needed, and $(python3 --version 2>&1 || true) was found." \
      "Install one and name it: make setup PYTHON=python3.12"
  fi
  # Only a complete environment is brought up to date; any other is made anew.
  if [ ! -x .venv/bin/python ] || [ ! -e "$stamp" ] || [[ "$(cat "$stamp")" != *"$(contents_of_python)" ]]; then
    say "making .venv with $("$python" --version)"
    rm -rf .venv
    "$python" -m venv .venv
  fi
  rm -f "$stamp"
  say "installing Python packages (requirements.lock)"
  .venv/bin/python -m pip install --quiet --disable-pip-version-check --no-input --require-hashes \
    --requirement requirements-uv.txt </dev/null
  .venv/bin/uv pip sync --compile-bytecode --quiet --python .venv/bin/python --require-hashes requirements.lock </dev/null
  .venv/bin/uv pip install --quiet --python .venv/bin/python --no-deps --no-build-isolation --editable . </dev/null
  printf '%s%s\n' "$(inputs_of_python)" "$(contents_of_python)" >"$stamp"
}

# ---------------------------------------------------------------- vendor files

set_up_vendor() {
  .venv/bin/python tools/vendor.py --check && return
  say "installing vendor files (package-lock.json)"
  .venv/bin/python tools/vendor.py </dev/null >/dev/null
}

# One set-up at a time: two make commands started together must not build .venv twice in one place.
mkdir -p build
exec 9>build/.setup.lock
flock 9
[ $# -gt 0 ] || set -- system python vendor
for step in "$@"; do
  case "$step" in
    system | python | vendor) "set_up_$step" ;;
    check) python_is_set_up || fail ".venv is not as make setup leaves it" ;;
    *) fail "unknown step '$step'; expected system, python, vendor or check" ;;
  esac
done
