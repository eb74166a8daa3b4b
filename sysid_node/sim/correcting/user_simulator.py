"""The simulator that a user names: ``jsbsim:NAME`` or ``jsbsim:FILE``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from sysid_node.aircraft.model import Aircraft
from sysid_node.dynamics.atmosphere import altitude_of
from sysid_node.errors import InputError
from sysid_node.sim.correcting.jsbsim_flight import JsbsimFlyer
from sysid_node.sim.correcting.jsbsim_model import CorrectedModel, write_corrected
from sysid_node.sim.importing.jsbsim.survey import ModelSurvey, survey_model

_FORM = "expected jsbsim:NAME of an aircraft that comes with JSBSim, or jsbsim:FILE of a model's XML"

#: How far the model may be from the aircraft file, as a share, where the file states no larger tolerance.
_SHARE = 0.01

#: The aircraft file's tolerances (1 sigma) within which a model is taken for the same aircraft.
_SIGMAS = 3.0


@dataclass(frozen=True)
class UserSimulator:
    """A user's simulator with its model, checked against the aircraft file."""

    label: str  # as the user gave it
    survey: ModelSurvey
    aircraft: Aircraft  # the aircraft file

    def corrected(self, after: Aircraft, folder: Path) -> CorrectedModel:
        """Write a copy of the model, with what ``after`` has other than the aircraft file. Raises InputError."""
        return write_corrected(self.survey, self.aircraft, after, folder)

    def flyers(self, model: CorrectedModel, rate: float) -> tuple[JsbsimFlyer, JsbsimFlyer]:
        """The simulator with the model as it was, and with the corrected one, for samples at a rate (Hz)."""
        files = (self.survey.files, model.files)
        before, after = (JsbsimFlyer(self.survey, each, self.aircraft, rate) for each in files)
        return before, after


def user_simulator(text: str, aircraft: Aircraft) -> UserSimulator:
    """The simulator of a command's option.

    Raises InputError where the text names none, JSBSim is not installed, the model does not load, or it is not the
    aircraft file's aircraft.
    """
    kind, separator, model = text.partition(":")
    if kind != "jsbsim" or not separator or not model:
        raise InputError(f"--simulator {text!r}: {_FORM}")
    reference = aircraft.reference
    survey = survey_model(model, reference.airspeed, altitude_of(reference.air_density))
    _require_same_aircraft(text, survey, aircraft)
    return UserSimulator(text, survey, aircraft)


def _require_same_aircraft(text: str, survey: ModelSurvey, aircraft: Aircraft) -> None:
    """Raises InputError where mass or sizes differ by more than the file's tolerances."""
    S, b, cbar = survey.geometry
    pairs = {
        "mass": (survey.mass, aircraft.mass, "kg"),
        "geometry.S": (S, aircraft.geometry.S, "m^2"),
        "geometry.b": (b, aircraft.geometry.b, "m"),
        "geometry.cbar": (cbar, aircraft.geometry.cbar, "m"),
    }
    for key, (theirs, ours, unit) in pairs.items():
        allowed = max(_SHARE * ours, _SIGMAS * aircraft.tolerances.get(key, 0.0))
        if abs(theirs - ours) > allowed:
            raise InputError(
                f"--simulator {text}: its {key} is {theirs:.4g} {unit}, the aircraft file {aircraft.name!r} says "
                f"{ours:.4g}; give the model's own file (sysid import makes it)"
            )
    missing = [name for name in aircraft.controls if name not in {s.name for s in survey.surfaces}]
    if missing:
        raise InputError(f"--simulator {text}: no command of its moves the {missing[0]} of {aircraft.name!r}; "
                         "give the model's own file (sysid import makes it)")  # fmt: skip
