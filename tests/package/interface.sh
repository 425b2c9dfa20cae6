#!/usr/bin/env bash
# Writes what libabigail sees of the public headers to the file $3: layouts, bases, virtual tables and members of every
# class in the namespace ipminmax, and the C interface's functions. $1: folder of the headers, as installed; $2: the shared library, which
# knows the names of those functions. CXX as for the library. Takes seconds: the library itself needs no debug information.
set -euo pipefail
include=$(cd "$1" && pwd) library=$2 record=$3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mapfile -t headers < <(cd "$include" && find -L ipminmax -name '*.h*' -type f | LC_ALL=C sort)
{
  printf '#include <%s>\n' "${headers[@]}"
  nm -D --defined-only "$library" | sed -n 's/.* T \(Ipminmax.*\)/auto* of_\1 = \&\1;/p'
  echo "namespace ipminmax {"
  (cd "$include" && awk '
    FNR == 1 {depth = 0; before = ""}
    /^namespace .*\{$/ {name[++depth] = $(NF - 1)}
    /^\}  \/\/ namespace/ {--depth}
    /^(class|struct|enum class) [A-Za-z0-9_]+( final)?( : [^;]*)? \{/ && depth == 1 && name[1] == "ipminmax" && before !~ /^template/ {
      print $1 == "enum" ? $3 : $2
    }
    {before = $0}' "${headers[@]}") | LC_ALL=C sort -u | sed 's/.*/void takes(&\&) {}/'
  echo "}"
} >"$work/interface.cpp"
test "$(grep -c '^void takes' "$work/interface.cpp")" -gt 90
test "$(grep -c '^auto\* of_' "$work/interface.cpp")" -gt 20
# shellcheck disable=SC2046
(cd "$work" && "${CXX:-g++}" -std=c++20 -g -fPIC -shared -I"$include" $(pkg-config --cflags ipopt) interface.cpp -o interface.so)
abidw --headers-dir "$include" --drop-private-types --no-show-locs --no-corpus-path --no-comp-dir-path \
  --out-file "$record" "$work/interface.so"
