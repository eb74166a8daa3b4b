"""Flights a second against batch size, on the GPU where JAX has one; says so where it has none.

python -m bench.simulator.gpu [--aircraft cdrw] [--seconds 10] [--largest 65536]
"""

from __future__ import annotations

import argparse
import time

import jax
import numpy as np

from bench.simulator.speed import ends
from sysid_node.aircraft.load import load_aircraft
from sysid_node.sim import Simulator, trim_flight


def gpu() -> jax.Device | None:
    """The first GPU, if JAX has one."""
    try:
        return jax.devices("gpu")[0]
    except RuntimeError:
        return None


def main() -> None:
    """Measures and prints a row a batch size."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--aircraft", default="cdrw")
    parser.add_argument("--seconds", type=float, default=10.0, help="of each flight, at 100 Hz")
    parser.add_argument("--largest", type=int, default=65536, help="batch size to go up to")
    args = parser.parse_args()
    device = gpu()
    if device is None:
        print(f"no GPU: JAX {jax.__version__} sees {', '.join(map(str, jax.devices()))}; nothing measured")
        return
    with jax.default_device(jax.devices("cpu")[0]):  # for which the many small programs of a trim compile in seconds
        simulator = Simulator(load_aircraft(args.aircraft))
        trim = trim_flight(simulator)
        samples = round(args.seconds * simulator.rate) + 1
        inputs = simulator.inputs(np.tile(trim.command, (samples, 1)))
    fixed = jax.device_put((simulator.model, trim.initial, inputs), device)
    print(f"{device.device_kind}: flights of {args.seconds:g} s\n{'batch':>8s} {'flights/s':>12s} {'RK4 steps/s':>14s}")
    size = 1
    while size <= args.largest:
        spread = np.random.default_rng(0).random((size, 1))
        thetas = jax.device_put(simulator.neutral() + 0.01 * simulator.scales * spread, device)
        seconds = _seconds(simulator, fixed, thetas)
        print(f"{size:8d} {size / seconds:12.0f} {size * (samples - 1) / seconds:14.3g}", flush=True)
        size *= 4


def _seconds(simulator: Simulator, fixed: tuple, thetas: jax.Array) -> float:
    """The quickest of three runs, compiled before."""
    model, initial, inputs = fixed
    run = lambda: jax.block_until_ready(  # noqa: E731
        ends(simulator.layout, model, thetas, initial, inputs, simulator.step)
    )
    run()
    times = []
    for _ in range(3):
        begin = time.perf_counter()
        run()
        times.append(time.perf_counter() - begin)
    return min(times)


if __name__ == "__main__":
    main()
