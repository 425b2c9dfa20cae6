#!/usr/bin/env bash
# Runs the commands of docs/beyond_one_machine.md: every indented line that begins with mpirun, in the order
# of the page, with the files that it shows.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
cp "$MODEL" saddle.nl
mkdir bin
ln -s "$IPMINMAX" bin/ipminmax
ln -s "$WORKER" bin/ipminmax-worker
ln -s "$PAGE_PROGRAM" bin/starts_on_ranks
export PATH=$work/bin:$PATH
sed -n 's/^    \(localhost slots=[0-9]*\)$/\1/p' "$PAGE" >hosts
test -s hosts

count=0
while IFS= read -r command; do
  echo "== $command"
  bash -c "$command" >log 2>&1 </dev/null || { cat log; exit 1; }
  case $command in
  *--verbose*) test "$(grep -c "^ipminmax-worker rank .* peak memory" log)" -eq 2 ;;
  *starts_on_ranks*) test "$(grep -c "^x = " log)" -eq 2 ;;
  *) grep -q "certified local minmax" log ;;
  esac
  count=$((count + 1))
done < <(sed -n 's/^    \(\$ \)\{0,1\}\(mpirun .*\)$/\2/p' "$PAGE")
test "$count" -ge 5
test "$(wc -l <points.csv)" -eq 2
echo "$count commands"
