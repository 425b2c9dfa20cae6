#!/usr/bin/env bash
# Builds linalg and core with clang and libc++ and runs their tests. Ipopt and the adapter, which share std::string with it, need the
# library that Ipopt was built with.
#
#   tests/systems/libcxx.sh [FOLDER]
#
# Debian 12: clang-16 libc++-16-dev libc++abi-16-dev googletest; libc++ 14 has no std::ranges algorithms. FOLDER (build/libcxx) is kept
# for the next run. CLANG: the compilers' number (16). JOBS: how many at once (2).
set -euo pipefail
source=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
work=${1:-$source/build/libcxx}
mkdir -p "$work"
work=$(cd "$work" && pwd)
common=("-DCMAKE_C_COMPILER=clang-${CLANG:-16}" "-DCMAKE_CXX_COMPILER=clang++-${CLANG:-16}" -DCMAKE_CXX_FLAGS=-stdlib=libc++
  -DCMAKE_BUILD_TYPE=Release "-DCMAKE_CXX_FLAGS_RELEASE=-O1 -DNDEBUG")
if [ ! -e "$work/gtest.done" ]; then  # Debian's is for g++'s library
  cmake -S /usr/src/googletest -B "$work/gtest" "${common[@]}" -DCMAKE_CXX_STANDARD=20 -DBUILD_GMOCK=OFF "-DCMAKE_INSTALL_PREFIX=$work/prefix"
  cmake --build "$work/gtest" -j "${JOBS:-2}" --target install
  touch "$work/gtest.done"
fi
cmake -S "$source" -B "$work/build" "${common[@]}" "-DCMAKE_PREFIX_PATH=$work/prefix" "-DGTest_ROOT=$work/prefix" -DIPMINMAX_PRECOMPILE=ON \
  -DIPMINMAX_BUILD_PYTHON=OFF -DIPMINMAX_BUILD_CASADI=OFF -DIPMINMAX_BUILD_EXAMPLES=OFF -DIPMINMAX_MPI=OFF
mapfile -t programs < <(cd "$source/tests/linalg" && ls -- *_test.cpp | sed 's/\(.*\)\.cpp/linalg_\1/')
cmake --build "$work/build" -j "${JOBS:-2}" --target "${programs[@]}" core_quick_tests
export OPENBLAS_NUM_THREADS=1
failed=0
for program in "${programs[@]}" core_quick_tests; do
  "$work/build/tests/$program" --gtest_brief=1 || failed=1
done
exit $failed
