"""The result of a diagnosis in one paragraph for a pilot."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from sysid_node.gap.diagnose import Diagnosis
from sysid_node.gap.document import document
from sysid_node.gap.residuals.excited_axes import quiet_motions
from sysid_node.gap.short_flights.readings import length_of
from sysid_node.gap.validation.spectral_error import Gap
from sysid_node.report.sections.gap.remainder import what_remains
from sysid_node.report.wording.causes import (
    MEASURED_ON,
    WORDS,
    alike,
    in_pilots_units,
    label_words,
    parameter_words,
    percent,
    units_of,
)
from sysid_node.report.wording.numbers import likely, number, percentage, with_interval

#: Readings that together are an aircraft's response about an axis.
_RESPONSES = {
    "pitch response": ("q", "theta", "alpha", "az"),
    "roll response": ("p", "phi"),
    "yaw response": ("r", "beta", "ay"),
    "forward motion": ("V", "ax"),
}

_TIMES = ("before", "after")

#: Said of flights whose thrust was not recorded, and of those whose flow angles were not measured.
_THRUST = "Thrust was not recorded: it is computed from the aircraft file's drag, and forward motion is not compared."
_GUSTS = "The effect of gusts is therefore unknown."

#: Motion of the air below which the paragraph does not mention it, m/s rms.
_STILL = 0.2


def paragraph(found: Diagnosis) -> str:
    """The size of the gap, its causes and what remains, in whole sentences."""
    return " ".join(part for make in _SENTENCES if (part := make(found)))


def _size(found: Diagnosis) -> str:
    """How large the gap is, and where most: in what the correction reduces most, where causes were found."""
    gap = found.size
    if not found.simulation_gap:
        worst = max(gap.per_channel, key=lambda c: gap.per_channel[c]["before"], default="")
        size = gap.per_channel[worst]["before"] if worst else gap.before
        response = WORDS.get(worst, "response")
        return f"The simulator's {response} differs from the flight's by {percent(size)} of the motion."
    before, after = ({words: _joint_error(gap, n, when) for words, n in _RESPONSES.items()} for when in _TIMES)
    reduction = {words: before[words] ** 2 - after[words] ** 2 for words in _RESPONSES}
    sizes = reduction if found.attribution.causes else before
    worst = max(sizes, key=lambda words: sizes[words])
    every = f"{length_of(found.models[0]):g} s"
    return (
        f"The simulator, restarted every {every} from the measured state, differs from the flight by "
        f"{percent(gap.before)} of the motion, and in its {worst} by {percent(before[worst])}."
    )


def _joint_error(gap: Gap, names: tuple[str, ...], when: str) -> float:
    """Root-mean-square error of several readings, ``before`` or ``after``; 0 where none of them moved."""
    errors = [gap.per_channel[name][when] for name in names if name in gap.per_channel]
    return float(np.sqrt(np.mean(np.square(errors)))) if errors else 0.0


def _findings(found: Diagnosis) -> str:
    """The causes, and how much of the gap their correction removes; or why there are none."""
    if found.verdict == "no_gap":
        return (
            "Noise and the aircraft file's tolerances explain this difference; noise alone would leave "
            f"{percent(found.size.noise_floor)}. No other effect is needed."
        )
    if found.verdict == "unsupported":
        return (
            "This flight cannot show why: the commands are too small, or the controls are moved only by an autopilot "
            "that responds to gusts. Fly larger manoeuvres."
        )
    if not found.attribution.causes:
        return (
            "Noise and tolerances do not explain this difference, and none of the known effects predicts it. "
            f"{_correction(found, 'With the derivatives fitted within their tolerances,')}"
        )
    known = "the simulator has" if found.surrogate else "the aircraft file says"
    causes = " and ".join(_cause(cause, known) for cause in document(found)["causes"])
    return " ".join([f"{_share(found)} {causes}.", _correction(found, "With this correction,"), *_doubts(found)])


def _doubts(found: Diagnosis) -> list[str]:
    """What the diagnosis leaves open."""
    if found.verdict == "ambiguous":
        return ["This flight cannot distinguish the alternatives."]
    if found.verdict == "unknown_effect":
        return [what_remains(found.decision, found.scores)]
    return ["Most of the difference remains."] if found.size.shrink_percent < 50.0 else []


def _share(found: Diagnosis) -> str:
    """How much of the gap above the noise lies at the causes' stations."""
    stations = {cause.candidate.station for cause in found.attribution.causes}
    above = [place for place in found.where if place["station"] != "noise"]
    total = max(sum(place["share"] for place in above), 1e-300)
    share = sum(place["share"] for place in above if place["station"] in stations) / total
    return f"Apart from noise, {percent(share)} of this comes from" if share > 0.5 else "The most probable cause is"


def _correction(found: Diagnosis, condition: str) -> str:
    """The error on flight that was not fitted, before and after; ``condition`` begins the sentence."""
    gap, (low, high) = found.size, found.size.ci95
    flight = MEASURED_ON[found.measured_on]
    left = "Noise alone would leave" if found.simulation_gap else "What follows neither controls nor flow leaves"
    floor = f"{left} {percent(gap.noise_floor)}."
    if gap.after > 0.95 * gap.before:
        return f"{condition} the error on {flight} is {percent(gap.after)} of the motion. {floor}"
    # all that is left counts as noise: nothing scatters
    interval = f" (95 % interval {percentage(low)} to {percentage(high)})" if low < high else ""
    return (
        f"{condition} the error on {flight} falls from {percent(gap.before)} to {percent(gap.after)} of the motion, "
        f"which closes {percentage(gap.shrink_percent)} %{interval} of the gap above the noise. {floor}"
    )


def _air_motion(found: Diagnosis) -> str:
    """How much the air moved, where it did."""
    if found.air_motion < _STILL:
        return ""
    return (
        f"The air moved across the flight path by {number(found.air_motion, 2)} m/s (root mean square, within "
        "seconds); this motion is counted as turbulence, not as an error of the simulator."
    )


def _quiet(found: Diagnosis) -> str:
    """Which motion the commands hardly excite, of which nothing is said."""
    quiet = quiet_motions(found.models)
    return f"The commands hardly excite the {quiet[0]} motion: nothing here is said about it." if quiet else ""


def _unmeasured(found: Diagnosis) -> str:
    """Which signals were not measured, and what the diagnosis cannot say without them."""
    angles = dict.fromkeys(angle for model in found.models for angle in model.flight.inferred)
    known = " and ".join(WORDS[angle] for angle in angles)
    sentences = [f"Not measured, but reconstructed from the inertial instruments: {known}.", _GUSTS] if angles else []
    return " ".join([*sentences, *([] if all(model.flight.metered for model in found.models) else [_THRUST])])


def _surrogate(found: Diagnosis) -> str:
    """How well the model stands for the user's simulator, where it was identified from simulated flights."""
    if found.surrogate is None:
        return ""
    error = found.surrogate.error
    worst, most = max(error.per_channel.items(), key=lambda item: item[1])
    return (
        f"The simulator is known from {number(found.surrogate.fitted_seconds, 3)} s of its own flights. On "
        f"{number(found.surrogate.held_out_seconds, 3)} s more of them this model of it is off by "
        f"{percent(error.total)} of the motion, most in {WORDS.get(worst, worst)} ({percent(most)}); what is smaller "
        "than that cannot be said of the simulator, and counts as noise."
    )


def _left_out(found: Diagnosis) -> str:
    """How much of the flight was not used."""
    seconds = sum(model.flight.left_out for model in found.models)
    if not seconds:
        return ""
    checked = ", and the result was checked on parts of the manoeuvre" if found.measured_on == "parts" else ""
    return f"The flight has one manoeuvre. {number(seconds, 2)} s of flight without a manoeuvre were left out{checked}."


def _cause(cause: Mapping[str, Any], known: str) -> str:
    """``actuator lag (time constant 0.110 ± 0.006 s; probability 0.98)``; ``known`` goes before what was believed."""
    units = units_of(cause["effect"])
    shown = [
        _parameter(name, *in_pilots_units(value, error, units.get(name, "")))
        for name, (value, error) in alike(cause["parameters"]).items()
        if abs(value) > 2.0 * error
    ]
    believed = {
        name: in_pilots_units(value, 0.0, units.get(name, ""))
        for name, value in alike(cause.get("believed", {})).items()
    }
    filed = [f"{parameter_words(n)} {number(v, 3)} {unit}".strip() for n, (v, _, unit) in believed.items()]
    if filed:
        shown = [*shown[:4], f"{known} {', '.join(filed[:4])}"]
    rivals = [label_words(rival) for rival in cause["indistinguishable_from"]]
    alternatives = f"; or {', '.join(rivals)}" if rivals else ""
    probability = f"probability {likely(cause['probability'])}"
    return f"{label_words(cause['label'])} ({'; '.join([*shown[:5], probability])}{alternatives})"


def _parameter(name: str, value: float, error: float, unit: str) -> str:
    """``time constant 0.110 ± 0.006 s``."""
    return f"{parameter_words(name)} {with_interval(value, 1.96 * error)} {unit}".strip()


_SENTENCES = (_size, _findings, _surrogate, _quiet, _air_motion, _unmeasured, _left_out)
