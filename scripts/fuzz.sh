#!/usr/bin/env bash
# Builds the fuzz targets with coverage (stable Rust and a C++ compiler are enough) and runs each:
#     scripts/fuzz.sh [SECONDS]
# What was found worth keeping stays in target/fuzz/corpus; a crash, a hang or a leak ends the script
# with an error and its bytes in target/fuzz/TARGET-*.
set -euo pipefail
cd "$(dirname "$0")/.."
seconds=${1:-20}
host=$(rustc -vV | sed -n 's/^host: //p')
# the passes that cargo-fuzz asks for, without a sanitizer: those need a nightly compiler
flags="-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4"
flags+=" -Cllvm-args=-sanitizer-coverage-inline-8bit-counters"
flags+=" -Cllvm-args=-sanitizer-coverage-pc-table -Cllvm-args=-sanitizer-coverage-trace-compares"
# with a target named, build scripts and macros are left without coverage
RUSTFLAGS="$flags" "${CARGO:-cargo}" build --release --locked --manifest-path fuzz/Cargo.toml \
  --target "$host" --target-dir target/fuzz

mkdir -p target/fuzz/corpus/{calls,text,scene}
cp examples/tshirt.json examples/skirt.json examples/two_panels.json target/fuzz/corpus/text/
# the other scenes have a mannequin, which takes a second to make
cp fuzz/seeds/scene.json examples/sphere_scene.json target/fuzz/corpus/scene/
for name in calls text scene; do
  echo "fuzz: $name for $seconds s"
  log=target/fuzz/$name.log
  if ! "target/fuzz/$host/release/$name" -max_total_time="$seconds" -timeout=60 -rss_limit_mb=2048 \
    -max_len=8192 -artifact_prefix="target/fuzz/$name-" "target/fuzz/corpus/$name" >"$log" 2>&1; then
    tail -n 40 "$log"
    exit 1
  fi
  # a run that covers nothing more than its seeds was built without coverage
  if grep -q 'no interesting inputs' "$log"; then
    echo "fuzz: $name was built without coverage"
    exit 1
  fi
  tail -n 1 "$log"
done
