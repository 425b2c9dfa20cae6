#!/usr/bin/env bash
# What a multistart finds has the same bits for any number of ranks and threads.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

"$PROGRAM" one_process expected 1 24
test "$(wc -l <expected)" -gt 30
"$PROGRAM" one_process threads 3 24
cmp expected threads
"$PROGRAM" starts single 1 24  # without mpirun
cmp expected single
for case in "1 2" "2 1" "3 1" "4 2"; do
  read -r ranks threads <<<"$case"
  mkdir "$ranks"
  # Each rank writes a file of its own: all have the answer.
  "$MPIEXEC" -n "$ranks" bash -c \
    "exec \"$PROGRAM\" starts $ranks/\${OMPI_COMM_WORLD_RANK} $threads 24" >/dev/null
  test "$(ls "$ranks" | wc -l)" -eq "$ranks"
  for file in "$ranks"/*; do cmp expected "$file"; done
done

if [ -n "${IPMINMAX:-}" ]; then
  echo "== ipminmax"
  cp "$MODEL" model.nl
  "$IPMINMAX" model.nl -s minmax_starts=60 minmax_points_file=points.csv >alone.log
  mv model.sol alone.sol
  mv points.csv alone.csv
  "$MPIEXEC" -n 3 "$IPMINMAX" model.nl -s minmax_starts=60 minmax_points_file=points.csv >ranks.log
  cmp alone.sol model.sol
  cmp alone.csv points.csv
  test "$(grep -c "^EXIT" ranks.log)" -eq 1  # only rank 0 prints
  grep -q "^1,-0.7999" points.csv
  # A script's terminal gets a line that is refreshed, a file one line per start.
  test "$(grep -c "solved$" alone.log)" -gt 10
  script -qec "$IPMINMAX model.nl minmax_starts=60" terminal.log >/dev/null
  grep -q $'\rMultistart: 60 of 60 starts, [0-9]* certified, best value' terminal.log
  test "$(grep -c " yes  solved" terminal.log)" -eq 0
fi
echo "all the same"
