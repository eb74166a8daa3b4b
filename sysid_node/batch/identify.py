"""Identification of an aircraft from flights by any batch method, checked on flights held out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.aircraft.stated_effects import as_estimated, not_taken_in_words, with_places_from_cg
from sysid_node.batch.data_compatibility import check_sensors, corrected
from sysid_node.batch.methods.constrained_least_squares import FORGETTING, WINDOW, constrained_least_squares
from sysid_node.batch.methods.equation_error import equation_error
from sysid_node.batch.methods.error_filtering import error_filtering
from sysid_node.batch.methods.frequency_equation_error import frequency_equation_error
from sysid_node.batch.methods.joint_estimation import KALMAN_FILTERS, JointEstimation
from sysid_node.batch.methods.maximum_likelihood_estimation import MaximumLikelihoodEstimation
from sysid_node.batch.methods.neural_gauss_newton import neural_gauss_newton
from sysid_node.batch.methods.recursive_least_squares import recursive_least_squares
from sysid_node.batch.models.rigid_body import STATES
from sysid_node.batch.models.stretches import interruptions_in_words, stretches
from sysid_node.batch.regression.filtering import lowpass
from sysid_node.batch.regression.measured_coefficients import measured_coefficients
from sysid_node.batch.regression.regressors import regressor_matrix
from sysid_node.batch.regression.stepwise import StepwiseSelection, supported_model
from sysid_node.batch.results.batch_fit import BatchFit
from sysid_node.batch.results.response import ModelResponse
from sysid_node.batch.results.validation import figures_of_merit
from sysid_node.batch.settings import BatchSettings
from sysid_node.batch.systematic.dead_sensors import without_dead_sensors
from sysid_node.batch.systematic.flight_posterior import FlightPosterior, flight_posterior
from sysid_node.batch.systematic.gust_bias import with_gust_bias, with_unconfirmed_named
from sysid_node.batch.systematic.online_passes import OnlineEstimate, online_estimates, online_passes
from sysid_node.batch.systematic.sensitivities import LikelihoodResponse, RegressionResponse, Response
from sysid_node.batch.systematic.stated_errors import without_stated_errors
from sysid_node.batch.systematic.systematic_errors import on_time, with_systematic_errors
from sysid_node.errors import InputError
from sysid_node.flight.record import Array, FlightRecord

#: Methods that regress each coefficient on measured signals.
_REGRESSIONS: dict[str, Callable[[Aircraft, Sequence[FlightRecord], BatchSettings], BatchFit]] = {
    "equation_error": lambda a, records, s: equation_error(a, records, s.low_pass),
    "frequency_equation_error": lambda a, records, s: frequency_equation_error(a, records, s.frequencies),
    "recursive_least_squares": lambda a, records, _: recursive_least_squares(a, records),
    "error_filtering": lambda a, records, _: error_filtering(a, records),
    "constrained_least_squares": lambda a, records, _: constrained_least_squares(a, records),
    "neural_gauss_newton": lambda a, records, s: neural_gauss_newton(a, records, s.low_pass),
}
#: Methods that integrate a model.
_SEARCHES = ("output_error", "filter_error")
METHODS = (*_REGRESSIONS, *_SEARCHES, *KALMAN_FILTERS)
#: Methods that estimate the motion of the air, so that gusts do not bias them.
_MODELS_GUSTS = frozenset({"filter_error"})

#: Of regressions that do not weigh all of the signals alike: low-pass (Hz), and the share of its weight that a sample
#: keeps in a second.
_FILTERS: dict[str, Callable[[BatchSettings], tuple[float, float]]] = {
    "equation_error": lambda s: (s.low_pass, 1.0),
    "neural_gauss_newton": lambda s: (s.low_pass, 1.0),
    "frequency_equation_error": lambda s: (s.frequencies[2], 1.0),
    "constrained_least_squares": lambda _: (0.0, FORGETTING ** (1.0 / WINDOW)),
}

_NOT_CONSIDERED = (
    "intervals hold noise alone: what the tolerances of aircraft and instruments add could not be computed, because "
    "the online estimator finds no solution in these flights"
)

#: Flight -> output or coefficient -> figure of merit -> value.
FiguresByFlight = dict[str, dict[str, dict[str, float]]]


@dataclass(frozen=True)
class Identification:
    """A fit, the coefficients of the fitted flights, and figures of merit on the flights held out.

    ``coefficients``: measured and modelled, below ``low_pass``. ``selections`` holds the stepwise selection of each
    coefficient's regressors, where one was made.
    """

    fit: BatchFit
    coefficients: Sequence[ModelResponse]
    holdout: FiguresByFlight
    selections: Mapping[str, StepwiseSelection]


def identify(
    method: str,
    aircraft: Aircraft,
    records: Sequence[FlightRecord],
    settings: BatchSettings,
    holdout: Sequence[FlightRecord] = (),
) -> Identification:
    """The derivatives of the aircraft file estimated from ``records``, and checked on ``holdout``.

    Servos and clocks that the flights show to be late are corrected in them first. What the tolerances of the aircraft
    file leave open goes into the intervals. Raises InputError for an unknown method or no flight, and as the method
    does.
    """
    if method not in METHODS:
        raise InputError(f"method {method!r}: expected one of {', '.join(METHODS)}")
    if not records:
        raise InputError("no flight to identify from; give at least one")
    flights = _prepared(method, as_estimated(aircraft), _named(records), _named(holdout), settings)
    fit, predict = _fitted_with_systematic_errors(method, flights, settings)
    fit = without_dead_sensors(fit, aircraft, records)
    figures: FiguresByFlight = {}
    for record in flights.holdout:
        coefficients = predicted_coefficients(flights.aircraft, fit.values, [record], settings.low_pass)
        figures[record.name] = _figures_of_flight(flights.aircraft, record, [*coefficients, *predict(record)])
    return Identification(
        replace(fit, remarks=(*flights.remarks, *fit.remarks)),
        predicted_coefficients(flights.aircraft, fit.values, flights.records, settings.low_pass),
        figures,
        flights.selections,
    )


def _in_stretches(
    method: str, aircraft: Aircraft, records: Sequence[FlightRecord], settings: BatchSettings
) -> tuple[list[FlightRecord], list[str]]:
    """The flights cut at interruptions where the ``method`` integrates, and remarks on it.

    Samples that lack what it needs are left out. Regressions need no cut, and leave out such samples themselves; output
    error needs no output at every sample.
    """
    if method in _REGRESSIONS:
        told = (interruptions_in_words(record, settings.max_gap) for record in records)
        return list(records), [text for text in told if text]
    needed = [*aircraft.control_symbols, "thrust", "rho"]
    if method != "output_error":
        needed += [*STATES, "ax", "ay", "az"]
    cut = [stretches(record, needed, settings.max_gap) for record in records]
    return [part for parts, _ in cut for part in parts], [remark for _, remarks in cut for remark in remarks]


@dataclass(frozen=True)
class _PreparedFlights:
    """Flights with sensors and clocks corrected, and the derivatives that are to be estimated from them."""

    aircraft: Aircraft
    recorded: Sequence[FlightRecord]  # stretches without interruption, with corrected sensors, clocks as recorded
    records: Sequence[FlightRecord]  # the same with corrected clocks
    holdout: Sequence[FlightRecord]
    posterior: FlightPosterior | None  # of the imperfections
    online: Mapping[str, OnlineEstimate]
    selections: Mapping[str, StepwiseSelection]
    remarks: Sequence[str]


def _prepared(
    method: str,
    aircraft: Aircraft,
    records: Sequence[FlightRecord],
    holdout: Sequence[FlightRecord],
    settings: BatchSettings,
) -> _PreparedFlights:
    """What is fitted: the flights after all corrections that the settings and the aircraft file ask for."""
    remarks = [told] if (told := not_taken_in_words(aircraft)) else []
    records, holdout = ([without_stated_errors(aircraft, one) for one in some] for some in (records, holdout))
    selections: Mapping[str, StepwiseSelection] = {}
    if settings.correct_sensors:
        found = check_sensors(aircraft, _in_stretches(method, aircraft, records, settings)[0], settings.segment or 10.0)
        records, holdout = ([corrected(one, found.fit.values) for one in some] for some in (records, holdout))
        remarks += found.remarks
    if settings.stepwise:
        before = aircraft.derivatives
        aircraft, selections = supported_model(aircraft, records, settings.low_pass)
        left_out = [name for name in before if name not in aircraft.derivatives]
        remarks.append(f"stepwise regression left out {', '.join(left_out) or 'nothing'}")
    passes = online_passes(aircraft, records, settings)  # of whole flights: it stands short interruptions
    posterior = flight_posterior(passes)
    recorded, cut = _in_stretches(method, aircraft, records, settings)
    records, (holdout, _) = recorded, _in_stretches(method, aircraft, holdout, settings)
    remarks += cut
    if posterior is not None:
        records, holdout = on_time(aircraft, records, posterior), on_time(aircraft, holdout, posterior)
    elif _uncertain(aircraft):
        remarks.append(_NOT_CONSIDERED)
    online = online_estimates(passes)
    return _PreparedFlights(
        with_places_from_cg(aircraft), recorded, records, holdout, posterior, online, selections, remarks
    )


def _fitted_with_systematic_errors(
    method: str, flights: _PreparedFlights, settings: BatchSettings
) -> tuple[BatchFit, Callable[[FlightRecord], Sequence[ModelResponse]]]:
    """The fit, its intervals widened by what the tolerances leave open, and the fitted model's outputs of a flight."""
    aircraft, records = flights.aircraft, flights.records
    try:
        fit, predict, response = _fitted(method, aircraft, records, settings)
        fit = _with_other_errors(fit, flights, response, models_gusts=method in _MODELS_GUSTS)
    except (np.linalg.LinAlgError, ArithmeticError) as error:
        names = ", ".join(record.name for record in records)
        raise InputError(
            f"{names}: {method} finds no solution ({' '.join(str(error).split())}); the motion does not determine the "
            "model: give flights that excite it, or a simpler model"
        ) from error
    return fit, predict


def _with_other_errors(
    fit: BatchFit, flights: _PreparedFlights, response: Callable[[], Response], *, models_gusts: bool
) -> BatchFit:
    """The fit with intervals that hold what gusts do to the method, and what the tolerances leave open."""
    if flights.posterior is not None:
        return with_systematic_errors(
            flights.aircraft,
            flights.recorded,
            fit,
            flights.posterior,
            response(),
            flights.online,
            models_gusts=models_gusts,
        )
    if models_gusts:
        return with_unconfirmed_named(fit, flights.online)
    return with_gust_bias(fit, flights.online, np.zeros(len(fit.estimates)))


def refuse_unused(method: str, settings: Mapping[str, object]) -> None:
    """Raise InputError where a setting is given, as of ``BatchSettings``, that the method does not use."""
    unused = [] if method == "frequency_equation_error" else ["frequencies"]
    if method in _REGRESSIONS:
        unused += ["rate", "states", "biases", "use_prior"]
    if method not in KALMAN_FILTERS:
        unused.append("process_noise")
    if method not in _SEARCHES and not BatchSettings.from_mapping(settings).correct_sensors:
        unused.append("segment")
    given = [key for key in settings if key in unused]
    if given and method in METHODS:
        raise InputError(f"setting {given[0]!r} is not used by {method}; leave it out, or choose another method")


def _fitted(
    method: str, aircraft: Aircraft, records: Sequence[FlightRecord], settings: BatchSettings
) -> tuple[BatchFit, Callable[[FlightRecord], Sequence[ModelResponse]], Callable[[], Response]]:
    """The fit, a function from a flight to the fitted model's outputs, and what makes its response to other records.

    Regressions model no outputs.
    """
    if method in _REGRESSIONS:
        fit = _REGRESSIONS[method](aircraft, records, settings)
        low_pass, kept = _FILTERS[method](settings) if method in _FILTERS else (0.0, 1.0)
        return fit, lambda _: (), lambda: RegressionResponse(aircraft, records, fit.values, low_pass, kept)
    if method in KALMAN_FILTERS:
        joint = JointEstimation.of(method, aircraft, records, settings)
        fit = joint.fit()
        return fit, lambda record: joint.responses(fit, record), lambda: partial(joint.changed, fit)
    search = MaximumLikelihoodEstimation.of(method, aircraft, records, settings)
    fit = search.fit()

    def response() -> Response:
        residuals, jacobian = search.linearised(fit)
        return LikelihoodResponse(residuals, records, jacobian, len(fit.estimates))

    return fit, lambda record: search.responses(fit, record), response


def _uncertain(aircraft: Aircraft) -> bool:
    """Whether the aircraft file has any tolerance."""
    return any(sigma > 0.0 for sigma in aircraft.tolerances.values())


def _named(records: Sequence[FlightRecord]) -> list[FlightRecord]:
    """The records under unique names."""
    names: list[str] = []
    for record in records:
        name = record.name or "flight"
        names.append(name if name not in names else f"{name} ({names.count(name) + 1 + len(names)})")
    return [replace(record, name=name) for record, name in zip(records, names, strict=True)]


def predicted_coefficients(
    aircraft: Aircraft, values: Mapping[str, float], records: Sequence[FlightRecord], low_pass: float
) -> list[ModelResponse]:
    """Measured coefficients and those modelled with ``values``, below ``low_pass`` Hz, of each flight that has them."""
    responses = []
    for record in records:
        try:
            flight = measured_coefficients(aircraft, record)
        except InputError:
            continue  # a flight without a sideslip vane, say, can be integrated, but has no measured coefficients
        modelled: dict[str, Array] = {}
        for coefficient, regressors in aircraft.model_structure.items():
            names = [f"{coefficient}_{name}" for name in regressors]
            if coefficient in flight.coefficients and all(name in values for name in names):
                modelled[coefficient] = regressor_matrix(flight, regressors) @ np.array(
                    [values[name] for name in names]
                )
        if modelled:
            measured = np.column_stack([flight.coefficients[name] for name in modelled])
            shown = [lowpass(flight.time, X, low_pass) for X in (measured, np.column_stack(list(modelled.values())))]
            responses.append(ModelResponse(flight.name, flight.time, tuple(modelled), *shown))
    return responses


def _figures_of_flight(
    aircraft: Aircraft, record: FlightRecord, responses: Sequence[ModelResponse]
) -> dict[str, dict[str, float]]:
    """The figures of merit of all responses to one flight."""
    table: dict[str, dict[str, float]] = {}
    for response in responses:
        inputs = {
            symbol: np.interp(response.time, record.time, record[symbol])
            for symbol in aircraft.control_symbols
            if np.isfinite(record[symbol]).all()
        }
        table |= figures_of_merit(response, inputs)
    return table
