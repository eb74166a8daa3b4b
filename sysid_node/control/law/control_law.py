"""The control law: feedforward by inversion of the moment equations, feedback of the errors, limits.

    u = trim + G^-1 (reference's accelerations - f(reference's motion)) - K (motion - reference's motion)

The feedforward is dynamic inversion along the reference motion with the present derivatives (Lombaerts, Huisman, Chu,
Mulder & Joosten, "Nonlinear reconfiguring flight control based on online physical model identification", J. Guidance
32(3), 2009). The motion is compared with the reference after the actuators' delay and lag (hedging, Johnson & Calise).
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.control.adaptation import AxisParameters
from sysid_node.control.design.axis import ControlAxis
from sysid_node.control.law import reference
from sysid_node.control.law.reference import DelayedReference, ReferenceMotion, ReferenceState
from sysid_node.control.settings import ControllerSettings
from sysid_node.control.types import Command, Measurements, SetPoints
from sysid_node.dynamics.atmosphere import GRAVITY, dynamic_pressure
from sysid_node.dynamics.linear_model import DimensionalScales
from sysid_node.dynamics.linearised import linear_derivatives, trimmed

Array = NDArray[np.float64]

LONGEST_STEP = 0.1  # s
SPEED_GAIN, SPEED_INTEGRAL = 0.6, 0.1  # 1/s, 1/s^2: of the airspeed loop
SPEED_FILTER = 1.0  # s, of the airspeed that gains are scheduled by
MOST_INTEGRAL = 1.0  # rad s
PRESSURES = (0.4, 2.5)  # range of dynamic pressure, relative to the reference, in which gains are scheduled


@dataclass(frozen=True)
class LawDesign:
    """What does not change in flight."""

    aircraft: Aircraft
    settings: ControllerSettings
    limits: Array  # (3,) rad, of the surfaces
    most_thrust: float  # N
    derivatives: Mapping[str, float]  # the file's, with what lookup tables add near level flight


@dataclass
class SurfaceState:
    """What the three surfaces were told, and where the feedback has moved them by the model of the actuators."""

    command: Array | None = None  # (3,) rad, the last
    at_limit: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(3, bool))  # at the end of their travel
    pending: deque[tuple[float, Array]] = field(default_factory=deque)  # feedback within the actuators' delay
    by_feedback: Array = field(default_factory=lambda: np.zeros(3))  # rad


@dataclass
class LawState:
    """The state of the control law."""

    design: LawDesign
    behind: DelayedReference
    reference: ReferenceState | None = None
    airspeed: float = math.nan  # m/s, filtered
    density: float = math.nan
    integrals: Array = field(default_factory=lambda: np.zeros(2))  # of theta's and phi's errors, rad s
    thrust: float = 0.0  # N, of the airspeed's integral
    surfaces: SurfaceState = field(default_factory=SurfaceState)
    gains: tuple[Array, ...] = ()  # (m, n) of both axes, the last
    wanted: ReferenceMotion | None = None  # the delayed reference, with which the motion is compared


def init(aircraft: Aircraft, settings: ControllerSettings) -> LawState:
    """The state before the first step."""
    throttle = aircraft.throttle
    weight = aircraft.mass * GRAVITY
    limits = np.array([aircraft.controls[c].limit or settings.command_limit for c in ("elevator", "aileron", "rudder")])
    most = 0.0 if throttle is None else throttle.max_thrust or 2.0 * weight
    design = LawDesign(aircraft, settings, limits, most, linear_derivatives(aircraft))
    return LawState(design, DelayedReference(settings.actuator_lag, settings.delay))


def step(
    law: LawState,
    measured: Measurements,
    points: SetPoints,
    flown: tuple[tuple[ControlAxis, AxisParameters], tuple[ControlAxis, AxisParameters]],
    excitation: Sequence[float] | Array,
    step: float,
) -> Command:
    """The command now, ``step`` (s) after the last one; ``excitation`` (3,) rad is added to it."""
    scales = _condition(law, measured, points, step)
    pressure = _pressure(law)
    level, trim = trimmed(law.design.aircraft, pressure)
    speed = law.design.aircraft.reference.airspeed
    points = reference.limited(points, level, speed, law.design.settings)
    if law.reference is None:
        law.reference = ReferenceState(_finite(measured.theta, level), _finite(measured.phi, 0.0))
    pitch, side = ({name: float(value) for name, value in axis.named(f.values).items()} for axis, f in flown)
    s = law.design.settings
    flight = reference.FlightCondition(
        law.airspeed, level, scales.force * side.get("CY_beta", 0.0), s.bandwidth, s.largest_pitch, s.largest_roll
    )
    wanted = reference.advance(law.reference, points, step, flight)
    forward = _feedforward(law.reference, wanted, pitch, side, scales, step)
    late = law.wanted = reference.follow(law.behind, measured.time, wanted, step)
    errors = _errors(law, measured, late, level)
    _transfer_bumplessly(law, errors, flown)
    back = np.concatenate([f.gains @ e for (_, f), e in zip(flown, errors, strict=True)]) / pressure
    planned = np.array([trim, 0.0, 0.0]) + forward + np.asarray(excitation, dtype=float)
    command, limited = _limited(law, planned - back, step)
    _follow_surfaces(law, measured.time, command - planned, step)
    _integrate(law, errors, limited, step)
    elevator, aileron, rudder = command.tolist()
    return Command(elevator, aileron, rudder, _thrust(law, measured, points, late, level, step))


def _condition(law: LawState, measured: Measurements, points: SetPoints, step: float) -> DimensionalScales:
    """The filtered flight condition; without a measured airspeed the last one, or the set-point."""
    known = law.design.aircraft.reference
    if math.isnan(law.airspeed):
        law.airspeed = _finite(measured.airspeed, _finite(points.airspeed, known.airspeed))
        law.density = known.air_density
    if math.isfinite(measured.airspeed):
        law.airspeed += min(step / SPEED_FILTER, 1.0) * (measured.airspeed - law.airspeed)
    law.airspeed = min(max(law.airspeed, 0.5 * known.airspeed), 2.0 * known.airspeed)
    if 0.1 < measured.density < 2.0:
        law.density = measured.density
    return DimensionalScales.of(law.design.aircraft, law.airspeed, law.density)


def _pressure(law: LawState) -> float:
    """Dynamic pressure relative to the reference, within ``PRESSURES``."""
    known = law.design.aircraft.reference
    share = law.density * law.airspeed**2 / (known.air_density * known.airspeed**2)
    return min(max(share, PRESSURES[0]), PRESSURES[1])


def _feedforward(
    ref: ReferenceState,
    wanted: ReferenceMotion,
    pitch: dict[str, float],
    side: dict[str, float],
    scales: DimensionalScales,
    step: float,
) -> Array:
    """(3,) rad: the surfaces that cause the reference's angular accelerations.

    Moves the reference angle of attack on.
    """
    rate = wanted.q + wanted.turn
    q = rate * scales.chord
    elevator = wanted.q_rate / scales.pitch - pitch["Cm_alpha"] * ref.alpha - pitch["Cm_q"] * q
    elevator /= pitch["Cm_de"]
    lift = pitch["CL_alpha"] * ref.alpha + pitch.get("CL_q", 0.0) * q + pitch.get("CL_de", 0.0) * elevator
    ref.alpha += step * (rate - scales.force * lift)
    ref.alpha = min(max(ref.alpha, -0.2), 0.2)
    p, r = wanted.p * scales.span, wanted.r * scales.span
    moment = np.linalg.solve(scales.lateral, [wanted.p_rate, wanted.r_rate])
    rest = [
        side.get(f"{c}_beta", 0.0) * wanted.beta + side.get(f"{c}_p", 0.0) * p + side.get(f"{c}_r", 0.0) * r
        for c in ("Cl", "Cn")
    ]
    effect = [[side.get(f"{c}_{s}", 0.0) for s in ("da", "dr")] for c in ("Cl", "Cn")]
    aileron, rudder = np.linalg.solve(effect, moment - rest)
    return np.array([elevator, aileron, rudder])


def _errors(law: LawState, measured: Measurements, late: ReferenceMotion, level: float) -> tuple[Array, Array]:
    """Errors of alpha, q, theta and its integral; of beta, p, r, phi and its integral; and the surfaces' feedback.

    The error of what is not measured is zero.
    """
    pitch = (measured.alpha - level - late.alpha, measured.q - late.q - late.turn, measured.theta - late.theta)
    side = (measured.beta - late.beta, measured.p - late.p, measured.r - late.r, measured.phi - late.phi)
    first, second = (np.nan_to_num(np.array(x), nan=0.0, posinf=0.0, neginf=0.0) for x in (pitch, side))
    return (
        np.concatenate([first, law.integrals[:1], law.surfaces.by_feedback[:1]]),
        np.concatenate([second, law.integrals[1:], law.surfaces.by_feedback[1:]]),
    )


def _transfer_bumplessly(
    law: LawState,
    errors: tuple[Array, Array],
    flown: tuple[tuple[ControlAxis, AxisParameters], tuple[ControlAxis, AxisParameters]],
) -> None:
    """Set the integrals, also in ``errors``, so that a change of gains does not move the surfaces (bumpless transfer).

    An integral times its gain is a deflection, such as that which trims a shifted centre of gravity. With other gains
    it would be another deflection until the integral has settled again (Astrom & Hagglund, "PID Controllers" (1995),
    sect. 3.5).
    """
    gains = tuple(f.gains for _, f in flown)
    for i, ((axis, _), error, now, before) in enumerate(zip(flown, errors, gains, law.gains, strict=False)):
        place, effect = axis.integral, now[:, axis.integral]
        share = float(effect @ (before @ error - now @ error)) / max(float(effect @ effect), 1e-12)
        error[place] = law.integrals[i] = min(max(law.integrals[i] + share, -MOST_INTEGRAL), MOST_INTEGRAL)
    law.gains = gains


def _follow_surfaces(law: LawState, time: float, feedback: Array, step: float) -> None:
    """Advance the model of the surfaces' deflections, with the delay and lag of the actuators.

    A surface moves by its whole travel at most, whatever the feedforward has asked for.
    """
    feedback = np.clip(feedback, -2.0 * law.design.limits, 2.0 * law.design.limits)
    surfaces, settings = law.surfaces, law.design.settings
    late = reference.delayed(surfaces.pending, time, feedback, settings.delay, step)
    surfaces.by_feedback += (1.0 - math.exp(-step / settings.actuator_lag)) * (late - surfaces.by_feedback)


def _limited(law: LawState, wanted: Array, step: float) -> tuple[Array, NDArray[np.bool_]]:
    """The command (3,) within its limits of amplitude and rate, and which surfaces are limited."""
    within = np.clip(wanted, -law.design.limits, law.design.limits)
    surfaces = law.surfaces
    if surfaces.command is not None:
        reach = law.design.settings.command_rate * step
        within = np.clip(within, surfaces.command - reach, surfaces.command + reach)
    surfaces.command, surfaces.at_limit = within, np.abs(within) >= law.design.limits
    return within, np.abs(within - wanted) > 1e-9


def _integrate(law: LawState, errors: tuple[Array, Array], limited: NDArray[np.bool_], step: float) -> None:
    """Integrate the errors of theta and phi, unless their surface is limited (anti-windup)."""
    for i, (error, stuck) in enumerate(zip((errors[0][2], errors[1][3]), limited[:2], strict=True)):
        if not stuck:
            law.integrals[i] = min(max(law.integrals[i] + step * error, -MOST_INTEGRAL), MOST_INTEGRAL)


def _thrust(
    law: LawState, measured: Measurements, points: SetPoints, late: ReferenceMotion, level: float, step: float
) -> float:
    """Thrust (N): drag in level flight, weight along the climb, and feedback of the airspeed."""
    if law.design.most_thrust == 0.0:
        return 0.0
    d = law.design.derivatives
    load: float = dynamic_pressure(law.density, law.airspeed) * law.design.aircraft.geometry.S
    weight = law.design.aircraft.mass * GRAVITY
    drag = d.get("CD_0", 0.0) + d.get("CD_alpha", 0.0) * level + d.get("CD_k", 0.0) * (weight / load) ** 2
    error = _finite(points.airspeed - measured.airspeed, 0.0)
    wanted = load * drag + weight * math.sin(late.theta - level - late.alpha) + law.thrust
    wanted += SPEED_GAIN * law.design.aircraft.mass * error
    given = min(max(wanted, 0.0), law.design.most_thrust)
    if given == wanted:
        law.thrust += SPEED_INTEGRAL * law.design.aircraft.mass * error * step
    return given


def _finite(value: float, otherwise: float) -> float:
    return value if math.isfinite(value) else otherwise
