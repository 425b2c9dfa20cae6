#!/usr/bin/env bash
# What goes wrong with MPI ends within seconds (limits here are of hanging: machines are busy) with a
# status that names the cause, and nothing is left running. Argument: the fault.
set -uo pipefail
work=$(mktemp -d)
log=$work/log
export TMPDIR=$work  # a mark of all processes that this script starts
trap 'rm -rf "$work"' EXIT

fail() {
  echo "$*"
  cat "$log"
  exit 1
}

# Whether a process has VARIABLE=VALUE. (Not by a pipe: where grep -q ends first it fails.)
started_with() { grep -zqxs -- "$1" "/proc/$2/environ"; }

# Processes of this script that run one of the programs.
left_running() {
  local process name
  for process in /proc/[0-9]*; do
    { read -r name <"$process/comm"; } 2>/dev/null || continue
    case $name in
    ipminmax | ipminmax-worker | mpi_*) ;;
    *) continue ;;
    esac
    started_with "TMPDIR=$work" "${process#/proc/}" && echo "${process#/proc/}"
  done
}

expect_nothing_left() {
  local k
  for k in $(seq 50); do
    [ -z "$(left_running)" ] && return
    sleep 0.2
  done
  fail "left running: $(left_running)"
}

# expect SECONDS EXIT_CODE|any TEXT COMMAND...
expect() {
  local limit=$1 code=$2 text=$3 found
  shift 3
  timeout "$limit" "$@" >"$log" 2>&1 </dev/null
  found=$?
  [ "$found" -ne 124 ] || fail "no end within $limit s"
  [ "$code" = any ] || [ "$found" -eq "$code" ] || fail "exit code $found instead of $code"
  grep -q -- "$text" "$log" || fail "no \"$text\""
  expect_nothing_left
}

wait_for() {
  local k
  for k in $(seq 3000); do
    grep -q -s -- "$1" "$log" && return
    sleep 0.1
  done
  fail "no \"$1\""
}

# Starts COMMAND..., waits for TEXT, sets $running to its process.
begin() {
  local text=$1
  shift
  "$@" >"$log" 2>&1 </dev/null &
  running=$!
  wait_for "$text"
}

# Waits for the end of $running: SECONDS TEXT
expect_end() {
  local limit=$1 text=$2 k
  for k in $(seq $((10 * limit))); do
    kill -0 "$running" 2>/dev/null || break
    sleep 0.1
  done
  kill -0 "$running" 2>/dev/null && fail "no end within $limit s"
  wait "$running"
  code=$?
  grep -q -- "$text" "$log" || fail "no \"$text\""
  expect_nothing_left
}

case $1 in
worker_killed)
  begin "first solve done" "$MPIEXEC" -n 1 "$PROGRAM" loop : -n 2 "$WORKER"
  for pid in $(left_running); do
    if grep -q ipminmax-worker "/proc/$pid/comm"; then kill -KILL "$pid"; break; fi
  done
  expect_end 100 "linear solver failed: rank [12] on .* has died (killed, or out of memory?)"
  [ "$code" -ne 0 ] || fail "exit code 0"
  ;;
no_memory_in_worker)
  # From now on the worker gets 24 MB more: too little for the workspace, enough for the least of
  # it, with which MUMPS's ranks would wait for each other once memory ends.
  begin "first solve done" "$MPIEXEC" -n 1 "$PROGRAM" large "$work/go" : -n 1 "$WORKER"
  for pid in $(left_running); do
    if grep -q ipminmax-worker "/proc/$pid/comm"; then
      size=$(sed -n 's/^VmSize:[^0-9]*\([0-9]*\) kB$/\1/p' "/proc/$pid/status")
      prlimit --pid "$pid" --as=$(((size + 24576) * 1024))
    fi
  done
  touch "$work/go"
  expect_end 100 "out of memory in the factorization of a KKT matrix"
  ;;
other_version)
  expect 100 any "invalid option: rank 1 on .* is of version 0.0.other, rank 0 of version" \
    "$MPIEXEC" -n 1 "$PROGRAM" solve : -n 1 "$OTHER_WORKER"
  ;;
no_mpi)
  # The plugin is not there; is there without MPI's libraries; and the program goes on without.
  IPMINMAX_MPI_LIBRARY=$work/absent.so expect 100 3 \
    "invalid option: MPI cannot be used: .*absent.so: cannot open shared object file" "$PROGRAM" solve
  IPMINMAX_MPI_LIBRARY=$WITHOUT_MPI expect 100 3 \
    "invalid option: MPI cannot be used: libipminmax_test_absent.so: cannot open shared object file" \
    "$PROGRAM" solve
  ;;
program_calls_mpi)
  for level in 0 1 2 3; do
    expect 100 0 "^solved: " "$MPIEXEC" -n 1 "$OWN" $level solve : -n 1 "$WORKER"
  done
  expect 100 0 "^solved: " "$OWN" 0 solve
  # Another thread than the main one calls MPI: with SERIALIZED and more it may.
  expect 100 0 "^solved: " "$MPIEXEC" -n 1 "$OWN" 2 solve --thread : -n 1 "$WORKER"
  expect 100 any "for calls of its main thread only" \
    "$MPIEXEC" -n 1 "$OWN" 1 solve --thread : -n 1 "$WORKER"
  ;;
not_rank_0)
  # Every rank solves, none is a worker.
  expect 100 any "mumps_mpi works for rank 0 alone, and this is rank 2 of 3" \
    "$MPIEXEC" -n 3 "$PROGRAM" solve
  grep -q "invalid option: rank [12] runs a program instead of ipminmax-worker" "$log" ||
    fail "no message of rank 0"
  # A worker is rank 0.
  expect 100 any "a worker cannot be the only rank or rank 0" \
    "$MPIEXEC" -n 1 "$WORKER" : -n 1 "$PROGRAM" solve
  expect 100 1 "a worker cannot be the only rank or rank 0" "$WORKER"
  ;;
interrupted)
  begin "first solve done" "$MPIEXEC" -n 1 "$PROGRAM" loop : -n 2 "$WORKER"
  kill -INT "$running"
  expect_end 100 "linear solver failed: the launcher ends the program: .*interrupted"
  [ "$code" -ne 0 ] || fail "exit code 0"
  ;;
starts_rank_killed)
  begin "under way" "$MPIEXEC" -n 3 "$PROGRAM" slow_starts 10000
  for pid in $(left_running); do
    started_with OMPI_COMM_WORLD_RANK=2 "$pid" && kill -KILL "$pid"
  done
  expect_end 100 "starts, .* points, stopped by the launcher"
  [ "$code" -ne 0 ] || fail "exit code 0"
  ;;
starts_taken_over)
  begin "under way" "$MPIEXEC" --enable-recovery -n 3 "$PROGRAM" slow_starts 320
  for pid in $(left_running); do
    started_with OMPI_COMM_WORLD_RANK=2 "$pid" && kill -KILL "$pid"
  done
  expect_end 100 "^320 starts"
  grep -q "rank 2 does not answer any more" "$log" || fail "the death was not noticed"
  ;;
starts_interrupted)
  begin "under way" "$MPIEXEC" -n 2 "$PROGRAM" slow_starts 10000
  kill -INT "$running"
  expect_end 100 "starts, .* points, stopped by the launcher"
  [ -n "${IPMINMAX:-}" ] || exit 0
  # The executable writes what it has. (It prints past mpirun, which stops reading before it kills.)
  cp "$MODEL" "$work/model.nl"
  "$MPIEXEC" -n 2 bash -c "exec \"$IPMINMAX\" \"$work/model.nl\" -s minmax_starts=10000000 \
    >\"$work/out.\$OMPI_COMM_WORLD_RANK\"" >/dev/null 2>"$log" </dev/null &
  running=$!
  log=$work/out.0
  wait_for "solved$"
  kill -INT "$running"
  expect_end 100 "stopped by the launcher"
  grep -q "stopped by the launcher" "$work/model.sol" || fail "no model.sol"
  ;;
mixed)
  expect 100 any "is a worker; to share starts" \
    "$MPIEXEC" -n 1 "$PROGRAM" starts "$work/out" 1 4 : -n 1 "$WORKER"
  ;;
*)
  echo "unknown fault $1"
  exit 2
  ;;
esac
echo "$1: as it should be"
