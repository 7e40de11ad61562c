#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Invariant filters beside FilterPy and Stone Soup (not part of CI).

    python3 -m venv venv && venv/bin/pip install filterpy stonesoup
    venv/bin/python bench/peers_filter.py build/bin/trammel

Runs the same samples through each library's alpha-beta(-gamma) filter and through `trammel filter run`,
prints the largest difference, compares the peers' own performance formulas with sums over the pulse response
(which need no formula), and times an update. Ends with status 1 if tracks that should agree do not.
"""
import csv
import datetime
import json
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy as np

AGREE = 1e-9
SLOW_START = 1e-6  # different start-ups, forgotten after 400 samples but for this
failures = []


def trammel_design(program, folder, spec):
    file = folder / "design.json"
    file.write_text(json.dumps(spec))
    out = subprocess.run([program, "filter", "design", str(file), "--json"], check=True, capture_output=True)
    return json.loads(out.stdout)


def pulse_gains(design, count=4000):
    """Noise gain of each row and of the prediction: sums of squares of pulse responses."""
    den = np.array(design["denominator"])
    rows = design["numerators"] + [design["prediction_numerator"]]
    gains = []
    for num in rows:
        y = np.zeros(count)
        for n in range(count):
            value = num[n] if n < len(num) else 0.0
            for j in range(1, min(len(den), n + 1)):
                value -= den[j] * y[n - j]
            y[n] = value
        gains.append(float(y @ y))
    return gains


def recursion(gains, dt, z, state):
    """The textbook recursion, x_i += kappa_i/(i! dt^i) u."""
    order = len(gains)
    fact = [1.0, 1.0, 2.0, 6.0]
    x = np.array(state, float)
    track = []
    for value in z:
        x = np.array([sum(dt ** (j - i) / fact[j - i] * x[j] for j in range(i, order)) for i in range(order)])
        u = value - x[0]
        x = x + np.array([gains[i] / (fact[i] * dt**i) for i in range(order)]) * u
        track.append(x.copy())
    return np.array(track)


def report(name, difference, tolerance=AGREE):
    agree = difference <= tolerance
    print(f"  {name:58s} {difference:9.2e}  {'agrees' if agree else 'DIFFERS'}")
    if not agree:
        failures.append(name)


def formula(name, found, correct):
    difference = max(abs(a - b) for a, b in zip(np.atleast_1d(found), np.atleast_1d(correct)))
    verdict = "right" if difference < 1e-8 else "WRONG"
    print(f"  {verdict}  {name}: {np.round(np.atleast_1d(found), 6)}  correct {np.round(np.atleast_1d(correct), 6)}")


def filtered(program, folder, spec, z, dt):
    """Last estimates through `trammel filter run`, which starts itself up."""
    design = folder / "run.json"
    design.write_text(json.dumps(spec))
    data = folder / "data.csv"
    data.write_text("t_s,x\n" + "".join(f"{i * dt!r},{float(v)!r}\n" for i, v in enumerate(z)))
    out = subprocess.run([program, "filter", "run", str(design), str(data)], check=True, capture_output=True)
    last = list(csv.DictReader(out.stdout.decode().splitlines()))[-1]
    return [float(last["x"])] + [float(last[f"x_d{i}"]) for i in range(1, spec["order"])]


def main():
    program = sys.argv[1] if len(sys.argv) > 1 else "build/bin/trammel"
    folder = pathlib.Path(tempfile.mkdtemp())
    rng = np.random.default_rng(1)
    dt = 0.5
    z = 3.0 + 2.0 * dt * np.arange(400) + rng.normal(size=400)

    print("FilterPy")
    from filterpy.gh import GHFilter, GHKFilter
    from filterpy.memory import FadingMemoryFilter

    g, h, k = 0.6, 0.25, 0.03
    peer = GHFilter(x=0.0, dx=0.0, dt=dt, g=g, h=h)
    track = np.array([peer.update(value) for value in z]).reshape(-1, 2)
    report("GHFilter against the recursion", np.abs(track - recursion([g, h], dt, z, [0, 0])).max())
    two = {"order": 2, "sampling_s": dt, "gains": [g, h]}
    ours = filtered(program, folder, two, z, dt)
    report("GHFilter against trammel filter run, last sample", np.abs(track[-1] - ours).max())
    peer = GHKFilter(x=0.0, dx=0.0, ddx=0.0, dt=dt, g=g, h=h, k=k)
    for value in z:
        peer.update(value)
    state = [float(peer.x), float(peer.dx), float(peer.ddx)]
    three = {"order": 3, "sampling_s": dt, "gains": [g, h, 4 * k]}
    report("GHKFilter (gamma = 4 k) against the recursion",
           np.abs(recursion([g, h, 4 * k], dt, z, [0, 0, 0])[-1] - state).max())
    report("GHKFilter against trammel filter run, last sample",
           np.abs(np.array(filtered(program, folder, three, z, dt)) - state).max(), SLOW_START)

    design = trammel_design(program, folder, two)
    correct = pulse_gains(design)
    report("noise gains of trammel against pulse responses, order 2",
           np.abs(np.array(design["noise_gain"] + [design["prediction_noise_gain"]]) - correct).max())
    formula("GHFilter.VRF", GHFilter(0, 0, dt, g, h).VRF(), correct[:2])
    formula("GHFilter.VRF_prediction", GHFilter(0, 0, dt, g, h).VRF_prediction(), correct[2])
    design = trammel_design(program, folder, three)
    correct = pulse_gains(design)
    report("noise gains of trammel against pulse responses, order 3",
           np.abs(np.array(design["noise_gain"] + [design["prediction_noise_gain"]]) - correct).max())
    ghk = GHKFilter(0, 0, 0, dt, g, h, k)
    formula("GHKFilter.VRF", ghk.VRF(), correct[:3])
    formula("GHKFilter.VRF_prediction", ghk.VRF_prediction(), correct[3])

    theta = 0.7
    fading = trammel_design(program, folder, {"order": 2, "sampling_s": dt,
                                              "rule": {"name": "fading_memory", "theta": theta}})
    memory = FadingMemoryFilter(x0=np.zeros(2), dt=dt, order=1, beta=theta)
    formula("FadingMemoryFilter(order=1).P", np.ravel(memory.P)[:2], fading["noise_gain"])
    # Its errors are for x = a t^2 with a = 1, that is x'' = 2.
    lag = [2.0 * fading["error_coefficients"][0][2], 2.0 * fading["error_coefficients"][1][2]]
    formula("FadingMemoryFilter(order=1).e", np.ravel(memory.e)[:2], lag)

    print("Stone Soup")
    from stonesoup.models.measurement.linear import LinearGaussian
    from stonesoup.types.detection import Detection
    from stonesoup.types.hypothesis import SingleHypothesis
    from stonesoup.types.prediction import StatePrediction
    from stonesoup.types.state import State
    from stonesoup.updater.alphabeta import AlphaBetaUpdater

    model = LinearGaussian(ndim_state=2, mapping=(0,), noise_covar=np.eye(1))
    updater = AlphaBetaUpdater(measurement_model=model, alpha=g, beta=h, vmap=np.array([1]))
    start = datetime.datetime(2024, 1, 1)
    posterior = State(np.array([[0.0], [0.0]]), timestamp=start)
    transition = np.array([[1.0, dt], [0.0, 1.0]])
    began = time.perf_counter()
    for i, value in enumerate(z):
        now = start + datetime.timedelta(seconds=dt * (i + 1))
        prediction = StatePrediction(transition @ posterior.state_vector, timestamp=now, prior=posterior)
        detection = Detection(np.array([[value]]), timestamp=now, measurement_model=model)
        posterior = updater.update(SingleHypothesis(prediction, detection), time_interval=datetime.timedelta(seconds=dt))
    stone_ns = (time.perf_counter() - began) / len(z) * 1e9
    report("AlphaBetaUpdater against the recursion",
           np.abs(np.ravel(posterior.state_vector).astype(float) - recursion([g, h], dt, z, [0, 0])[-1]).max())

    peer = GHFilter(x=0.0, dx=0.0, dt=dt, g=g, h=h)
    began = time.perf_counter()
    for value in z:
        peer.update(value)
    filterpy_ns = (time.perf_counter() - began) / len(z) * 1e9
    print(f"Time per update: FilterPy {filterpy_ns:.0f} ns, Stone Soup {stone_ns:.0f} ns; "
          "trammel: bench_filter, AlphaBeta")
    if failures:
        print("Not as expected: " + "; ".join(failures))
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
