"""What one unit of each imperfection changes in the signals, to first order.

Signs are those of a quantity that is larger than was taken. A change is a function of the ``ColumnChanges`` that it
adds to, of the last part of its tolerance's key, and of the whole key.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

from sysid_node.online.systematic.column_changes import AXES, FORCES, RATES, ColumnChanges, Terms

Change = Callable[[ColumnChanges, str, str], None]

_MOMENTS = {"Cl": "p", "Cm": "q", "Cn": "r"}
_COEFFICIENTS = ("CL", "CD", "CY", "Cl", "Cm", "Cn")


def change_of(key: str) -> Change | None:
    """What a tolerance with this key changes; None where it changes no signal."""
    return CHANGES.get(key) or CHANGES.get(key.rpartition(".")[0]) or _control(key)


def _control(key: str) -> Change | None:
    parts = key.split(".")
    if len(parts) == 3 and parts[0] == "controls":
        return {"scale": _control_scale, "offset": _control_offset}.get(parts[2])
    return None


def _symbol(changes: ColumnChanges, key: str) -> str:
    return changes.aircraft.controls[key.split(".")[1]].symbol


def _control_scale(changes: ColumnChanges, name: str, key: str) -> None:
    changes.scale(_symbol(changes, key), 1.0)


def _control_offset(changes: ColumnChanges, name: str, key: str) -> None:
    changes.shift(_symbol(changes, key), 1.0)


def _mass(changes: ColumnChanges, name: str, key: str) -> None:
    _scaled_forces(changes, 1.0 / changes.aircraft.mass)


def _scaled_forces(changes: ColumnChanges, share: float) -> None:
    for axis, (terms, mean) in changes.forces().items():
        changes.force(axis, {n: (share * a, share * b) for n, (a, b) in terms.items()}, share * mean)


def _inertia(changes: ColumnChanges, name: str, key: str) -> None:
    g, reference = changes.aircraft.geometry, changes.aircraft.reference
    per_area = 1.0 / (0.5 * reference.air_density * reference.airspeed**2 * g.S)
    roll, pitch = per_area / g.b, per_area / g.cbar
    if name == "Ixz":
        changes.acceleration("Cl", "r", -roll)
        changes.acceleration("Cn", "p", -roll)
        return
    coefficient, rate, factor = {"Ixx": ("Cl", "p", roll), "Iyy": ("Cm", "q", pitch), "Izz": ("Cn", "r", roll)}[name]
    changes.acceleration(coefficient, rate, factor)


def _geometry(changes: ColumnChanges, name: str, key: str) -> None:
    g = changes.aircraft.geometry
    if name == "S":
        for coefficient in _COEFFICIENTS:
            changes.scale(coefficient, -1.0 / g.S)
        return
    length = g.b if name == "b" else g.cbar
    for coefficient, rate in _MOMENTS.items():
        if (rate == "q") == (name == "cbar"):
            changes.scale(coefficient, -1.0 / length)
            changes.scale(rate, 1.0 / length)


def _density(changes: ColumnChanges, name: str, key: str) -> None:
    for regressor in ("alpha", "beta", "p", "q", "r", "V", *changes.layout.timed):
        changes.rescale(regressor, 1.0)
    changes.rescale("k", -1.0)
    _shift_coefficients(changes, -1.0)


def _shift_coefficients(changes: ColumnChanges, share: float) -> None:
    """Change the means of all coefficients by a share of them, as the dynamic pressure is another."""
    for coefficient in _COEFFICIENTS:
        changes.shift(coefficient, share * changes.means.of(coefficient))


def _airspeed_scale(changes: ColumnChanges, name: str, key: str) -> None:
    _airspeed(changes, -1.0)  # a scale that is too large reads too much: the true airspeed is less


def _airspeed_bias(changes: ColumnChanges, name: str, key: str) -> None:
    _airspeed(changes, -1.0 / changes.airspeed)


def _airspeed(changes: ColumnChanges, share: float) -> None:
    for regressor in ("alpha", "beta", *changes.layout.timed):
        changes.rescale(regressor, 2.0 * share)
    for rate in RATES:
        changes.rescale(rate, share)
        changes.shift(rate, -share * changes.means.of(rate))
    changes.rescale("V", 3.0 * share)
    changes.shift("V", share * changes.means.of("V"))
    changes.rescale("k", -2.0 * share)
    _shift_coefficients(changes, -2.0 * share)
    for axis, (terms, _) in changes.forces().items():  # the flow turns by the accelerations over the airspeed
        changes.angles_by_force(axis, {n: (-share * a, 0.0) for n, (a, _) in terms.items()})
    changes.angles_by_rate("p", "p", -share)
    _angles_by_arms(changes, ("alpha", "beta"), -share)


def _vane_scale(changes: ColumnChanges, name: str, key: str) -> None:
    """A vane's scale is that of the flow at the probe, which is that at the CG less what the arms bring."""
    changes.by_vane(name)({name: (-1.0, 0.0)}, -changes.means.of(name))
    _angles_by_arms(changes, (name,), 1.0)


def _angles_by_arms(changes: ColumnChanges, angles: Sequence[str], factor: float) -> None:
    """Change flow angles at the CG by ``factor`` times what the probe's arms bring to them."""
    for along, arm in enumerate(changes.aircraft.sensors.air_data):
        for flow in changes.probe_flow(along):
            if flow.of in angles:
                changes.flow_at_cg(flow, factor * arm)


def _vane_bias(changes: ColumnChanges, name: str, key: str) -> None:
    changes.by_vane(name)({}, -1.0)
    if name == "alpha":
        changes.mean_alpha(-1.0)


def _mean_alpha(changes: ColumnChanges, name: str, key: str) -> None:
    changes.by_integration("alpha")({}, 1.0)
    changes.mean_alpha(1.0)


def _air_data_late(changes: ColumnChanges, name: str, key: str) -> None:
    _air_data_later(changes, 1.0)


def _air_data_later(changes: ColumnChanges, by: float) -> None:
    """The rates of what the probe measures: of the flow at the CG, and of its difference from the flow at the probe."""
    for angle in ("alpha", "beta"):
        changes.by_vane(angle)({angle: (0.0, by)}, 0.0)
    changes.airspeed_varies({"0": (0.0, 0.5 * by)})  # k goes with the airspeed's square
    for along, arm in enumerate(changes.aircraft.sensors.air_data):
        for flow in changes.probe_flow(along):
            # the flow at the CG is that at the probe and what the arm brings, which is not late
            changes.flow_at_cg(flow, 0.0, rate=-by * arm)


def _imu_late(changes: ColumnChanges, name: str, key: str) -> None:
    """Only the times between topics matter, so that a late IMU is the same as early air data and actuators.

    Its own columns are products, k p for example, of which it makes one factor late. Were they moved as a whole, the
    difference, the rate of k times p, would be the only part of the change that nothing else can make up for.
    """
    _air_data_later(changes, -1.0)
    _actuators_later(changes, -1.0)


def _actuators_late(changes: ColumnChanges, name: str, key: str) -> None:
    _actuators_later(changes, 1.0)


def _actuators_later(changes: ColumnChanges, by: float) -> None:
    for control in changes.layout.timed:
        changes.add(control, {control: (0.0, by)})


def _imu_scale(changes: ColumnChanges, name: str, key: str) -> None:
    if name in RATES:
        changes.rate(name, name, -1.0)
        changes.angles_by_rate(name, name, -1.0)
        return
    axis = name[-1].upper()
    terms, mean = changes.forces()[axis]
    _reading(changes, axis, {n: (-a, -b) for n, (a, b) in terms.items()}, -mean)


def _reading(changes: ColumnChanges, axis: str, terms: Terms, mean: float) -> None:
    """The force along a body axis is another than the accelerometers say."""
    changes.force(axis, terms, mean)
    changes.angles_by_force(axis, terms)


def _imu_bias(changes: ColumnChanges, name: str, key: str) -> None:
    if name in RATES:
        changes.shift(name, -1.0 / (changes.per_column(name) * changes.means.k))
        return
    mean = -_per_acceleration(changes) / changes.means.k
    changes.force(name[-1].upper(), {"0": (-mean, 0.0)}, mean)  # constant, while the mean goes with k
    if name == "ay":
        changes.mean_sideslip(mean)


def _per_acceleration(changes: ColumnChanges) -> float:
    """Reference force coefficient per m/s^2."""
    aircraft, reference = changes.aircraft, changes.aircraft.reference
    return aircraft.mass / (0.5 * reference.air_density * reference.airspeed**2 * aircraft.geometry.S)


def _imu_misalignment(changes: ColumnChanges, name: str, key: str) -> None:
    about = ("roll", "pitch", "yaw").index(name)
    one, other = (about + 1) % 3, (about + 2) % 3
    forces = changes.forces()
    for target, source, sign in ((one, other, -1.0), (other, one, 1.0)):
        terms, mean = forces[FORCES[source]]
        turned = {n: (sign * a, sign * b) for n, (a, b) in terms.items()}
        changes.force(FORCES[target], turned, sign * mean)
        changes.rate(RATES[target], RATES[source], sign)
        if name != "roll":
            changes.angles_by_force(FORCES[target], turned)
            changes.angles_by_rate(RATES[target], RATES[source], sign)
    if name == "roll":  # bank follows from the readings and turns with them, and so do both angles
        changes.by_integration("alpha")({"beta": (1.0, 0.0)}, 0.0)
        changes.by_integration("beta")({"alpha": (-1.0, 0.0)}, 0.0)
        changes.mean_sideslip(-forces["Z"][1])


def _imu_place(changes: ColumnChanges, name: str, key: str) -> None:
    _imu_moved(changes, name, 1.0)


def _imu_moved(changes: ColumnChanges, name: str, by: float) -> None:
    """The IMU's arm is longer: its tangential acceleration, angular acceleration x arm, is not the CG's."""
    along = AXES.index(name)
    per_acceleration = _per_acceleration(changes)
    # (w x e)_i for the unit vector e: the next axis gains w of the one after, and the one after loses w of the next
    changes.acceleration(FORCES[(along + 1) % 3], RATES[(along + 2) % 3], -by * per_acceleration)
    changes.acceleration(FORCES[(along + 2) % 3], RATES[(along + 1) % 3], by * per_acceleration)


def _probe_place(changes: ColumnChanges, name: str, key: str) -> None:
    _probe_moved(changes, name, 1.0)


def _probe_moved(changes: ColumnChanges, name: str, by: float) -> None:
    """The probe's arm is longer: the flow at the CG is that at the probe less rates x arm."""
    for flow in changes.probe_flow(AXES.index(name)):
        changes.flow_at_cg(flow, by)


def _cg(changes: ColumnChanges, name: str, key: str) -> None:
    """The CG lies further along an axis: arms are shorter, and moments about the file's CG hold e x force."""
    _imu_moved(changes, name, -1.0)
    _probe_moved(changes, name, -1.0)
    along, g = AXES.index(name), changes.aircraft.geometry
    forces = changes.forces()
    for moment, source, sign in (((along + 1) % 3, (along + 2) % 3, -1.0), ((along + 2) % 3, (along + 1) % 3, 1.0)):
        coefficient, length = (("Cl", g.b), ("Cm", g.cbar), ("Cn", g.b))[moment]
        terms, mean = forces[FORCES[source]]
        factor = sign / length
        changes.add(coefficient, {n: (factor * a, factor * b) for n, (a, b) in terms.items()})
        changes.shift(coefficient, factor * mean)


def _max_thrust(changes: ColumnChanges, name: str, key: str) -> None:
    throttle = changes.aircraft.throttle
    assert throttle is not None
    full = throttle.max_thrust or 1.0
    _thrust(changes, math.cos(throttle.inclination) / full, -math.sin(throttle.inclination) / full, throttle.arm / full)


def _inclination(changes: ColumnChanges, name: str, key: str) -> None:
    throttle = changes.aircraft.throttle
    assert throttle is not None
    _thrust(changes, -math.sin(throttle.inclination), -math.cos(throttle.inclination), 0.0)


def _thrust_arm(changes: ColumnChanges, name: str, key: str) -> None:
    _thrust(changes, 0.0, 0.0, 1.0)


def _thrust(changes: ColumnChanges, forward: float, down: float, arm: float) -> None:
    """Shares of the thrust that are in fact along x and z, and its arm (m): the aerodynamics' part is less."""
    thrust = changes.means.of("thrust")
    changes.force("X", {"thrust": (-forward, 0.0)}, -forward * thrust)
    changes.force("Z", {"thrust": (-down, 0.0)}, -down * thrust)
    factor = -arm / changes.aircraft.geometry.cbar
    changes.add("Cm", {"thrust": (factor, 0.0)})
    changes.shift("Cm", factor * thrust)


#: What one unit of a tolerance changes, by its key or by all of the key but its last part.
CHANGES: Mapping[str, Change] = {
    "mass": _mass,
    "inertia": _inertia,
    "geometry": _geometry,
    "air_density": _density,
    "airspeed_scale": _airspeed_scale,
    "airspeed_bias": _airspeed_bias,
    "vane_scale": _vane_scale,
    "vane_bias": _vane_bias,
    "mean_alpha": _mean_alpha,
    "delays.air_data": _air_data_late,
    "air_data_lag": _air_data_late,
    "delays.imu": _imu_late,
    "delays.actuators": _actuators_late,
    "imu_scale": _imu_scale,
    "imu_bias": _imu_bias,
    "imu_misalignment": _imu_misalignment,
    "sensors.imu": _imu_place,
    "sensors.air_data": _probe_place,
    "cg_shift": _cg,
    "throttle.max_thrust": _max_thrust,
    "throttle.inclination": _inclination,
    "throttle.arm": _thrust_arm,
}
