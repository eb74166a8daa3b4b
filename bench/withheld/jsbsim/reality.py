"""A JSBSim model in flight with a withheld effect: its motion as ideal instruments would feel it, step by step."""

from __future__ import annotations

import math
import tempfile
from collections import deque
from collections.abc import Mapping, Sequence
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

import numpy as np

from bench.withheld.jsbsim.drawing import Withheld
from bench.withheld.plants.motion import DivergedError, Instant
from sysid_node.aircraft.model import Aircraft
from sysid_node.sim.importing.jsbsim.files import ModelFiles, copy_model
from sysid_node.sim.importing.jsbsim.program import FOOT, POUND, SLUG, Program
from sysid_node.sim.importing.jsbsim.surfaces import COMMANDS
from sysid_node.sim.importing.jsbsim.survey import ModelSurvey
from sysid_node.sim.importing.jsbsim.trim import SteadyFlight, find_trim

_AXES = {"Cl": ("ROLL", "bw-ft"), "Cm": ("PITCH", "cbarw-ft"), "Cn": ("YAW", "bw-ft")}
#: Of a model in body axes: the axes of a coefficient, each with a sign and the function of alpha that turns it.
_BODY = {
    "CL": (("X", 1.0, "sin"), ("Z", -1.0, "cos")),
    "CD": (("X", -1.0, "cos"), ("Z", -1.0, "sin")),
    "CY": (("Y", 1.0, ""),),
}
_STATES = {
    "alpha": ("aero/alpha-rad",),
    "beta": ("aero/beta-rad",),
    "p": ("velocities/p-aero-rad_sec", "aero/bi2vel"),
    "q": ("velocities/q-aero-rad_sec", "aero/ci2vel"),
    "r": ("velocities/r-aero-rad_sec", "aero/bi2vel"),
    "0": (),
}


def edited(survey: ModelSurvey, folder: Path, withheld: Withheld) -> ModelFiles:
    """A copy of the model with what of the effects its XML holds."""
    files = copy_model(survey.files, folder, ())
    tree = ElementTree.parse(files.main)
    root = tree.getroot()
    effects = withheld.effects
    for name, value in effects.get("derivative_error", {}).items():
        _coefficient(root, name, value)
    if "rotor" in withheld.unlisted:
        _rotor(root, survey, withheld.unlisted["rotor"])
    more = effects.get("mass_error", {}).get("error", 0.0)
    if more:
        _point_mass(root, more * survey.mass, survey.cg_in)
    if "cg_shift" in effects:  # a load taken from here and put there: mass is moved, none is added
        load, arm = 0.1 * survey.mass * (1.0 + more), effects["cg_shift"]["x"] / 0.1
        x, y, z = survey.cg_in
        _point_mass(root, -load, survey.cg_in)
        _point_mass(root, load, (x - arm / 0.0254, y, z))
    tree.write(files.main)
    return files


def _without_lags(files: ModelFiles, controls: Sequence[str]) -> None:
    """Takes the lags of servos out of a model: all that moves such a control follows its command outside JSBSim."""
    tree = ElementTree.parse(files.main)
    for actuator in tree.iter("actuator"):
        if any(control in actuator.get("name", "") for control in controls):
            for lag in actuator.findall("lag"):
                actuator.remove(lag)
    tree.write(files.main)


def _coefficient(root: Element, name: str, value: float) -> None:
    coefficient, _, state = name.partition("_")
    aerodynamics = root.find("aerodynamics")
    assert aerodynamics is not None
    if coefficient in _AXES:
        axis_name, length = _AXES[coefficient]
        _term(_axis(aerodynamics, axis_name), name, [f"metrics/{length}", *_STATES[state]], value)
    elif aerodynamics.find("axis[@name='DRAG']") is not None:
        axis = {"CL": "LIFT", "CD": "DRAG", "CY": "SIDE"}[coefficient]
        _term(_axis(aerodynamics, axis), name, list(_STATES[state]), value)
    else:
        for axis, sign, turn in _BODY[coefficient]:
            _term(_axis(aerodynamics, axis), f"{name}-{axis}", list(_STATES[state]), sign * value, turn)


def _axis(aerodynamics: Element, name: str) -> Element:
    axis = aerodynamics.find(f"axis[@name='{name}']")
    assert axis is not None, name
    return axis


def _term(axis: Element, name: str, properties: list[str], value: float, turn: str = "") -> None:
    product = SubElement(SubElement(axis, "function", name=f"aero/withheld/{name}"), "product")
    for place in ("aero/qbar-psf", "metrics/Sw-sqft", *properties):
        SubElement(product, "property").text = place
    if turn:
        SubElement(SubElement(product, turn), "property").text = "aero/alpha-rad"
    SubElement(product, "value").text = repr(value)


def _rotor(root: Element, survey: ModelSurvey, share: float) -> None:
    """A rotor's momentum along x: it pitches the aircraft by yaw rate and yaws it by pitch rate."""
    aerodynamics = root.find("aerodynamics")
    assert aerodynamics is not None
    S, _, cbar = survey.geometry
    speed = survey.steady.state.airspeed
    momentum = share * _DAMPING * 0.25 * _DENSITY * speed * S * cbar**2 * _FOOT_POUNDS
    for axis, state, sign in (("PITCH", "r", -1.0), ("YAW", "q", 1.0)):
        product = SubElement(SubElement(_axis(aerodynamics, axis), "function", name=f"aero/withheld/rotor-{axis}"),
                             "product")  # fmt: skip
        SubElement(product, "property").text = f"velocities/{state}-rad_sec"
        SubElement(product, "value").text = repr(sign * momentum)


def _point_mass(root: Element, mass: float, place_in: tuple[float, float, float]) -> None:
    balance = root.find("mass_balance")
    assert balance is not None
    point = SubElement(balance, "pointmass", name=f"withheld {len(balance)}")
    SubElement(point, "weight", unit="LBS").text = repr(mass / 0.45359237)
    place = SubElement(point, "location", name="POINTMASS", unit="IN")
    for axis, value in zip("xyz", place_in, strict=True):
        SubElement(place, axis).text = repr(value)


#: By which a rotor is scaled: a usual damping in pitch, -Cm_q, and the air's density, kg/m^3.
_DAMPING, _DENSITY, _FOOT_POUNDS = 10.0, 1.2, 1.0 / 1.3558179483


class Servo:
    """A servo between the command and JSBSim: delay, lag, free play, rate limit, offset, lost effect, in this order."""

    def __init__(self, values: Mapping[str, float], start: float, step: float) -> None:
        self._values, self._step = values, step
        whole, self._part = divmod(values.get("command_delay", 0.0) / step, 1.0)
        self._given = deque([start] * (int(whole) + 2), int(whole) + 2)  # commands, the newest last
        self._lagged = self._linked = self._position = start

    def move(self, command: float) -> float:
        """The surface's effective deflection (rad) one step on."""
        values, step = self._values, self._step
        self._given.append(command)
        command = self._part * self._given[0] + (1.0 - self._part) * self._given[1]
        lag = values.get("actuator_lag", 0.0)
        self._lagged += (command - self._lagged) * (1.0 - math.exp(-step / lag) if lag else 1.0)
        half = 0.5 * values.get("actuator_backlash", 0.0)
        off = self._lagged - self._linked
        self._linked += math.copysign(max(abs(off) - half, 0.0), off)
        reach = values.get("actuator_rate_limit", math.inf) * step
        self._position += min(max(self._linked - self._position, -reach), reach)
        return (self._position + values.get("actuator_bias", 0.0)) * (
            1.0 - values.get("control_effectiveness_loss", 0.0)
        )


class Reality:
    """The aircraft in flight, at a rate in Hz."""

    def __init__(self, survey: ModelSurvey, aircraft: Aircraft, withheld: Withheld, rate: float) -> None:
        self._survey, self._withheld, self._rate = survey, withheld, rate
        self.controls = tuple(aircraft.controls)
        with tempfile.TemporaryDirectory() as place:
            files = edited(survey, Path(place), withheld)
            _without_lags(files, [name for name in self.controls if withheld.servo(name)])
            self._program = Program(files, rate)
        self._trimmed = self._trim()
        throttle = aircraft.throttle
        self._full = (throttle.max_thrust or 1.0) if throttle else 1.0
        self.trim = {**self._trimmed.deflections, "thrust": self._full * self._trimmed.state.throttle}
        self._surfaces = {s.name: s for s in survey.surfaces}
        self.cg = self._moved()

    def _trim(self) -> SteadyFlight:
        """The steady flight of this reality, with its surfaces free."""
        survey = self._survey
        with tempfile.TemporaryDirectory() as place:
            files = edited(survey, Path(place) / "edited", self._withheld)
            moved = {name for s in survey.surfaces for name in s.properties}
            free = Program(copy_model(files, Path(place) / "free", moved))
            found = find_trim(free, survey.surfaces, survey.steady.state)
        if found is None:
            raise DivergedError("no trim")
        return found

    def _moved(self) -> tuple[float, float, float]:
        """The true centre of gravity from the file's, m, forward-right-down."""
        now = [float(self._program.fdm[f"inertia/cg-{axis}-in"]) for axis in "xyz"]
        x, y, z = (0.0254 * (a - b) for a, b in zip(now, self._survey.cg_in, strict=True))
        return -x, y, -z

    def start(self) -> Instant:
        """Back to the trim; the motion there."""
        step = 1.0 / self._rate
        self._servos = {n: Servo(self._servo(n), self.trim[n], step) for n in self.controls}
        self._program.put(self._trimmed.state, self._properties(self.trim, self._trimmed.state.throttle))
        self._program.step(round(2.0 * self._rate))
        self.cg = self._moved()
        return self.instant()

    def _servo(self, control: str) -> dict[str, float]:
        """What moves a control between its command and JSBSim: nothing where nothing of it is withheld."""
        withheld = dict(self._withheld.servo(control))
        if withheld:
            withheld["actuator_lag"] = withheld.get("actuator_lag", 0.0) + self._survey.servos[control].lag
        return withheld

    def _properties(self, deflections: Mapping[str, float], throttle: float) -> dict[str, float]:
        found = {}
        for name, surface in self._surfaces.items():
            found |= {COMMANDS[name]: surface.command_for(deflections[name])}
        return found | {f"fcs/throttle-cmd-norm[{i}]": throttle for i in range(max(self._survey.engines, 1))}

    def step(self, commands: Mapping[str, float], gusts: Sequence[float], share: float) -> None:
        """One step on with commands (rad, thrust N) in a share of the gusts (m/s, body axes)."""
        fdm = self._program.fdm
        moved = {name: self._servos[name].move(commands[name]) for name in self.controls}
        moved["elevator"] += self._withheld.unlisted.get("crossfeed", 0.0) * (moved["aileron"] - self.trim["aileron"])
        self._program.drive(self._properties(moved, min(max(commands["thrust"] / self._full, 0.0), 1.0)))
        if any(gusts[:3]):
            phi, theta, psi = (float(fdm[f"attitude/{a}-rad"]) for a in ("phi", "theta", "psi"))
            air = _rotation(phi, theta, psi) @ np.array(gusts[:3]) * share / FOOT
            for way, value in zip(("north", "east", "down"), air.tolist(), strict=True):
                fdm[f"atmosphere/gust-{way}-fps"] = value
        fdm.run()

    def instant(self) -> Instant:
        """The motion now. Raises DivergedError."""
        fdm = self._program.fdm

        def triple(names: str, unit: float = 1.0, axes: str = "xyz") -> tuple[float, float, float]:
            a, b, c = (float(fdm[names.format(x)]) * unit for x in axes)
            return a, b, c

        mass = float(fdm["inertia/mass-slugs"]) * SLUG
        euler = tuple(float(fdm[f"attitude/{a}-rad"]) for a in ("phi", "theta", "psi"))
        force = triple("forces/fb{}-total-lbs", POUND / mass)
        if not (abs(euler[1]) < 1.4 and math.isfinite(force[2]) and abs(force[2]) < 200.0):
            raise DivergedError("the flight diverges")
        return Instant(
            force,
            triple("accelerations/{}dot-rad_sec2", axes="pqr"),
            triple("velocities/{}-rad_sec", axes="pqr"),
            euler,  # type: ignore[arg-type]
            triple("velocities/{}-aero-fps", FOOT, "uvw"),
            triple("velocities/{}-aero-rad_sec", axes="pqr"),
            float(fdm["atmosphere/rho-slugs_ft3"]) * SLUG / FOOT**3,
        )


def _rotation(phi: float, theta: float, psi: float) -> np.ndarray:
    """Body axes to north, east, down."""
    (sp, st, ss), (cp, ct, cs) = np.sin([phi, theta, psi]), np.cos([phi, theta, psi])
    return np.array(
        [
            [ct * cs, sp * st * cs - cp * ss, cp * st * cs + sp * ss],
            [ct * ss, sp * st * ss + cp * cs, cp * st * ss - sp * cs],
            [-st, sp * ct, cp * ct],
        ]
    )
