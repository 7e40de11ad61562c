#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Runs a campaign as a job array on a Slurm cluster of this one machine, kills a task, has it requeued, and compares
# the merged table with that of a single process: sh slurm_test.sh PROGRAM FOLDER_OF_THE_EXAMPLE
# Needs the Debian packages slurmctld, slurmd, slurm-client and munge, and root; exit code 77 (skipped) otherwise.
# Everything lives in a temporary folder, with ports, keys and sockets of its own, and is stopped at the end.
set -eu
program=$1
example=$2

skip() {
  echo "skipped: $1"
  exit 77
}
for command in slurmctld slurmd munged mungekey sbatch squeue scancel scontrol; do
  PATH="$PATH:/usr/sbin" command -v "$command" >/dev/null 2>&1 || skip "no $command"
done
[ "$(id -u)" -eq 0 ] || skip "not root"
PATH="$PATH:/usr/sbin"

folder=$(mktemp -d)
stop() {
  for name in slurmd slurmctld munged; do
    if [ -f "$folder/$name.pid" ]; then kill "$(cat "$folder/$name.pid")" 2>/dev/null || true; fi
  done
  for name in slurmd slurmctld munged; do # removed by each as the last thing it does
    for _ in 1 2 3 4 5 6 7 8 9 10; do [ ! -f "$folder/$name.pid" ] || sleep 0.5; done
  done
  rm -rf "$folder"
}
trap stop EXIT
trap 'exit 1' INT TERM
fail() {
  echo "FAILED: $1" >&2
  tail -n 20 "$folder"/*.log >&2 || true
  exit 1
}
# wait_for SECONDS WHAT COMMAND...: until the command succeeds.
wait_for() {
  left=$(($1 * 2))
  what=$2
  shift 2
  until "$@" >/dev/null 2>&1; do
    left=$((left - 1))
    [ "$left" -gt 0 ] || fail "waiting for $what"
    sleep 0.5
  done
}

host=$(hostname -s)
port=$((20000 + $$ % 20000))
mkdir -m 755 "$folder/state" "$folder/spool"
chmod 755 "$folder"
mungekey --create --keyfile="$folder/munge.key"
munged --key-file="$folder/munge.key" --socket="$folder/munge.socket" --pid-file="$folder/munged.pid" \
  --log-file="$folder/munged.log" --seed-file="$folder/munge.seed" --force
cat >"$folder/slurm.conf" <<CONF
ClusterName=one
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
SlurmctldPort=$port
SlurmdPort=$((port + 1))
AuthType=auth/munge
AuthInfo=socket=$folder/munge.socket
CredType=cred/munge
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerType=sched/builtin
ReturnToService=2
NodeName=$host NodeAddr=127.0.0.1 CPUs=$(nproc) State=UNKNOWN
PartitionName=all Nodes=$host Default=YES MaxTime=INFINITE State=UP
CONF
export SLURM_CONF="$folder/slurm.conf"
slurmctld
slurmd
idle() { [ "$(sinfo --noheader --format=%t)" = idle ]; }
wait_for 60 "the node" idle

cd "$folder"
cat >scenario.toml <<'SCENARIO'
[model]
knots_s = {start = 0, stop = 200, step = 10}
[nominal]
position_m = [3000, 4000, 800]
velocity_mps = [60, 20, 5]
[bounds]
position_m = 100
velocity_mps = 10
acceleration_mps2 = 4
[[station]]
name = "radar"
kind = "azimuth_elevation_range"
position_m = [0, 0, 0]
covariance = [[1e-6, 0, 0], [0, 1e-6, 0], [0, 0, 100]]
times_s = {start = 0, stop = 200, step = 1}
SCENARIO
runs=20000
parts=80
"$program" campaign plan scenario.toml --runs $runs --parts $parts --out alone
"$program" campaign run alone
"$program" campaign merge alone

"$program" campaign plan scenario.toml --runs $runs --parts $parts --out cluster
export TRAMMEL="$program"
job=$(sbatch --parsable --array=1-4 "$example/campaign.sbatch" cluster)
complete() { find cluster/parts -name '*.csv' | wc -l; }
begun() { [ "$(complete)" -ge 6 ]; }
wait_for 120 "the first parts" begun

# The program of the first task dies as by the kernel's hand in the middle of its work, and its job with it; the job
# is requeued. A task that is still at work is requeued as well, as if its node were taken away.
killed=$(pgrep -f -o "campaign run cluster --shard 1/4") || fail "no task at work"
kill -KILL "$killed"
failed() { scontrol show job "${job}_1" | grep -q JobState=FAILED; }
wait_for 60 "the killed task to be noticed" failed
sleep 2 # a task is not launched again in the second of its death
scontrol requeue "${job}_1" || fail "requeueing the killed task"
running=$(squeue --noheader --array --states=RUNNING --format=%i | grep "^${job}_" | grep -v "_1$" | head -n 1) || true
if [ -n "$running" ]; then scontrol requeue "$running"; fi
[ "$(complete)" -lt $parts ] || fail "the work was over before the kill: raise the number of runs"

# A requeued task waits two minutes by Slurm's own rule; this brings it forward.
over() {
  scontrol update jobid="$job" starttime=now || true
  [ -z "$(squeue --noheader --jobs="$job")" ]
}
wait_for 400 "the tasks" over
[ "$(complete)" -eq $parts ] || fail "$(complete) of $parts parts after the array"
"$program" campaign merge cluster
cmp alone/merged.csv cluster/merged.csv || fail "the merged tables differ"
grep -q "0 of $parts missing" trammel-*.log || fail "no task saw the end"
echo "merged tables are identical after a kill and a requeue"
