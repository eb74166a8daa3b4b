"""What tests of the controller share: an aircraft, what its sensors say in level flight, estimates as it wants them."""

import math
from collections.abc import Mapping

from sysid_node.aircraft.load import load_aircraft
from sysid_node.control.types import IdentifiedDerivative, Measurements
from sysid_node.dynamics.linearised import trimmed

AIRCRAFT = load_aircraft("cdrw")
LEVEL, _ = trimmed(AIRCRAFT)
STEP = 0.005
NAN = math.nan


def level(time: float, **changes: float) -> Measurements:
    """Level flight at the reference condition, but for ``changes``."""
    airspeed, density = AIRCRAFT.reference.airspeed, AIRCRAFT.reference.air_density
    return Measurements(time, 0.0, 0.0, 0.0, 0.0, LEVEL, airspeed, LEVEL, 0.0, density)._replace(**changes)


def beliefs(
    factors: Mapping[str, float] | None = None, half: float = 0.05, **changes: object
) -> dict[str, IdentifiedDerivative]:
    """The file's derivatives times ``factors``, known to a share ``half``, valid and explained but for ``changes``."""
    found = {}
    for name, d in AIRCRAFT.derivatives.items():
        value = d.value * (factors or {}).get(name, 1.0)
        width = half * abs(d.value)
        found[name] = IdentifiedDerivative(value, value - width, value + width, True, 1.0)._replace(**changes)
    return found
