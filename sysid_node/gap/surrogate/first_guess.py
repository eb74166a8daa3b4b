"""The aircraft file as a first guess of a simulator: derivatives with room, sensors as noisy as the simulated ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sysid_node.aircraft.model import Aircraft, Derivative
from sysid_node.aircraft.names import STANDARD_DERIVATIVES, split_derivative
from sysid_node.flight.record import Array
from sysid_node.gap.flightdata.gap_flight import GapFlight

#: 1 sigma of a first guess, as a share of itself. Three of them are allowed for.
_SHARE = 0.7

#: 1 sigma of the first guess of a derivative by an angle, by coefficient; it is larger by a rate, smaller of an offset.
_SIZES = {"CL": 1.0, "CD": 0.1, "CY": 0.3, "Cl": 0.1, "Cm": 0.3, "Cn": 0.1}
_BY_REGRESSOR = {"0": 0.2, "p": 2.0, "q": 10.0, "r": 2.0, "k": 1.0, "V": 1.0}

#: Least noise of a simulated sensor, as a share of what the file states of the real one.
_LEAST_NOISE = 1e-3

_COLUMNS = {
    "accel": ("ax", "ay", "az"),
    "gyro": ("p", "q", "r"),
    "airspeed": ("V",),
    "alpha": ("alpha",),
    "beta": ("beta",),
    "attitude": ("phi", "theta"),
}

#: Standard deviation of the third difference of white noise of standard deviation one: sqrt(1 + 9 + 9 + 1).
_THIRD_DIFFERENCE = np.sqrt(20.0)


def first_guess(aircraft: Aircraft, simulated: Sequence[GapFlight]) -> Aircraft:
    """The aircraft with tolerances of first guesses, and with the noise of the simulated sensors.

    Derivatives of the standard model that the file does not state are added with the value zero.
    """
    symbols = {*aircraft.control_symbols, "0", "alpha", "beta", "p", "q", "r"}
    has_drag_polar = "CD_k" in aircraft.derivatives
    missing = [
        name
        for name in STANDARD_DERIVATIVES
        if name not in aircraft.derivatives
        and split_derivative(name)[1] in symbols
        and not (has_drag_polar and name == "CD_alpha")
    ]
    known = {**aircraft.derivatives, **{name: Derivative(0.0) for name in missing}}
    derivatives = {name: Derivative(d.value, room(name, d)) for name, d in known.items()}
    noise = {sensor: simulated_noise(aircraft, sensor, simulated) for sensor in aircraft.noise}
    return replace(aircraft, derivatives=derivatives, noise=noise)


def room(name: str, known: Derivative) -> float:
    """1 sigma of a derivative's first guess."""
    coefficient, regressor = split_derivative(name)
    return max(
        known.tolerance or 0.0, _SHARE * abs(known.value), _SIZES[coefficient] * _BY_REGRESSOR.get(regressor, 1.0)
    )


def simulated_noise(aircraft: Aircraft, sensor: str, flights: Sequence[GapFlight]) -> float:
    """1 sigma of a simulated sensor's noise (SI), from the third differences of its readings."""
    least = _LEAST_NOISE * aircraft.noise[sensor]
    columns = [f.record[n] for f in flights for n in _COLUMNS.get(sensor, ()) if n not in (*f.filled, *f.inferred)]
    return max([least, *(_white_noise(column) for column in columns if np.isfinite(column).all())])


def _white_noise(series: Array) -> float:
    """Standard deviation of the white noise in a smooth series (N,), from the median of its third differences."""
    return float(np.median(np.abs(np.diff(series, 3))) / (0.6745 * _THIRD_DIFFERENCE))
