#!/usr/bin/env bash
# Cross compiles for another machine, runs tests of linalg and core under qemu, and compares what the certificate says of some hundred
# solves with what it says on this one. A folder of Debian's packages of that architecture stands for the machine; nothing in it is
# installed.
#
#   tests/systems/cross.sh arm64|i386 [FOLDER [VERDICTS]]
#
# Debian: g++-aarch64-linux-gnu or g++-i686-linux-gnu, qemu-user, mmdebstrap. FOLDER (build/ and the architecture) is kept for the next
# run. VERDICTS: this machine's program tests/verdicts.
set -euo pipefail
source=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
architecture=$1
work=${2:-$source/build/$architecture}
verdicts=${3:-}
mkdir -p "$work"
work=$(cd "$work" && pwd)
root=$work/root
case $architecture in
  arm64) triplet=aarch64-linux-gnu compiler=$triplet processor=aarch64 flags="-Wno-psabi" ;;
  i386) triplet=i386-linux-gnu compiler=i686-linux-gnu processor=i386 flags="-msse2 -mfpmath=sse" ;;
  *) echo "arm64 or i386" >&2; exit 2 ;;
esac
emulator=qemu-$processor

if [ ! -e "$work/root.done" ]; then
  rm -rf "$root"
  mmdebstrap --variant=extract --architectures="$architecture" "$(. /etc/os-release && echo "$VERSION_CODENAME")" "$root" \
    --include=libc6-dev,libstdc++-12-dev,linux-libc-dev,libeigen3-dev,liblapack-dev,libblas-dev,libgtest-dev \
    --include=libmumps-seq-dev,libmetis-dev,coinor-libipopt-dev
  for name in blas lapack; do  # what their installation would link
    ln -s "$name/lib$name.so.3" "$root/usr/lib/$triplet/lib$name.so.3"
    ln -s "lib$name.so.3" "$root/usr/lib/$triplet/lib$name.so"
  done
  touch "$work/root.done"
fi

cat >"$work/toolchain.cmake" <<END
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR $processor)
set(CMAKE_C_COMPILER $compiler-gcc)
set(CMAKE_CXX_COMPILER $compiler-g++)
set(CMAKE_SYSROOT "$root")
set(CMAKE_FIND_ROOT_PATH "$root")
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(CMAKE_LIBRARY_ARCHITECTURE $triplet)
set(CMAKE_EXE_LINKER_FLAGS "-Wl,-rpath-link,$root/usr/lib/$triplet")
set(CMAKE_CROSSCOMPILING_EMULATOR "$emulator;-L;$root")
END
export PKG_CONFIG_SYSROOT_DIR=$root PKG_CONFIG_LIBDIR=$root/usr/lib/$triplet/pkgconfig:$root/usr/lib/pkgconfig:$root/usr/share/pkgconfig

cmake -S "$source" -B "$work/build" -DCMAKE_TOOLCHAIN_FILE="$work/toolchain.cmake" -DCMAKE_BUILD_TYPE=Release \
  "-DCMAKE_CXX_FLAGS_RELEASE=-O2 -DNDEBUG${flags:+ $flags}" -DIPMINMAX_PRECOMPILE=ON -DIPMINMAX_BUILD_PYTHON=OFF -DIPMINMAX_BUILD_CASADI=OFF \
  -DIPMINMAX_BUILD_EXAMPLES=OFF -DIPMINMAX_MPI=OFF
mapfile -t programs < <(cd "$source/tests/linalg" && ls -- *_test.cpp | sed 's/\(.*\)\.cpp/linalg_\1/')
cmake --build "$work/build" -j "$(nproc)" --target "${programs[@]}" core_quick_tests verdicts
export OPENBLAS_NUM_THREADS=1
# qemu is slow for tests that count seconds and for the slower half of the contract, does not keep limits of the address space, and
# breaks down in children of processes with threads.
skipped='MumpsSolver.NullPivotsThat*:MemoryLimit.OfTheAddressSpace*:*.AreMadeAnewInAForkedChild'
skipped=$skipped:Workers.LeaveTheWorkToTheCallerWhereThereAreNoThreadsToBeHad
skipped=$skipped':*/ma57*:*/ma97*:*/pardiso*:*/*_amd:*/*_pord:*/*_metis'
failed=0
for program in "${programs[@]}" core_quick_tests; do
  "$emulator" -L "$root" "$work/build/tests/$program" --gtest_brief=1 "--gtest_filter=-$skipped" || failed=1
done
if [ -n "$verdicts" ]; then
  "$emulator" -L "$root" "$work/build/tests/verdicts" "$work/there.txt" 2
  "$verdicts" "$work/here.txt" 2
  "$verdicts" --compare "$work/here.txt" "$work/there.txt"
fi
exit $failed
