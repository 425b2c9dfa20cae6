#!/bin/bash
# What a tenth and ten times of each number of core/certificate/parameters.hpp (of counts, half and twice)
# change in the table of verdicts: certificates lost and gained, refutations, false certificates.
#
#   bench/constants.sh [BUILD [GAMES]]     after building the target verdicts in BUILD (build/release)
#
# One program is built in which the numbers can be changed. GAMES: of each random family (5).
set -euo pipefail
source=$(cd "$(dirname "$0")/.." && pwd)
build=${1:-$source/build/release}
games=${2:-5}
work=$build/constants
mkdir -p "$work/core/certificate"
header=$source/core/certificate/parameters.hpp
numbers=$(grep -oE '^constexpr [^;]*;' "$header" | grep -oE '\bk[A-Z][A-Za-z]*' | sort -u)
{
  sed -E 's/^constexpr /inline /' "$header"
  echo '#include <string>'
  echo '#include <vector>'
  echo 'namespace ipminmax::parameters::certificate {'
  echo 'struct Number { std::string name; double value; void (*set)(double); };'
  echo 'inline const std::vector<Number> kNumbers = {'
  for name in $numbers; do
    echo "{\"$name\", static_cast<double>($name), [](double v) { $name = static_cast<decltype($name)>(v); }},"
  done
  echo '};}'
} >"$work/core/certificate/parameters.hpp"
flags=(-std=c++20 -O2 -DNDEBUG -I "$work" -I "$source" -I "$source/tests" -I "$build/include"
  -isystem /usr/include/eigen3)
objects=()
for file in "$source"/core/certificate/*.cpp; do
  objects+=("$work/$(basename "$file" .cpp).o")
  ${CMAKE_CXX_COMPILER_LAUNCHER:-} c++ "${flags[@]}" -c "$file" -o "${objects[-1]}"
done
libraries=$(ninja -C "$build" -t commands verdicts | tail -1 | grep -oE '(/[^ ]*\.so|-l[a-z]+)' | sort -u)
# shellcheck disable=SC2086
c++ "${flags[@]}" -DIPMINMAX_CHANGE_NUMBERS "$source/tests/verdicts.cpp" "${objects[@]}" \
  -o "$work/constants" "$build/tests/libipminmax_test_support.a" "$build/libipminmax_core.a" \
  "$build/libipminmax_linalg.a" $libraries
"$work/constants" --constants "$games"
