"""An attitude-hold autopilot: in simulated flights, as in real ones, the surfaces then depend on the motion.

It holds trim attitude and airspeed with feedback that is limited to a share of each surface's travel, on top of the
planned commands. Gains follow from the aircraft's steady responses (Stevens, Lewis & Johnson (2016), ch. 4: attitude
loops around rate damping); they are not optimised.
"""

from __future__ import annotations

from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.dynamics.attitude import euler_angles
from sysid_node.sim.compiled.programs import kept
from sysid_node.sim.flying.lengths import cut, padded
from sysid_node.sim.flying.rollout import RolloutInputs, SimulatedFlight, fly
from sysid_node.sim.flying.trim import Trim
from sysid_node.sim.model.chain import Chain
from sysid_node.sim.model.layout import OUTPUTS, AircraftNumbers, ParameterLayout, Scalar
from sysid_node.sim.model.state import body_state
from sysid_node.sim.simulator import Simulator
from sysid_node.sim.stations import command

Array = NDArray[np.float64]

#: Bandwidth of the attitude loops, rad/s; of the integral in it, 1/s; of the airspeed loop, 1/s.
BANDWIDTH, _INTEGRAL, _SPEED = 1.5, 0.3, 0.4

#: Share of a surface's travel that feedback may use.
_SHARE = 0.5

#: Longest command delay that a flight with the autopilot can have, s.
_LONGEST_DELAY = 0.5

#: Outputs that are fed back, in the order of the gain matrix's columns.
SEEN = ("p", "q", "r", "phi", "theta", "V")


class Autopilot(NamedTuple):
    """Feedback: correction = gains (outputs - hold) + integral gains * time integral of (outputs - hold), limited."""

    gains: Scalar  # (controls + 1, 6) on p q r phi theta V
    integral: Scalar  # (controls + 1, 6)
    hold: Scalar  # (6,) values that are held
    limit: Scalar  # (controls + 1,) rad, N
    lowest: Scalar  # (controls + 1,) limits of the command itself
    highest: Scalar


class _AutopilotState(NamedTuple):
    """What the autopilot carries from sample to sample."""

    integral: Scalar  # (6,) of outputs - hold
    sample: Scalar  # number of the next sample
    history: Scalar  # (K, controls + 1) commands given, the newest last


def autopilot_for(simulator: Simulator, trim: Trim) -> Autopilot:
    """The autopilot that holds this trim; a loop whose surface the aircraft lacks stays open."""
    aircraft, commands = simulator.aircraft, simulator.commands
    gains, integral = np.zeros((len(commands), len(SEEN))), np.zeros((len(commands), len(SEEN)))
    for control, entries in _loops(aircraft).items():
        for seen, gain in entries.items():
            gains[commands.index(control), SEEN.index(seen)] = gain
            if seen in ("phi", "theta"):
                integral[commands.index(control), SEEN.index(seen)] = _INTEGRAL * gain
    limits = np.minimum(np.asarray(simulator.model.limits), 0.5)
    thrust = min(float(simulator.model.max_thrust), 10.0 * 9.8 * aircraft.mass) if aircraft.throttle else 0.0
    attitude = euler_angles(body_state(jnp.asarray(trim.initial)).attitude, jnp)
    speed = float(np.linalg.norm(trim.initial[3:6]))
    return Autopilot(
        gains=jnp.asarray(gains),
        integral=jnp.asarray(integral),
        hold=jnp.asarray([0.0, 0.0, 0.0, attitude.x, attitude.y, speed]),
        limit=jnp.asarray([*(_SHARE * limits), thrust]),
        lowest=jnp.asarray([*(-np.asarray(simulator.model.limits)), 0.0]),
        highest=jnp.asarray([*np.asarray(simulator.model.limits), thrust]),
    )


def fly_held(
    simulator: Simulator,
    theta: Array,
    trim: Trim,
    inputs: RolloutInputs,
    autopilot: Autopilot,
    given: NDArray[np.bool_] | None = None,
) -> SimulatedFlight:
    """The flight from trim with the autopilot on; ``inputs.commands`` are the planned ones, trim included.

    ``given`` (N,): at which samples the autopilot gives a new command, which is held until the next; None: at all.
    """
    history, samples = round(_LONGEST_DELAY * simulator.rate) + 2, len(inputs.commands)
    flight: SimulatedFlight = _fly_held(
        simulator.layout,
        history,
        simulator.model,
        theta,
        trim.initial,
        padded(inputs),
        simulator.step,
        autopilot,
        padded(jnp.ones(samples, bool) if given is None else jnp.asarray(given)),
        samples,
    )
    return cut(flight, samples)


@kept(2)
def _fly_held(
    layout: ParameterLayout,
    history: int,
    model: AircraftNumbers,
    theta: Scalar,
    initial: Scalar,
    inputs: RolloutInputs,
    step: Scalar,
    autopilot: Autopilot,
    given: Scalar,
    samples: Scalar | int,
) -> SimulatedFlight:
    chain = Chain.of(layout, model, theta, step, -initial[2])
    columns = jnp.array([OUTPUTS.index(name) for name in SEEN])

    def pilot(state: _AutopilotState, outputs: Scalar, planned: Scalar) -> tuple[Scalar, Scalar, _AutopilotState]:
        error = outputs[columns] - autopilot.hold
        # XLA would call a library for matrix products, outside of the loop's kernel
        wanted = jnp.sum(autopilot.gains * error + autopilot.integral * state.integral, axis=1)
        correction = jnp.clip(wanted, -autopilot.limit, autopilot.limit)
        saturated = jnp.any(jnp.abs(wanted) > autopilot.limit)  # the integral stops while the correction is limited
        commanded = jnp.clip(planned + correction, autopilot.lowest, autopilot.highest)
        commanded = jnp.where(given[state.sample], commanded, state.history[-1])
        past = jnp.concatenate([state.history[1:], commanded[None]])
        arriving = command.arrive_from_history(layout, chain.effects, past, step)
        integral = state.integral + jnp.where(saturated, 0.0, error * step)
        return commanded, arriving, _AutopilotState(integral, state.sample + 1, past)

    start = _AutopilotState(jnp.zeros(len(SEEN)), jnp.ones((), int), jnp.tile(inputs.commands[0], (history, 1)))
    return fly(chain, initial, inputs, pilot, start, samples)


def _loops(aircraft: Aircraft) -> dict[str, dict[str, float]]:
    """Gains by control and output, from the aircraft's steady responses."""
    loops: dict[str, dict[str, float]] = {}
    pitch, roll, yaw = _pitch_response(aircraft), _roll_response(aircraft), _value(aircraft, "Cn_dr")
    if pitch:
        loops["elevator"] = {"theta": -BANDWIDTH / pitch, "q": -0.2 * BANDWIDTH / pitch}
    if roll:
        loops["aileron"] = {"phi": -BANDWIDTH / roll, "p": -0.05 * BANDWIDTH / roll}
    if yaw:
        span, speed = aircraft.geometry.b, aircraft.reference.airspeed
        damping = abs(_value(aircraft, "Cn_r")) * span / (2.0 * speed)  # doubles the natural damping
        loops["rudder"] = {"r": -damping / yaw}
    if aircraft.throttle is not None:
        loops["thrust"] = {"V": -_SPEED * aircraft.mass}
    return {control: entries for control, entries in loops.items() if control in (*aircraft.controls, "thrust")}


def _pitch_response(aircraft: Aircraft) -> float:
    """Steady rate of turn of the flight path, rad/s per rad of elevator; 0 without Cm_alpha."""
    if not _value(aircraft, "Cm_alpha"):
        return 0.0
    alpha = _value(aircraft, "Cm_de") / abs(_value(aircraft, "Cm_alpha"))
    lift = _value(aircraft, "CL_alpha") * alpha + _value(aircraft, "CL_de")
    reference = aircraft.reference
    return 0.5 * reference.air_density * reference.airspeed * aircraft.geometry.S / aircraft.mass * lift


def _roll_response(aircraft: Aircraft) -> float:
    """Steady roll rate, rad/s per rad of aileron; 0 without Cl_p."""
    damping = _value(aircraft, "Cl_p")
    if not damping:
        return 0.0
    return -_value(aircraft, "Cl_da") / damping * 2.0 * aircraft.reference.airspeed / aircraft.geometry.b


def _value(aircraft: Aircraft, name: str) -> float:
    return aircraft.derivatives[name].value if name in aircraft.derivatives else 0.0
