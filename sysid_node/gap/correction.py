"""The correction that a diagnosis leads to: the aircraft file with what was found, and options for ``simulate``."""

from __future__ import annotations

from dataclasses import replace

from sysid_node.aircraft.model import DELAY_EFFECTS, Aircraft, UncertainValue
from sysid_node.gap.diagnose import Diagnosis
from sysid_node.gap.document import parameters, stated_by


def corrected_aircraft(found: Diagnosis) -> Aircraft:
    """The aircraft file with the derivatives as the flights have them within their tolerances, and with the causes.

    The causes are among its ``effects`` (a late topic among its ``delays``), each with its standard error as tolerance.
    All other effects of the file stay as it states them: what was fitted of them within their tolerances is no finding.
    """
    fit = found.attribution.corrected
    change = dict(zip(fit.simulator.names, (fit.flights[0].point - fit.simulator.neutral()).tolist(), strict=True))
    derivatives = {
        n: replace(d, value=d.value + change[f"derivative_error.{n}"]) for n, d in found.aircraft.derivatives.items()
    }
    effects = dict(found.aircraft.effects)
    delays = dict(found.aircraft.delays)
    for effect, values in cause_values(found).items():
        topic = next((t for t, name in DELAY_EFFECTS.items() if name == effect), None)
        if topic is not None and effect not in effects:
            delays[topic] = values["delay"]
        else:
            effects[effect] = {**effects.get(effect, {}), **values}
    return replace(found.aircraft, derivatives=derivatives, effects=effects, delays=delays)


def cause_values(found: Diagnosis) -> dict[str, dict[str, UncertainValue]]:
    """The causes' parameters with their standard errors, by effect; errors of derivatives are not among them."""
    fit, values = found.attribution.corrected, dict[str, dict[str, UncertainValue]]()
    point = fit.flights[0].point
    for cause in found.attribution.causes:
        if cause.candidate.effect == "derivative_error":
            continue
        sizes = parameters(found.attribution.size_fit, cause, found.attribution.causes)
        stated = stated_by(cause.candidate, fit.simulator, cause.candidate.entries)
        of_effect = values.setdefault(cause.candidate.effect, {})
        for name, (_, error) in sizes.items():
            of_effect[name] = UncertainValue(stated[name].value(point), error)
    return {effect: of_effect for effect, of_effect in values.items() if of_effect}


def effect_options(found: Diagnosis) -> list[str]:
    """The causes as ``sysid simulate --effect`` takes them; the derivatives' errors are in the corrected file."""
    return [
        ":".join([effect, *(f"{name}={item.value:.6g}" for name, item in values.items())])
        for effect, values in cause_values(found).items()
    ]
