"""What a diagnosis found, in one paragraph for a pilot."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from sysid_node.gap.diagnose import Diagnosis
from sysid_node.gap.document import document
from sysid_node.gap.validation.simulation_error import WINDOW
from sysid_node.gap.validation.spectral_error import Gap
from sysid_node.report.wording.names import COEFFICIENT_WORDS, REGRESSOR_WORDS, words_of
from sysid_node.report.wording.numbers import likely, number, with_interval
from sysid_node.sim import EFFECTS
from sysid_node.sim.model.layout import Layout

#: What is compared, in words.
WORDS = {
    **COEFFICIENT_WORDS,
    "V": "airspeed",
    "alpha": "angle of attack",
    "beta": "sideslip",
    "phi": "roll angle",
    "theta": "pitch angle",
    "psi": "heading",
    "ax": "forward specific force",
    "ay": "sideways specific force",
    "az": "downward specific force",
    **{name: REGRESSOR_WORDS[name] for name in "pqr"},
}

#: Readings that together are an aircraft's response about an axis.
_RESPONSES = {
    "pitch response": ("q", "theta", "alpha", "az"),
    "roll response": ("p", "phi"),
    "yaw response": ("r", "beta", "ay"),
    "forward motion": ("V", "ax"),
}

_TIMES = ("before", "after")

#: Of flights on which nobody metered the thrust.
_THRUST = " Thrust was not recorded: it is taken as what the file's drag leaves, and forward motion is not compared."

#: Motion of the air that is not worth a word, m/s rms.
_STILL = 0.2


def paragraph(found: Diagnosis) -> str:
    """What was found."""
    return f"{_off(found)}{_findings(found)}{_weather(found)}{_blindness(found)}{_quiet(found)}"


def _off(found: Diagnosis) -> str:
    """How far off the simulator is, and where most: of what is mended, where causes were found."""
    gap = found.size
    if found.simulation_gap:
        before, after = ({words: _together(gap, n, when) for words, n in _RESPONSES.items()} for when in _TIMES)
        mended = {words: before[words] ** 2 - after[words] ** 2 for words in _RESPONSES}
        sizes = mended if found.attribution.causes else before
        worst = max(sizes, key=lambda words: sizes[words])
        return (
            f"Begun anew every {WINDOW:g} s in the flight's own state, the simulator's {worst} is "
            f"{percent(before[worst])} off, {percent(gap.before)} over all readings"
        )
    worst = max(gap.per_channel, key=lambda c: gap.per_channel[c]["before"], default="")
    size = gap.per_channel[worst]["before"] if worst else gap.before
    return f"The simulator's {WORDS.get(worst, 'response')} is {percent(size)} off"


def _together(gap: Gap, names: tuple[str, ...], when: str) -> float:
    """Error of some readings together, ``before`` or ``after``; 0 where none of them moved."""
    own = [gap.per_channel[name][when] for name in names if name in gap.per_channel]
    return float(np.sqrt(np.mean(np.square(own)))) if own else 0.0


def _findings(found: Diagnosis) -> str:
    """What is to blame, and what it would mend."""
    if found.verdict == "no_gap":
        return (
            ", no more than noise and the aircraft file's tolerances allow: noise alone would leave "
            f"{percent(found.size.noise_floor)}. No other effect is needed."
        )
    if found.verdict == "unsupported":
        return (
            ", but the flight cannot say why: too little is commanded, or only an autopilot that answers gusts moves "
            "the controls. Fly larger manoeuvres."
        )
    if not found.attribution.causes:
        return (
            ", by more than noise and tolerances allow, and none of the effects known here predicts it: "
            f"{_falls(found, 'with the derivatives within their tolerances')}."
        )
    causes = document(found)["causes"]
    said = " and ".join(_cause(cause) for cause in causes)
    doubt = {
        "ambiguous": " This flight does not settle which.",
        "unknown_effect": " Much remains that no effect known here predicts.",
    }.get(found.verdict, "")
    most = " Most of what the simulator is off by remains." if not doubt and found.size.shrink_percent < 50.0 else ""
    return f". {_share(found)} {said}. With that added, {_falls(found, 'all in all')}.{doubt}{most}"


def _share(found: Diagnosis) -> str:
    """How much of what is above the noise lies at the causes' stations."""
    stations = {cause.candidate.station for cause in found.attribution.causes}
    above = [w for w in found.where if w["station"] != "noise"]
    own = sum(w["share"] for w in above if w["station"] in stations) / max(sum(w["share"] for w in above), 1e-300)
    return f"Noise aside, {percent(own)} of that comes from" if own > 0.5 else "The flight says:"


def _falls(found: Diagnosis, otherwise: str) -> str:
    """The error on flight not fitted, before and after."""
    gap, (low, high) = found.size, found.size.ci95
    whose = "the flight held out" if found.held_out else "parts of the flight that were not fitted"
    if gap.after > 0.95 * gap.before:
        return (
            f"{otherwise}, the error on {whose} is {percent(gap.after)} of the motion; noise alone would leave "
            f"{percent(gap.noise_floor)}"
        )
    return (
        f"the error on {whose} falls from {percent(gap.before)} to {percent(gap.after)} of the motion, "
        f"{number(gap.shrink_percent, 3)} % ({number(low, 3)} to {number(high, 3)}) of what could be closed; noise "
        f"alone would leave {percent(gap.noise_floor)}"
    )


def _blindness(found: Diagnosis) -> str:
    """What was not measured, and what cannot be said without."""
    angles = dict.fromkeys(angle for model in found.models for angle in model.flight.inferred)
    thrust = "" if all(model.flight.metered for model in found.models) else _THRUST
    if not angles:
        return thrust
    known = " and ".join(WORDS[angle] for angle in angles)
    gusts = "What gusts do is not known then."
    return f" Not measured, but inferred from the inertial instruments: {known}. {gusts}{thrust}"


def _quiet(found: Diagnosis) -> str:
    """What of the flight was not looked at."""
    left_out = sum(model.flight.left_out for model in found.models)
    if not left_out:
        return ""
    return (
        f" There is one manoeuvre: {number(left_out, 2)} s of flight without any were left out, and its parts checked."
    )


def _weather(found: Diagnosis) -> str:
    """How much the air moved, where it did."""
    if found.air_motion < _STILL:
        return ""
    return (
        f" The air was not still: across the flight path it moved by {number(found.air_motion, 2)} m/s within "
        "seconds (root mean square), which is taken as weather, not as the aircraft's doing."
    )


def _cause(cause: Mapping[str, Any]) -> str:
    """``actuator lag (time constant 0.110 ± 0.006 s, probability 0.98)``."""
    units = units_of(cause["effect"])
    shown = [
        f"{words_of(name)} {with_interval(value, 1.96 * error)} {units.get(name, '')}".strip()
        for name, (value, error) in cause["parameters"].items()
        if abs(value) > 2.0 * error
    ]
    rivals = cause["indistinguishable_from"]
    beside = f"; or {', '.join(words_of(r) for r in rivals)}" if rivals else ""
    sure = f"probability {likely(cause['probability'])}"
    return f"{words_of(cause['label'])} ({'; '.join([*shown[:4], sure])}{beside})"


def units_of(effect: str) -> dict[str, str]:
    """Units of the parameters of an effect, where they do not depend on the aircraft."""
    layout = Layout(("elevator", "aileron", "rudder"), ("de", "da", "dr"), ())
    return {p.name: "" if p.unit == "1" else p.unit for p in EFFECTS[effect].parameters(layout)}


def percent(share: float) -> str:
    """``38 %``."""
    return f"{number(100.0 * share, 2)} %"
