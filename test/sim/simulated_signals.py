"""Simulated flights as measured signals."""

import numpy as np

from sysid_node.dynamics.atmosphere import air_density
from sysid_node.sim import RolloutInputs, SimulatedFlight, Simulator, Trim
from sysid_node.sim.prediction.signals import MeasuredSignals

SAMPLES = 601


def signals_from(flight: SimulatedFlight, commands: np.ndarray) -> MeasuredSignals:
    outputs, states = np.asarray(flight.outputs), np.asarray(flight.states)
    return MeasuredSignals(
        rates=outputs[:, 3:6],
        air=outputs[:, 9:12],
        density=np.asarray(air_density(-states[:, 2], np)),
        commands=np.asarray(commands),
        climb=states[0, 2] - states[:, 2],
    )


def smooth_inputs(simulator: Simulator, trim: Trim) -> RolloutInputs:
    """Deflections without edges, so that differences of rates are exact enough."""
    time = np.arange(SAMPLES) * simulator.step
    waves = [0.04 * np.sin(4 * time), 0.05 * np.sin(5 * time + 1), 0.08 * np.sin(3 * time + 2), np.sin(2 * time)]
    return simulator.inputs(trim.command + np.column_stack(waves) * np.sin(0.5 * time)[:, None] ** 2)
