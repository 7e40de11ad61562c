#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Times `trammel sdp` and csdp on every problem of a folder with reference.csv, one after the other on one core, and
# prints a table: status, largest DIMACS error, relative error of the objective, CPU seconds of both.
#   bench/sdplib.sh PROGRAM FOLDER [NAME...]
# csdp reads parameters from its folder, so it runs in an empty one. OpenBLAS gets one thread.
set -eu
program=$(realpath "$1")
folder=$(realpath "$2")
shift 2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
export OPENBLAS_NUM_THREADS=1 LC_ALL=C
[ $# -gt 0 ] || set -- $(tail -n +2 "$folder/reference.csv" | cut -d, -f1)

cpu() { # runs a command, five times if it is short, and prints the median of its CPU seconds
  /usr/bin/env python3 -c '
import resource, statistics, subprocess, sys

def total():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime

times = []
while len(times) < (5 if not times or times[0] < 0.5 else 1):
    before = total()
    with open(sys.argv[1], "w") as out:
        subprocess.run(sys.argv[2:], stdout=out, stderr=subprocess.DEVNULL)
    times.append(total() - before)
print("%.4f" % statistics.median(times))' "$@"
}

printf '%-10s %-18s %9s %9s %9s %9s\n' problem status error objective trammel csdp
for name in "$@"; do
  ours=$(cpu ours.json taskset -c 0 "$program" sdp "$folder/$name.dat-s" --json)
  theirs=$(cpu theirs.txt taskset -c 0 csdp "$folder/$name.dat-s")
  reference=$(grep "^$name," "$folder/reference.csv")
  python3 - "$name" "$ours" "$theirs" "$reference" <<'PYTHON'
import json, sys
name, ours, theirs, reference = sys.argv[1:]
result = json.load(open("ours.json"))
optimum = float(reference.rsplit(",", 4)[1])
error = max(abs(e) for e in result["dimacs"])
objective = abs(result["primal_objective"] - optimum) / abs(optimum)
print(f"{name:<10} {result['status']:<18} {error:9.1e} {objective:9.1e} {float(ours):9.4f} {float(theirs):9.4f}", flush=True)
with open("sums", "a") as sums:
    sums.write(f"{ours} {theirs}\n")
PYTHON
done
python3 -c '
rows = [tuple(map(float, line.split())) for line in open("sums")]
a, b = (sum(column) for column in zip(*rows))
print(f"total      {a:.1f} s against {b:.1f} s of csdp, ratio {a / b:.2f}")'
