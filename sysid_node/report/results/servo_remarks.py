"""How late each control follows, beside what the aircraft file says."""

from __future__ import annotations

from sysid_node.aircraft.model import Aircraft
from sysid_node.online.estimates.servo_gap import servo_times_in_file
from sysid_node.online.types import Estimates
from sysid_node.report.results.comparison import half_width


def servo_remarks(aircraft: Aircraft, final: Estimates) -> list[str]:
    """A sentence on all servos whose time is known; none where there is none."""
    known = {name: d for name, d in final.servos.items() if d.valid}
    late = servo_times_in_file(aircraft)
    delays = [
        f"{name} {1e3 * d.value:.0f} \u00b1 {1e3 * half_width(d):.0f} ms "
        f"(the file says {f'{1e3 * late[name]:.0f} ms' if name in late else 'nothing'})"
        for name, d in known.items()
    ]
    return [f"Controls follow what is recorded of them later by: {', '.join(delays)}."] if delays else []
