"""Transport delay between a command and its actuator."""

from __future__ import annotations

from sysid_node.sim.effects.base import Effect, SimulationParameter, each_control

#: The longest delay that can be stated, s.
LONGEST = 0.5

EFFECT = Effect(
    name="command_delay",
    station="command",
    summary="Commands reach the actuators late.",
    equation="u'(t) = u(t - delay); commands are linear between samples",
    source="Hodgkinson (1999), Aircraft Handling Qualities (equivalent time delay)",
    parameters=each_control(
        SimulationParameter("delay", "s", "transport delay", 0.05, lower=0.0, upper=LONGEST), throttle=True
    ),
    shared="delay",
)
