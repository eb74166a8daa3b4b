"""Names, units and ranges of the simulator's effects and their parameters, as aircraft files and commands state them.

This table is plain data, so that an aircraft file can be checked without the simulator.
``test/sim/test_effect_names.py`` holds it against the effects themselves. An effect that acts on the controls has a
parameter for each, named after the control.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass

_INFINITE = math.inf


@dataclass(frozen=True)
class EffectParameter:
    """One number of an effect, as a user states it. ``lower`` and ``upper`` are inclusive."""

    name: str
    unit: str
    lower: float = -math.inf
    upper: float = math.inf


@dataclass(frozen=True)
class EffectNames:
    """The parameters of one effect.

    ``each`` are those of every control: its ``name`` follows that of the control (mostly it is empty). ``all_controls``
    is the key that states all controls at once, besides a number without any key. ``throttle`` says that the throttle
    has one, too. ``derivatives`` says that there is one for each derivative of the file.
    """

    fixed: tuple[EffectParameter, ...] = ()
    each: tuple[EffectParameter, ...] = ()
    all_controls: str = ""
    throttle: bool = False
    derivatives: bool = False

    def parameters(
        self, controls: Collection[str], throttle: bool, derivatives: Iterable[str]
    ) -> dict[str, EffectParameter]:
        """The parameters by name for an aircraft with these controls, with or without throttle, and derivatives."""
        named = [*controls, *(("throttle",) if throttle and self.throttle else ())]
        varying = [EffectParameter(c + p.name, p.unit, p.lower, p.upper) for p in self.each for c in named]
        if self.derivatives:
            varying += [EffectParameter(name, "1" if name.endswith("_0") else "1/rad") for name in derivatives]
        return {p.name: p for p in (*varying, *self.fixed)}


def _fixed(*parameters: tuple[str, str, float, float]) -> EffectNames:
    return EffectNames(fixed=tuple(EffectParameter(*p) for p in parameters))


def _alike(names: str, unit: str, lower: float, upper: float) -> tuple[tuple[str, str, float, float], ...]:
    return tuple((name, unit, lower, upper) for name in names.split())


def _each(unit: str, lower: float, upper: float, *fixed: EffectParameter, key: str = "") -> EffectNames:
    return EffectNames(fixed, (EffectParameter("", unit, lower, upper),), key)


_ONSET = EffectParameter("onset", "s")
_DELAY = _fixed(("delay", "s", -0.5, 0.5))
_PLACE = "x y z"

#: Every effect of the simulator, in the order of its chain.
EFFECT_NAMES: Mapping[str, EffectNames] = {
    "command_delay": EffectNames((), (EffectParameter("", "s", 0.0, 0.5),), "delay", throttle=True),
    "actuator_lag": _each("s", 0.0, 1.0, EffectParameter("damping", "1", 0.1, 10.0), key="time_constant"),
    "actuator_backlash": _each("rad", 0.0, 0.5, key="width"),
    "actuator_rate_limit": _each("rad/s", 0.02, _INFINITE, key="rate"),
    "actuator_bias": _each("rad", -0.5, 0.5),
    "stuck_surface": EffectNames(
        (_ONSET,), (EffectParameter("", "1", 0.0, 1.0), EffectParameter("_position", "rad", -1.5, 1.5))
    ),
    "control_effectiveness_loss": _each("1", -1.0, 1.0, _ONSET),
    "steady_wind": _fixed(*_alike("north east", "m/s", -60.0, 60.0), ("down", "m/s", -30.0, 30.0)),
    "turbulence": _fixed(("intensity", "m/s", 0.0, 15.0), ("rotation", "1", 0.0, 2.0)),
    "gust": _fixed(
        *_alike("forward right down", "m/s", -30.0, 30.0),
        ("start", "s", -_INFINITE, _INFINITE),
        ("length", "m", 0.5, 2000.0),
    ),
    "derivative_error": EffectNames(derivatives=True),
    "nonlinear_pitching_moment": _fixed(
        ("quadratic", "1/rad^2", -_INFINITE, _INFINITE), ("cubic", "1/rad^3", -_INFINITE, _INFINITE)
    ),
    "stall_separation": _fixed(
        ("depth", "1", 0.0, 1.5),
        ("alpha_star", "rad", 0.05, 1.0),
        ("a1", "1", 1.0, 60.0),
        ("tau1", "cbar/V", 0.5, 100.0),
        ("tau2", "cbar/V", 0.0, 30.0),
        ("CD_X", "1", -1.0, 2.0),
        ("Cm_X", "1", -1.0, 1.0),
    ),
    "unsteady_aerodynamics": _fixed(("CL_alphadot", "1/rad", -20.0, 20.0), ("Cm_alphadot", "1/rad", -60.0, 60.0)),
    "lateral_alpha_coupling": _fixed(
        *_alike("Cl_beta_alpha Cn_beta_alpha Cl_r_alpha", "1/rad^2", -_INFINITE, _INFINITE)
    ),
    "control_nonlinearity": _each("1/rad^2", -100.0, 100.0),
    "drag_rise": _fixed(("parabola", "1", -2.0, 5.0)),
    "lateral_asymmetry": _fixed(("CY_0", "1", -0.5, 0.5), *_alike("Cl_0 Cn_0", "1", -0.2, 0.2)),
    "ground_effect": _fixed(("lift", "1", 0.0, 2.0), *_alike("drag moment", "1", 0.0, 1.0), ("height", "m", 0.0, 2e4)),
    "thrust_scale": _fixed(("error", "1", -1.0, 3.0)),
    "thrust_line_offset": _fixed(("arm", "m", -2.0, 2.0)),
    "thrust_yaw": _fixed(("arm", "m", -2.0, 2.0), ("p_factor", "m/rad", -5.0, 5.0), ("torque_arm", "m", -1.0, 1.0)),
    "propwash": _fixed(("gain", "1", -5.0, 50.0)),
    "motor_lag": _fixed(("time_constant", "s", 0.0, 10.0)),
    "mass_error": _fixed(("error", "1", -0.8, 3.0)),
    "inertia_error": _fixed(*_alike("Ixx Iyy Izz", "1", -0.8, 5.0), ("Ixz", "1", -0.5, 0.5)),
    "cg_shift": _fixed(*_alike(_PLACE, "m", -2.0, 2.0)),
    "structural_mode": _fixed(
        ("gain", "1", -5.0, 5.0),
        ("slope", "rad/m", -20.0, 20.0),
        ("frequency", "Hz", 0.5, 40.0),
        ("damping", "1", 0.001, 1.0),
    ),
    "imu_bias": _fixed(*_alike("ax ay az", "m/s^2", -20.0, 20.0), *_alike("p q r", "rad/s", -2.0, 2.0)),
    "imu_scale": _fixed(*_alike("ax ay az p q r", "1", -0.9, 2.0)),
    "imu_misalignment": _fixed(*_alike("roll pitch yaw", "rad", -0.5, 0.5)),
    "imu_lever_arm": _fixed(*_alike(_PLACE, "m", -50.0, 50.0)),
    "airspeed_scale": _fixed(("error", "1", -0.9, 2.0)),
    "vane_bias": _fixed(*_alike("alpha beta", "rad", -0.5, 0.5)),
    "vane_scale": _fixed(*_alike("alpha beta", "1", -0.9, 2.0)),
    "vane_lever_arm": _fixed(*_alike(_PLACE, "m", -100.0, 100.0)),
    "air_data_lag": _fixed(("time_constant", "s", 0.0, 2.0)),
    "sensor_noise": _fixed(("scale", "1", 0.0, 100.0)),
    "imu_delay": _DELAY,
    "air_data_delay": _DELAY,
    "actuator_stamp_delay": _DELAY,
}
