"""Output error and filter error on whole flights: the model that was measured for, the pieces, the start values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.batch.methods.equation_error import DEFAULT_LOW_PASS, equation_error
from sysid_node.batch.methods.filter_error import filter_error, predict_filter_error
from sysid_node.batch.methods.output_error import output_error, predict_output_error
from sysid_node.batch.models.manoeuvres import cut_into_segments, manoeuvre_data, with_forces_at_cg
from sysid_node.batch.models.model import ManoeuvreData, StateSpaceModel
from sysid_node.batch.models.rigid_body import AT_CG, OUTPUTS, STATES, rigid_body
from sysid_node.batch.regression.effective_length import effective_degrees_of_freedom
from sysid_node.batch.regression.filtering import averaging_factor, block_averaged
from sysid_node.batch.results.batch_fit import BatchFit, ModelResponse
from sysid_node.batch.settings import BatchSettings
from sysid_node.errors import InputError
from sysid_node.flight.record import FlightRecord

#: Coefficients that each axis' states need, and the states they then allow.
_AXES = {
    ("CL", "Cm"): ("alpha", "q", "theta"),
    ("CY", "Cl", "Cn"): ("beta", "p", "r", "phi"),
}
_MODELLED_BY = {"ax": "CD", "ay": "CY", "az": "CL"}


@dataclass(frozen=True)
class StateSpaceEstimation:
    """One estimation by a method that integrates the equations of motion."""

    method: str
    aircraft: Aircraft
    settings: BatchSettings
    model: StateSpaceModel
    pieces: tuple[ManoeuvreData, ...]
    remarks: tuple[str, ...]

    @classmethod
    def of(
        cls, method: str, aircraft: Aircraft, records: Sequence[FlightRecord], settings: BatchSettings
    ) -> StateSpaceEstimation:
        """Raises InputError where the model needs what was not measured."""
        model, remarks = model_for_flights(aircraft, records, settings, gusts=method == "filter_error")
        return cls(method, aircraft, settings, model, (), remarks).on(records)

    def on(self, records: Sequence[FlightRecord]) -> StateSpaceEstimation:
        """The same model, and so the same compiled program, set up for other flights.

        Raises InputError where these are too short.
        """
        _require_length(self.model, self.aircraft, records)
        started, remark = _started(self.model, self.aircraft, records)
        pieces = [_pieces(self.method, started, self.aircraft, record, self.settings) for record in records]
        flat = tuple(piece for several in pieces for piece in several)
        return replace(self, model=started, pieces=flat, remarks=(*self.remarks, *remark))

    def fit(self) -> BatchFit:
        """The estimation."""
        states, biases = self.model.states, self.settings.biases
        if self.method == "filter_error":
            fit = filter_error(self.model, self.pieces, initial_states=states, biases=biases, correlated=True)
        else:
            fit = output_error(self.model, self.pieces, initial_states=states, biases=biases)
        return replace(fit, responses=_joined(fit.responses), remarks=(*self.remarks, *fit.remarks))

    def responses(self, fit: BatchFit, record: FlightRecord) -> list[ModelResponse]:
        """The fit's answer to another flight: open loop with its own initial states, or one sample ahead."""
        pieces = _pieces(self.method, self.model, self.aircraft, record, self.settings)
        own = {"initial_states": self.model.states, "biases": self.settings.biases}
        if self.method == "filter_error":
            return _joined(predict_filter_error(self.model, pieces, fit.values, fit.extras, **own))
        return _joined(predict_output_error(self.model, pieces, fit.values, **own))


def model_for_flights(
    aircraft: Aircraft, records: Sequence[FlightRecord], settings: BatchSettings, gusts: bool = False
) -> tuple[StateSpaceModel, tuple[str, ...]]:
    """The rigid-body model that the aircraft file and the measurements allow, and what had to be left out.

    ``gusts``: with states for turbulence.
    """
    remarks = []
    thrust = aircraft.throttle is None or all(record.measured("thrust") for record in records)
    states = settings.states or _possible_states(aircraft, thrust)
    if not settings.states and "CD" in aircraft.structure and not thrust:
        remarks.append("thrust was not measured: the airspeed is taken as measured, and CD is left out")
    if not states:
        raise InputError(
            f"aircraft {aircraft.name}: its derivatives ({', '.join(aircraft.structure)}) make no complete motion; an "
            "equation-error method estimates each coefficient alone"
        )
    unflown = [record.name for record in records if not record.measured("V")]
    if unflown:
        raise InputError(
            f"flight {unflown[0]!r}: its airspeed was never measured, and without it no coefficient makes a force; "
            "record air_data, or leave the flight out"
        )
    needs_thrust = aircraft.throttle is not None and thrust
    first = rigid_body(aircraft, states, (), thrust=needs_thrust)
    modelled = {name.partition("_")[0] for name in first.names}
    candidates = [*(name for name in STATES if name in states), *(a for a, c in _MODELLED_BY.items() if c in modelled)]
    measured = [name for name in candidates if all(record.measured(name) for record in records)]
    outputs = [name for name in measured if name in OUTPUTS]
    model = rigid_body(aircraft, states, outputs, use_prior=settings.use_prior, thrust=needs_thrust, gusts=gusts)
    lost = [name for name in states if name not in outputs]
    if lost:
        remarks.append(f"{', '.join(lost)} not measured: known through the other outputs alone")
    return model, tuple(remarks)


def _require_length(model: StateSpaceModel, aircraft: Aircraft, records: Sequence[FlightRecord]) -> None:
    """Raises InputError where the flights are too short for one of the model's coefficients.

    Outputs and states tell of the same few motions: they do not make up for a flight that ends before it has begun.
    """
    for coefficient, regressors in aircraft.structure.items():
        names = [name for name in (f"{coefficient}_{r}" for r in regressors) if name in model.names]
        if names:
            effective_degrees_of_freedom(names, [record.time for record in records], DEFAULT_LOW_PASS)


def _possible_states(aircraft: Aircraft, thrust: bool) -> tuple[str, ...]:
    structure = set(aircraft.structure)
    possible = {state for needed, states in _AXES.items() if structure.issuperset(needed) for state in states}
    if thrust and {"CL", "CD"} <= structure and "alpha" in possible:
        possible.add("V")
    return tuple(state for state in STATES if state in possible)


def _started(
    model: StateSpaceModel, aircraft: Aircraft, records: Sequence[FlightRecord]
) -> tuple[StateSpaceModel, tuple[str, ...]]:
    """The model with start values from equation error where that is possible, else the aircraft file's."""
    try:
        found = equation_error(aircraft, records).estimates
    except InputError as error:
        return model, (f"started from the aircraft file's values, equation error being impossible: {error}",)
    return model.started_at({name: e.value for name, e in found.items() if e.valid and name in model.names}), ()


def _pieces(
    method: str, model: StateSpaceModel, aircraft: Aircraft, record: FlightRecord, settings: BatchSettings
) -> list[ManoeuvreData]:
    """The flight in pieces. Output error integrates at the full rate and averages the outputs, measured and modelled;
    a filter, which must correct the state at every output, gets averaged inputs as well.
    """
    if set(AT_CG) & set(model.inputs):
        record = with_forces_at_cg(aircraft, record)
    if not record.measured("rho"):
        density = np.full(len(record), aircraft.reference.air_density)
        record = replace(record, columns={**record.columns, "rho": density})
    if method == "filter_error":
        return [
            manoeuvre_data(model, piece)
            for piece in cut_into_segments(block_averaged(record, settings.rate), settings.segment)
        ]
    every = averaging_factor(record, settings.rate)
    return [manoeuvre_data(model, piece, every=every) for piece in cut_into_segments(record, settings.segment)]


def _joined(responses: Sequence[ModelResponse]) -> list[ModelResponse]:
    """The answers to the pieces of each flight as one."""
    flights: dict[str, list[ModelResponse]] = {}
    for response in responses:
        flights.setdefault(response.name.partition(" [")[0], []).append(response)
    return [_concatenated(name, parts) for name, parts in flights.items()]


def _concatenated(name: str, parts: Sequence[ModelResponse]) -> ModelResponse:
    step = float(np.median(np.diff(parts[0].time)))
    starts = np.cumsum([0.0, *(part.time[-1] + step for part in parts[:-1])])
    return ModelResponse(
        name,
        np.concatenate([start + part.time for start, part in zip(starts, parts, strict=True)]),
        parts[0].names,
        np.concatenate([part.measured for part in parts]),
        np.concatenate([part.modelled for part in parts]),
    )
