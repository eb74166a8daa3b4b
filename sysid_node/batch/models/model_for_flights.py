"""The rigid-body model that an aircraft file and the measurements of its flights allow."""

from __future__ import annotations

from collections.abc import Sequence

from sysid_node.aircraft.model import Aircraft
from sysid_node.aircraft.names import LATERAL
from sysid_node.batch.models.model import StateSpaceModel
from sysid_node.batch.models.rigid_body import OUTPUTS, STATES, rigid_body
from sysid_node.batch.regression.effective_length import effective_degrees_of_freedom
from sysid_node.batch.settings import DEFAULT_LOW_PASS, BatchSettings
from sysid_node.errors import InputError
from sysid_node.flight.record import FlightRecord

#: Coefficients that each axis' states need, and the states they then allow.
_AXES = {
    ("CL", "Cm"): ("alpha", "q", "theta"),
    LATERAL: ("beta", "p", "r", "phi"),
}
_MODELLED_BY = {"ax": "CD", "ay": "CY", "az": "CL"}


def model_for_flights(
    aircraft: Aircraft, records: Sequence[FlightRecord], settings: BatchSettings, gusts: bool = False
) -> tuple[StateSpaceModel, tuple[str, ...]]:
    """The rigid-body model that the aircraft file and the measurements allow, and remarks on what it leaves out.

    ``gusts``: with states for turbulence. Raises InputError where the derivatives make no complete motion, or where the
    airspeed was not measured.
    """
    remarks = []
    thrust = aircraft.throttle is None or all(record.measured("thrust") for record in records)
    states = settings.states or _possible_states(aircraft, thrust)
    if not settings.states and "CD" in aircraft.model_structure and not thrust:
        remarks.append("thrust was not measured: the airspeed is taken as measured, and CD is left out")
    _check_modellable(aircraft, records, states)
    needs_thrust = aircraft.throttle is not None and thrust
    first = rigid_body(aircraft, states, (), thrust=needs_thrust)
    modelled = {name.partition("_")[0] for name in first.names}
    candidates = [*(name for name in STATES if name in states), *(a for a, c in _MODELLED_BY.items() if c in modelled)]
    measured = [name for name in candidates if all(record.measured(name) for record in records)]
    outputs = [name for name in measured if name in OUTPUTS]
    model = rigid_body(aircraft, states, outputs, use_prior=settings.use_prior, thrust=needs_thrust, gusts=gusts)
    unmeasured = [name for name in states if name not in outputs]
    if unmeasured:
        remarks.append(f"{', '.join(unmeasured)} not measured: known through the other outputs alone")
    return model, tuple(remarks)


def _check_modellable(aircraft: Aircraft, records: Sequence[FlightRecord], states: Sequence[str]) -> None:
    """Raises InputError where there are no states to integrate, or no airspeed."""
    if not states:
        raise InputError(
            f"aircraft {aircraft.name}: its derivatives ({', '.join(aircraft.model_structure)}) make no complete "
            "motion; an equation-error method estimates each coefficient alone"
        )
    unmeasured = [record.name for record in records if not record.measured("V")]
    if unmeasured:
        raise InputError(
            f"flight {unmeasured[0]!r}: its airspeed was never measured, and without it no coefficient makes a force; "
            "record air_data, or leave the flight out"
        )


def require_length(model: StateSpaceModel, aircraft: Aircraft, records: Sequence[FlightRecord]) -> None:
    """Raises InputError where the flights are too short for one of the model's coefficients.

    Each equation must be determined by the flight alone: several outputs respond to the same few motions, so that more
    of them do not make up for a short flight.
    """
    for coefficient, regressors in aircraft.model_structure.items():
        names = [name for name in (f"{coefficient}_{r}" for r in regressors) if name in model.names]
        if names:
            effective_degrees_of_freedom(names, [record.time for record in records], DEFAULT_LOW_PASS)


def _possible_states(aircraft: Aircraft, thrust: bool) -> tuple[str, ...]:
    """The states whose coefficients have derivatives in the aircraft file; ``thrust``: whether it is known."""
    structure = set(aircraft.model_structure)
    possible = {state for needed, states in _AXES.items() if structure.issuperset(needed) for state in states}
    if thrust and {"CL", "CD"} <= structure and "alpha" in possible:
        possible.add("V")
    return tuple(state for state in STATES if state in possible)
