#!/usr/bin/env bash
set -euo pipefail
# shellcheck disable=SC2086
cmake -S . -B build -G Ninja ${CMAKE_ARGS:-} -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX="$PREFIX" \
  -DCMAKE_PREFIX_PATH="$PREFIX" -DIPOPT_ROOT="$PREFIX" -DIPMINMAX_BUILD_TESTS=OFF -DIPMINMAX_BUILD_EXAMPLES=OFF \
  -DIPMINMAX_BUILD_CASADI=OFF -DIPMINMAX_MPI=OFF -DPython3_EXECUTABLE="$PYTHON" \
  -DIPMINMAX_PYTHON_DIR="$("$PYTHON" -c 'import os, sys, sysconfig; print(os.path.relpath(sysconfig.get_path("purelib"), sys.prefix))')"
cmake --build build -j "${CPU_COUNT:-2}"
cmake --install build
