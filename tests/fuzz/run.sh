#!/usr/bin/env bash
# Fuzzes each target for $1 seconds (default 30) from its corpus in the tree; new inputs stay in
# build/fuzz/corpus, what crashes in build/fuzz/findings. Needs clang and libclang-rt-14-dev.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
seconds=${1:-30}

cmake/install_dependencies.sh clang libclang-rt-14-dev
precompile=${CMAKE_CXX_COMPILER_LAUNCHER:+OFF}  # see tests/run.sh
cmake --preset fuzz -DIPMINMAX_PRECOMPILE="${precompile:-ON}"
cmake --build --preset fuzz -j "${JOBS:-$(nproc)}" --target nl_fuzz options_fuzz c_fuzz
export ASAN_OPTIONS=allocator_may_return_null=1:detect_leaks=0 OPENBLAS_NUM_THREADS=1
mkdir -p build/fuzz/findings
for target in nl options c; do
  mkdir -p "build/fuzz/corpus/$target"
  dictionary=()
  if [ -f "tests/fuzz/$target.dict" ]; then dictionary=(-dict="tests/fuzz/$target.dict"); fi
  "build/fuzz/tests/fuzz/${target}_fuzz" -max_total_time="$seconds" -timeout=60 -rss_limit_mb=4096 \
    -max_len=4096 "${dictionary[@]}" -print_final_stats=1 \
    -artifact_prefix=build/fuzz/findings/ "build/fuzz/corpus/$target" "tests/fuzz/corpus/$target"
done
