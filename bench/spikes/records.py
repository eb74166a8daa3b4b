"""Real flights in which an effect is put, and the aircraft files that are believed of them.

A published model of another flight would differ from the record in every derivative. So the derivatives are the
record's own, by ordinary least squares on its coefficients (Klein & Morelli (2006), Aircraft System Identification,
ch. 5), with a tolerance of a tenth. What a record holds beside its derivatives, and why this is believed, is said by
flight.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from bench.withheld.mattering import coefficients
from sysid_node.aircraft.model import Aircraft, Control, Derivative, Geometry, Inertia, Reference, Throttle
from sysid_node.flight.csv import read_csv
from sysid_node.flight.record import FlightRecord

Array = NDArray[np.float64]
Part = tuple[str, float, float]  # file, from and to (s)

#: 1 sigma of a derivative: a share of its size, and at least what moves its coefficient by a share of the motion.
SHARE, _LEAST = 0.1, 0.02

#: Band in which coefficients are regressed, Hz.
_BAND = 4.0

_READINGS = ("ax", "ay", "az", "p", "q", "r", "phi", "theta", "psi", "V", "alpha", "beta")
_SIDEWAYS = ("ay", "p", "r", "beta", "da", "dr")
_SURFACES = {"elevator": "de", "aileron": "da", "rudder": "dr"}
_IN_PLANE = {"CL": ("0", "alpha", "q"), "CD": ("0", "alpha"), "Cm": ("0", "alpha", "q")}
_OF_PLANE = dict.fromkeys(("CY", "Cl", "Cn"), ("0", "beta", "p", "r"))

_PRECISE = {"accel": 0.01, "gyro": 0.0005, "airspeed": 0.05, "alpha": 0.0005, "beta": 0.0005, "attitude": 0.0005}
_GOOD = {"accel": 0.02, "gyro": 0.001, "airspeed": 0.1, "alpha": 0.0007, "beta": 0.0007, "attitude": 0.0007}
_BUMPY = {"accel": 0.03, "gyro": 0.001, "airspeed": 0.1, "alpha": 0.001, "beta": 0.001, "attitude": 0.001}
_SMALL = {"accel": 0.15, "gyro": 0.01, "airspeed": 0.2, "alpha": 0.006, "beta": 0.006, "attitude": 0.005}

_BIAS = {"accel": 0.03, "gyro": 0.001, "airspeed": 0.3, "alpha": 0.003, "beta": 0.003}
_SMALL_BIAS = {"accel": 0.1, "gyro": 0.003, "airspeed": 0.3, "alpha": 0.01, "beta": 0.01}


@dataclass(frozen=True)
class Flight:
    """A part of a record that is fitted, one that is held out, and what is known of both.

    ``learned`` are the parts from which the belief's derivatives are; ``late`` is by how much (s) the surfaces follow
    there what was recorded. ``holds`` are effects that the record has beside its derivatives, and ``why`` says why.
    """

    aircraft: str
    fitted: Part
    held: Part | None
    learned: tuple[Part, ...]
    noise: Mapping[str, float]  # 1 sigma as the record shows it between samples
    bias: Mapping[str, float] = field(default_factory=lambda: _BIAS)
    in_plane: bool = False  # whether the motion is in the plane of symmetry, so that lateral signals are left out
    late: float = 0.0
    regressors: Mapping[str, tuple[str, ...]] = field(default_factory=dict)  # by coefficient, other than the usual ones
    moved: tuple[str, ...] = tuple(_SURFACES)  # surfaces that move in both parts
    still: tuple[str, ...] = ()  # surfaces that rest in both parts
    holds: tuple[str, ...] = ()
    why: str = ""


#: As the published models of the HFB-320 have it: coefficients that change with the airspeed.
_WITH_SPEED = {"CL": ("0", "V", "alpha"), "CD": ("0", "V", "alpha"), "Cm": ("0", "V", "alpha", "q", "de")}

_CESSNA = tuple((f"cessna_{name}3211_1.csv", *span) for name, span in
                {"de": (17.0, 45.0), "da": (17.0, 45.0), "dr": (17.0, 45.0), "dadr": (7.0, 35.0)}.items())  # fmt: skip
_OWN = "a simulation of another program with its own nonlinear model: the derivatives are those of small motions"

#: The flights, by name.
FLIGHTS: Mapping[str, Flight] = {
    "cessna_de": Flight("cessna", ("cessna_de3211_1.csv", 17.0, 45.0), None, _CESSNA, _PRECISE,
                        moved=("elevator",), in_plane=True, holds=("unsteady_aerodynamics",), why=_OWN),
    "cessna_da": Flight("cessna", ("cessna_da3211_1.csv", 17.0, 45.0), ("cessna_dadr3211_1.csv", 7.0, 35.0), _CESSNA,
                        _PRECISE, moved=("aileron",), still=("elevator",), why=_OWN),
    "cessna_dr": Flight("cessna", ("cessna_dr3211_1.csv", 17.0, 45.0), ("cessna_dadr3211_1.csv", 7.0, 35.0), _CESSNA,
                        _PRECISE, moved=("rudder",), still=("elevator",), why=_OWN),
    "cessna_dadr": Flight("cessna", ("cessna_dadr3211_1.csv", 7.0, 35.0), ("cessna_da3211_1.csv", 17.0, 45.0), _CESSNA,
                          _PRECISE, moved=("aileron",), still=("elevator",), why=_OWN),
    "hfb320": Flight("hfb320", ("hfb320.csv", 0.0, 30.0), ("hfb320.csv", 30.0, 60.0), (("hfb320.csv", 0.0, 60.0),),
                     _BUMPY, in_plane=True, regressors=_WITH_SPEED, moved=("elevator",),
                     holds=("air_data_lag", "air_data_delay"),
                     why="its angle of attack follows the vertical force 0.05 to 0.1 s late (Real flights)"),
    "twin_otter": Flight("twin_otter", ("twin_otter_018.csv", 0.0, 8.0), None, (("twin_otter_018.csv", 0.0, 8.0),),
                         _GOOD, in_plane=True, moved=("elevator",)),
    "attas": Flight("attas", ("attas_lateral_1.csv", 0.0, 30.0), ("attas_lateral_1.csv", 30.04, 60.04),
                    (("attas_lateral_1.csv", 0.0, 30.0), ("attas_lateral_1.csv", 30.04, 60.04)), _GOOD,
                    moved=("rudder",)),
    "thor": Flight("thor", ("thor_75a.csv", 5.0, 45.0), ("thor_75a.csv", 55.0, 95.0), (("thor_75a.csv", 0.0, 100.0),),
                   _SMALL, _SMALL_BIAS, late=0.06, regressors={"CL": ("0", "alpha")}, moved=("elevator", "aileron"),
                   holds=("command_delay", "actuator_lag", "actuator_stamp_delay"),
                   why="surfaces are commands: correlations say that they follow after 40 to 60 ms"),
}  # fmt: skip


def part(folder: Path, flight: Flight, span: Part) -> FlightRecord:
    """A part of a record, its time from zero; without lateral signals where the motion is in the plane of symmetry."""
    name, begin, end = span
    record = _whole(folder / name)
    keep = (record.time >= begin - 1e-9) & (record.time <= end + 1e-9)
    columns = {column: values[keep] for column, values in record.columns.items()}
    for angle in ("phi", "psi"):
        columns[angle] = np.unwrap(columns[angle])
    if flight.in_plane:
        columns |= {column: np.full(int(keep.sum()), np.nan) for column in _SIDEWAYS}
    return FlightRecord(record.time[keep] - record.time[keep][0], columns, record.name)


@cache
def _whole(path: Path) -> FlightRecord:
    return read_csv(path)


@cache
def _numbers(path: Path) -> Mapping[str, Any]:
    """Masses, inertias and geometries beside the records."""
    known: Mapping[str, Any] = yaml.safe_load(path.read_text(encoding="utf-8"))
    return known


def rate_of(record: FlightRecord) -> float:
    """Samples a second."""
    return 1.0 / float(np.median(np.diff(record.time)))


def belief(folder: Path, flight: Flight) -> Aircraft:
    """The aircraft file: the record's own derivatives, each with a tolerance."""
    parts = [part(folder, flight, span) for span in flight.learned]
    bare = _without_derivatives(folder, flight, parts[0])
    tables = [_regression(bare, flight, record) for record in parts]
    derivatives = {}
    for index, (coefficient, regressors) in enumerate(_structure(flight).items()):
        left = np.concatenate([found[:, index] for found, _ in tables])
        columns = {r: np.concatenate([x[r] for _, x in tables]) for r in regressors}
        derivatives |= _fitted(coefficient, left, columns)
    return replace(bare, derivatives=derivatives)


def _structure(flight: Flight) -> dict[str, tuple[str, ...]]:
    """Regressors by coefficient, in the order of ``coefficients``."""
    plane = {name: (*own, *(("de",) if name != "CD" else ())) for name, own in _IN_PLANE.items()}
    across = {} if flight.in_plane else {name: (*own, "da", "dr") for name, own in _OF_PLANE.items()}
    both = plane | across | dict(flight.regressors)
    return {name: both.get(name, ()) for name in ("CL", "CD", "CY", "Cl", "Cm", "Cn")}


def _without_derivatives(folder: Path, flight: Flight, record: FlightRecord) -> Aircraft:
    own = _numbers(folder / "aircraft.yaml")[flight.aircraft]
    Iyy = float(own["inertia"]["Iyy"])
    inertia = {"Ixx": Iyy, "Izz": 2.0 * Iyy} | {axis: float(value) for axis, value in own["inertia"].items()}
    controls = ("elevator",) if flight.in_plane else tuple(_SURFACES)
    return Aircraft(
        name=flight.aircraft,
        source="mass, inertia and geometry from beside the record; derivatives by least squares on the record",
        mass=float(own["mass"]),
        inertia=Inertia(**inertia),
        geometry=Geometry(**own["geometry"]),
        reference=Reference(float(record["V"].mean()), float(record["rho"].mean())),
        controls={name: Control(name, _SURFACES[name], {name: 1.0}) for name in controls},
        derivatives={},
        throttle=Throttle("throttle"),
        noise=dict(flight.noise),
        noise_bias=dict(flight.bias),
    )


def _regression(bare: Aircraft, flight: Flight, record: FlightRecord) -> tuple[Array, dict[str, Array]]:
    """Coefficients (N, 6) and regressors (N,) of a part, low-passed; commands as late as the surfaces are."""
    seen = np.nan_to_num(np.column_stack([record[name] for name in _READINGS]))
    commands = [np.nan_to_num(record[s]) for s in bare.control_symbols]
    late = [np.interp(record.time - flight.late, record.time, c) for c in commands]
    rate = rate_of(record)
    found, x = coefficients(bare, seen, np.column_stack([*late, np.nan_to_num(record["thrust"])]), record["rho"], rate)
    low = butter(4, min(_BAND, 0.4 * rate), fs=rate, output="sos")
    kept = slice(round(0.5 * rate), -round(0.5 * rate))
    x["V"] = record["V"] / bare.reference.airspeed
    return sosfiltfilt(low, found, axis=0)[kept], {n: sosfiltfilt(low, v)[kept] for n, v in x.items()}


def _fitted(coefficient: str, left: Array, columns: Mapping[str, Array]) -> dict[str, Derivative]:
    """The derivatives of one coefficient (N,) by least squares on columns (N,); those that do not move are left out."""
    moving = {name: values for name, values in columns.items() if name == "0" or values.std() > 1e-9}
    if not moving:
        return {}
    matrix = np.column_stack(list(moving.values()))
    values = np.linalg.lstsq(matrix, left, rcond=None)[0]
    swing = float(left.std())
    found = {}
    for (name, column), value in zip(moving.items(), values.tolist(), strict=True):
        least = _LEAST * swing / (float(column.std()) if name != "0" else 0.1)
        found[f"{coefficient}_{name}"] = Derivative(value, max(SHARE * abs(value), least))
    return found
