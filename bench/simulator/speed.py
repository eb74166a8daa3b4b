"""The simulator's speed: flight, Jacobian, compilation, batches, and JSBSim's bare step rate in the same run.

    python -m bench.simulator.speed [--aircraft cdrw] [--repeat 5]

Two columns: wall-clock, which whatever else runs on the machine disturbs, and processor time, which it hardly does; the
best of several. Rates by processor time count two cores for the batch and one for JSBSim.
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
from numpy.typing import NDArray

from sysid_node.aircraft.load import load_aircraft
from sysid_node.sim import RolloutInputs, Simulator, trim_flight
from sysid_node.sim.compiled.xla import PLAIN_VARIABLE
from sysid_node.sim.export.jsbsim import jsbsim_model
from sysid_node.sim.flying.rollout import rollout
from sysid_node.sim.model.layout import AircraftNumbers, ParameterLayout

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
    begin = time.perf_counter(), time.process_time()
    jax.block_until_ready(call(simulator.neutral(), trim.initial, inputs))
    print(time.perf_counter() - begin[0], time.process_time() - begin[1])
"""

#: Wall-clock and processor time, s.
Times = NDArray[np.float64]


def best(call: Callable[[], Any], repeat: int) -> Times:
    """Of the quickest of several calls, the first (which compiles) apart."""
    jax.block_until_ready(call())
    times = []
    for _ in range(repeat):
        begin = time.perf_counter(), time.process_time()
        jax.block_until_ready(call())
        times.append((time.perf_counter() - begin[0], time.process_time() - begin[1]))
    return np.min(times, axis=0)


PLAIN = """
import time, numpy as np, jax
from sysid_node.aircraft.load import load_aircraft
from sysid_node.sim import Simulator, trim_flight
simulator = Simulator(load_aircraft({aircraft!r}))
trim = trim_flight(simulator)
inputs = simulator.inputs(np.tile(trim.command, ({samples}, 1)))
fly = lambda: jax.block_until_ready(simulator.rollout(simulator.neutral(), trim.initial, inputs))
fly()
times = []
for _ in range({repeat}):
    begin = time.perf_counter(), time.process_time()
    fly()
    times.append((time.perf_counter() - begin[0], time.process_time() - begin[1]))
print(*np.min(times, axis=0))
"""


def without_options(aircraft: str, repeat: int) -> Times:
    """A flight in a fresh process whose compiler has no options (``compiled.xla``)."""
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, PLAIN_VARIABLE: "1", "JAX_COMPILATION_CACHE_DIR": folder}
        environment.pop("XLA_FLAGS", None)
        code = PLAIN.format(aircraft=aircraft, samples=SAMPLES, repeat=repeat)
        done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    return np.array(done.stdout.split(), dtype=float)


def compile_times(aircraft: str) -> tuple[Times, Times]:
    """First calls of rollout and Jacobian (2, 2) in a fresh process: without and with the persistent cache."""
    code = COLD.format(aircraft=aircraft, samples=SAMPLES)
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "JAX_COMPILATION_CACHE_DIR": folder}
        runs = [
            subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
            for _ in range(2)
        ]
    cold, cached = (np.array(run.stdout.split(), dtype=float).reshape(2, 2) for run in runs)
    return cold, cached


@partial(jax.jit, static_argnums=0)
def ends(
    layout: ParameterLayout,
    model: AircraftNumbers,
    thetas: jax.Array,
    initial: jax.Array,
    inputs: RolloutInputs,
    step: float,
) -> jax.Array:
    """Last states (B, 13) of a flight for each parameter vector (B, P)."""
    fly = lambda theta: rollout(layout, model, theta, initial, inputs, step).states[-1]  # noqa: E731
    return jax.vmap(fly)(thetas)


def batch_rate(simulator: Simulator, repeat: int) -> Times:
    """RK4 steps a second of a batch of flights, half of it on each of two threads."""
    trim = trim_flight(simulator)
    inputs = simulator.inputs(np.tile(trim.command, (BATCH_SAMPLES, 1)))
    thetas = simulator.neutral() + 0.01 * simulator.scales * np.random.default_rng(0).random((BATCH, 1))
    half = lambda part: jax.block_until_ready(  # noqa: E731
        ends(simulator.layout, simulator.model, part, trim.initial, inputs, simulator.step)
    )
    with ThreadPoolExecutor(2) as pool:
        seconds = best(lambda: list(pool.map(half, np.split(thetas, 2))), repeat)
    return BATCH * (BATCH_SAMPLES - 1) / (seconds / [1.0, 2.0])


def jsbsim_rate(simulator: Simulator, repeat: int) -> Times:
    """Frames a second of JSBSim with the same aircraft, nothing read and nothing written."""
    with tempfile.TemporaryDirectory() as folder:
        name = simulator.aircraft.name
        place = Path(folder) / "aircraft" / name
        place.mkdir(parents=True)
        (place / f"{name}.xml").write_text(jsbsim_model(simulator.aircraft))
        return _frames(jsbsim.FGFDMExec(folder), name, simulator.aircraft.reference.airspeed, repeat)


def _frames(fdm: jsbsim.FGFDMExec, name: str, airspeed: float, repeat: int) -> Times:
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
    plain = without_options(args.aircraft, args.repeat)
    batch, bare = batch_rate(simulator, args.repeat), jsbsim_rate(simulator, args.repeat)
    c172p = _frames(jsbsim.FGFDMExec(None), "c172p", 52.0, args.repeat)
    count = len(simulator.names)
    rows = [
        ("flight of 60 s at 100 Hz, ms", 1e3 * flight, "40"),
        ("the same without the compiler's options, over with them", plain / flight, "5"),
        (f"its Jacobian, {count} parameters, s", slopes, "0.5"),
        ("first flight, s", cold[0], "15"),
        ("first flight, program from the cache, s", cached[0], "2"),
        ("first Jacobian, s", cold[1], "15"),
        ("first Jacobian, program from the cache, s", cached[1], "2"),
        ("batch, million RK4 steps a second", batch / 1e6, "1"),
        ("JSBSim with its c172p, million frames a second", c172p / 1e6, ""),
        ("JSBSim with this aircraft, the same", bare / 1e6, ""),
        ("batch over JSBSim with its c172p", batch / c172p, "10"),
        ("batch over JSBSim with this aircraft", batch / bare, "10"),
    ]
    print(f"{'':50s} {'wall':>8s} {'cpu':>8s} {'goal':>6s}")
    for what, (wall, processor), goal in rows:
        print(f"{what:50s} {wall:8.3g} {processor:8.3g} {goal:>6s}")


if __name__ == "__main__":
    main()
