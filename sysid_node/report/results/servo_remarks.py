"""How late each control follows, beside what the aircraft file says."""

from __future__ import annotations

import math

from sysid_node.aircraft.model import Aircraft
from sysid_node.online.estimates.servo_gap import servo_times_in_file
from sysid_node.online.types import Estimates
from sysid_node.report.results.comparison import half_width


def servo_remarks(aircraft: Aircraft, final: Estimates) -> list[str]:
    """A sentence on all servos whose time is known, and one on the others; none where there are none."""
    known = {name: d for name, d in final.servos.items() if d.valid}
    late = servo_times_in_file(aircraft)
    delays = [
        f"{name} {1e3 * d.value:.0f} \u00b1 {1e3 * half_width(d):.0f} ms "
        f"(the file says {f'{1e3 * late[name]:.0f} ms' if name in late else 'nothing'})"
        for name, d in known.items()
    ]
    vague = [
        f"{name} {1e3 * d.value:.0f} \u00b1 {1e3 * half_width(d):.0f} ms"
        for name, d in final.servos.items()
        if not d.valid and math.isfinite(d.standard_error)
    ]
    remarks = [f"Surfaces lag what is recorded of them by: {', '.join(delays)}."] if delays else []
    return remarks + ([f"Not known well enough: the lag of {', '.join(vague)}."] if vague else [])
