"""A manoeuvre in words, in numbers and against time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from sysid_node.excite.manoeuvre import THROTTLE, control_limits
from sysid_node.excite.multisine import relative_peak_factor
from sysid_node.excite.optimise import Optimum, posterior_to_prior_ratios
from sysid_node.excite.prediction import tolerances_of
from sysid_node.report.drawing import figures
from sysid_node.report.drawing.figures import BLUE, GREEN, PURPLE, VERMILION, Figure
from sysid_node.report.results.manoeuvre_result import ManoeuvreResult
from sysid_node.report.wording.numbers import listing, number, plural, seconds

DEGREES = 180.0 / np.pi
_COLOURS = {"elevator": BLUE, "aileron": VERMILION, "rudder": GREEN}

#: Remaining share of a tolerance below which a derivative counts as well determined, and above which as hardly.
WELL, HARDLY = 0.1, 0.9


def opening(result: ManoeuvreResult) -> Mapping[str, Any]:
    """Sentences and facts."""
    left = posterior_to_prior_ratios(result.prediction.information, tolerances_of(result.aircraft))
    plan, flight = result.prediction.manoeuvre, result.prediction.flight
    optimum = result.optimum
    return {
        "aircraft": result.aircraft.name,
        "length": seconds(plan.duration),
        "moved": listing(list(plan.moved)),
        "well": int((left < WELL).sum()),
        "count": plural(left.size, "derivative"),
        "hardly": int((left > HARDLY).sum()),
        "beyond": beyond_envelope(result),
        "optimum": None if optimum is None else _optimum(optimum),
        "facts": [
            ("Aircraft", result.aircraft.name),
            ("Airspeed", f"{number(float(flight['V'][0]))}\u202fm/s"),
            ("Autopilot", "holds attitude and airspeed" if result.autopilot else "off"),
            ("Length", seconds(plan.duration)),
        ],
    }


def context(result: ManoeuvreResult) -> Mapping[str, Any]:
    """The specification, the deflections of each control, and the plan against time."""
    plan = result.prediction.manoeuvre
    limits = control_limits(result.aircraft)
    rows = []
    for name in plan.moved:
        values, scale, unit = plan.deflections[name], *_unit(name)
        peak = float(np.abs(values).max())
        share = f"{number(100 * peak / limits[name], 2)}\u202f%" if np.isfinite(limits[name]) else ""
        rows.append(
            (
                name,
                f"{number(scale * peak)}\u202f{unit}".strip(),
                share,
                number(relative_peak_factor(values[values != 0])),
            )
        )
    surfaces = [name for name in plan.moved if name != THROTTLE]
    return {"spec": plan.spec.split("+"), "rows": rows, "figure": _figure(result, surfaces) if surfaces else None}


def _unit(name: str) -> tuple[float, str]:
    return (1.0, "") if name == THROTTLE else (DEGREES, "deg")


def _figure(result: ManoeuvreResult, surfaces: list[str]) -> Figure:
    plan = result.prediction.manoeuvre
    traces = [
        figures.line(plan.time, DEGREES * plan.deflections[name], name, colour=_COLOURS.get(name, PURPLE), width=1.4)
        for name in surfaces
    ]
    layout = {"xaxis": figures.axis("time, s"), "yaxis": figures.axis("deg from trim"), "showlegend": len(traces) > 1}
    return Figure(
        f"Planned deflections of {', '.join(surfaces)} from trim, deg against time", traces, layout, height=280
    )


def beyond_envelope(result: ManoeuvreResult) -> list[str]:
    """Limits of the envelope that the flight exceeds, in words."""
    names = {
        "alpha": "angle of attack",
        "beta": "sideslip",
        "bank": "bank",
        "pitch": "pitch",
        "rate": "an angular rate",
    }
    names["airspeed"] = "airspeed"
    excess = result.envelope.excess(result.prediction.flight)
    return [f"{names[n]} ({number(100 * (1 + e), 3)}\u202f% of its limit)" for n, e in excess.items() if e > 0]


def _optimum(optimum: Optimum) -> Mapping[str, str]:
    return {
        "start": f"{number(100 * optimum.cost_start, 3)}\u202f%",
        "best": f"{number(100 * optimum.cost_best, 3)}\u202f%",
        "trials": plural(optimum.evaluations, "trial"),
        "spec": optimum.start.manoeuvre.spec,
    }
