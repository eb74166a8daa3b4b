"""Simulated flights as measured signals, and the coefficients that are predicted from these."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from sysid_node.dynamics.atmosphere import air_density
from sysid_node.sim import RolloutInputs, SimulatedFlight, Simulator, Trim
from sysid_node.sim.prediction.accelerations import predict_accelerations
from sysid_node.sim.prediction.coefficients import coefficients
from sysid_node.sim.prediction.signals import MeasuredSignals

SAMPLES = 601


def signals_from(flight: SimulatedFlight, commands: np.ndarray, step: float) -> MeasuredSignals:
    outputs, states = np.asarray(flight.outputs), np.asarray(flight.states)
    return MeasuredSignals(
        rates=outputs[:, 3:6],
        air=outputs[:, 9:12],
        density=np.asarray(air_density(-states[:, 2], np)),
        commands=np.asarray(commands),
        climb=states[0, 2] - states[:, 2],
        time=step * np.arange(len(outputs)),
    )


def smooth_inputs(simulator: Simulator, trim: Trim) -> RolloutInputs:
    """Deflections without edges, so that differences of rates are exact enough."""
    time = np.arange(SAMPLES) * simulator.step
    waves = [0.04 * np.sin(4 * time), 0.05 * np.sin(5 * time + 1), 0.08 * np.sin(3 * time + 2), np.sin(2 * time)]
    return simulator.inputs(trim.command + np.column_stack(waves) * np.sin(0.5 * time)[:, None] ** 2)


@partial(jax.jit, static_argnums=0)
def _predicted(layout, model, theta, signals: MeasuredSignals, step: float) -> jax.Array:
    return jnp.stack(coefficients(model, signals, predict_accelerations(layout, model, theta, signals, step)), axis=1)


_slopes = jax.jit(jax.jacfwd(_predicted, argnums=2), static_argnums=0)


def predicted_coefficients(simulator: Simulator, theta: np.ndarray, signals: MeasuredSignals) -> np.ndarray:
    """CL CD CY Cl Cm Cn (N, 6) that parameters (P,) predict for signals (N,), reduced by the aircraft file."""
    return np.asarray(_predicted(simulator.layout, simulator.model, theta, signals, simulator.step))


def coefficient_slopes(simulator: Simulator, theta: np.ndarray, signals: MeasuredSignals) -> np.ndarray:
    """Derivatives (N, 6, P) of ``predicted_coefficients`` with respect to the parameters, by forward mode."""
    return np.asarray(_slopes(simulator.layout, simulator.model, theta, signals, simulator.step))
