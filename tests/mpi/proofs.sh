#!/usr/bin/env bash
# A proof over y has the same bits for any number of ranks, and a model that throws on one ends all.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

"$PROGRAM" proofs expected  # without mpirun
grep -q " 1 0 | proved over all y" expected
for ranks in 1 2 3; do
  mkdir "$ranks"
  "$MPIEXEC" -n "$ranks" bash -c "exec \"$PROGRAM\" proofs $ranks/\${OMPI_COMM_WORLD_RANK}"
  test "$(ls "$ranks" | wc -l)" -eq "$ranks"
  for file in "$ranks"/*; do cmp expected "$file"; done
done
"$MPIEXEC" -n 3 "$PROGRAM" proof_that_throws >thrown 2>&1
test "$(grep -c "^the model throws$" thrown)" -eq 3
echo "all the same"
