"""An aircraft file in a handbook's terms: tables for the terminal and the page, and the page's figures."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from sysid_node.aircraft.default_tolerances import default_of
from sysid_node.aircraft.model import Aircraft
from sysid_node.dynamics.handbook.handbook import Handbook
from sysid_node.online.types import Estimates
from sysid_node.report.drawing import figures
from sysid_node.report.drawing.figures import BLUE, Figure
from sysid_node.report.sections import budget
from sysid_node.report.wording.numbers import NONE, number

DEGREES = 180.0 / math.pi


@dataclass(frozen=True)
class TextTable:
    """A title, headings and rows of text; the first column is text, the others are right-aligned where ``numbers``."""

    title: str
    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numbers: bool = True


def opening(book: Handbook) -> Mapping[str, Any]:
    """How many values look unusual, and facts."""
    aircraft, count = book.aircraft, sum(finding.unusual for finding in book.findings)
    facts = [
        ("Aircraft", aircraft.name),
        ("Mass", f"{number(aircraft.mass)}\u202fkg"),
        ("Wing", f"{number(aircraft.geometry.S)}\u202fm², span {number(aircraft.geometry.b)}\u202fm"),
        (
            "Reference",
            f"{number(aircraft.reference.airspeed)}\u202fm/s, {number(aircraft.reference.air_density)}\u202fkg/m³",
        ),
        ("Static margin", static_margin(book)),
    ]
    return {"unusual": count, "checks": len(book.findings), "facts": facts, "left_out": book.left_out}


def static_margin(book: Handbook) -> str:
    """The static margin with its 1-sigma uncertainty, % of the mean chord."""
    return f"{number(100 * book.static_margin)} ± {number(100 * book.static_margin_error, 2)}\u202f% of the chord"


def unusual(book: Handbook) -> Mapping[str, Any]:
    """All checks, the unusual ones first."""
    return {"findings": [(f, number(f.value)) for f in book.findings]}


def trim_context(book: Handbook) -> Mapping[str, Any]:
    """Trim over airspeed as table and figures."""
    speed = np.array([t.airspeed for t in book.trims])
    columns = [
        ("alpha, deg", [DEGREES * t.alpha for t in book.trims]),
        ("elevator, deg", [DEGREES * t.elevator for t in book.trims]),
        ("thrust, N", [t.thrust for t in book.trims]),
    ]
    drawn = [
        _figure(f"Trim: {title} against airspeed", speed, np.array(values), "airspeed, m/s", title)
        for title, values in columns
        if np.isfinite(values).all()
    ]
    return {"tables": [trim_table(book)], "figures": drawn}


def mode_context(book: Handbook) -> Mapping[str, Any]:
    """Modes of motion."""
    return {"tables": [mode_table(book)], "figures": []}


def performance_context(book: Handbook) -> Mapping[str, Any]:
    """Speeds and control power; lift and drag curves."""
    curve = book.polar
    angle = DEGREES * curve.alpha
    drawn = [
        _figure("Trimmed lift coefficient against alpha", angle, curve.lift, "alpha, deg", "CL"),
        _figure("Trimmed drag coefficient against alpha", angle, curve.drag, "alpha, deg", "CD"),
        _figure("Trimmed polar: lift against drag coefficient", curve.drag, curve.lift, "CD", "CL"),
    ]
    return {"tables": [performance_table(book), power_table(book)], "figures": drawn}


def file_context(book: Handbook) -> Mapping[str, Any]:
    """Servos and delays, and tolerances that the file states."""
    return {"tables": [servo_table(book.aircraft), tolerance_table(book.aircraft)], "figures": []}


def trim_table(book: Handbook) -> TextTable:
    """Level flight over airspeed."""
    rows = [
        (f"{t.airspeed:.1f}", number(DEGREES * t.alpha), number(DEGREES * t.elevator), number(t.thrust), number(t.lift))
        for t in book.trims
    ]
    return TextTable("Level flight", ("airspeed, m/s", "alpha, deg", "elevator, deg", "thrust, N", "CL"), tuple(rows))


def mode_table(book: Handbook) -> TextTable:
    """Modes at the reference airspeed."""
    rows = []
    for mode in book.modes:
        change = f"{number(mode.time_to_half)} ({'half' if mode.stable else 'double'})"
        rows.append((mode.name, number(mode.frequency), number(mode.damping), change))
    title = f"Modes at {number(book.trim.airspeed)} m/s"
    return TextTable(title, ("mode", "frequency, rad/s", "damping ratio", "time to half or double, s"), tuple(rows))


def performance_table(book: Handbook) -> TextTable:
    """Stall, glide and climb."""
    found = book.performance
    stall = f"CL {number(found.largest_lift)} at {number(DEGREES * found.stall_alpha)} deg; {found.stall_from}"
    climb = "full thrust as the file states it, the same at every airspeed"
    if not math.isfinite(found.climb_rate):
        climb = "the file states no max_thrust"
    rows = (
        ("stall speed, m/s", number(found.stall_speed), stall),
        ("best glide, m/s", number(found.glide_speed), found.glide_note),
        ("lift over drag there", number(found.glide_ratio), ""),
        ("best climb, m/s", number(found.climb_rate), climb),
        ("airspeed of best climb, m/s", number(found.climb_speed), ""),
    )
    return TextTable("Performance", ("quantity", "value", "remark"), rows, numbers=False)


def power_table(book: Handbook) -> TextTable:
    """Control power per degree and at the file's limit."""
    power = book.power
    rows = [
        _power_row(book, "aileron", "steady roll rate", power.roll_rate, "deg/s"),
        _power_row(book, "elevator", "pitch acceleration", power.pitch_acceleration, "deg/s²"),
        _power_row(book, "rudder", "steady sideslip", power.sideslip, "deg"),
    ]
    return TextTable("Control power", ("control and what it does", "per rad", "at its limit"), tuple(rows))


def _power_row(book: Handbook, control: str, words: str, value: float, unit: str) -> tuple[str, str, str]:
    stated = book.aircraft.controls.get(control)
    limit = stated.limit if stated else None
    per_radian = {"deg/s": "rad/s", "deg/s²": "rad/s²", "deg": "rad"}[unit]
    at_limit = NONE if limit is None else f"{number(DEGREES * limit * value)} {unit}"
    return f"{control}: {words}", f"{number(value)} {per_radian}", at_limit


def servo_table(aircraft: Aircraft) -> TextTable:
    """Servos, delays and further effects that the file states."""
    rows = [
        (f"{effect}.{key}", number(item.value), NONE if item.tolerance is None else number(item.tolerance))
        for effect, items in aircraft.effects.items()
        for key, item in items.items()
    ]
    rows += [
        (f"delays.{topic}", number(d.value), NONE if d.tolerance is None else number(d.tolerance))
        for topic, d in aircraft.delays.items()
        if d.value or d.tolerance is not None
    ]
    return TextTable("Servos, delays and effects in the file", ("key", "value", "tolerance"), tuple(rows))


def tolerance_table(aircraft: Aircraft) -> TextTable:
    """Tolerances that the file states itself, and the default's size in words."""
    rows = []
    for stated, number_in_file in aircraft.stated_tolerances.items():
        # that of the air density counts as a share
        density = stated == "reference.air_density"
        key, value = ("air_density", aircraft.tolerances["air_density"]) if density else (stated, number_in_file)
        if key not in aircraft.tolerances:
            continue
        default = default_of(key)
        usual = f"{number(100 * default.share)} %" if default.share else f"{number(default.absolute)} {default.unit}"
        rows.append((key, number(value), usual))
    return TextTable("Tolerances other than the defaults", ("key", "in the file", "default"), tuple(rows))


def budget_table(estimates: Estimates) -> TextTable:
    """What each derivative's uncertainty would be made of after a usual flight."""
    title = f"Error budget after {estimates.time:.0f} s of simulated flight: 3-2-1-1s, still air, commands alone"
    headings = ("derivative", "standard error", "largest sources", "what would help most")
    errors = {name: number(d.standard_error, 2) for name, d in estimates.derivatives.items()}
    rows = tuple((row.name, errors[row.name], row.sources, row.advice) for row in budget.budget_rows(estimates))
    return TextTable(title, headings, rows, numbers=False)


def budget_context(expected: Estimates | str) -> Mapping[str, Any]:
    """The budget as a table, or why there is none."""
    if isinstance(expected, str):
        return {"tables": [], "figures": [], "why": expected}
    return {"tables": [budget_table(expected)], "figures": [], "why": ""}


def _figure(label: str, x: Any, y: Any, below: str, beside: str) -> Figure:
    layout = {"xaxis": figures.axis(below), "yaxis": figures.axis(beside)}
    return Figure(label, [figures.line(x, y, beside, colour=BLUE)], layout, height=260)
