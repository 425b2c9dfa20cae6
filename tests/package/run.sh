#!/usr/bin/env bash
# Installs the build folder $1 into a fresh prefix, then builds and runs the consumer with CMake and
# with a plain compiler call, and runs the installed executable. CXX and CXXFLAGS as for the library.
set -euo pipefail
source_dir=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
build_dir=$(cd "$1" && pwd)
cxx=${CXX:-g++}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
prefix=$work/prefix

cmake --install "$build_dir" --prefix "$prefix" >"$work/install.log" || { cat "$work/install.log"; exit 1; }
# Moving the prefix must not matter.
mv "$prefix" "$work/moved"
prefix=$work/moved

echo "== find_package"
cmake -S "$source_dir" -B "$work/cmake" -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_CXX_COMPILER="$cxx" \
  >"$work/cmake.log" || { cat "$work/cmake.log"; exit 1; }
cmake --build "$work/cmake"
"$work/cmake/consumer"

if [ -x "$prefix/bin/ipminmax" ]; then  # not built without the AMPL solver library
  echo "== ipminmax saddle.nl"
  cp "$source_dir/saddle.nl" "$work"
  "$prefix/bin/ipminmax" "$work/saddle.nl" -s | tee "$work/saddle.log"
  grep -q "certified local minmax" "$work/saddle.log"
  grep -q "^objno 0 0$" "$work/saddle.sol"
fi

pc_dir=$(dirname "$(find "$prefix" -name ipminmax.pc)")
lib_dir=${pc_dir%/pkgconfig}
export PKG_CONFIG_PATH=$pc_dir${PKG_CONFIG_PATH:+:$PKG_CONFIG_PATH}
export LD_LIBRARY_PATH=$lib_dir${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}
for static in "" --static; do
  echo "== pkg-config $static"
  # shellcheck disable=SC2046,SC2086
  "$cxx" -std=c++20 ${CXXFLAGS:-} "$source_dir/consumer.cpp" -o "$work/consumer" \
    $(pkg-config $static --cflags --libs ipminmax ipopt)
  "$work/consumer"
done
