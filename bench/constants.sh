#!/bin/bash
# What a tenth and ten times of each number of core/<ROOM>/parameters.hpp (of counts, a third and three times) change
# in the table of verdicts: certificates and solves lost and gained, solves that differ at all, factorizations, false
# certificates.
#
#   bench/constants.sh [ROOM [BUILD [GAMES]]]     after building the target verdicts in BUILD (build/release)
#
# ROOM: certificate or method. One program is built in which the numbers can be changed. GAMES: of each random family (5).
set -euo pipefail
source=$(cd "$(dirname "$0")/.." && pwd)
room=${1:-certificate}
build=${2:-$source/build/release}
games=${3:-5}
work=$build/constants/$room
mkdir -p "$work/core/$room"
header=$source/core/$room/parameters.hpp
{
  sed -E 's/^constexpr /inline /' "$header"
  echo '#include <string>'
  echo '#include <vector>'
  echo 'namespace ipminmax::parameters {'
  echo 'struct Number { std::string name; double value; void (*set)(double); };'
  echo 'inline const std::vector<Number> kNumbers = {'
  awk '/^namespace / { room = $2; sub(/.*::/, "", room); if (outer == "") outer = room }
       /^}  \/\/ namespace / { room = outer }
       /^constexpr / {
         for (i = 2; i < NF; ++i) if ($i ~ /^k/ && $(i + 1) == "=") {
           n = room "::" $i
           printf "{\"%s\", static_cast<double>(%s), [](double v) { %s = static_cast<decltype(%s)>(v); }},\n", n, n, n, n
         }
       }' "$header"
  echo '};}'
} >"$work/core/$room/parameters.hpp"
flags=(-std=c++20 -O2 -DNDEBUG -I "$work" -I "$source" -I "$source/tests" -I "$build/include"
  -isystem /usr/include/eigen3)
objects=()
cd "$source"
for folder in $(grep -rl "core/$room/parameters.hpp" core | xargs dirname | sort -u); do
  for file in "$folder"/*.cpp; do
    objects+=("$work/$(basename "$file" .cpp).o")
    ${CMAKE_CXX_COMPILER_LAUNCHER:-} c++ "${flags[@]}" -c "$file" -o "${objects[-1]}"
  done
done
if [ -f "$build/build.ninja" ]; then
  link=$(ninja -C "$build" -t commands verdicts | tail -1)
else
  link=$(cat "$build/tests/CMakeFiles/verdicts.dir/link.txt")
fi
libraries=$(grep -oE '(/[^ ]*\.so|-l[a-z]+)' <<<"$link" | sort -u)
# shellcheck disable=SC2086
c++ "${flags[@]}" "-DIPMINMAX_CHANGE_NUMBERS=\"core/$room/parameters.hpp\"" "$source/tests/verdicts.cpp" "${objects[@]}" \
  -o "$work/constants" "$build/tests/libipminmax_test_support.a" "$build/libipminmax_core.a" \
  "$build/libipminmax_linalg.a" $libraries
"$work/constants" --constants "$games"
