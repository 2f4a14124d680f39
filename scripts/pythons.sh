#!/usr/bin/env bash
# Environments with NumPy and pytest for every Python from 3.9 to 3.13 that can be found, in
# target/pythons/VERSION: on the path, or where pyenv keeps its own. A version that is not there is
# told and left out.
set -u
cd "$(dirname "$0")/.."
for version in 3.9 3.10 3.11 3.12 3.13; do
  home=target/pythons/$version
  if [ -x "$home/bin/python" ] && "$home/bin/python" -c 'import numpy, pytest' 2>/dev/null; then
    continue
  fi
  found=
  for place in "python$version" "${PYENV_ROOT:-$HOME/.pyenv}/versions/$version".*/bin/python; do
    # the name may be a launcher for a version that was not chosen
    if "$place" -c "import sys; sys.exit('%d.%d' % sys.version_info[:2] != '$version')" 2>/dev/null; then
      found=$place
      break
    fi
  done
  if [ -z "$found" ]; then
    echo "pythons: Python $version is not here"
    continue
  fi
  echo "pythons: Python $version from $found"
  rm -rf "$home"
  mkdir -p target/pythons
  "$found" -m venv "$home" &&
    "$home/bin/python" -m pip install --quiet --no-compile --disable-pip-version-check numpy pytest || rm -rf "$home"
done
