"""What the identifier would say of an aircraft after a usual flight: its file flown in this package's simulator.

Nothing is wrong in that flight, so that the errors of the estimates are those of noise and of the file's tolerances.
They show before the first flight what should be weighed, measured or calibrated.
"""

from __future__ import annotations

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.online.alignment.in_pieces import PieceAlignment
from sysid_node.online.replay import run
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.types import Estimates

#: 3-2-1-1 on each surface in turn, three times.
_MANOEUVRE = ("3211:repeat=3",)

_RATE = 100.0  # Hz, of all messages
_SIMULATED = 200.0  # Hz


def expected_estimates(aircraft: Aircraft) -> Estimates:
    """The estimates at the end of the flight: in still air, with the file's noise, from commands alone.

    Raises InputError where the aircraft cannot be flown: it has no trim, or the manoeuvre takes it out of flight.
    """
    from sysid_node.excite.spec import parse_manoeuvre  # noqa: PLC0415  # JAX takes its time
    from sysid_node.sim.flying.recording import FlightSampler  # noqa: PLC0415
    from sysid_node.sim.flying.sortie import SortieConditions, fly_sortie  # noqa: PLC0415
    from sysid_node.sim.simulator import Simulator  # noqa: PLC0415

    simulator = Simulator(aircraft, _SIMULATED)
    plan = parse_manoeuvre(_MANOEUVRE, aircraft, simulator.rate, None)
    deflections = np.column_stack([plan.surfaces(), np.zeros(plan.time.size)])
    sortie = fly_sortie(simulator, deflections, SortieConditions(command_rate=_RATE))
    streams = FlightSampler(_RATE, _RATE, _RATE, surfaces="commanded").record(sortie)
    settings = OnlineSettings()
    aligned = PieceAlignment(aircraft, settings.max_gap, "commands").take(streams, last=True)
    if not aligned.time.size:
        raise InputError("no sample of the simulated flight could be aligned")
    (final,) = run(aircraft, settings, aligned.time, aligned.samples, aligned.time[-1:], commands_from=0)
    return final
