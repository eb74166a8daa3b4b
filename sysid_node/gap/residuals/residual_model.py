"""Residuals of one flight: measured minus predicted channels by window and frequency, and their slopes.

A ``ResidualModel`` holds what was measured and what predictions take from the flight. It calls the compiled functions
of ``predictions``, transforms what they return, and keeps the spectra in its ``prediction_cache``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from sysid_node.flight.record import Array, FlightRecord
from sysid_node.gap.flightdata.gap_flight import GapFlight
from sysid_node.gap.residuals.flight_path_reconstruction import Flow
from sysid_node.gap.residuals.noise_gain import NoiseGain
from sysid_node.gap.residuals.prediction_cache import cache_of
from sysid_node.gap.residuals.predictions import (
    AIR_AND_ATTITUDE,
    CHANNELS,
    FORCES,
    Channels,
    Prediction,
    PredictionInputs,
    all_channels,
    directional_slopes,
    evaluate,
    flow,
    force_coefficients,
    free_parameters,
    instrument_readings,
    kinematic_parameters,
    slopes_by_derivative,
)
from sysid_node.gap.residuals.windowed_spectra import Complex, Windows
from sysid_node.sim import Simulator
from sysid_node.sim.model import parameters
from sysid_node.sim.prediction.coefficients import COEFFICIENTS

#: Directions along which a prediction is differentiated at once: coefficients along as many as most effects have
#: parameters, all channels along as many as there are biases and clocks. Fewer directions are filled up with zeros,
#: which takes milliseconds; another program for fewer would take half a minute to compile.
_WIDTHS = {force_coefficients: 3, all_channels: 9}

_Result = TypeVar("_Result")


@dataclass(frozen=True, eq=False)
class Measurement:
    """What was measured in a flight, N samples, in W windows of L lines and twelve ``CHANNELS``."""

    record: FlightRecord  # at the analysis rate
    windows: Windows
    series: Array  # (N, 12)
    spectra: Complex  # (W, L, 12)
    axes: NDArray[np.bool_]  # (12,) which channels were measured


@dataclass(frozen=True, eq=False)
class ResidualModel:
    """A flight, and what parameters of the simulator leave of it."""

    simulator: Simulator
    flight: GapFlight
    measurement: Measurement
    inputs: PredictionInputs
    noise: Array  # (L, 12) power that the sensors' noise leaves in measured minus predicted
    gusts: float = 0.0  # rms of the air's motion across the flight path, m/s, by the aircraft file
    simulator_error: Array = field(default_factory=lambda: np.zeros(len(CHANNELS)))  # (12,) see ``SimulatorError``
    reading_errors: Mapping[str, float] = field(default_factory=dict)  # the same of short flights' readings
    instruments: Array | None = None  # (P,) parameters at which the air seems to move least; none: the file's
    gain: NoiseGain | None = None  # how the noise's power depends on the parameters; none: it does not

    @property
    def record(self) -> FlightRecord:
        """The flight at the analysis rate."""
        return self.measurement.record

    @property
    def time(self) -> Array:
        """Times (N,) of the samples, s since the recording began."""
        return np.asarray(self.flight.begin + self.record.time)

    @property
    def windows(self) -> Windows:
        """Windows and lines of the spectra."""
        return self.measurement.windows

    @property
    def series(self) -> Array:
        """Measured channels (N, 12)."""
        return self.measurement.series

    @property
    def measured(self) -> Complex:
        """Measured channels by window and line (W, L, 12)."""
        return self.measurement.spectra

    @property
    def axes(self) -> NDArray[np.bool_]:
        """Which channels (12,) were measured."""
        return self.measurement.axes

    @property
    def motion_power(self) -> Array:
        """Power (12,) of what was measured, about the windows' means; zero where nothing was."""
        return np.asarray((np.abs(self.measured[:, 1:]) ** 2).sum(axis=(0, 1)) * self.axes)

    @property
    def commands(self) -> Array:
        """Commands (N, controls + 1) as recorded: deflections in rad, thrust in N."""
        return np.asarray(self.inputs.signals.commands)[: len(self.record)]

    def excess_noise(self, theta: Array) -> Array:
        """Power (L, 12) of the sensors' noise in the residual at parameters (P,) beyond that at the file's."""
        return np.zeros_like(self.noise) if self.gain is None else self.gain.excess(theta)

    def predicted_series(self, theta: Array) -> Array:
        """Channels (N, 12) that parameters (P,) predict."""
        return np.concatenate(
            [self._series(force_coefficients, theta), self._series(instrument_readings, theta)], axis=1
        )

    def predicted(self, theta: Array) -> Complex:
        """Channels by window and line (W, L, 12) that parameters (P,) predict."""
        cache, key = cache_of(self), theta.tobytes()
        known = cache.forces.get(key)
        forces = self.windows.transform(self._series(force_coefficients, theta)) if known is None else known
        kinematic = self._kinematic_key(theta)
        readings = cache.readings.get(kinematic)
        if readings is None:
            spectra = self.windows.transform(self._series(instrument_readings, theta))
            readings = cache.readings.keep(kinematic, spectra)
        return np.concatenate([cache.forces.keep(key, forces), readings], axis=2)

    def residual(self, theta: Array) -> Complex:
        """Measured minus predicted channels (W, L, 12), zero where not measured."""
        return np.asarray((self.measured - self.predicted(theta)) * self.axes)

    def slopes(self, theta: Array, indices: list[int]) -> Complex:
        """Derivatives (W, L, 12, K) of the predicted channels with respect to parameters of these indices.

        ``residual`` at the same parameters costs little afterwards.
        """
        cache, key = cache_of(self), theta.tobytes() + np.array(indices, np.intp).tobytes()
        known = cache.slopes.get(key)
        return cache.slopes.keep(key, self._slopes(theta, indices) if known is None else known)

    def slopes_of_readings(self, theta: Array, indices: list[int]) -> Complex:
        """Derivatives (W, L, 6, K) of predicted air data and attitude with respect to parameters of these indices."""
        slopes = np.zeros((*self.measured.shape, len(indices)), complex)
        kinematic = kinematic_parameters(self.simulator.layout)
        self._fill(slopes, theta, indices, [k for k, i in enumerate(indices) if i in kinematic])
        return slopes[:, :, len(COEFFICIENTS) :]

    def series_by_derivative(self, theta: Array) -> Array:
        """Derivatives (N, 6, D) of the predicted coefficients by each derivative of the aircraft file."""
        s = self.simulator
        slopes = slopes_by_derivative(s.layout, s.model, theta, self._acting(theta), self.inputs, self.flow(theta))
        return joined(slopes, len(self.record))

    def programs(self) -> Iterator[Callable[[], object]]:
        """Calls of each compiled program of slopes: loading or compiling them takes a while."""
        neutral, kinematic = self.simulator.neutral(), kinematic_parameters(self.simulator.layout)
        other = free_parameters(force_coefficients, self.simulator.layout)[:1]
        yield partial(self._slopes_along, all_channels, neutral, kinematic[:1])
        yield partial(self._slopes_along, force_coefficients, neutral, other)
        yield partial(self._slopes_by_derivative, neutral)

    def _slopes(self, theta: Array, indices: list[int]) -> Complex:
        slopes = np.zeros((*self.measured.shape, len(indices)), complex)
        simulator, forces = self.simulator, len(COEFFICIENTS)
        layout, kinematic = simulator.layout, kinematic_parameters(simulator.layout)
        derivatives = {simulator.names.index(f"derivative_error.{n}"): d for d, n in enumerate(layout.derivatives)}
        linear = [k for k, index in enumerate(indices) if index in derivatives]
        if linear:
            by_derivative = self._slopes_by_derivative(theta)
            slopes[:, :, :forces, linear] = by_derivative[..., [derivatives[indices[k]] for k in linear]]
        others = [k for k, index in enumerate(indices) if index not in derivatives and index not in kinematic]
        for places in _batches(others, _WIDTHS[force_coefficients]):
            along = self._slopes_along(force_coefficients, theta, [indices[k] for k in places])
            slopes[:, :, :forces, places] = along
        self._fill(slopes, theta, indices, [k for k, index in enumerate(indices) if index in kinematic])
        return np.asarray(slopes * self.axes[:, None])

    def _fill(self, slopes: Complex, theta: Array, indices: list[int], kinematic: list[int]) -> None:
        """Puts into ``slopes`` (W, L, 12, K) those of all channels by the kinematic ones among the indices."""
        for places in _batches(kinematic, _WIDTHS[all_channels]):
            slopes[..., places] = self._slopes_along(all_channels, theta, [indices[k] for k in places])

    def _kinematic_key(self, theta: Array) -> bytes:
        """Of parameters (P,) those that flow, air data and attitude depend on."""
        return theta[kinematic_parameters(self.simulator.layout)].tobytes()

    def flow(self, theta: Array) -> Flow | None:
        """The flow at parameters (P,), computed anew where a kinematic one differs."""
        cache, key = cache_of(self), self._kinematic_key(theta)
        known = cache.flows.get(key)
        return cache.flows.keep(key, self._evaluate(flow, theta)) if known is None else known

    def _series(self, prediction: Prediction, theta: Array) -> Array:
        """A prediction's channels (N, 6) at parameters (P,)."""
        return joined(self._evaluate(prediction, theta, self.flow(theta)), len(self.record))

    def _evaluate(self, function: Callable[..., _Result], theta: Array, *known_flow: Flow | None) -> _Result:
        s = self.simulator
        result: _Result = evaluate(function, s.layout, s.model, theta, self._acting(theta), self.inputs, *known_flow)
        return result

    def _acting(self, theta: Array) -> NDArray[np.bool_]:
        """Which parameters (P,) are not neutral."""
        return np.asarray(theta != parameters.neutral(self.simulator.layout))

    def _slopes_by_derivative(self, theta: Array) -> Complex:
        """Derivatives (W, L, 6, D) of the coefficients by each derivative of the aircraft file."""
        return self.windows.transform(self.series_by_derivative(theta))

    def _slopes_along(self, prediction: Prediction, theta: Array, indices: list[int]) -> Complex:
        """Derivatives (W, L, channels, K) by at most ``_WIDTHS`` parameters; what is predicted is kept, too."""
        s, samples, acting = self.simulator, len(self.record), self._acting(theta)
        free = free_parameters(prediction, s.layout)
        acting[indices] = True
        directions = np.zeros((_WIDTHS[prediction], len(free)))
        directions[np.arange(len(indices)), [free.index(i) for i in indices]] = 1.0
        values, slopes = directional_slopes(
            prediction, s.layout, s.model, theta, acting, directions, self.inputs, self.flow(theta)
        )
        self._keep(theta, joined(values, samples))
        return self.windows.transform(joined(slopes, samples, len(indices)))

    def _keep(self, theta: Array, series: Array) -> None:
        """Keeps coefficients (N, 6), or all channels (N, 12), that were predicted at parameters (P,)."""
        cache = cache_of(self)
        forces = (cache.forces, theta.tobytes(), FORCES)
        readings = (cache.readings, self._kinematic_key(theta), AIR_AND_ATTITUDE)
        for known, key, channels in (forces, readings):
            if series[:, channels].size and known.get(key) is None:
                known.keep(key, self.windows.transform(series[:, channels]))


def _batches(places: list[int], size: int) -> Iterator[list[int]]:
    """Lists of at most ``size`` places."""
    return (places[first : first + size] for first in range(0, len(places), size))


def joined(channels: Channels, samples: int, *most: int) -> Array:
    """One array (N, channels, ...) of channels (n, ...) with n >= N samples; of further axes the first ``most``."""
    wanted = tuple(map(slice, (samples, *most)))
    return np.stack([np.asarray(channel)[wanted] for channel in channels], axis=1)


__all__ = ["CHANNELS", "COEFFICIENTS", "Measurement", "ResidualModel", "joined"]
