#!/usr/bin/env bash
# Installs what is missing, builds the library and the examples in build/release and runs an example
# with the given arguments; default: pursuit_evasion. JOBS: default all cores.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
example=${1:-pursuit_evasion}
shift || true

cd "$root"
cmake/install_dependencies.sh
# From scratch, but where there is a compiler cache, which cannot keep what this uses.
precompile=${CMAKE_CXX_COMPILER_LAUNCHER:+OFF}
cmake --preset release -DIPMINMAX_PRECOMPILE="${precompile:-ON}"
cmake --build build/release --target "$example" -j "${JOBS:-$(nproc)}"
export OPENBLAS_NUM_THREADS=${OPENBLAS_NUM_THREADS:-1}
cd build/release/examples
exec "./$example" "$@"
