#!/usr/bin/env bash
# Installs the build folder $1 into a fresh prefix, then builds and runs the consumer with CMake and
# with a plain compiler call, in C++ and in C, and runs the installed executable. CC, CXX and CXXFLAGS as
# for the library.
set -euo pipefail
source_dir=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
build_dir=$(cd "$1" && pwd)
cxx=${CXX:-g++}
cc=${CC:-gcc}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
prefix=$work/prefix

cmake --install "$build_dir" --prefix "$prefix" >"$work/install.log" || { cat "$work/install.log"; exit 1; }
# Moving the prefix must not matter.
mv "$prefix" "$work/moved"
prefix=$work/moved

echo "== find_package"
cmake -S "$source_dir" -B "$work/cmake" -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_CXX_COMPILER="$cxx" \
  -DCMAKE_C_COMPILER="$cc" \
  >"$work/cmake.log" || { cat "$work/cmake.log"; exit 1; }
cmake --build "$work/cmake"
"$work/cmake/consumer"
"$work/cmake/c_consumer"

library=$(find "$prefix" -name libipminmax.so)
if [ -n "$library" ] && env -u LD_LIBRARY_PATH ldd "$library" | grep "not found"; then exit 1; fi  # an Ipopt of one's own

if [ -x "$prefix/bin/ipminmax" ]; then  # not built without the AMPL solver library
  echo "== ipminmax saddle.nl"
  cp "$source_dir/saddle.nl" "$work"
  "$prefix/bin/ipminmax" "$work/saddle.nl" -s | tee "$work/saddle.log"
  grep -q "certified local minmax" "$work/saddle.log"
  grep -q "^objno 0 0$" "$work/saddle.sol"
  page=$(find "$prefix" -name ipminmax.1)
  grep -q "^\.SH Flags" "$page"
  grep -q "minmax_max_variables" "$page"
fi

plugin=$(find "$prefix" -name libipminmax_mpi.so)
if [[ -n $plugin && -x $prefix/bin/ipminmax && ${CXXFLAGS:-} != *-fsanitize=*address* ]]; then
  echo "== the moved plugin is found"
  OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 \
    "$prefix/bin/ipminmax" "$work/saddle.nl" linear_solver=mumps_mpi | grep "certified local minmax"
  test -x "$prefix/bin/ipminmax-worker"
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
  # shellcheck disable=SC2046,SC2086
  "$cc" -std=c99 -pedantic ${CXXFLAGS:-} "$source_dir/consumer.c" -o "$work/c_consumer" \
    $(pkg-config $static --cflags --libs ipminmax ipopt) -lm
  "$work/c_consumer"
done

echo "== header together with Ipopt's, as C99 and as C++"
cat >"$work/both.c" <<'END'
#include <IpStdCInterface.h>
#include <ipminmax.h>
static Eval_F_CB eval_f;
static IpminmaxEval_F_CB eval_f_of_ours;
int main(void) {
  return eval_f != 0 || eval_f_of_ours != 0 ||
         (int)Maximum_Iterations_Exceeded != (int)IPMINMAX_MAXIMUM_ITERATIONS_EXCEEDED;
}
END
# shellcheck disable=SC2046
"$cc" -std=c99 -Wall -Wextra $(pkg-config --cflags ipminmax ipopt) "$work/both.c" -o "$work/both"
"$work/both"
echo '#include <ipminmax.h>' >"$work/header.c"
"$cc" -std=c99 -pedantic -Wall -Wextra -Werror -I"$prefix/include" -fsyntax-only "$work/header.c"
"$cxx" -Wall -Wextra -Werror -I"$prefix/include" -x c++ -fsyntax-only "$work/header.c"

echo "== no C name of libipopt's"
ours=$(find "$lib_dir" -name 'libipminmax.so' -o -name 'libipminmax_adapter.a' | head -1)
ipopt=$(find -L $(pkg-config --variable=libdir ipopt) /usr/lib /usr/lib/*-linux-gnu -maxdepth 1 \
  -name libipopt.so 2>/dev/null | head -1 || true)
c_names() { sed -n 's/.* [TDBRVW] \([A-Za-z][A-Za-z0-9_]*\)$/\1/p' | sort -u; }
if [ "${ours##*.}" = so ]; then nm -D --defined-only "$ours"; else nm -g --defined-only "$ours"; fi \
  | c_names >"$work/ours"
nm -D --defined-only "$ipopt" | c_names >"$work/theirs"
grep -qx IpminmaxCreate "$work/ours"  # both lists were read
grep -qx CreateIpoptProblem "$work/theirs"
if comm -12 "$work/ours" "$work/theirs" | grep .; then exit 1; fi
if grep -v '^Ipminmax' "$work/ours"; then echo "C names without the prefix"; exit 1; fi

echo "== every installed header alone, without Eigen"
if grep -rl Eigen "$prefix/include"; then exit 1; fi
alone() { "$cxx" -std=c++20 -Wall -Wextra -Wconversion -Wshadow -Werror -fsyntax-only -x c++ "${@:1:$#-1}" -include "${@: -1}" /dev/null; }
export -f alone
export cxx
# shellcheck disable=SC2046
find "$prefix/include/ipminmax" -name '*.h*' -print0 |
  xargs -0 -n 1 -P 2 bash -c 'alone "$@"' _ -I"$prefix/include" \
    $(pkg-config --cflags ipopt | sed 's/-I/-isystem /g')

echo "== the shared library exports the public names and no others"
shared=$build_dir/libipminmax.so
readelf -d "$shared" | grep "SONAME.*libipminmax.so.$(pkg-config --modversion ipminmax | cut -d. -f1,2)\]" >/dev/null
nm -D --defined-only -C "$shared" | sed -n 's/^[0-9a-f]* [TDBR] //p' >"$work/exported"
grep -q '^ipminmax::solve(' "$work/exported"
grep -q '^IpminmaxSolve$' "$work/exported"
if grep -vE '^(ipminmax::|Ipminmax|(vtable|typeinfo|typeinfo name|virtual thunk|non-virtual thunk) (for|to) ipminmax::)' \
  "$work/exported"; then exit 1; fi
if grep -E 'CanonicalProblem|KktSystem|LdltSolver|MumpsSolver' "$work/exported"; then exit 1; fi
# Names of Ipopt's version are part of ours.
if [ "$(pkg-config --modversion ipopt)" = 3.11.9 ] && [[ ${CXXFLAGS:-} != *-fsanitize* ]]; then
  echo "== no name that programs were linked with is gone"
  sed -n 's/^ \([^ (@]*\)@.*/\1/p' "$source_dir"/../../debian/libipminmax*.symbols | LC_ALL=C sort >"$work/promised"
  nm -D --defined-only "$shared" | awk '{print $3}' | LC_ALL=C sort >"$work/present"
  test "$(wc -l <"$work/promised")" -gt 100
  if LC_ALL=C comm -23 "$work/promised" "$work/present" | grep .; then
    echo "gone: programs need a new minor version, see \"Releases\" in CONTRIBUTING.md" >&2
    exit 1
  fi
fi

# From the day on that CHANGELOG.md gives a version with this soname, all but additions fails; before that it is listed.
recorded=$(ls "$source_dir"/../../debian/libipminmax*.abi.xz)
if command -v abidw >/dev/null && [ "$(pkg-config --modversion ipopt)" = 3.11.9 ] &&
  [ "$("$cxx" -dumpversion)" = 12 ] && [[ ${CXXFLAGS:-} != *-fsanitize* ]]; then
  echo "== types, layouts and functions are those that programs were built with"
  interface() { CXX=$cxx "$source_dir/interface.sh" "$1" "$shared" "$2"; }
  interface "$prefix/include" "$work/now.abi"
  xz -dc "$recorded" >"$work/recorded.abi"
  soname=$(pkg-config --modversion ipminmax | cut -d. -f1,2)
  released=()
  if grep -q "^## \[${soname/./\\.}\.[0-9]*\] - 20" "$source_dir/../../CHANGELOG.md"; then released=(--no-added-syms); fi
  changed=0
  abidiff "${released[@]}" "$work/recorded.abi" "$work/now.abi" >"$work/changed" || changed=$?
  if [ $changed -ne 0 ]; then
    head -100 "$work/changed"
    if [ $((changed & 3)) -ne 0 ] || [ ${#released[@]} -ne 0 ]; then
      echo "changed since $soname was released: programs need a new minor version, see \"Releases\" in CONTRIBUTING.md" >&2
      exit 1
    fi
    echo "Version $soname is not released: debian/update-symbols records it anew"
  fi

  # It does see a member that is put in.
  cp -r "$prefix/include" "$work/other"
  sed -i 's/^struct Inertia {/&\n  long long put_in = 0;/' "$work/other/ipminmax/linalg/inertia.hpp"
  interface "$work/other" "$work/other.abi"
  abidiff "$work/now.abi" "$work/other.abi" >"$work/changed" && { echo "abidiff saw nothing"; exit 1; }
  grep -q "put_in" "$work/changed"
fi
# shellcheck disable=SC2046,SC2086
"$cxx" -std=c++20 ${CXXFLAGS:-} "$source_dir/consumer.cpp" -o "$work/consumer" \
  -I"$prefix/include" -L"$build_dir" -lipminmax $(pkg-config --cflags --libs ipopt)
LD_LIBRARY_PATH=$build_dir "$work/consumer"
