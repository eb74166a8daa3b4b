"""Late stamps of the air data."""

from __future__ import annotations

from sysid_node.sim.effects.base import Effect, SimulationParameter, fixed

EFFECT = Effect(
    name="air_data_delay",
    station="clock",
    summary="Air-data messages say when they were sent, not when they were measured.",
    equation="y'(t) = y(t - delay), cubic between samples",
    source="Klein & Morelli (2006), Aircraft System Identification, ch. 9 (time skew of data channels)",
    parameters=fixed(SimulationParameter("delay", "s", "stamp minus time of the event", 0.03, lower=-0.5, upper=0.5)),
)
