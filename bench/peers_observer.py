#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Times `trammel observer simulate` against the same loop vectorised over the runs in numpy.

usage: peers_observer.py PROGRAM [RUNS] [REPETITIONS]

Both fly the published example (V = 100 m/s, 80 s, 400 measurements, 80 plans per run) with beta_1 = 10. The numpy
loop plans with the same safeguarded Newton iteration for all runs at once. Printed are the ratio of the medians, and
that without the start of the program (its time for one run; the numpy loop is timed inside the interpreter), with the
statistics of both, which have to agree within their scatter. The program uses all cores, numpy one.
"""
import json
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np

V, SIGMA0, DT, T, PER_PLAN, BETA, A_MIN = 100.0, 0.002, 0.2, 80.0, 5, 10.0, 200.0
SIGMA = SIGMA0 * np.sqrt(DT)


def cubic_remainder(t):
    t2 = t * t
    series = 1 / 6 - t2 / 120 * (1 - t2 / 42 * (1 - t2 / 72 * (1 - t2 / 110 * (1 - t2 / 156))))
    return np.where(t < 1.0, series, (t - np.sin(t)) / np.maximum(t, 1.0) ** 3)


def sinc(t):
    return np.where(t > 0, np.sin(t) / np.where(t > 0, t, 1.0), 1.0)


def secular(xi, p):
    """q = xi F2 and its slope for all runs; e, delta: runs x 2."""
    g11, e, delta, gain, fd2 = p
    h = 0.5 * xi
    c, s = np.cos(h), np.sin(h)
    m = sinc(h)
    sx = m * c
    n = 0.5 * (1 + sx)
    small = xi < 1e-2
    safe = np.where(small, 1.0, xi)
    dm = np.where(small, -xi / 12, (c - m) / safe)
    dn = np.where(small, -xi / 6, (np.cos(xi) - sx) / (2 * safe))
    v = delta * c[:, None] + (gain * m)[:, None]
    top = (gain * m * m)[:, None] + delta * n[:, None]
    weight = e * e * delta / (v * v)
    dv = -0.5 * delta * s[:, None] + (gain * dm)[:, None]
    total = (weight * top).sum(1)
    slope = (weight * ((2 * gain * m * dm)[:, None] + delta * dn[:, None] - 2 * top * dv / v)).sum(1)
    tangent = np.where(small, 1 / 3 + xi * xi / 30, (2 - 2 * np.cos(xi) - xi * np.sin(xi)) / np.where(small, 1.0, (1 - np.cos(xi)) ** 2))
    f2 = 1 / g11 + gain * (total + 2 * fd2 * cubic_remainder(xi) / (m * m))
    return xi * f2, 1 / g11 + gain * (total + xi * slope + fd2 * tangent)


def plan(position, gamma, to_go):
    """Channel quantities, xi and w of all runs."""
    x = np.minimum(position[:, 0], -(V * to_go + A_MIN))
    a = x + V * to_go
    span = V * to_go / (x * a)
    gain = span / (V * SIGMA**2)
    g11 = gamma[:, 0, 0]
    b = gamma[:, 1:, 0] / g11[:, None]
    s = gamma[:, 1:, 1:] - gamma[:, 1:, :1] * b[:, None, :]
    theta = 0.5 * np.arctan2(2 * s[:, 0, 1], s[:, 0, 0] - s[:, 1, 1])
    co, si = np.cos(theta), np.sin(theta)
    first = co * co * s[:, 0, 0] + 2 * co * si * s[:, 0, 1] + si * si * s[:, 1, 1]
    second = si * si * s[:, 0, 0] - 2 * co * si * s[:, 0, 1] + co * co * s[:, 1, 1]
    delta = np.stack([1 / first, 1 / second], 1)
    turn = lambda u: np.stack([co * u[:, 0] + si * u[:, 1], co * u[:, 1] - si * u[:, 0]], 1)
    phi = turn(position[:, 1:] / x[:, None])
    fm, fd = 0.5 * phi, 0.5 * phi
    e = fm - turn(b)
    p = (g11, e, delta, gain, (fd * fd).sum(1))
    rho = gain / delta.max(1)
    h = np.pi / 2 + np.arctan(rho / (np.pi / 2))
    for _ in range(6):
        h -= (h - np.pi / 2 - np.arctan(rho / h)) / (1 + rho / (h * h + rho * rho))
    high = 2 * h
    low = np.zeros_like(high)
    right = SIGMA * gain * np.sqrt(BETA)
    xi = np.minimum(right / secular(np.zeros_like(high), p)[1], 0.5 * high)
    for _ in range(60):
        q, dq = secular(xi, p)
        ratio = q / right
        done = np.abs(ratio - 1) < 1e-13
        if done.all():
            break
        below = ratio < 1
        low = np.where(below, xi, low)
        high = np.where(below, high, xi)
        step = xi + 2 * q * (1 - np.sqrt(ratio)) / dq
        step = np.where((step > low) & (step < high), step, 0.5 * (low + high))
        xi = np.where(done, xi, step)
    hh = 0.5 * xi
    w = delta * e / (delta * np.cos(hh)[:, None] + (gain * sinc(hh))[:, None])
    back = lambda u: np.stack([co * u[:, 0] - si * u[:, 1], si * u[:, 0] + co * u[:, 1]], 1)
    return x, a, span, hh, back(fm), back(fd), back(w)


def path(p, t):
    x0, a, span, h, fm, fd, w = p
    x = x0 + V * t
    r = (a - x) / (x * a) / span
    s1, s2 = np.sin(h * r), np.sin(h * (1 - r))
    ramp = np.sin(h * (2 * r - 1)) / np.sin(h)
    return x[:, None] * (fm + ramp[:, None] * fd + (2 * s1 * s2)[:, None] * w)


def simulate(runs, seed):
    random = np.random.default_rng(seed)
    mean = np.array([-10000.0, 50.0, -100.0])
    sd = np.array([800.0, 20.0, 20.0])
    truth = mean + sd * random.standard_normal((runs, 3))
    while (far := truth[:, 0] > -8000.0).any():
        truth[far] = mean + sd * random.standard_normal((far.sum(), 3))
    estimate = np.tile(mean, (runs, 1))
    information = np.tile(np.diag(1 / sd**2), (runs, 1, 1))
    effort = np.zeros(runs)
    measurements = round(T / DT)
    for i in range(measurements):
        if i % PER_PLAN == 0:
            planned = plan(estimate, np.linalg.inv(information), T - i * DT)
            before = path(planned, 0.0)
            begin = i
        after = path(planned, (i + 1 - begin) * DT)
        move = after - before
        before = after
        effort += np.abs(move).sum(1)
        for state in (truth, estimate):
            state[:, 0] += V * DT
            state[:, 1:] += move
        measured = truth[:, 1:] / truth[:, :1] + SIGMA0 * random.standard_normal((runs, 2))
        x = estimate[:, 0]
        tangent = estimate[:, 1:] / x[:, None]
        weight = np.where(x < -50.0, 1 / (x * x * SIGMA0**2), 0.0)
        information[:, 0, 0] += weight * (tangent * tangent).sum(1)
        for k in (1, 2):
            information[:, 0, k] -= weight * tangent[:, k - 1]
            information[:, k, 0] -= weight * tangent[:, k - 1]
            information[:, k, k] += weight
        pull = (weight * x)[:, None] * (measured - tangent)
        right = np.stack([-(tangent * pull).sum(1), pull[:, 0], pull[:, 1]], 1)
        estimate += np.linalg.solve(information, right[:, :, None])[:, :, 0]
    error = estimate[:, 0] - truth[:, 0]
    miss = np.hypot(truth[:, 1], truth[:, 2])
    return {"mean_error_m": error.mean(), "sd_error_m": error.std(ddof=1), "miss_mean_m": miss.mean(),
            "effort_mean_m": effort.mean()}


def main():
    program = sys.argv[1]
    runs = int(sys.argv[2]) if len(sys.argv) > 2 else 5000
    repetitions = int(sys.argv[3]) if len(sys.argv) > 3 else 3
    spec = {"position_m": [-10000, 50, -100], "covariance_m2": [[640000, 0, 0], [0, 400, 0], [0, 0, 400]],
            "speed_mps": V, "time_to_go_s": T, "sigma0": SIGMA0, "measurement_interval_s": DT,
            "beta_per_s": [BETA, 0, 0], "replan_interval_s": PER_PLAN * DT, "max_start_x_m": -8000}
    with tempfile.NamedTemporaryFile("w", suffix=".json") as file:
        json.dump(spec, file)
        file.flush()

        def fly(count, seed):
            begin = time.perf_counter()
            text = subprocess.run([program, "observer", "simulate", file.name, "--runs", str(count), "--seed",
                                   str(seed), "--json"], check=True, capture_output=True, text=True).stdout
            return time.perf_counter() - begin, text

        starts, ours, theirs = [], [], []
        for k in range(repetitions):  # alternating: other load on the machine hits all
            starts.append(fly(1, k)[0])
            took, text = fly(runs, k)
            ours.append(took)
            begin = time.perf_counter()
            peer = simulate(runs, k)
            theirs.append(time.perf_counter() - begin)
    result = json.loads(text)
    for name, value in peer.items():
        print(f"{name:16} trammel {result[name]:10.4f}   numpy {value:10.4f}")
    a, b, start = statistics.median(ours), statistics.median(theirs), statistics.median(starts)
    print(f"median of {repetitions}: trammel {a:.3f} s, numpy {b:.3f} s, ratio {b / a:.1f}")
    print(f"without the program's start of {start:.3f} s: ratio {b / (a - start):.1f}")


if __name__ == "__main__":
    main()
