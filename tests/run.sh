#!/usr/bin/env bash
# Installs what is missing, builds everything in build/release and runs all tests.
# Arguments go to ctest: tests/run.sh -L core, tests/run.sh -LE slow. JOBS: default all cores.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
jobs=${JOBS:-$(nproc)}

cmake/install_dependencies.sh locales libmumps-dev libopenmpi-dev openmpi-bin  # a decimal comma; MPI
cmake --preset release
cmake --build build/release -j "$jobs"
cd build/release
exec ctest --output-on-failure -j "$jobs" "$@"
