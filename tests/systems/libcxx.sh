#!/usr/bin/env bash
# Reads every source of linalg and core with clang and libc++, without making code: what only g++'s library has is an
# error. Ipopt and the adapter, which share std::string with it, need the library that Ipopt was built with.
# Debian 12: clang-16 libc++-16-dev libc++abi-16-dev; libc++ 14 has no std::ranges algorithms. CLANG: the compiler (clang++-16).
# JOBS: how many at once (2).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
check() {
  "${CLANG:-clang++-16}" -std=c++20 -stdlib=libc++ -fsyntax-only -DNDEBUG -Wall -Wextra -isystem /usr/include/eigen3 -I. \
    '-DIPMINMAX_VERSION="0"' '-DIPMINMAX_LIBDIR="lib"' "$1" || { echo "failed: $1"; exit 1; }
}
export -f check
find linalg core -name '*.cpp' -not -path 'linalg/mpi/*' -print0 | xargs -0 -n 1 -P "${JOBS:-2}" bash -c 'check "$1"' _
echo "all sources of linalg and core are read"
