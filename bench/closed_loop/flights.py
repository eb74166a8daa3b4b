"""A closed loop in one process: simulator, online estimator, exciter and controller, as their nodes call them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.load import load_aircraft
from sysid_node.control import controller
from sysid_node.control.inputs.estimates import identified_derivatives
from sysid_node.control.settings import ControllerSettings as Control
from sysid_node.control.types import ErrorCorrelation, Measurements, SetPoints
from sysid_node.dynamics.atmosphere import GRAVITY
from sysid_node.excite import exciter
from sysid_node.excite.exciter_settings import ExcitationSettings
from sysid_node.excite.relative_precision import relative_precision
from sysid_node.online.session import Session
from sysid_node.online.settings import OnlineSettings as Estimation
from sysid_node.sim import Simulator, Trim, trim_flight
from sysid_node.sim.flying import live
from sysid_node.sim.flying.live import LiveConditions

Array = NDArray[np.float64]

RATE = 100.0  # Hz, of everything
ESTIMATES = 20.0  # Hz
BEGIN = 3.0  # s, when excitation begins
ACTUATORS = "actuator_lag:time_constant=0.05"
#: Known well enough to fly on; what is lost later is excited again.
EXCITATION = ExcitationSettings(accuracy=0.15, watch=True)


@dataclass(frozen=True)
class Sortie:
    """One flight: what fails, when, in which air; what is asked for; who flies."""

    effects: tuple[str, ...] = ()
    onset: float = 30.0  # s
    seconds: float = 60.0
    air: LiveConditions = field(default_factory=LiveConditions)
    adapt: bool = True
    excitation: ExcitationSettings = EXCITATION
    asked: float = 1.0  # size of the set-points
    aircraft: str = "cdrw"
    method: str = "sls_rft"  # least squares: instruments are made of the file's aircraft, which a failed one is not


@dataclass(frozen=True)
class Flown:
    """What became of it, N samples; rad."""

    time: Array
    attitude: Array  # (N, 3) true pitch, roll, sideslip
    wanted: Array  # (N, 3) the reference model's
    surfaces: Array  # (N, 3)
    exciting: NDArray[np.bool_]  # (N,)
    cautions: list[str]  # what the pitch and lateral gains were last said to be
    events: list[exciter.ExcitationEvent]
    lost: float  # s, when control was lost; inf = never

    def error(self, start: float, stop: float, without: NDArray[np.bool_] | None = None) -> Array:
        """(3,) rms of pitch, roll and sideslip from what was wanted, rad; infinite once control is lost.

        Samples (N,) ``without`` do not count; NaN where none is left.
        """
        if self.lost < stop:
            return np.full(3, np.inf)
        chosen = (self.time >= start) & (self.time < stop)
        if without is not None:
            chosen &= ~without
        square = np.sum((self.attitude - self.wanted)[chosen] ** 2, axis=0)
        return np.asarray(np.sqrt(square / (np.count_nonzero(chosen) or np.nan)))


@cache
def prepared(aircraft: str) -> tuple[Simulator, Trim, Array]:
    """Simulator, trim, and the effects that are there from the start."""
    simulator = Simulator(load_aircraft(aircraft), RATE)
    return simulator, trim_flight(simulator), live.vector(simulator, [ACTUATORS])


def set_points(time: float, level: float, size: float) -> SetPoints:
    """Steps of roll and pitch about ``level`` (rad), one after the other."""
    roll = (0.3, 0.0, -0.3, 0.0)[int(time / 4.0) % 4]
    pitch = (0.08, 0.0, -0.05, 0.0)[int((time + 1.0) / 3.0) % 4]
    return SetPoints(roll=size * roll, pitch=level + size * pitch)


def fly(sortie: Sortie) -> Flown:
    """Fly it."""
    simulator, trim, sound = prepared(sortie.aircraft)
    aircraft = simulator.aircraft
    failed = live.vector(simulator, [ACTUATORS, *sortie.effects])
    flight = live.start(simulator, trim, sortie.air, sound)
    pilot = controller.init(aircraft, Control(adapt=sortie.adapt))
    session = Session(aircraft, Estimation(method=sortie.method), ESTIMATES)
    excitation = exciter.init(aircraft, sortie.excitation)
    command: Sequence[float] = trim.command.tolist()
    rows, lost = [], math.inf
    for k in range(round(sortie.seconds * RATE)):
        flight.theta = failed if k >= sortie.onset * RATE else sound
        now = live.step(simulator, flight, command)
        _estimate(session, pilot, excitation, now)
        command, wanted = _command(pilot, excitation, now, set_points(now.time, trim.alpha, sortie.asked))
        true = _attitude(now.state)
        rows.append((now.time, *true, *wanted, *now.surfaces[:3], excitation.active))
        if not (np.abs(true) < (1.0, 1.4, 0.6)).all():
            lost = now.time
            break
    table = np.array(rows)
    said = [axis.verdict for axis in pilot.axes]
    return Flown(
        table[:, 0], table[:, 1:4], table[:, 4:7], table[:, 7:10], table[:, 10] > 0.0, said, excitation.events, lost
    )


def _estimate(
    session: Session, pilot: controller.ControllerState, excitation: exciter.ExciterState, now: live.LiveReading
) -> None:
    """Messages into the estimator, and what falls due to those who use it."""
    stamp = round(1e9 * now.time)
    *surfaces, thrust = now.surfaces.tolist()
    throttle = session.aircraft.throttle
    assert throttle is not None
    assert throttle.max_thrust is not None
    joints = (*(next(iter(c.joints)) for c in session.aircraft.controls.values()), throttle.joint)
    session.actuators(stamp, joints, (*surfaces, thrust / throttle.max_thrust))
    V, alpha, beta = now.outputs[9:].tolist()
    session.air_data(stamp, (V, alpha, beta, now.density))
    for due in session.imu(stamp, tuple(now.outputs[:6].tolist())):
        covariance = session.renewed_covariance()
        if covariance is not None:
            controller.receive_correlation(pilot, ErrorCorrelation(*covariance.correlation()))
        controller.receive_estimates(pilot, now.time, identified_derivatives(due.estimates))
        precision = relative_precision(due.estimates.derivatives.values(), session.aircraft)
        if exciter.receive_estimates(excitation, now.time, precision):
            session.reset()


def _command(
    pilot: controller.ControllerState, excitation: exciter.ExciterState, now: live.LiveReading, points: SetPoints
) -> tuple[Sequence[float], Array]:
    """Command (4,) and what was wanted: pitch, roll, sideslip (3,)."""
    _, _, az, p, q, r, phi, theta, _, V, alpha, beta = now.outputs.tolist()
    if not excitation.events and now.time >= BEGIN:
        exciter.start(excitation, now.time)
    extra = exciter.step(excitation, now.time, exciter.LimitedQuantities(phi, theta, V, -az / GRAVITY))
    sensed = Measurements(now.time, p, q, r, phi, theta, V, alpha, beta, now.density)
    command = controller.step(pilot, sensed, points, extra.tolist())
    wanted = pilot.law.wanted
    assert wanted is not None
    return command, np.array([wanted.theta, wanted.phi, wanted.beta])


def _attitude(state: Array) -> Array:
    """True pitch, roll and sideslip (3,) of a state (13,), in still air."""
    u, v, w = state[3:6]
    a, b, c, d = state[6:10]
    pitch = math.asin(min(max(2.0 * (a * c - d * b), -1.0), 1.0))
    roll = math.atan2(2.0 * (a * b + c * d), 1.0 - 2.0 * (b * b + c * c))
    return np.array([pitch, roll, math.atan2(v, math.hypot(u, w))])


def icing(severity: float) -> tuple[str, ...]:
    """Ice all over, as changes of derivatives: Bragg et al., AIAA 2000-0360, table 2, times ``severity``."""
    derivatives = prepared("cdrw")[0].aircraft.derivatives
    terms = ":".join(f"{n}={severity * share * derivatives[n].value:.6g}" for n, share in ICE.items())
    return (f"derivative_error:{terms}",)


#: Share by which ice all over changed the derivatives of a Twin Otter.
ICE: Mapping[str, float] = {
    **{"CL_alpha": -0.10, "CL_q": -0.012, "CL_de": -0.095, "CD_0": 0.5},
    **{"Cm_alpha": -0.099, "Cm_q": -0.035, "Cm_de": -0.10},
    **{"CY_beta": -0.20, "Cl_beta": -0.10, "Cl_p": -0.10, "Cl_da": -0.10, "Cl_dr": -0.08},
    **{"Cn_beta": -0.20, "Cn_r": -0.061, "Cn_dr": -0.083},
}


def aft(margin: float) -> tuple[str, ...]:
    """The CG moved until the static margin is ``margin`` (share of the chord; negative: unstable)."""
    aircraft = prepared("cdrw")[0].aircraft
    d = aircraft.derivatives
    chord = aircraft.geometry.cbar
    shift = margin + d["Cm_alpha"].value / d["CL_alpha"].value
    return (f"cg_shift:x={chord * shift:.6g}",)


def baseline(sortie: Sortie) -> Sortie:
    """The same with the gains of the aircraft file."""
    return replace(sortie, adapt=False)
