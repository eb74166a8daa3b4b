"""Real flights in which an effect is put, and the aircraft files that are believed of them.

A published model of another flight would differ from the record in every derivative. So the derivatives are the
record's own, by ordinary least squares on its coefficients (Klein & Morelli (2006), Aircraft System Identification,
ch. 5), with a tolerance of a tenth. What a record holds beside its derivatives, and why this is believed, is said by
flight.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray
from scipy.signal import butter, lfilter, sosfiltfilt

from bench.withheld.mattering import coefficients
from sysid_node.aircraft.model import Aircraft, Control, Derivative, Geometry, Inertia, ReferenceCondition, Throttle
from sysid_node.flight.csv import read_csv
from sysid_node.flight.record import FlightRecord

Array = NDArray[np.float64]
Part = tuple[str, float, float]  # file, from and to (s)

#: 1 sigma of a derivative: a share of its size, and at least what moves its coefficient by a share of the motion.
SHARE, _LEAST = 0.1, 0.02

#: Band in which coefficients are regressed, Hz.
_BAND = 4.0

_READINGS = ("ax", "ay", "az", "p", "q", "r", "phi", "theta", "psi", "V", "alpha", "beta")
_AIR = ("V", "alpha", "beta")
_SIDEWAYS = ("ay", "p", "r", "beta", "da", "dr")
_SURFACES = {"elevator": "de", "aileron": "da", "rudder": "dr"}
_IN_PLANE = {"CL": ("0", "alpha", "q"), "CD": ("0", "alpha"), "Cm": ("0", "alpha", "q")}
_OF_PLANE = dict.fromkeys(("CY", "Cl", "Cn"), ("0", "beta", "p", "r"))

#: Readings of each sensor, and the finest resolution (1 sigma) that any of them is believed to have.
_SENSORS = {"accel": ("ax", "ay", "az"), "gyro": ("p", "q", "r"), "airspeed": ("V",), "alpha": ("alpha",),
            "beta": ("beta",), "attitude": ("phi", "theta")}  # fmt: skip
_FINEST = {"accel": 0.002, "gyro": 1e-4, "airspeed": 0.02, "alpha": 1e-4, "beta": 1e-4, "attitude": 1e-4}

_BIAS = {"accel": 0.03, "gyro": 0.001, "airspeed": 0.3, "alpha": 0.003, "beta": 0.003}
_SMALL_BIAS = {"accel": 0.1, "gyro": 0.003, "airspeed": 0.3, "alpha": 0.01, "beta": 0.01}


@dataclass(frozen=True)
class Flight:
    """Parts of a record that are fitted, parts that are held out, and what is known of them.

    ``learned`` are the parts from which the belief's derivatives are; ``late`` and ``lag`` are by how much (s) the
    surfaces follow there what was recorded, and ``air_late`` how late (s) the air data are. ``holds`` are effects that
    the record has beside its derivatives, ``own`` their sizes where they are known (``judging.judge``), and ``why``
    says why. ``cancelled`` are effects that undo what the record holds.
    """

    aircraft: str
    fitted: tuple[Part, ...]
    held: tuple[Part, ...]
    learned: tuple[Part, ...]
    bias: Mapping[str, float] = field(default_factory=lambda: _BIAS)
    in_plane: bool = False  # whether the motion is in the plane of symmetry, so that lateral signals are left out
    late: float = 0.0
    lag: float = 0.0
    air_late: float = 0.0
    regressors: Mapping[str, tuple[str, ...]] = field(default_factory=dict)  # by coefficient, other than the usual ones
    moved: tuple[str, ...] = tuple(_SURFACES)  # surfaces that move in what is fitted
    still: tuple[str, ...] = ()  # surfaces that rest in both parts
    holds: tuple[str, ...] = ()
    own: Mapping[str, float] = field(default_factory=dict)
    cancelled: tuple[str, ...] = ()
    why: str = ""


#: As the published models of the HFB-320 have it: coefficients that change with the airspeed.
_WITH_SPEED = {"CL": ("0", "V", "alpha"), "CD": ("0", "V", "alpha"), "Cm": ("0", "V", "alpha", "q", "de")}

_CESSNA = tuple((f"cessna_{name}3211_1.csv", *span) for name, span in
                {"de": (17.0, 45.0), "da": (17.0, 45.0), "dr": (17.0, 45.0), "dadr": (7.0, 35.0)}.items())  # fmt: skip
_LAGGED = (
    "surfaces are commands: with a lag of 0.1 s least squares leaves 0.1 to 2 % of the moments' power, without it 6 to "
    "9 %. Beside it the lateral records hold a yawing moment that no derivatives describe"
)


def _cessna(
    fitted: Part, held: tuple[Part, ...], moved: tuple[str, ...], still: tuple[str, ...] = (), *, in_plane: bool = False
) -> Flight:
    """A flight of the simulated light transport, whose surfaces follow their commands."""
    return Flight("cessna", (fitted,), held, _CESSNA, in_plane=in_plane, lag=0.1, moved=moved, still=still,
                  holds=("actuator_lag",), own={"actuator_lag": 0.1}, cancelled=("actuator_stamp_delay",),
                  why=_LAGGED)  # fmt: skip


#: How late the air data of the HFB-320 and of the Twin Otter are, s.
_HFB_AIR, _TWIN_OTTER_AIR = 0.22, 0.025

#: By how much (s) what the surfaces of ATTAS do follows what was recorded of them. The rudder's readings are late.
_ATTAS_LATE = {"aileron": 0.011, "rudder": -0.019}

_DE, _DA, _DR, _DADR = _CESSNA
_ATTAS = (("attas_lateral_1.csv", 0.0, 30.0), ("attas_lateral_1.csv", 30.04, 60.04))

#: The flights, by name.
FLIGHTS: Mapping[str, Flight] = {
    "cessna_de": _cessna(_DE, (), ("elevator",), in_plane=True),
    "cessna_da": _cessna(_DA, (_DADR,), ("aileron",), ("elevator",)),
    "cessna_dr": _cessna(_DR, (_DADR,), ("rudder",), ("elevator",)),
    "cessna_dadr": _cessna(_DADR, (_DA,), ("aileron", "rudder"), ("elevator",)),
    "hfb320": Flight("hfb320", (("hfb320.csv", 0.0, 30.0),), (("hfb320.csv", 30.0, 60.0),),
                     (("hfb320.csv", 0.0, 60.0),), in_plane=True, regressors=_WITH_SPEED, moved=("elevator",),
                     air_late=_HFB_AIR, holds=("air_data_lag", "air_data_delay"), own={"air_data_delay": _HFB_AIR},
                     cancelled=("imu_delay",),
                     why="in both parts its angle of attack follows the integrated rates and forces best 0.2 to 0.25 s "
                         "late, with a scale of 0.93 to 1.03"),
    "twin_otter": Flight("twin_otter", (("twin_otter_018.csv", 0.0, 8.0),), (), (("twin_otter_018.csv", 0.0, 8.0),),
                         in_plane=True, moved=("elevator",), air_late=_TWIN_OTTER_AIR,
                         holds=("air_data_delay", "vane_lever_arm"), own={"air_data_delay": _TWIN_OTTER_AIR},
                         why="its angle of attack follows the integrated rates and forces best 0.025 s late, with a "
                             "third of the error; a vane 1.7 m ahead would do nearly as well"),
    "attas": Flight("attas", _ATTAS, (), _ATTAS, moved=("aileron", "rudder"),
                    holds=("imu_bias", "imu_scale", "command_delay"),
                    own={"actuator_stamp_delay": -_ATTAS_LATE["rudder"],
                         **{f"{effect}.{control}": late for effect in ("command_delay", "actuator_lag")
                            for control, late in _ATTAS_LATE.items()}},
                    why="in both manoeuvres the gyroscopes drift against the attitude by 0.0035 rad/s in pitch, 0.001 "
                        "in roll and 0.0009 in yaw, and read 3 % (roll) and 4 % (yaw) more than it turns; the rolling "
                        "moment follows the aileron as recorded best 0.011 s late, the yawing moment the rudder 0.019 "
                        "s early"),
    "thor": Flight("thor", (("thor_75a.csv", 5.0, 45.0),), (("thor_75a.csv", 55.0, 95.0),),
                   (("thor_75a.csv", 0.0, 100.0),), _SMALL_BIAS, late=0.06, regressors={"CL": ("0", "alpha")},
                   moved=("elevator", "aileron"), holds=("command_delay", "actuator_lag"),
                   own={"command_delay": 0.06}, cancelled=("actuator_stamp_delay",),
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
    bare = _without_derivatives(folder, flight, parts)
    tables = [regression(bare, flight, record) for record in parts]
    derivatives = {}
    for index, (coefficient, regressors) in enumerate(_structure(flight).items()):
        left = np.concatenate([found[:, index] for found, _ in tables])
        columns = {r: np.concatenate([x[r] for _, x in tables]) for r in regressors}
        derivatives |= _fitted(coefficient, left, columns)
    return replace(bare, derivatives=derivatives)


def regression(bare: Aircraft, flight: Flight, record: FlightRecord) -> tuple[Array, dict[str, Array]]:
    """Coefficients (N, 6) and regressors (N,) of a part, low-passed; commands as late as the surfaces are."""
    later = record.time + flight.air_late
    seen = np.nan_to_num(np.column_stack([
        np.interp(later, record.time, record[name]) if name in _AIR else record[name] for name in _READINGS
    ]))  # fmt: skip
    commands = [np.nan_to_num(record[s]) for s in bare.control_symbols]
    rate = rate_of(record)
    late = [_followed(np.interp(record.time - flight.late, record.time, c), flight.lag * rate) for c in commands]
    found, x = coefficients(bare, seen, np.column_stack([*late, np.nan_to_num(record["thrust"])]), record["rho"], rate)
    low = butter(4, min(_BAND, 0.4 * rate), fs=rate, output="sos")
    kept = slice(round(0.5 * rate), -round(0.5 * rate))
    x["V"] = record["V"] / bare.reference.airspeed
    return sosfiltfilt(low, found, axis=0)[kept], {n: sosfiltfilt(low, v)[kept] for n, v in x.items()}


def _noise(records: Sequence[FlightRecord]) -> dict[str, float]:
    """1 sigma of a sample by sensor: third differences of white noise have 20 times its variance."""
    found = {}
    for sensor, names in _SENSORS.items():
        known = [np.diff(r[name], 3).std() / np.sqrt(20.0) for r in records for name in names if r.measured(name)]
        found[sensor] = max(float(np.median(known)) if known else 0.0, _FINEST[sensor])
    return found


def _structure(flight: Flight) -> dict[str, tuple[str, ...]]:
    """Regressors by coefficient, in the order of ``coefficients``."""
    plane = {name: (*own, *(("de",) if name != "CD" else ())) for name, own in _IN_PLANE.items()}
    across = {} if flight.in_plane else {name: (*own, "da", "dr") for name, own in _OF_PLANE.items()}
    both = plane | across | dict(flight.regressors)
    return {name: both.get(name, ()) for name in ("CL", "CD", "CY", "Cl", "Cm", "Cn")}


def _without_derivatives(folder: Path, flight: Flight, records: Sequence[FlightRecord]) -> Aircraft:
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
        reference=ReferenceCondition(float(records[0]["V"].mean()), float(records[0]["rho"].mean())),
        controls={name: Control(name, _SURFACES[name], {name: 1.0}) for name in controls},
        derivatives={},
        throttle=Throttle("throttle"),
        noise=_noise(records),
        noise_bias=dict(flight.bias),
    )


def _followed(command: Array, lag: float) -> Array:
    """Position (N,) of a surface that follows its command with a first-order lag of so many samples."""
    decay = np.exp(-1.0 / lag) if lag else 0.0
    followed: Array = lfilter([1.0 - decay], [1.0, -decay], command - command[0]) + command[0]
    return followed


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
