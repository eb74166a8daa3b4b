"""The simulator's speed: flight, Jacobian, compilation, batches, and JSBSim's bare step rate in the same run.

    python bench/sim.py [--aircraft cdrw] [--repeat 5]

Times are wall-clock on this machine with whatever else runs on it; the best of several.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import jax
import jsbsim
import numpy as np

from sysid_node.aircraft.load import load_aircraft
from sysid_node.sim import Inputs, Simulator, trim_flight
from sysid_node.sim.export.jsbsim import jsbsim_model
from sysid_node.sim.layout import Layout, Model
from sysid_node.sim.rollout import rollout

SAMPLES = 6001  # 60 s at 100 Hz
BATCH, BATCH_SAMPLES = 256, 1001

COLD = """
import time, numpy as np, jax
from sysid_node.aircraft.load import load_aircraft
from sysid_node.sim import Simulator, trim_flight
simulator = Simulator(load_aircraft({aircraft!r}))
trim = trim_flight(simulator)
inputs = simulator.inputs(np.tile(trim.command, ({samples}, 1)))
for call in (simulator.rollout, simulator.jacobian):
    begin = time.perf_counter()
    jax.block_until_ready(call(simulator.neutral(), trim.initial, inputs))
    print(time.perf_counter() - begin)
"""


def best(call: Callable[[], Any], repeat: int) -> float:
    """Seconds of the quickest of several calls, the first (which compiles) apart."""
    jax.block_until_ready(call())
    times = []
    for _ in range(repeat):
        begin = time.perf_counter()
        jax.block_until_ready(call())
        times.append(time.perf_counter() - begin)
    return min(times)


def compile_times(aircraft: str) -> tuple[list[float], list[float]]:
    """First calls of rollout and Jacobian (s) in a fresh process: without and with the persistent cache."""
    code = COLD.format(aircraft=aircraft, samples=SAMPLES)
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "JAX_COMPILATION_CACHE_DIR": folder}
        runs = [
            subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
            for _ in range(2)
        ]
    cold, cached = ([float(line) for line in run.stdout.split()] for run in runs)
    return cold, cached


@partial(jax.jit, static_argnums=0)
def ends(layout: Layout, model: Model, thetas: jax.Array, initial: jax.Array, inputs: Inputs, step: float) -> jax.Array:
    """Last states (B, 13) of a flight for each parameter vector (B, P)."""
    fly = lambda theta: rollout(layout, model, theta, initial, inputs, step).states[-1]  # noqa: E731
    return jax.vmap(fly)(thetas)


def batch_rate(simulator: Simulator, repeat: int) -> float:
    """RK4 steps a second of a batch of flights, half of it on each of two threads."""
    trim = trim_flight(simulator)
    inputs = simulator.inputs(np.tile(trim.command, (BATCH_SAMPLES, 1)))
    thetas = simulator.neutral() + 0.01 * simulator.scales * np.random.default_rng(0).random((BATCH, 1))
    half = lambda part: jax.block_until_ready(  # noqa: E731
        ends(simulator.layout, simulator.model, part, trim.initial, inputs, simulator.step)
    )
    with ThreadPoolExecutor(2) as pool:
        seconds = best(lambda: list(pool.map(half, np.split(thetas, 2))), repeat)
    return BATCH * (BATCH_SAMPLES - 1) / seconds


def jsbsim_rate(simulator: Simulator, repeat: int) -> float:
    """Frames a second of JSBSim with the same aircraft, nothing read and nothing written."""
    with tempfile.TemporaryDirectory() as folder:
        name = simulator.aircraft.name
        place = Path(folder) / "aircraft" / name
        place.mkdir(parents=True)
        (place / f"{name}.xml").write_text(jsbsim_model(simulator.aircraft))
        return _frames(jsbsim.FGFDMExec(folder), name, simulator.aircraft.reference.airspeed, repeat)


def _frames(fdm: jsbsim.FGFDMExec, name: str, airspeed: float, repeat: int) -> float:
    fdm.set_debug_level(0)
    fdm.set_dt(0.01)
    fdm.load_model(name)
    for key, value in {"ic/h-sl-ft": 3000.0, "ic/u-fps": airspeed / 0.3048}.items():
        fdm[key] = value
    fdm.run_ic()
    count = 5000
    return count / best(lambda: [fdm.run() for _ in range(count)] and None, repeat)


def main() -> None:
    """Measures and prints the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--aircraft", default="cdrw")
    parser.add_argument("--repeat", type=int, default=5)
    args = parser.parse_args()
    simulator = Simulator(load_aircraft(args.aircraft))
    trim = trim_flight(simulator)
    inputs = simulator.inputs(np.tile(trim.command, (SAMPLES, 1)))
    theta = simulator.neutral()
    flight = best(lambda: simulator.rollout(theta, trim.initial, inputs), args.repeat)
    slopes = best(lambda: simulator.jacobian(theta, trim.initial, inputs), args.repeat)
    cold, cached = compile_times(args.aircraft)
    batch, bare = batch_rate(simulator, args.repeat), jsbsim_rate(simulator, args.repeat)
    c172p = _frames(jsbsim.FGFDMExec(None), "c172p", 52.0, args.repeat)
    count = len(simulator.names)
    rows = [
        ("flight of 60 s at 100 Hz", f"{1e3 * flight:.1f} ms", "40 ms"),
        (f"its Jacobian, {count} parameters", f"{slopes:.2f} s", "0.5 s"),
        ("first flight, compiled cold / from the cache", f"{cold[0]:.1f} / {cached[0]:.1f} s", "15 / 2 s"),
        ("first Jacobian, cold / from the cache", f"{cold[1]:.1f} / {cached[1]:.1f} s", "15 / 2 s"),
        ("batch on two threads, RK4 steps a second", f"{batch / 1e6:.2f} million", "1 million"),
        ("JSBSim with its c172p, frames a second", f"{c172p / 1e3:.0f} thousand", ""),
        ("JSBSim with this aircraft, frames a second", f"{bare / 1e3:.0f} thousand", ""),
        ("batch over JSBSim, c172p / this aircraft", f"{batch / c172p:.0f} / {batch / bare:.0f} times", "10 times"),
    ]
    for what, value, goal in rows:
        print(f"{what:46s} {value:>16s}   {goal and f'(goal: {goal})'}")


if __name__ == "__main__":
    main()
