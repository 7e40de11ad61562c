#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Structured solver beside CSDP and SDPA on the whitened matrix inequality, one core, one run.

    bench/peers_sdp.py BUILD/bench/whitened_program [SEGMENTS ...]

Needs the Debian packages coinor-csdp, libopenblas0-pthread and sdpa. Minutes beyond 17 segments (p = 57).
"""
import os
import re
import subprocess
import sys
import tempfile
import time

program = os.path.abspath(sys.argv[1])
segments = [int(word) for word in sys.argv[2:]] or [7, 12, 17]
os.environ.update(OPENBLAS_NUM_THREADS="1", OMP_NUM_THREADS="1", LC_ALL="C")
os.sched_setaffinity(0, {0})


def timed(words):
    start = time.perf_counter()
    done = subprocess.run(words, capture_output=True, text=True)
    return time.perf_counter() - start, done.stdout


print(f"{'p':>4} {'trammel s':>10} {'relative gap':>13} {'CSDP s':>8} {'error':>9} {'SDPA s':>8} {'error':>9} {'ratio':>6}")
with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    for count in segments:
        p, ours, lower, upper = map(float, timed([program, str(count), "lmi.dat-s"])[1].split())
        row, times = "", []
        for name, words in (("csdp", ["csdp", "lmi.dat-s"]), ("sdpa", ["sdpa", "-ds", "lmi.dat-s", "-o", "sdpa.out", "-numThreads", "1"])):
            seconds, text = timed(words)
            found = re.search(r"(?:Primal objective value:|objValPrimal *=) *([-+0-9.eE]+)", text)
            value = abs(float(found.group(1))) if found else float("nan")
            times.append(seconds)
            row += f" {seconds:8.2f} {value / upper - 1:9.1e}"
        print(f"{p:4.0f} {ours:10.4f} {(upper - lower) / upper:13.1e}{row} {min(times) / ours:6.0f}", flush=True)
