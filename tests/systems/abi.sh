#!/usr/bin/env bash
# Compares the binary interface of the shared library with that of another state: libabigail's abidiff on builds with
# debug information. Ends with 0 where programs that were built with the other state run with this one.
#
#   tests/systems/abi.sh [STATE [FOLDER]]     STATE: a commit (the last tag); FOLDER: of the builds (build/abi)
#
# Both libraries are compiled, without optimization. Debian: abigail-tools. What continuous integration checks are the
# exported names alone (tests/package/run.sh against debian/*.symbols).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
state=${1:-$(git describe --tags --abbrev=0)}
work=${2:-build/abi}
mkdir -p "$work"
work=$(cd "$work" && pwd)

library() { # source folder, build folder
  cmake -S "$1" -B "$2" -DCMAKE_BUILD_TYPE=Debug "-DCMAKE_CXX_FLAGS_DEBUG=-O0 -g" \
    -DIPMINMAX_BUILD_TESTS=OFF -DIPMINMAX_BUILD_EXAMPLES=OFF -DIPMINMAX_BUILD_PYTHON=OFF -DIPMINMAX_BUILD_CASADI=OFF \
    -DIPMINMAX_MPI=OFF >"$2.log"
  cmake --build "$2" -j "${JOBS:-$(nproc)}" --target ipminmax_shared >>"$2.log"
}
rm -rf "$work/source"
mkdir "$work/source"
git archive "$state" | tar x -C "$work/source"
library "$work/source" "$work/before"
library . "$work/after"
abidiff --headers-dir1 "$work/before/include" --headers-dir2 "$work/after/include" --drop-private-types \
  "$work/before/libipminmax.so" "$work/after/libipminmax.so"
echo "no difference from $state, or none that matters"
