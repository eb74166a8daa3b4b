"""Layer ``sim``: a six-degree-of-freedom flight simulator, one JAX function from commands to messages.

    simulator = Simulator(aircraft, rate=100.0)
    theta = simulator.vector(["actuator_lag:time_constant=0.05"])     # (P,) all parameters of all effects
    trim = trim_flight(simulator, airspeed=18.0)                     # .initial (13,), .command (controls + 1,)
    inputs = simulator.inputs(commands)                              # (N, controls + 1): rad, and thrust in N
    flight = simulator.rollout(theta, trim.initial, inputs)          # .outputs (N, 12), .states, .surfaces, ...
    slopes = simulator.jacobian(theta, trim.initial, inputs)         # (N, 12, P)

``simulator.neutral()`` is the vector of the aircraft as its file describes it; ``simulator.names``, ``.parameters`` and
``.scales`` describe the vector's entries (``derivative_error.Cm_alpha`` is added to the file's Cm_alpha, and so is
every other derivative). ``simulator.initial(V, alpha, beta, euler, rates)`` makes a state and can be differentiated.
``rollout`` and ``initial`` are pure: ``jax.vmap`` and ``jax.jacfwd`` may transform them. Surfaces, thrust and gusts are
linear between samples.

``prediction`` evaluates the same chain on measured signals without integrating the motion: ``predict_accelerations``
gives the accelerations, ``coefficients`` the coefficients that they show. ``flying`` simulates whole flights (trim,
turbulence, autopilot, noise), or one sample at a time, and writes them as messages; ``signals`` makes turbulence, and
``export`` writes other simulators' models. The page docs/reference/effects.md describes every effect.

Everything is SI, radians, body axes forward-right-down, float64.
"""

from sysid_node.sim.compiled import xla

xla.configure()

from sysid_node.sim.effects import EFFECTS, STATIONS, Effect, SimulationParameter  # noqa: E402
from sysid_node.sim.flying.rollout import RolloutInputs, SimulatedFlight  # noqa: E402
from sysid_node.sim.flying.trim import Trim, trim_flight  # noqa: E402
from sysid_node.sim.simulator import Simulator  # noqa: E402

__all__ = [
    "EFFECTS",
    "STATIONS",
    "Effect",
    "RolloutInputs",
    "SimulatedFlight",
    "SimulationParameter",
    "Simulator",
    "Trim",
    "trim_flight",
]
