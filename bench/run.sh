#!/usr/bin/env bash
# Installs what is missing, builds the benchmarks in build/bench and runs them.
#   bench/run.sh [--seconds N] [--csv FOLDER] [NAME [arguments of that program]]
# NAME: horizon, mpc, embedded, baselines, robust, minimization, scalable, backends, schur; default: all of them.
# --seconds: time for each program, about (default: its own). --csv: folder of the tables
# (default: build/bench/csv). JOBS: of the build, default all cores.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
programs=(horizon mpc embedded baselines robust minimization scalable backends schur)
csv="$root/build/bench/csv"
seconds=()

while [ $# -gt 0 ]; do
  case $1 in
    --seconds | --csv)
      if [ $# -lt 2 ]; then
        echo "$1 needs a value" >&2
        exit 2
      fi
      if [ "$1" = --csv ]; then
        mkdir -p "$2"
        csv=$(cd "$2" && pwd)
      else
        seconds=(--seconds "$2")
      fi
      shift 2
      ;;
    --help | -h)
      sed -n '2,7s/^# \{0,1\}//p' "${BASH_SOURCE[0]}"
      exit 0
      ;;
    -*)
      echo "unknown option $1; --help lists them" >&2
      exit 2
      ;;
    *)
      break
      ;;
  esac
done
if [ $# -gt 0 ]; then
  if [[ " ${programs[*]} " != *" $1 "* ]]; then
    echo "no benchmark $1; there are ${programs[*]}" >&2
    exit 2
  fi
  programs=("$1")
  shift
fi

cd "$root"
cmake/install_dependencies.sh libbenchmark-dev
cmake --preset release -B build/bench -DIPMINMAX_BUILD_BENCH=ON -DIPMINMAX_BUILD_TESTS=OFF \
  -DIPMINMAX_BUILD_EXAMPLES=OFF
cmake --build build/bench --target "${programs[@]/#/bench_}" -j "${JOBS:-$(nproc)}"
export OPENBLAS_NUM_THREADS=${OPENBLAS_NUM_THREADS:-1}
for program in "${programs[@]}"; do
  echo
  echo "=== $program"
  "build/bench/bench/bench_$program" "${seconds[@]}" --csv "$csv" "$@"
done
echo
echo "Tables as CSV: $csv"
