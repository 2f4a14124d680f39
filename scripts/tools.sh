#!/usr/bin/env bash
# Installs what the tests use beside Rust and a C/C++ compiler: clang, CMake, pkg-config and valgrind
# as Debian packages where this user may install them, a Python environment in target/venv, the
# wheels that the package's installation needs in target/wheels, and environments of other Pythons.
# Prints what is missing and goes on; under CI=true a missing tool is an error.
set -u
cd "$(dirname "$0")/.."
missing=()
for pair in clang:clang cmake:cmake pkg-config:pkg-config valgrind:valgrind; do
  command -v "${pair%%:*}" >/dev/null 2>&1 || missing+=("${pair##*:}")
done
if [ ${#missing[@]} -gt 0 ] && command -v apt-get >/dev/null 2>&1 && [ "$(id -u)" = 0 ]; then
  echo "tools: installing ${missing[*]}"
  (apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq "${missing[@]}") >target-tools.log 2>&1 ||
    tail -n 5 target-tools.log
  rm -f target-tools.log
fi
if [ ! -x target/venv/bin/python ] || ! target/venv/bin/python -c 'import numpy, pytest' 2>/dev/null; then
  echo "tools: making a Python environment in target/venv"
  mkdir -p target
  python3 -m venv target/venv && target/venv/bin/pip install --quiet --disable-pip-version-check numpy pytest setuptools wheel
fi
# masters of FMI for the tests; libcosim's wheels do not exist for every platform
if [ -x target/venv/bin/python ] && ! target/venv/bin/python -c 'import fmpy' 2>/dev/null; then
  echo "tools: installing fmpy and libcosimpy in target/venv"
  target/venv/bin/python -m pip install --quiet --disable-pip-version-check fmpy==0.3.32
  target/venv/bin/python -m pip install --quiet --disable-pip-version-check libcosimpy==0.0.6 ||
    echo "tools: libcosimpy cannot be installed here; its test is skipped"
fi
# parameter sweeps of FMUs
if [ -x target/venv/bin/python ] && ! target/venv/bin/python -c 'import distributed, matplotlib' 2>/dev/null; then
  echo "tools: installing distributed and matplotlib in target/venv"
  target/venv/bin/python -m pip install --quiet --disable-pip-version-check distributed==2026.8.0 matplotlib==3.11.2
fi
# what `pip install ./python` asks for, so that its test needs no network
if [ -x target/venv/bin/python ] && ! ls target/wheels/numpy-* target/wheels/setuptools-* target/wheels/wheel-* >/dev/null 2>&1; then
  echo "tools: fetching wheels into target/wheels"
  target/venv/bin/pip download --quiet --disable-pip-version-check --dest target/wheels numpy 'setuptools>=68' wheel
fi
bash scripts/pythons.sh
status=0
for tool in clang cmake pkg-config valgrind target/venv/bin/python; do
  if ! command -v "$tool" >/dev/null 2>&1; then
    echo "tools: $tool is not there; tests that need it are skipped"
    status=1
  fi
done
if [ "${CI:-}" = true ]; then exit $status; fi
exit 0
