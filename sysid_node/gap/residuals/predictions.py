"""What parameters predict of a flight, as compiled functions: six coefficients, six readings, and their derivatives.

Coefficients of forces and moments are predicted from the measured motion and commands by the simulator's own chain
(``sim.prediction``), air data and attitude from the inertial instruments (``flight_path_reconstruction``).
Together they are as many channels as there are measured signals, so that each measurement counts once. All functions
are pure and generic over parameter vectors; ``residual_model`` calls them for one flight.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, partial
from typing import Any, NamedTuple, TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from sysid_node.gap.residuals.flight_path_reconstruction import READINGS, Flow, InstrumentReadings, flow_of, reconstruct
from sysid_node.sim import EFFECTS
from sysid_node.sim.compiled.programs import kept
from sysid_node.sim.model import parameters
from sysid_node.sim.model.chain import Chain
from sysid_node.sim.model.layout import AircraftNumbers, ParameterLayout, Scalar
from sysid_node.sim.model.parameters import Parameters
from sysid_node.sim.prediction.accelerations import predict_accelerations
from sysid_node.sim.prediction.coefficients import COEFFICIENTS, coefficients
from sysid_node.sim.prediction.signals import MeasuredSignals

#: Channels that are compared, in order.
CHANNELS = (*COEFFICIENTS, *READINGS)

#: Where the coefficients and the readings stand among the channels.
FORCES, AIR_AND_ATTITUDE = slice(len(COEFFICIENTS)), slice(len(COEFFICIENTS), None)

_Result = TypeVar("_Result")

#: Channels, each (N,) or (N, K). They become one array outside of XLA, which would compute all of them for each entry.
Channels = Sequence[Scalar]

#: A prediction: of layout, model, parameters (P,), which of them act (P,), a flight's inputs, and the flow.
Prediction = Callable[..., Channels]


class ObserverMemory(NamedTuple):
    """How long the observer of the air trusts the inertial instruments, s."""

    observer: Scalar | float  # time constant with which predicted air data are corrected by the measured ones
    vane: Scalar | float  # the same of the rate of alpha; zero follows the vane at every sample


class PredictionInputs(NamedTuple):
    """What predictions take from a flight of N samples at a constant rate; series are padded at the end."""

    signals: MeasuredSignals
    motion: InstrumentReadings | None  # None without attitude
    memory: ObserverMemory
    vanes: Scalar  # (2,) one where alpha and beta were measured, zero elsewhere
    step: Scalar  # s


def flow(
    layout: ParameterLayout, model: AircraftNumbers, theta: Parameters, _: Scalar, inputs: PredictionInputs
) -> Flow | None:
    """The flow by the inertial instruments, which depends on kinematic parameters alone; None without attitude."""
    if inputs.motion is None:
        return None
    chain = Chain.of(layout, model, theta, inputs.step, jnp.zeros(()))
    return flow_of(chain, inputs.motion, inputs.memory.vane, inputs.vanes)


@partial(jax.jit, static_argnums=0)  # traced once for all programs that contain it
def force_coefficients(
    layout: ParameterLayout,
    model: AircraftNumbers,
    theta: Parameters,
    acting: Scalar,
    inputs: PredictionInputs,
    known_flow: Flow | None,
) -> Channels:
    """Six coefficients (N,) of forces and moments that parameters (P,) predict in a flow that is known."""
    signals = inputs.signals
    if known_flow is not None:
        signals = signals._replace(**known_flow._asdict())
    return tuple(
        coefficients(model, inputs.signals, predict_accelerations(layout, model, theta, signals, inputs.step, acting))
    )


@partial(jax.jit, static_argnums=0)
def instrument_readings(
    layout: ParameterLayout,
    model: AircraftNumbers,
    theta: Parameters,
    _: Scalar,
    inputs: PredictionInputs,
    __: Flow | None = None,
) -> Channels:
    """Air data and attitude, six series (N,), that parameters (P,) predict; zeros without attitude."""
    if inputs.motion is None:
        return (jnp.zeros(inputs.signals.density.size),) * len(READINGS)
    return tuple(reconstruct(layout, model, theta, inputs.motion, inputs.memory.observer, inputs.step).T)


def all_channels(
    layout: ParameterLayout,
    model: AircraftNumbers,
    theta: Parameters,
    acting: Scalar,
    inputs: PredictionInputs,
    _: Flow | None,
) -> Channels:
    """All twelve channels (N,) that parameters (P,) predict, in the flow that they themselves give."""
    own_flow = flow(layout, model, theta, acting, inputs)
    forces = force_coefficients(layout, model, theta, acting, inputs, own_flow)
    return (*forces, *instrument_readings(layout, model, theta, acting, inputs))


@kept(2)
def evaluate(function: Callable[..., _Result], layout: ParameterLayout, *arguments: Any) -> _Result:
    """What one of the functions above returns for these arguments."""
    return function(layout, *arguments)


@kept(2)
def directional_slopes(
    prediction: Prediction,
    layout: ParameterLayout,
    model: AircraftNumbers,
    theta: Scalar,
    acting: Scalar,
    directions: Scalar,
    inputs: PredictionInputs,
    known_flow: Flow | None,
) -> tuple[Channels, Channels]:
    """Channels (N,) of a prediction, and their derivatives (N, K) along directions (K, M) of ``free_parameters``."""
    free, fixed = free_parameters(prediction, layout), jnp.unstack(theta)

    def at(entries: Scalar) -> Channels:
        point = list(fixed)
        for place, entry in zip(free, jnp.unstack(entries), strict=True):
            point[place] = entry
        return tuple(prediction(layout, model, point, acting, inputs, known_flow))

    def along(direction: Scalar) -> tuple[Channels, Channels]:
        slope: tuple[Channels, Channels] = jax.jvp(at, (theta[np.array(free)],), (direction,))
        return slope

    values, slopes = jax.vmap(along, out_axes=(None, 1))(directions)
    return values, slopes


@kept(1)
def slopes_by_derivative(
    layout: ParameterLayout,
    model: AircraftNumbers,
    theta: Scalar,
    acting: Scalar,
    inputs: PredictionInputs,
    known_flow: Flow | None,
) -> Channels:
    """Derivatives (N, D) of the six coefficients with respect to each derivative of the aircraft file.

    They equal the slopes along ``derivative_error`` at a quarter of the cost: no slope of the flow, of the actuators or
    of the kinematics has to be carried along.
    """

    def forces(derivatives: Scalar) -> Channels:
        changed = model._replace(derivatives=derivatives)
        return tuple(force_coefficients(layout, changed, theta, acting, inputs, known_flow))

    slopes: Channels = jax.jacfwd(forces)(model.derivatives)
    return slopes


#: Effects of clocks and sensors that the kinematics do not contain: stamps of commands, and noise, which has no value.
_NOT_KINEMATIC = frozenset({"actuator_stamp_delay", "sensor_noise"})


@cache
def kinematic_parameters(layout: ParameterLayout) -> list[int]:
    """Entries of the parameter vector that the kinematics depend on: clocks, sensors, and where the sensors are."""
    return [
        i
        for i, (effect, _) in enumerate(parameters.table(layout))
        if effect == "cg_shift" or (EFFECTS[effect].station in {"sensors", "clock"} and effect not in _NOT_KINEMATIC)
    ]


@cache
def free_parameters(prediction: Prediction, layout: ParameterLayout) -> list[int]:
    """Entries of the parameter vector by which a prediction is differentiated.

    Coefficients in a known flow are differentiated by what does not move the flow, all channels by what does.
    """
    kinematic = kinematic_parameters(layout)
    if prediction is not force_coefficients:
        return kinematic
    return [i for i in range(len(parameters.table(layout))) if i not in kinematic]
