"""The work on one flight of a fleet, which a worker process does: estimates, their covariance, the diagnosis."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

from sysid_node.api.flight_file import FlightFile, load
from sysid_node.api.replaying import replay, replay_settings
from sysid_node.errors import InputError
from sysid_node.fleet.catalogue.locations import local_copy
from sysid_node.fleet.outcome import FleetSettings, FlightOutcome, FlightTask
from sysid_node.flight.logs.origin import log_origin
from sysid_node.flight.record import Array
from sysid_node.report.files.runs.run_folder import REPORT, write_aircraft, write_run

#: Hz at which a fleet's replays estimate: what its result holds is the estimate at the end.
PUBLISH_RATE = 1.0
GAP_FOLDER = "gap"


class _Estimated(NamedTuple):
    """Estimates of n derivatives, the seconds of flight, and a function that writes the flight's own report."""

    seconds: float
    names: tuple[str, ...]
    values: Array
    covariance: Array
    statistical: Array
    valid: np.typing.NDArray[np.bool_]
    write: Callable[[Path], None]


def check_settings(settings: FleetSettings) -> None:
    """Raise InputError where a method or a setting is wrong, before any flight is begun."""
    if not settings.method:
        replay_settings(settings.settings)
        return
    from sysid_node.batch.identify import METHODS, refuse_unused  # noqa: PLC0415  # JAX takes its time
    from sysid_node.batch.settings import BatchSettings  # noqa: PLC0415

    if settings.method not in METHODS:
        raise InputError(f"method {settings.method!r}: expected one of {', '.join(METHODS)}")
    BatchSettings.from_mapping(settings.settings)
    refuse_unused(settings.method, settings.settings)


def estimate_flight(task: FlightTask) -> FlightOutcome:
    """The outcome of one flight. Raises InputError as the commands of one flight do, and where nothing is estimated."""
    path = local_copy(task.location, Path(task.cache))
    settings = task.settings
    flight = load(path, task.aircraft, topics=settings.topics, body_frame=settings.body_frame)
    found = _identified(flight, settings) if settings.method else _replayed(flight, settings)
    origin = log_origin(path)
    document, report, files = None, "", {}
    with TemporaryDirectory(prefix="sysid-fleet-") as folder:
        place = Path(folder)
        if settings.reports:
            found.write(place)
            report = REPORT
        if settings.gap:
            from sysid_node.api.gap_diagnosis import diagnose  # noqa: PLC0415  # JAX takes its time

            diagnosis = diagnose(flight)
            (place / GAP_FOLDER).mkdir()
            diagnosis.write(place / GAP_FOLDER)
            document = json.loads((place / GAP_FOLDER / "gap.json").read_text(encoding="utf-8"))
            report = report or f"{GAP_FOLDER}/{REPORT}"
        files = {str(f.relative_to(place)): f.read_bytes() for f in sorted(place.rglob("*")) if f.is_file()}
    return FlightOutcome(
        aircraft=task.aircraft.name,
        vehicle=origin.vehicle,
        date=origin.date,
        data_seconds=found.seconds,
        names=found.names,
        values=found.values,
        covariance=found.covariance,
        statistical_covariance=found.statistical,
        valid=found.valid,
        gap=document,
        report=report,
        files=files,
    )


def _replayed(flight: FlightFile, settings: FleetSettings) -> _Estimated:
    found = replay(flight, {"publish_rate": PUBLISH_RATE, **settings.settings}, judge_faults=False)
    covariance = found.covariance
    if covariance is None:
        raise InputError(f"{flight.name}: is too short, nothing is estimated; give a longer flight")
    rows = [found.final.derivatives[name] for name in covariance.names]
    values, valid = np.array([row.value for row in rows]), np.array([row.valid for row in rows], bool)
    parts = (covariance.total, covariance.statistical)
    seconds = found.run.data.seconds

    def write(folder: Path) -> None:
        write_run(folder, found.run)
        write_aircraft(folder, found.aircraft)

    return _known(seconds, covariance.names, values, *parts, valid, write)


def _identified(flight: FlightFile, settings: FleetSettings) -> _Estimated:
    from sysid_node.api.identification import identify  # noqa: PLC0415  # JAX takes its time

    found = identify(flight, settings.method, settings.settings)
    fit, rows = found.identification.fit, found.derivatives
    places = [i for i, name in enumerate(fit.estimates) if name in rows]
    names = tuple(name for name in fit.estimates if name in rows)
    systematic = np.zeros_like(fit.covariance) if fit.systematic.covariance is None else fit.systematic.covariance
    kept = np.ix_(places, places)
    total, statistical = fit.covariance[kept], (fit.covariance - systematic)[kept]
    values, valid = np.array([rows[name].value for name in names]), np.array([rows[name].valid for name in names], bool)
    return _known(found.run.data.seconds, names, values, total, statistical, valid, found.write)


def _known(
    seconds: float,
    names: tuple[str, ...],
    values: Array,
    covariance: Array,
    statistical: Array,
    valid: np.typing.NDArray[np.bool_],
    write: Callable[[Path], None],
) -> _Estimated:
    """The estimates without those of which nothing is known. Raises InputError where that is all of them."""
    finite = np.isfinite(values) & np.isfinite(covariance).all(axis=1)
    if not finite.any():
        raise InputError("nothing is estimated: the flight is too short, or moves too little; give a longer one")
    kept = np.ix_(finite, finite)
    chosen = tuple(name for name, keep in zip(names, finite.tolist(), strict=True) if keep)
    return _Estimated(seconds, chosen, values[finite], covariance[kept], statistical[kept], valid[finite], write)
