"""Effects that add to the coefficients, by their equations: CL, CD, CY, Cl, Cm, Cn from the flow.

``wing_damage`` and ``ice`` are on nobody's list of candidates.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from bench.withheld.plants.motion import GRAVITY, Effects, Flow
from sysid_node.aircraft.model import Aircraft

Six = tuple[float, float, float, float, float, float]
Values = Mapping[str, float]
Addition = Callable[[Flow], Six]


def nonlinear_pitching_moment(values: Values, aircraft: Aircraft, alpha0: float) -> Addition:
    quadratic, cubic = values.get("quadratic", 0.0), values.get("cubic", 0.0)

    def add(x: Flow) -> Six:
        a = x.alpha - alpha0
        return 0.0, 0.0, 0.0, 0.0, quadratic * a * a + cubic * a**3, 0.0

    return add


def lateral_alpha_coupling(values: Values, aircraft: Aircraft, alpha0: float) -> Addition:
    Cl_beta, Cn_beta, Cl_r = (values.get(n, 0.0) for n in ("Cl_beta_alpha", "Cn_beta_alpha", "Cl_r_alpha"))

    def add(x: Flow) -> Six:
        a = x.alpha - alpha0
        return 0.0, 0.0, 0.0, (Cl_beta * x.beta + Cl_r * x.r) * a, 0.0, Cn_beta * x.beta * a

    return add


def drag_rise(values: Values, aircraft: Aircraft, alpha0: float) -> Addition:
    lift0 = aircraft.derivatives["CL_0"].value + aircraft.derivatives["CL_alpha"].value * alpha0

    def add(x: Flow) -> Six:
        return 0.0, values["parabola"] * (x.CL - lift0) ** 2, 0.0, 0.0, 0.0, 0.0

    return add


def lateral_asymmetry(values: Values, aircraft: Aircraft, alpha0: float) -> Addition:
    always = (0.0, 0.0, values.get("CY_0", 0.0), values.get("Cl_0", 0.0), 0.0, values.get("Cn_0", 0.0))
    return lambda x: always


def unsteady_aerodynamics(values: Values, aircraft: Aircraft, alpha0: float) -> Addition:
    CL, Cm = values.get("CL_alphadot", 0.0), values.get("Cm_alphadot", 0.0)
    return lambda x: (CL * x.alpha_rate, 0.0, 0.0, 0.0, Cm * x.alpha_rate, 0.0)


def derivative_error(values: Values, aircraft: Aircraft, alpha0: float) -> Addition:
    """Of the terms in flow and rates; those of the controls act on the deflections."""
    names = ("CL", "CD", "CY", "Cl", "Cm", "Cn")
    terms = [(names.index(c), r, v) for name, v in values.items() for c, _, r in [name.partition("_")]]

    def add(x: Flow) -> Six:
        total = [0.0] * 6
        for place, regressor, value in terms:
            total[place] += value * (1.0 if regressor == "0" else getattr(x, regressor))
        return tuple(total)  # type: ignore[return-value]

    return add


def wing_damage(values: Values, aircraft: Aircraft, alpha0: float) -> Addition:
    """The right wing's outer part is gone from the onset on: lift, roll and yaw that grow with the angle of attack."""
    share, onset = values["share"], values["onset"]
    slope = aircraft.derivatives["CL_alpha"].value

    def add(x: Flow) -> Six:
        if x.time < onset:
            return (0.0,) * 6
        lost = share * slope * (x.alpha + 2.0 * 0.7 * 0.5 * x.p)  # the strip at 0.7 of the half span
        drag = 0.15 * share + 0.2 * lost * x.alpha
        return -lost, drag, 0.0, 0.35 * lost, 0.0, 0.35 * drag

    return add


def ice(values: Values, aircraft: Aircraft, alpha0: float) -> Addition:
    """Ice that grows with time on wing and tail: lift slope lost, drag gained, the tail's hold on the pitch lost."""
    loss, drag, seconds = values["lift_loss"], values["drag"], values["seconds"]
    slopes = {n: aircraft.derivatives[n].value for n in ("CL_alpha", "Cm_alpha", "Cm_q")}

    def add(x: Flow) -> Six:
        grown = min(x.time / seconds, 1.0)
        lift = -loss * grown * slopes["CL_alpha"] * x.alpha
        pitch = -loss * grown * (slopes["Cm_alpha"] * x.alpha + slopes["Cm_q"] * x.q)
        return lift, drag * grown * (1.0 + 20.0 * x.alpha * x.alpha), 0.0, 0.0, pitch, 0.0

    return add


ADDITIONS: Mapping[str, Callable[[Values, Aircraft, float], Addition]] = {
    f.__name__: f
    for f in (
        nonlinear_pitching_moment,
        lateral_alpha_coupling,
        drag_rise,
        lateral_asymmetry,
        unsteady_aerodynamics,
        derivative_error,
        wing_damage,
        ice,
    )
}


def additions(effects: Effects, aircraft: Aircraft) -> list[Addition]:
    """Those of these effects that add to the coefficients."""
    alpha0 = reference_alpha(aircraft)
    return [ADDITIONS[name](values, aircraft, alpha0) for name, values in effects.items() if name in ADDITIONS]


def reference_alpha(aircraft: Aircraft) -> float:
    """Angle of attack (rad) of level flight at the reference condition: lift carries the weight, Cm is zero."""
    reference = aircraft.reference
    pressure_area = 0.5 * reference.air_density * reference.airspeed**2 * aircraft.geometry.S
    lift = aircraft.mass * GRAVITY / pressure_area
    CL_0, CL_alpha, CL_de, Cm_0, Cm_alpha, Cm_de = (
        aircraft.derivatives[n].value for n in ("CL_0", "CL_alpha", "CL_de", "Cm_0", "Cm_alpha", "Cm_de")
    )
    return ((lift - CL_0) * Cm_de + Cm_0 * CL_de) / (CL_alpha * Cm_de - CL_de * Cm_alpha)


class Separation:
    """Kirchhoff's stall with hysteresis: the attached fraction of the flow as a state."""

    def __init__(self, values: Values) -> None:
        self.depth = values.get("depth", 0.0)
        self.alpha_star, self.a1 = values.get("alpha_star", 0.26), values.get("a1", 20.0)
        self.tau1, self.tau2 = values.get("tau1", 10.0), values.get("tau2", 3.0)
        self.CD_X, self.Cm_X = values.get("CD_X", 0.1), values.get("Cm_X", -0.05)
        self.attached = 1.0

    def start(self, alpha: float) -> None:
        """Settled on an angle of attack."""
        self.attached = self._steady(alpha)

    def _steady(self, lagged: float) -> float:
        return 0.5 * (1.0 - math.tanh(self.a1 * (lagged - self.alpha_star)))

    def advance(self, alpha: float, alpha_rate: float, time_scale: float, step: float) -> None:
        """One step (s) on; time_scale is cbar / V."""
        steady = self._steady(alpha - self.tau2 * time_scale * alpha_rate)
        self.attached = steady + (self.attached - steady) * math.exp(-step / (self.tau1 * time_scale))

    def lift_factor(self) -> float:
        """What is left of the attached lift."""
        half = 0.5 * (1.0 + math.sqrt(max(self.attached, 0.0)))
        return 1.0 - self.depth * (1.0 - half * half)

    def drag_and_moment(self) -> tuple[float, float]:
        """Added CD and Cm."""
        gone = self.depth * (1.0 - self.attached)
        return self.CD_X * gone, self.Cm_X * gone
