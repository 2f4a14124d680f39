#!/usr/bin/env bash
# Installs the release build: header, library with its soname, CMake and pkg-config files.
#     scripts/install.sh PREFIX
set -euo pipefail
cd "$(dirname "$0")/.."
prefix=${1:?usage: install.sh PREFIX}
mkdir -p "$prefix"
prefix=$(cd "$prefix" && pwd)
from=${TOILE_LIBRARY_DIR:-target/release}
version=$(sed -n 's/^version = "\(.*\)"/\1/p' Cargo.toml | head -n 1)
major=${version%%.*}
soname=libtoile.so.$major

install -d "$prefix/include" "$prefix/lib/pkgconfig" "$prefix/lib/cmake/toile"
install -m 644 include/toile.h include/toile.hpp "$prefix/include/"

# the build tree's library has no soname, so that programs run without links beside it; the
# installed one is linked anew from the static library with one
symbols=$(mktemp)
trap 'rm -f "$symbols"' EXIT
{
  echo '{ global:'
  nm -D --defined-only --format=posix "$from/libtoile.so" | cut -d ' ' -f 1 | sed 's/$/;/'
  echo 'local: *; };'
} > "$symbols"
${CC:-cc} -shared -o "$prefix/lib/libtoile.so.$version" -Wl,-soname,"$soname" \
  -Wl,--version-script="$symbols" -Wl,--whole-archive "$from/libtoile.a" -Wl,--no-whole-archive \
  -Wl,--gc-sections -Wl,-z,defs -lpthread -ldl -lm -lgcc_s -lc
ln -sf "libtoile.so.$version" "$prefix/lib/$soname"
ln -sf "$soname" "$prefix/lib/libtoile.so"
install -m 644 "$from/libtoile.a" "$prefix/lib/"

fill() { sed -e "s|@PREFIX@|$prefix|g" -e "s|@VERSION@|$version|g" -e "s|@MAJOR@|$major|g" \
  -e "s|@MINOR@|$(echo "$version" | cut -d . -f 2)|g" "$1" > "$2"; }
fill include/toile.pc.in "$prefix/lib/pkgconfig/toile.pc"
fill include/cmake/toile-config.cmake.in "$prefix/lib/cmake/toile/toile-config.cmake"
fill include/cmake/toile-config-version.cmake.in \
  "$prefix/lib/cmake/toile/toile-config-version.cmake"
echo "installed toile $version under $prefix"
