#!/usr/bin/env bash
# clang's address and undefined behaviour sanitizers: programs of tests that between them call every part
# with hostile input, with leaks looked for, then each fuzzer for $1 seconds (default 30). Arguments after it
# are the programs to build and run instead, as target names.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
seconds=${1:-30}
shift || true
programs=("$@")
if [ ${#programs[@]} -eq 0 ]; then
  programs=(hostile_models_slow_test hostile_faults_slow_test ampl_damaged_files_test)
fi

cmake/install_dependencies.sh clang libclang-rt-14-dev
precompile=${CMAKE_CXX_COMPILER_LAUNCHER:+OFF}  # see tests/run.sh
cmake --preset fuzz -DIPMINMAX_BUILD_TESTS=ON -DIPMINMAX_PRECOMPILE="${precompile:-ON}"
cmake --build --preset fuzz -j "${JOBS:-$(nproc)}" --target "${programs[@]}"
export ASAN_OPTIONS=allocator_may_return_null=1 UBSAN_OPTIONS=print_stacktrace=1 OPENBLAS_NUM_THREADS=1
for program in "${programs[@]}"; do
  runs=300
  if [ "$program" = hostile_faults_slow_test ]; then runs=2; fi  # models, with hundreds of faults each
  IPMINMAX_RUNS=${IPMINMAX_RUNS:-$runs} "build/fuzz/tests/$program" --gtest_brief=1
done
exec tests/fuzz/run.sh "$seconds"
