#!/usr/bin/env bash
# Configures, builds and tries Ipminmax in many ways; each line of the table that it prints is one of them: what differs
# from the defaults, CMake and its generator, seconds of configuring and building, and what CMake says is not built.
#
#   tests/systems/matrix.sh [FOLDER [WAYS]]      FOLDER (build): build folders are made inside, matrix-1, matrix-2, ...
#                                                WAYS: a regular expression; those whose name and generator match it
#
# Not part of continuous integration: each way compiles the library, unless a compiler cache has it.
# Environment: CASADI_DIR (folder of casadi-config.cmake: ways with its plugin), CMAKE (another cmake), JOBS.
set -euo pipefail
source=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
work=${1:-$source/build}
ways=${2:-.}
cmake=${CMAKE:-cmake}
version=$("$cmake" --version | sed -n 's/.*version //p')
jobs=${JOBS:-$(nproc)}
unset CMAKE_GENERATOR
mkdir -p "$work"
work=$(cd "$work" && pwd)
count=0
failed=0

seconds() { date +%s.%N; }

# Name, generator, source folder, program to run in the build folder, CMake's arguments.
way() {
  local name=$1 generator=$2 folder=$3 program=$4
  shift 4
  [[ "$name $generator" =~ $ways ]] || return 0
  count=$((count + 1))
  local build=$work/matrix-$count log=$work/matrix-$count.log verdict="" begun configured
  rm -rf "$build"
  begun=$(seconds)
  if ! "$cmake" -S "$folder" -B "$build" -G "$generator" -DCMAKE_BUILD_TYPE=Release \
    "-DCMAKE_CXX_FLAGS_RELEASE=-O2 -DNDEBUG" "$@" >"$log" 2>&1; then
    verdict="CONFIGURE FAILED"
  fi
  configured=$(seconds)
  if [ -z "$verdict" ] && ! "$cmake" --build "$build" -j "$jobs" >>"$log" 2>&1; then verdict="BUILD FAILED"; fi
  if [ -z "$verdict" ] && ! (cd "$build" && eval "$program") >>"$log" 2>&1; then verdict="RUN FAILED"; fi
  [ -n "$verdict" ] && failed=1
  awk -v name="$name" -v generator="$generator" -v cmake="$version" -v a="$begun" -v b="$configured" -v c="$(seconds)" \
    -v verdict="${verdict:-builds and runs}" -v off="$(sed -n 's/^-- \(.*: no .*\)/\1/p' "$log" | paste -sd ';')" \
    'BEGIN {printf "| %s | %s | %s | %.0f | %.0f | %s | %s |\n", name, cmake, generator, b - a, c - b, verdict, off}'
  rm -rf "$build"
}

echo "| way | CMake | generator | configure, s | build and run, s | | not built |"
echo "|---|---|---|---|---|---|---|"
own=(-DIPMINMAX_BUILD_TESTS=OFF -DIPMINMAX_BUILD_EXAMPLES=OFF)
saddle="./ipminmax $source/tests/package/saddle.nl | grep 'local minmax'"
python='PYTHONPATH=python $(sed -n "s/^_Python3_EXECUTABLE:INTERNAL=//p" CMakeCache.txt) -c "import ipminmax"'
way "all that is found" Ninja "$source" "$saddle && $python" "${own[@]}"
way "all that is found" "Unix Makefiles" "$source" "$saddle && $python" "${own[@]}"
way "static libraries" Ninja "$source" "$saddle" "${own[@]}" -DBUILD_SHARED_LIBS=OFF
way "without MPI" Ninja "$source" "$saddle" "${own[@]}" -DIPMINMAX_MPI=OFF
way "without ASL" Ninja "$source" "$python" "${own[@]}" -DIPMINMAX_BUILD_AMPL=OFF
way "without Python" Ninja "$source" "$saddle" "${own[@]}" -DIPMINMAX_BUILD_PYTHON=OFF
if [ -n "${CASADI_DIR:-}" ]; then
  way "with CasADi" Ninja "$source" "test -e casadi/libcasadi_nlpsol_ipminmax.so" "${own[@]}" "-Dcasadi_DIR=$CASADI_DIR"
fi
way "nothing optional" "Unix Makefiles" "$source" true "${own[@]}" -DIPMINMAX_MPI=OFF -DIPMINMAX_BUILD_AMPL=OFF \
  -DIPMINMAX_BUILD_PYTHON=OFF -DIPMINMAX_BUILD_CASADI=OFF

# A user's project that has it inside, without and with what is off there by default.
project=$(mktemp -d)
trap 'rm -rf "$project"' EXIT
cp "$source"/tests/package/{consumer.cpp,consumer.c,model.hpp} "$project"
cat >"$project/CMakeLists.txt" <<END
cmake_minimum_required(VERSION 3.22)
project(user LANGUAGES C CXX)
if(BY STREQUAL FetchContent)
  include(FetchContent)
  FetchContent_Declare(ipminmax SOURCE_DIR "$source")
  FetchContent_MakeAvailable(ipminmax)
else()
  add_subdirectory("$source" ipminmax)
endif()
add_executable(consumer consumer.cpp)
target_link_libraries(consumer PRIVATE ipminmax::ipminmax)
add_executable(c_consumer consumer.c)
target_link_libraries(c_consumer PRIVATE ipminmax::ipminmax m)
END
consumers="./consumer && ./c_consumer"
for how in add_subdirectory FetchContent; do
  for generator in Ninja "Unix Makefiles"; do
    way "$how" "$generator" "$project" "$consumers" -DBY=$how "-DFETCHCONTENT_BASE_DIR=$work/matrix-$((count + 1))"
  done
done
extras=(-DBY=add_subdirectory -DIPMINMAX_BUILD_PYTHON=ON)
[ -n "${CASADI_DIR:-}" ] && extras+=(-DIPMINMAX_BUILD_CASADI=ON "-Dcasadi_DIR=$CASADI_DIR")
way "add_subdirectory, all on" Ninja "$project" "$consumers" "${extras[@]}"
way "add_subdirectory, nothing optional" Ninja "$project" "$consumers" -DBY=add_subdirectory -DIPMINMAX_MPI=OFF \
  -DIPMINMAX_BUILD_AMPL=OFF
exit $failed
