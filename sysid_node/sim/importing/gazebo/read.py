"""Reads a Gazebo model into an aircraft file's contents."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Control, Geometry, Inertia
from sysid_node.errors import InputError
from sysid_node.sim.importing.gazebo.advanced_lift_drag import AdvancedLiftDrag
from sysid_node.sim.importing.gazebo.controls import controls_of, joint_angles
from sysid_node.sim.importing.gazebo.lift_drag import LiftDrag
from sysid_node.sim.importing.gazebo.motion import I_GAIN, leads, motor_effects, servo_effects
from sysid_node.sim.importing.gazebo.numbers import number_in
from sysid_node.sim.importing.gazebo.sdf import SdfModel, masses, read_sdf
from sysid_node.sim.importing.imported import Imported, asymmetry_notes
from sysid_node.sim.importing.plant import Plant, PlantEngine, PlantStates, aircraft_of, nondimensional

Array = NDArray[np.float64]

#: From forward-left-up to forward-right-down and back.
_TURN = np.array([1.0, -1.0, -1.0])

_ALPHA = np.deg2rad(np.arange(-16.0, 24.01, 1.0))
_BETA = np.deg2rad([-15.0, -10.0, -5.0, 0.0, 5.0, 10.0, 15.0])


@dataclass(frozen=True)
class Rotor:
    """A MulticopterMotorModel: thrust k w^2 along the rotor link's z axis, drag and torques by its coefficients."""

    joint: str
    place: Array  # from the centre of gravity, m, forward-right-down
    axis: Array
    constants: Mapping[str, float]
    turning: float  # 1 counter-clockwise, -1 clockwise

    @property
    def full_thrust(self) -> float:
        """N."""
        return self.constants["motorConstant"] * self.constants["maxRotVelocity"] ** 2


def read_gazebo(path: Path, airspeed: float | None = None) -> Imported:
    """The aircraft of an SDF with AdvancedLiftDrag or LiftDrag plugins. Raises InputError."""
    model = read_sdf(path)
    plant, loads, kinds = _plant(model, path.name)
    aircraft, _ = aircraft_of(plant, airspeed)
    return Imported(aircraft, tuple(_notes(model, loads, *kinds)))


def gazebo_plant(path: Path) -> Plant:
    """The equations of an SDF with AdvancedLiftDrag or LiftDrag plugins. Raises InputError."""
    return _plant(read_sdf(path), path.name)[0]


def _plant(model: SdfModel, file: str) -> tuple[Plant, _Loads, tuple[bool, bool]]:
    """The equations, the loads in them, and whether there are simple and advanced plugins."""
    simple = [LiftDrag.of(p, model.file) for p in model.plugins_named("LiftDrag", "LiftDragPlugin")]
    advanced = [AdvancedLiftDrag.of(p, model.file) for p in model.plugins_named("AdvancedLiftDrag")]
    if not simple and not advanced:
        raise InputError(
            f"{model.file}: model {model.name!r} has no plugin LiftDrag or AdvancedLiftDrag; nothing is to be read"
        )
    missing = {name for name in (*(w.link for w in simple), *(w.link for w in advanced)) if name not in model.links}
    if missing:
        raise InputError(
            f"{model.file}: a lift-drag plugin names the link {min(missing)!r}, which the model does not have"
        )
    mass, centre, inertia = masses(model)
    geometry, density = _geometry(simple, advanced, model.file)
    loads = _Loads(model, centre, simple, advanced, _rotor(model, centre))
    unknown = sorted(set(loads.joints) - set(model.joints))
    if unknown:
        raise InputError(
            f"{model.file}: a lift-drag plugin names the joint {unknown[0]!r}, which the model does not have"
        )
    controls = controls_of(_power(loads, geometry, density), _limits(model, loads.joints))
    loads.controls = controls
    plant = Plant(
        name=model.name,
        source=f"Gazebo's model {model.name} in {file}",
        mass=mass,
        inertia=Inertia(*(float(inertia[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (0, 2)))),
        geometry=geometry,
        density=density,
        controls=controls,
        air=loads.air,
        engine=PlantEngine(loads.engine, loads.rotor.joint, loads.rotor.full_thrust) if loads.rotor else None,
        nodes=_nodes(simple, advanced),
        effects=servo_effects(model, controls) | (motor_effects(loads.rotor.constants) if loads.rotor else {}),
    )
    return plant, loads, (bool(simple), bool(advanced))


class _Loads:
    """Sums the loads of all plugins about the centre of gravity, forward-right-down."""

    def __init__(
        self,
        model: SdfModel,
        centre: Array,
        simple: Sequence[LiftDrag],
        advanced: Sequence[AdvancedLiftDrag],
        rotor: Rotor | None,
    ) -> None:
        self._simple, self._advanced, self.rotor = simple, advanced, rotor
        self._origin = {name: body.pose for name, body in model.links.items()}
        self._centre = centre
        self.controls: Mapping[str, Control] = {}
        joints = [wing.joint for wing in simple if wing.joint] + [j for wing in advanced for j in wing.joints]
        self.joints = tuple(dict.fromkeys(joints))

    def air(self, s: PlantStates) -> Array:
        """Loads (N, 6) of the wings, and of the rotor's drag and torques."""
        angles = joint_angles(self.controls, s.controls)
        return self.of_joints(s, angles)

    def of_joints(self, s: PlantStates, angles: Mapping[str, Array]) -> Array:
        """The same by the joints' angles."""
        velocity, rates = _motion(s)
        total = np.zeros((len(s.airspeed), 6))
        for wing in self._simple:
            pose = self._origin[wing.link]
            arm = _TURN * (pose.place + pose.axes.apply(wing.place) - self._centre)
            at = (velocity + np.cross(rates, arm)) * _TURN
            force = wing.force(pose.axes.inv().apply(at), angles.get(wing.joint, np.zeros(len(at))))
            total += _about(pose.axes.apply(force) * _TURN, arm)
        for whole in self._advanced:
            arm = _TURN * (self._origin[whole.link].place + whole.place - self._centre)
            force, moment = whole.load(velocity + np.cross(rates, arm), rates, angles)
            total += _about(force, arm)
            total[:, 3:] += moment
        return total + self._rotor_drag(s, velocity, rates)

    def _rotor_drag(self, s: PlantStates, velocity: Array, rates: Array) -> Array:
        if self.rotor is None:
            return np.zeros((len(velocity), 6))
        rotor, k = self.rotor, self.rotor.constants
        speed = k["maxRotVelocity"] * np.sqrt(np.maximum(s.throttle, 0.0))
        at = velocity + np.cross(rates, rotor.place)
        across = at - np.outer(at @ rotor.axis, rotor.axis)
        total = _about(-(speed * k["rotorDragCoefficient"])[:, None] * across, rotor.place)
        thrust = k["motorConstant"] * speed**2
        total[:, 3:] -= rotor.turning * np.outer(thrust * k["momentConstant"], rotor.axis)
        total[:, 3:] -= (speed * k["rollingMomentCoefficient"])[:, None] * across
        return total

    def engine(self, s: PlantStates) -> Array:
        """Loads (N, 6) of the thrust."""
        assert self.rotor is not None
        thrust = self.rotor.full_thrust * s.throttle
        return _about(np.outer(thrust, self.rotor.axis), self.rotor.place)


def _motion(s: PlantStates) -> tuple[Array, Array]:
    forward = s.airspeed * np.cos(s.beta)
    velocity = [forward * np.cos(s.alpha), s.airspeed * np.sin(s.beta), forward * np.sin(s.alpha)]
    return np.column_stack(velocity), np.column_stack([s.p, s.q, s.r])


def _about(force: Array, arm: Array) -> Array:
    """Loads (N, 6) of a force (N, 3) at a point (3,)."""
    return np.hstack([force, np.cross(np.broadcast_to(arm, force.shape), force)])


def _geometry(simple: Sequence[LiftDrag], advanced: Sequence[AdvancedLiftDrag], file: str) -> tuple[Geometry, float]:
    """Reference sizes and density: the plugin's own, or of separate surfaces the sum of the horizontal ones' areas.

    A LiftDrag plugin states neither span nor chord; the span is twice the largest distance of a surface's place from
    the middle and of its own half width, the chord the area over the span.

    Raises InputError where no surface is horizontal.
    """
    if advanced:
        whole = advanced[0]
        return Geometry(whole.values["area"], whole.span, whole.chord), whole.values["air_density"]
    wings = [wing for wing in simple if abs(wing.upward[2]) > 0.7]
    if not wings:
        raise InputError(f"{file}: no LiftDrag surface has <upward> along z, so it has no wing; correct <upward>")
    area = sum(wing.area for wing in wings)
    places = sorted({round(abs(float(wing.place[1])), 6) for wing in wings})
    reach = places[-1] + (0.5 * (places[-1] - places[-2]) if len(places) > 1 else 0.0)
    span = 2.0 * reach if reach > 0.0 else math.sqrt(6.0 * area)
    return Geometry(area, span, area / span), simple[0].density


def _nodes(simple: Sequence[LiftDrag], advanced: Sequence[AdvancedLiftDrag]) -> dict[str, Array]:
    """Nodes of alpha and beta; alpha has those where the plugins' curves have kinks."""
    kinks = [sign * whole.values["alpha_stall"] for whole in advanced for sign in (-1.0, 1.0)]
    for wing in simple:
        kinks += [-wing.alpha0, wing.alpha_stall - wing.alpha0, -wing.alpha_stall - wing.alpha0]
    inside = [k for k in kinks if _ALPHA[0] < k < _ALPHA[-1]]
    return {"alpha": np.unique([*_ALPHA, *inside]), "beta": _BETA}


def _power(loads: _Loads, geometry: Geometry, density: float) -> dict[str, Array]:
    """Each joint's coefficients per rad (6,) at a small angle of attack."""
    one = np.ones(2)
    states = PlantStates(20.0 * one, 0.05 * one, 0.0 * one, 0.0 * one, 0.0 * one, 0.0 * one, {}, 0.0 * one)
    power = {}
    for joint in loads.joints:
        angles = dict.fromkeys(loads.joints, 0.0 * one) | {joint: np.array([-0.01, 0.01])}
        found = nondimensional(loads.of_joints(states, angles), density, states, geometry)
        power[joint] = (found[1] - found[0]) / 0.02
    return power


def _limits(model: SdfModel, joints: Sequence[str]) -> dict[str, float]:
    """The largest angle of each joint either way, rad, of those that have limits."""
    limits = {}
    for joint in joints:
        ends = [model.joint_number(joint, f"axis/limit/{end}") for end in ("lower", "upper")]
        known = [abs(end) for end in ends if end is not None]
        if known:
            limits[joint] = max(known)
    return limits


def _rotor(model: SdfModel, centre: Array) -> Rotor | None:
    motors = model.plugins_named("MulticopterMotorModel")
    if not motors:
        return None
    plugin = max(motors, key=lambda motor: float(_thrust_axis(model, motor)[0]))  # of a VTOL the one that pulls forward
    link = _motor_link(model, plugin)
    names = {
        "motorConstant": 8.54858e-06,
        "momentConstant": 0.016,
        "maxRotVelocity": 838.0,
        "rotorDragCoefficient": 1e-4,
        "rollingMomentCoefficient": 1e-6,
        "timeConstantUp": 0.0125,
        "timeConstantDown": 0.025,
    }
    body = model.links[link]
    return Rotor(
        joint=(plugin.findtext("jointName") or "throttle").strip(),
        place=_TURN * (body.centre - centre),
        axis=_thrust_axis(model, plugin),
        constants={name: number_in(plugin, name, default, model.file) for name, default in names.items()},
        turning=-1.0 if (plugin.findtext("turningDirection") or "").strip() == "cw" else 1.0,
    )


def _motor_link(model: SdfModel, plugin: Element) -> str:
    """The link that a motor turns. Raises InputError where the model has it not."""
    link = (plugin.findtext("linkName") or "").strip()
    if link not in model.links:
        raise InputError(f"{model.file}: the motor's link {link!r} is not in the model")
    return link


def _thrust_axis(model: SdfModel, plugin: Element) -> Array:
    """The direction of a motor's thrust, forward-right-down."""
    return _TURN * model.links[_motor_link(model, plugin)].pose.axes.apply(np.array([0.0, 0.0, 1.0]))


def _notes(model: SdfModel, loads: _Loads, simple: bool, advanced: bool) -> list[str]:
    notes = []
    if simple:
        notes.append("LiftDrag states no span and no chord: those of the file only make coefficients non-dimensional.")
    if advanced:
        notes.append("The pitching moment has Cem0 and Cema; gz-sim before the fix of pull request 3817 drops them.")
    notes.append(
        "At the points of any two variables the tables are exact; between them they are linear (1 degree of alpha), "
        "and what three variables only do together is left out."
    )
    if loads.rotor is not None:
        notes.append(
            "The throttle is the share of full thrust, (rotor speed / maxRotVelocity)^2; how the rotor's drag and "
            "torques follow it is in the tables over the throttle."
        )
        up, down = loads.rotor.constants["timeConstantUp"], loads.rotor.constants["timeConstantDown"]
        if up != down:
            notes.append(f"The motor's lag is the mean of {up:g} s (up) and {down:g} s (down).")
    motors = model.plugins_named("MulticopterMotorModel")
    if len(motors) > 1:
        joint = loads.rotor.joint if loads.rotor is not None else ""
        notes.append(f"Of {len(motors)} motors only that of {joint} is held, the first that pulls forward most; a file "
                     "has one throttle.")  # fmt: skip
    if any(model.includes):
        notes.append(f"Masses of included models ({', '.join(filter(None, model.includes))}) are not counted.")
    inertia = masses(model)[2]
    cross = max(abs(float(inertia[0, 1])), abs(float(inertia[1, 2])))
    return [
        *notes,
        *asymmetry_notes(cross / (float(inertia.diagonal().max()) or 1.0)),
        *_servo_notes(model, loads.joints),
    ]


def _servo_notes(model: SdfModel, joints: Sequence[str]) -> list[str]:
    """What of the joints' travel and of their controllers the file does not hold."""
    notes = []
    for joint in joints:
        low, high = (model.joint_number(joint, f"axis/limit/{end}") for end in ("lower", "upper"))
        if low is not None and high is not None and abs(low + high) > 0.05 * (high - low):
            notes.append(f"The joint {joint} moves from {low:.3f} to {high:.3f} rad; a file has one limit both ways.")
    controllers = model.plugins_named("JointPositionController")
    if any(number_in(p, "i_gain", I_GAIN, model.file) for p in controllers):
        notes.append("Integral gains of the joints' controllers are not held.")
    jumps = leads(model, joints)
    if jumps:
        told = ", ".join(f"{joint} {share:.0%}" for joint, share in jumps.items())
        notes.append(
            f"A derivative gain (d_gain) lets a joint take a part of a step at once ({told}); a file has no such lead, "
            "and its lag is that behind a ramp."
        )
    return notes
