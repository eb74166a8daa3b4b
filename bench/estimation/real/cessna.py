"""A simulated aircraft of 5 t whose model is not published, without noise; its surfaces follow commands."""

from __future__ import annotations

from pathlib import Path

from bench.estimation.real import aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.csv import read_csv
from sysid_node.flight.record import FlightRecord


def flown(folder: Path, manoeuvre: str) -> FlightRecord:
    """The record of 3-2-1-1s on ``de``, ``da``, ``dr``, or ``dadr``."""
    return read_csv(folder / f"cessna_{manoeuvre}3211_1.csv")


def known(folder: Path, manoeuvre: str) -> Aircraft:
    """Its longitudinal or lateral model, with the controls that the manoeuvre moves."""
    if manoeuvre == "de":
        return aircraft.cessna_longitudinal(folder)
    names = {"da": "aileron", "dr": "rudder"}
    return aircraft.cessna_lateral(folder, [name for symbol, name in names.items() if symbol in manoeuvre])
