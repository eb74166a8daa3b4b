"""The Kalman filters of state and parameters on whole flights: their model, what they are told, and their fit.

The filters start from the aircraft file: a derivative's value, uncertain by its tolerance. Sensor noise is the file's.
Process noise is that of light turbulence (``PROCESS_NOISE``), times the setting ``process_noise``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.batch.likelihood.joint_kalman_filter import FilterNoise, FilterSteps, filter_along, one_step_predictions
from sysid_node.batch.methods.extended_kalman_filter import EXTENDED
from sysid_node.batch.methods.iterated_kalman_filter import ITERATED
from sysid_node.batch.methods.unscented_kalman_filter import UNSCENTED
from sysid_node.batch.models.manoeuvre import ManoeuvreData
from sysid_node.batch.models.manoeuvres import manoeuvre_data, record_for_model
from sysid_node.batch.models.model import StateSpaceModel
from sysid_node.batch.models.model_for_flights import model_for_flights, require_length
from sysid_node.batch.regression.filtering import averaging_factor, block_averaged
from sysid_node.batch.regression.prior import tolerance_of
from sysid_node.batch.results.batch_fit import BatchFit, SearchEnd
from sysid_node.batch.results.estimate import ParameterEstimate
from sysid_node.batch.results.identifiability import identifiability_remarks
from sysid_node.batch.results.parameter_track import ParameterTrack
from sysid_node.batch.results.response import ModelResponse
from sysid_node.batch.settings import BatchSettings
from sysid_node.errors import InputError
from sysid_node.flight.record import Array, FlightRecord

KALMAN_FILTERS: dict[str, FilterSteps] = {
    "extended_kalman_filter": EXTENDED,
    "iterated_kalman_filter": ITERATED,
    "unscented_kalman_filter": UNSCENTED,
}

#: Process noise in light turbulence, 1 sigma, unit of the state per root second. Gusts move airspeed and flow angles
#: (0.5 m/s per root second at 15 m/s), and the turning of the air moves the rates; chosen for small aircraft. The
#: HFB-320 at 105 m/s has 3.6 m/s, 0.024 rad, 0.017 rad/s (q) and 0.0045 rad (theta) in the published analysis.
PROCESS_NOISE = {
    **{"V": 0.4, "alpha": 0.03, "beta": 0.04, "p": 0.3, "q": 0.1, "r": 0.1},
    **{"phi": 1e-3, "theta": 1e-3},
}

#: Kind of the aircraft file's noise by output, where it is not the output's own name.
_NOISE_KINDS = {
    **{"V": "airspeed", "p": "gyro", "q": "gyro", "r": "gyro", "phi": "attitude", "theta": "attitude"},
    **{"ax": "accel", "ay": "accel", "az": "accel"},
}

#: 1 sigma of the initial value of a state that is not measured: m/s, rad, rad/s.
_UNMEASURED = {**dict.fromkeys(("alpha", "beta", "p", "q", "r", "phi", "theta"), 0.1), "V": 1.0}

#: An estimate whose error is still this share of its start value's has learnt nothing from the flight.
_NOT_EXCITED = 0.95


@dataclass(frozen=True)
class JointEstimation:
    """One estimation by a Kalman filter of state and parameters; the flights are whole, whatever ``segment`` says."""

    method: str
    aircraft: Aircraft
    settings: BatchSettings
    model: StateSpaceModel
    manoeuvres: tuple[ManoeuvreData, ...]
    noise: FilterNoise
    remarks: tuple[str, ...]

    @classmethod
    def of(
        cls, method: str, aircraft: Aircraft, records: Sequence[FlightRecord], settings: BatchSettings
    ) -> JointEstimation:
        """The estimation set up for these flights.

        Raises InputError where the model needs what was not measured, where the flights are too short, and where
        ``settings`` ask for biases, which the filters do not estimate.
        """
        if settings.biases:
            raise InputError(
                f"setting biases: {method} estimates no biases; leave them out, or use output_error or filter_error"
            )
        model, remarks = model_for_flights(aircraft, records, settings)
        require_length(model, aircraft, records)
        manoeuvres = tuple(_manoeuvre(model, aircraft, record, settings) for record in records)
        averaged = min(averaging_factor(record, settings.rate) for record in records)
        noise = filter_noise(model, aircraft, averaged, settings.process_noise)
        return cls(method, aircraft, settings, model, manoeuvres, noise, remarks)

    def fit(self) -> BatchFit:
        """The estimates after the last sample, with their track; the responses are one-step predictions with them.

        Raises InputError where an output has gaps or the filter diverges.
        """
        track = filter_along(self.model, self.manoeuvres, self.noise, KALMAN_FILTERS[self.method])
        values = dict(zip(track.names, (float(v) for v in track.values[-1]), strict=True))
        responses = self._predicted(values, self.manoeuvres)
        residuals = np.concatenate([response.residuals for response in responses])
        deviation = np.sqrt(np.mean(residuals**2, axis=0))
        samples = sum(len(manoeuvre) for manoeuvre in self.manoeuvres)
        return BatchFit(
            method=self.method,
            estimates=self._assessed(track),
            covariance=track.covariance,
            noise=dict(zip(self.model.outputs, deviation.tolist(), strict=True)),
            log_det=float(2.0 * np.sum(np.log(np.maximum(deviation, 1e-300)))),
            responses=responses,
            search=SearchEnd(
                converged=True,
                iterations=1,
                message=f"one pass along {samples} samples, started at the aircraft file's values within its "
                "tolerances",
            ),
            remarks=(*self.remarks, *identifiability_remarks(track.covariance, track.names, ())),
            extras=self._noise_levels(),
            track=track,
        )

    def changed(self, fit: BatchFit, records: Sequence[FlightRecord]) -> Array:
        """(P,) by how much the estimates differ from those of ``fit`` where other records are filtered."""
        assert fit.track is not None
        others = [_manoeuvre(self.model, self.aircraft, record, self.settings) for record in records]
        found = filter_along(self.model, others, self.noise, KALMAN_FILTERS[self.method])
        return np.asarray(found.values[-1] - fit.track.values[-1])

    def responses(self, fit: BatchFit, record: FlightRecord) -> list[ModelResponse]:
        """One-step predictions of another flight with the parameters of ``fit``; raises InputError as ``fit`` does."""
        return self._predicted(fit.values, [_manoeuvre(self.model, self.aircraft, record, self.settings)])

    def _predicted(self, values: dict[str, float], manoeuvres: Sequence[ManoeuvreData]) -> list[ModelResponse]:
        steps = KALMAN_FILTERS[self.method]
        return one_step_predictions(self.model.started_at(values), manoeuvres, self.noise, steps)

    def _assessed(self, track: ParameterTrack) -> dict[str, ParameterEstimate]:
        """The final estimates; not valid where the flight added nothing to what the aircraft file says."""
        start = dict(zip(track.names, self.noise.start[len(self.model.states) :], strict=True))
        return {
            name: e if e.standard_error < _NOT_EXCITED * start[name] else e.invalid("not excited")
            for name, e in track.final.items()
        }

    def _noise_levels(self) -> dict[str, float]:
        """What the filter was told, 1 sigma: ``process_<state>`` (per root second) and ``sensor_<output>``."""
        process = zip((f"process_{name}" for name in self.model.states), np.sqrt(self.noise.process), strict=True)
        sensor = zip((f"sensor_{name}" for name in self.model.outputs), np.sqrt(self.noise.sensor), strict=True)
        return {name: float(value) for name, value in (*process, *sensor)}


def filter_noise(model: StateSpaceModel, aircraft: Aircraft, averaged: int, process_noise: float) -> FilterNoise:
    """What a filter is told for an aircraft: sensor noise of means over ``averaged`` samples, tolerances, turbulence.

    ``process_noise`` multiplies ``PROCESS_NOISE``.
    """
    deviations = [aircraft.noise[_NOISE_KINDS.get(name, name)] / np.sqrt(averaged) for name in model.outputs]
    sensor = dict(zip(model.outputs, deviations, strict=True))
    initial = [sensor.get(name, _UNMEASURED[name]) for name in model.states]
    tolerances = [tolerance_of(aircraft, name) for name in model.names]
    process = np.array([process_noise * PROCESS_NOISE[name] for name in model.states])
    return FilterNoise(process**2, np.array(deviations) ** 2, np.array([*initial, *tolerances]))


def _manoeuvre(
    model: StateSpaceModel, aircraft: Aircraft, record: FlightRecord, settings: BatchSettings
) -> ManoeuvreData:
    return manoeuvre_data(model, block_averaged(record_for_model(model, aircraft, record), settings.rate))
