#!/usr/bin/env bash
# Installs what is missing, builds everything in build/release and runs all tests.
# Arguments go to ctest: tests/run.sh -L core, tests/run.sh -LE slow. JOBS: default all cores.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
jobs=${JOBS:-$(nproc)}

# For the tests alone: a decimal comma; ADOL-C; MPI; the Python package, which is left out where it finds nothing, and its wheel.
cmake/install_dependencies.sh locales libadolc-dev libmumps-dev libopenmpi-dev openmpi-bin \
  python3-dev python3-numpy python3-scipy pybind11-dev patchelf
# Precompiled headers, but where there is a compiler cache, which cannot keep what uses them.
precompile=${CMAKE_CXX_COMPILER_LAUNCHER:+OFF}
cmake --preset release -DIPMINMAX_PRECOMPILE="${precompile:-ON}"
cmake --build build/release -j "$jobs"
cd build/release
exec ctest --output-on-failure -j "$((jobs + 1))" "$@"  # tests of ranks mostly wait
