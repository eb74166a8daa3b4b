"""Late stamps of the actuators."""

from __future__ import annotations

from sysid_node.sim.effects.base import Effect, SimulationParameter, fixed

EFFECT = Effect(
    name="actuator_stamp_delay",
    station="clock",
    summary="Actuator messages say when they were sent, not when the surface was there.",
    equation="recorded(t) = u(t - delay); so from a record, u(t) = recorded(t + delay)",
    source="Klein & Morelli (2006), Aircraft System Identification, ch. 9 (time skew of data channels)",
    parameters=fixed(SimulationParameter("delay", "s", "stamp minus time of the event", 0.03, lower=-0.5, upper=0.5)),
)
