#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# From a bare clone to .venv: finds uv and Python 3.13, installs requirements.lock, checks what bpy needs of the machine.
set -eu
cd "$(dirname "$0")/.."

say() { printf 'vellus: %s\n' "$*" >&2; }
fail() { say "$*"; exit 1; }

# pyenv leaves shims on the PATH that do not run, so a Python counts only once it has answered.
answers_313() { "$1" -c 'import sys; sys.exit(sys.version_info[:2] != (3, 13))' 2>/dev/null; }

find_python() {
  for candidate in python3.13 "${PYENV_ROOT:-$HOME/.pyenv}"/versions/3.13*/bin/python3.13 python3; do
    if answers_313 "$candidate"; then command -v "$candidate"; return; fi
  done
}

find_uv() {
  if command -v uv; then return; fi
  if [ ! -x .venv-bootstrap/bin/uv ]; then
    for candidate in "$python" python3 /usr/bin/python3; do
      if [ -n "$candidate" ] && "$candidate" -c 'import ensurepip, venv' 2>/dev/null; then break; fi
      candidate=
    done
    [ -n "$candidate" ] || fail "uv is missing, and so is a Python 3 with venv and pip to install it" \
      "(on Debian: apt-get install python3-venv)."
    say "installing uv into .venv-bootstrap"
    "$candidate" -m venv --clear .venv-bootstrap
    # The lock's own entry for uv: the line that names it and the hashes that it continues with.
    awk '/^uv==/ { entry = 1 } entry { print } entry && !/\\$/ { exit }' requirements.lock > .venv-bootstrap/uv.txt
    .venv-bootstrap/bin/python -m pip --quiet --disable-pip-version-check install \
      --require-hashes --only-binary=:all: -r .venv-bootstrap/uv.txt >&2 ||
      fail "uv is missing, and pip could not install it; install uv by hand and run make again."
  fi
  echo .venv-bootstrap/bin/uv
}

check_libraries() {
  [ "$(uname -s)" = Linux ] || return 0
  missing=$(ldd .venv/lib/python3.13/site-packages/bpy/__init__.so | awk '/not found/ { print $1 }' | sort -u)
  # bpy opens this one by name when something is drawn, so ldd does not list it.
  .venv/bin/python -c 'import ctypes; ctypes.CDLL("libEGL.so.1")' 2>/dev/null || missing="$missing libEGL.so.1"
  [ -z "$missing" ] || fail "Blender needs shared libraries that this machine lacks:" $missing \
    "(on Debian, as root: apt-get install $(paste -s -d ' ' tools/debian-packages.txt))."
  .venv/bin/python -c 'import bpy, gpu; gpu.init()' >/dev/null 2>&1 ||
    say "warning: nothing can be drawn here, so pictures and their tests will fail;" \
      "an OpenGL driver is missing (on Debian: libgl1-mesa-dri)."
}

python=$(find_python)
uv=$(find_uv)
if [ -z "$python" ]; then
  say "no Python 3.13 here; asking uv for one"
  "$uv" python install 3.13 || fail "Python 3.13 is missing and could not be fetched;" \
    "install it (a python3.13 on the PATH, or pyenv install 3.13) and run make again."
  python=3.13
fi

answers_313 .venv/bin/python || "$uv" venv --quiet --clear --no-project --python "$python" .venv
say "installing requirements.lock into .venv"
"$uv" pip sync --quiet --python .venv/bin/python --require-hashes requirements.lock ||
  fail "requirements.lock could not be installed (see above)."
check_libraries
touch .venv/installed
