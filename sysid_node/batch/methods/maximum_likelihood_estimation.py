"""Output error and filter error on whole flights: the model for them, the pieces, the start values."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.batch.likelihood.filter_error_problem import FilterErrorProblem
from sysid_node.batch.likelihood.problem import LikelihoodProblem
from sysid_node.batch.likelihood.unknowns import Unknowns
from sysid_node.batch.methods.equation_error import equation_error
from sysid_node.batch.methods.filter_error import filter_error, predict_filter_error
from sysid_node.batch.methods.output_error import OutputErrorProblem, output_error, predict_output_error
from sysid_node.batch.models.manoeuvre import ManoeuvreData
from sysid_node.batch.models.manoeuvres import cut_into_segments, manoeuvre_data, record_for_model
from sysid_node.batch.models.model import StateSpaceModel
from sysid_node.batch.models.model_for_flights import model_for_flights, require_length
from sysid_node.batch.regression.filtering import averaging_factor, block_averaged
from sysid_node.batch.results.batch_fit import BatchFit
from sysid_node.batch.results.response import ModelResponse
from sysid_node.batch.settings import BatchSettings
from sysid_node.errors import InputError
from sysid_node.flight.record import Array, FlightRecord

#: Log of the factor by which the residuals of one set of start values are larger than another's, to be far worse.
_FAR_WORSE = float(np.log(10.0))
_FROM_FILE = (
    "started from the aircraft file's values: with those of equation error the model moves quite otherwise than the "
    "aircraft did"
)


@dataclass(frozen=True)
class MaximumLikelihoodEstimation:
    """One estimation by output error or filter error, set up for given flights."""

    method: str
    aircraft: Aircraft
    settings: BatchSettings
    model: StateSpaceModel
    pieces: tuple[ManoeuvreData, ...]
    remarks: tuple[str, ...]

    @classmethod
    def of(
        cls, method: str, aircraft: Aircraft, records: Sequence[FlightRecord], settings: BatchSettings
    ) -> MaximumLikelihoodEstimation:
        """The estimation set up for these flights. Raises InputError where the model needs what was not measured."""
        model, remarks = model_for_flights(aircraft, records, settings, gusts=method == "filter_error")
        return cls(method, aircraft, settings, model, (), remarks).on(records)

    def on(self, records: Sequence[FlightRecord]) -> MaximumLikelihoodEstimation:
        """The same model, and so the same compiled program, set up for other flights.

        Raises InputError where these are too short.
        """
        require_length(self.model, self.aircraft, records)
        pieces = [_pieces(self.method, self.model, self.aircraft, record, self.settings) for record in records]
        here = replace(self, pieces=tuple(piece for several in pieces for piece in several))
        started, remark = _started(self.model, self.aircraft, records)
        there = replace(here, model=started)
        # a filter is corrected at every output, so that its predictions do not diverge
        if self.method == "output_error" and there._misfit() - here._misfit() > _FAR_WORSE:
            return replace(here, remarks=(*self.remarks, _FROM_FILE))
        return replace(there, remarks=(*self.remarks, *remark))

    def fit(self) -> BatchFit:
        """The fit, with the responses to the pieces of each flight joined. Raises InputError as the method does."""
        states, biases = self.model.states, self.settings.biases
        if self.method == "filter_error":
            fit = filter_error(self.model, self.pieces, initial_states=states, biases=biases, correlated=True)
        else:
            fit = output_error(self.model, self.pieces, initial_states=states, biases=biases)
        return replace(fit, responses=_joined(fit.responses), remarks=(*self.remarks, *fit.remarks))

    def linearised(self, fit: BatchFit) -> tuple[Callable[[Sequence[FlightRecord]], Array], Array]:
        """All residuals (N,) in units of the noise, as a function of the flights, and their Jacobian (N, n).

        Both with the unknowns (n,) that the search of ``fit`` ended with; the Jacobian is with respect to these.
        """
        assert fit.search.unknowns is not None
        z, base = fit.search.unknowns, self._problem(self.pieces)
        noise = base.noise(z)

        def residuals(records: Sequence[FlightRecord]) -> Array:
            pieces = [_pieces(self.method, self.model, self.aircraft, record, self.settings) for record in records]
            return self._problem([piece for several in pieces for piece in several]).residuals(z, noise)

        return residuals, base.jacobian(z, noise)

    def _misfit(self) -> float:
        """The mean logarithm of the residuals' standard deviations at the start values; inf where these diverge."""
        problem = self._problem(self.pieces)
        with np.errstate(over="ignore", invalid="ignore"):
            found = float(np.mean(np.log(np.diag(problem.noise(problem.start())))))
        return found if np.isfinite(found) else np.inf

    def _problem(self, pieces: Sequence[ManoeuvreData]) -> LikelihoodProblem:
        unknowns = Unknowns.of(self.model, pieces, self.model.states, self.settings.biases)
        if self.method == "filter_error":
            return FilterErrorProblem(unknowns, correlated=True)
        return OutputErrorProblem(unknowns)

    def responses(self, fit: BatchFit, record: FlightRecord) -> list[ModelResponse]:
        """The fitted model's response to another flight; of filter error, its one-step predictions."""
        pieces = _pieces(self.method, self.model, self.aircraft, record, self.settings)
        nuisances = {"initial_states": self.model.states, "biases": self.settings.biases}
        if self.method == "filter_error":
            return _joined(predict_filter_error(self.model, pieces, fit.values, fit.extras, **nuisances))
        return _joined(predict_output_error(self.model, pieces, fit.values, **nuisances))


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
    """The flight in pieces.

    Output error integrates at the full rate and averages the outputs, measured and modelled. A filter corrects the
    state at every output, so that its inputs are averaged as well.
    """
    record = record_for_model(model, aircraft, record)
    if method == "filter_error":
        return [
            manoeuvre_data(model, piece)
            for piece in cut_into_segments(block_averaged(record, settings.rate), settings.segment)
        ]
    every = averaging_factor(record, settings.rate)
    return [manoeuvre_data(model, piece, every=every) for piece in cut_into_segments(record, settings.segment)]


def _joined(responses: Sequence[ModelResponse]) -> list[ModelResponse]:
    """The responses to the pieces of each flight as one."""
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
