"""The correction that a diagnosis leads to: the aircraft file with what was found, and options for ``simulate``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from sysid_node.aircraft.model import DELAY_EFFECTS, Aircraft, UncertainValue
from sysid_node.flight.record import Array
from sysid_node.gap.diagnose import Diagnosis
from sysid_node.gap.document import parameters, stated_by
from sysid_node.sim.model.parameters import stated_parameters


def corrected_aircraft(found: Diagnosis) -> Aircraft:
    """The aircraft file as the flights have it: derivatives and stated effects within their tolerances, and the causes.

    The causes are among its ``effects`` (a late topic among its ``delays``), each with its standard error as tolerance.
    """
    fit = found.attribution.corrected
    names, point = fit.simulator.names, fit.flights[0].point
    file = fit.simulator.neutral()
    derivatives = {
        n: replace(d, value=float(d.value + _change(names, point, file, f"derivative_error.{n}")))
        for n, d in found.aircraft.derivatives.items()
    }
    effects = _believed_effects(found)
    delays = dict(found.aircraft.delays)
    for effect, values in cause_values(found).items():
        topic = next((t for t, name in DELAY_EFFECTS.items() if name == effect), None)
        if topic is not None and effect not in effects:
            delays[topic] = values["delay"]
        else:
            effects[effect] = {**effects.get(effect, {}), **values}
    return replace(found.aircraft, derivatives=derivatives, effects=effects, delays=delays)


def _change(names: Sequence[str], point: Array, file: Array, name: str) -> float:
    """How far the fit moved a parameter from the aircraft file's value."""
    index = names.index(name)
    return float(point[index] - file[index])


def _believed_effects(found: Diagnosis) -> dict[str, dict[str, UncertainValue]]:
    """The file's effects, with the values that the fit gives those that are nuisance parameters."""
    fit = found.attribution.corrected
    moved, point = set(fit.nuisances.indices), fit.flights[0].point
    effects: dict[str, dict[str, UncertainValue]] = {}
    for effect, values in found.aircraft.effects.items():
        stated = stated_parameters(fit.simulator.layout, effect)
        effects[effect] = {
            name: replace(item, value=stated[name].value(point)) if moved & set(stated[name].entries) else item
            for name, item in values.items()
        }
    return effects


def cause_values(found: Diagnosis) -> dict[str, dict[str, UncertainValue]]:
    """The causes' parameters with their standard errors, by effect; errors of derivatives are not among them."""
    fit, values = found.attribution.corrected, dict[str, dict[str, UncertainValue]]()
    point = fit.flights[0].point
    for cause in found.attribution.causes:
        if cause.candidate.effect == "derivative_error":
            continue
        sizes = parameters(found.attribution.size_fit, cause)
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
