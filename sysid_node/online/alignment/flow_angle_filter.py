"""Angle of attack and sideslip where no vane measures them: a kinematic filter on IMU, airspeed and the lift.

Within the lines' band the angles are the integrals of the kinematic equations (Klein & Morelli 2006, eqs. 3.33 and
3.34; flight path reconstruction: ibid., ch. 10): the velocity of the IMU's own point, so that no angular acceleration
is needed, with an attitude of the filter's own. What integration cannot know (the gyros' biases, attitude, slow drift)
an extended Kalman filter learns from three slow references: the airspeed, the angle of attack that the aircraft
file's lift asks for, and the sideslip that its side force asks for. Their densities are those of light to moderate
gusts, so that the filter's corner is well under the band: of the references, and with them of the file's errors,
little is left in the band; ``doubt`` counts it.

What is lost. The mean angle of attack is the aircraft file's: offsets, and the drag's slopes (lift turns into drag with
it), are not known. And the angles are those of the aircraft against the mean air: gusts move the aircraft without
showing in them. They are noise of the regression then, which the residual's density counts in the intervals; as the
deflections do not know of gusts in open loop, instrumental variables are not biased by them.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.dynamics import scalar
from sysid_node.dynamics.airflow import velocity_of
from sysid_node.dynamics.atmosphere import GRAVITY, dynamic_pressure
from sysid_node.dynamics.forces import lift_and_drag
from sysid_node.dynamics.linearised import linear_derivatives
from sysid_node.online.frequency.regression_signals import OFFSET, Layout
from sysid_node.online.regression.information import Information, Spectrum
from sysid_node.online.regression.least_squares import Solution
from sysid_node.online.regression.normal_equations import NormalEquations
from sysid_node.online.types import SAMPLE_COLUMNS

Array = NDArray[np.float64]

ALPHA, BETA = SAMPLE_COLUMNS.index("alpha"), SAMPLE_COLUMNS.index("beta")
AIR_INTERVAL = SAMPLE_COLUMNS.index("air_interval")
EVERY = 0.1  # s between corrections
FINEST = 1e-5  # rad: no vane has less noise, whatever a file says
HIDDEN = 10.0  # times the energy of the gusts in the airspeed that a reconstructed angle must move
MIDDLE = 2.0 * math.pi * 0.5  # rad/s: middle of the band, where the integrated noise is likened to a vane's
_CONTROLS = len(SAMPLE_COLUMNS)
#: What the references are believed to be off by, as white noise: gusts of 0.04 rad, or of as much of the airspeed,
#: with a correlation time of some 5 s. rad^2 s.
_GUSTS = 0.016
#: Random walks beyond the sensors' noise: velocity m/s, attitude rad, gyro biases rad/s, each per sqrt(s).
_WALKS = (0.02, 0.001, 5e-5)
#: 1 sigma at the start: flow angles rad, attitude rad, biases rad/s.
_FLOW, _ATTITUDE, _BIAS = 0.05, 0.1, 0.01
_TOLERANCE = 0.2  # share of a derivative that it may be off by where the file does not say
_SLOW = 0.6  # rad/s under which gusts and motion are not in the band
_MEMORY = 60.0  # s over which their energies are counted
_WILDEST, _FASTEST, _THINNEST = 1e6, 1e4, 1e-6  # m/s^2 and rad/s, m/s, kg/m^3 of no flight: no readings
_STEEPEST = 1.4  # rad of pitch or flow angle beyond which the filter is lost and begins anew


@dataclass(frozen=True)
class Kinematics:
    """What the filter needs of the aircraft."""

    lift: tuple[float, float, tuple[tuple[int, float], ...]]  # slope, offset, and (place among regressors, derivative)
    side: tuple[float, float, tuple[tuple[int, float], ...]]
    imu: tuple[float, float, float]  # m from the CG
    probe: tuple[float, float, float]  # m from the IMU
    mass_over_area: float  # kg/m^2
    half_span: float  # m
    half_chord: float
    airspeed: float  # m/s, reference
    airspeed_noise: float  # m/s
    walks: Array  # (7,) densities of the states' random walks, per s
    interval: float  # s a squared s: between vane readings as noisy as the integrals, over the IMU's interval


#: Time (s), ``followed`` and ``energies`` as they stood then.
Report = tuple[float, list[float], list[float]]


@dataclass
class FlowAngleFilter:
    """The filter: u v w m/s of the IMU's point against the mean air, phi theta rad, biases of p and q rad/s."""

    kinematics: Kinematics | None  # None: the aircraft file has no lift slope or no side-force slope
    missing: tuple[bool, bool] | None = None  # whether alpha, beta are not measured; None = nothing has come yet
    time: float = math.nan
    step: float = 0.0  # s between the last two samples
    state: list[float] = field(default_factory=list)
    covariance: Array = field(default_factory=lambda: np.empty((0, 0)))
    imu: Sequence[float] = ()
    surprise: list[float] = field(default_factory=lambda: [0.0] * 3)  # sums since the last correction
    count: int = 0
    corrected: float = math.nan
    slow: list[float] = field(default_factory=list)  # what changes slowly in airspeed (its share), alpha, beta
    energies: list[float] = field(default_factory=lambda: [0.0] * 3)  # of the rest, rad^2
    followed: list[float] = field(default_factory=lambda: [0.0] * 3)  # sums of squared gains, 1/s^2, and their number

    reports: deque[Report] = field(default_factory=lambda: deque(maxlen=1024))

    @property
    def active(self) -> bool:
        """Whether an angle is reconstructed."""
        return self.missing is not None and any(self.missing)


def init(aircraft: Aircraft) -> FlowAngleFilter:
    """A filter that has seen nothing."""
    return FlowAngleFilter(_kinematics(aircraft))


def complete(filter_: FlowAngleFilter, time: float, sample: Sequence[float], max_gap: float) -> Sequence[float]:
    """The sample (``SAMPLE_COLUMNS``, controls), with the angles that its aircraft does not measure.

    The first sample decides which those are. NaN where the sample lacks what reconstruction needs. After a gap
    longer than ``max_gap`` s the filter keeps its biases and begins anew.
    """
    if filter_.missing is None:
        filter_.missing = math.isnan(sample[ALPHA]), math.isnan(sample[BETA])
    k = filter_.kinematics
    if not any(filter_.missing) or k is None:
        return sample
    angles = _angles(filter_, k, time, sample, max_gap)
    filled = list(sample)
    for column, missing, angle in zip((ALPHA, BETA), filter_.missing, angles, strict=True):
        if missing:
            filled[column] = angle
    if all(filter_.missing):
        filled[AIR_INTERVAL] = k.interval * filter_.step
    return filled


def complete_many(filter_: FlowAngleFilter, time: Array, samples: Array, max_gap: float) -> Array:
    """``complete`` of samples (N, M) at ``time`` (N,) s, one after the other: the same bits."""
    if not time.size or (filter_.missing is not None and not filter_.active):
        return samples
    first = complete(filter_, float(time[0]), samples[0].tolist(), max_gap)
    if not filter_.active:
        return samples
    rest = zip(time[1:].tolist(), samples[1:].tolist(), strict=True)
    return np.array([first, *(complete(filter_, t, sample, max_gap) for t, sample in rest)])


def remarks(filter_: FlowAngleFilter) -> list[str]:
    """What a reader of the estimates should know of the angles; nothing where vanes measure both."""
    missing = filter_.missing or (False, False)
    angles = [angle for angle, absent in zip(("angle of attack", "sideslip"), missing, strict=True) if absent]
    if not angles or filter_.kinematics is None:
        return []
    return [f"Not measured, so reconstructed from IMU and airspeed: {' and '.join(angles)}."]


def flaw(filter_: FlowAngleFilter, at: float, name: str, regressors: Sequence[str]) -> str:
    """Why the derivative of this name and coefficient's regressors cannot be known ``at`` (s); "" where it can."""
    if not filter_.active or filter_.missing is None:
        return ""
    coefficient, _, regressor = name.partition("_")
    no_alpha, no_beta = filter_.missing
    if (coefficient == "CD" and no_alpha) or (regressor == "0" and (no_alpha or no_beta)):
        return "flow angle not measured"
    gusts, *motions = _report(filter_, at)[2]
    for angle, missing, motion in zip(("alpha", "beta"), filter_.missing, motions, strict=True):
        if missing and angle in regressors and motion < HIDDEN * gusts:
            return f"gusts hide {angle}"
    return ""


def doubt(
    filter_: FlowAngleFilter,
    at: float,
    aircraft: Aircraft,
    layout: Layout,
    lines: Spectrum,
    equations: NormalEquations,
    solution: Solution,
    info: Information,
) -> Array:
    """(C, P, P) covariance by which errors of the aircraft file reach the unknowns through the reconstructed angles.

    An error e of a regressor moves the solution by theta (Z'A)^-1 Z'e. Of e only the energy is known: the most that it
    can do, by Cauchy and Schwarz, is counted.
    """
    covariance = np.zeros((len(equations.coefficients), equations.columns.size, equations.columns.size))
    if filter_.missing is None or not filter_.active or not solution.usable:
        return covariance
    gram = info.grams.sum(axis=0)
    outer = gram[equations.instruments[:, None], equations.instruments] * equations.same_block
    reach = solution.inverse @ outer @ solution.inverse.T
    energies = _error_energies(filter_, at, aircraft, layout, lines, info)
    for name, missing, energy in zip(("alpha", "beta"), filter_.missing, energies, strict=True):
        if missing:
            theta = np.array([regressor == name for regressor in equations.regressors]) @ solution.theta
            covariance += (energy * theta**2)[:, None, None] * reach
    return covariance * equations.belongs.T[:, :, None] * equations.belongs.T[:, None, :]


def _error_energies(
    filter_: FlowAngleFilter, at: float, aircraft: Aircraft, layout: Layout, lines: Spectrum, info: Information
) -> list[float]:
    """Energies over the lines of the errors of alpha and beta that the file's errors make.

    In the band the angles follow the references with the filter's gain over the frequency; and a mean alpha that is
    off by d adds d times the integral of the roll rate to sideslip.
    """
    late = np.array([np.mean(lines.omega[band] ** -2.0) for band in lines.bands])  # s^2: what integrals have
    integrated = late @ info.grams.diagonal(axis1=1, axis2=2)
    slacks = _slack(aircraft, layout, "CL", "alpha"), _slack(aircraft, layout, "CY", "beta")
    *gains, count = _report(filter_, at)[1]
    energies = [
        gain / max(count, 1.0) * float(integrated @ slack**2) for gain, slack in zip(gains, slacks, strict=True)
    ]
    if "p" in layout.names:
        means = info.integrals / max(float(info.integrals[OFFSET]), 1e-9)
        per_rate = 2.0 * aircraft.reference.airspeed / aircraft.geometry.b
        energies[1] += float(means**2 @ slacks[0] ** 2) * per_rate**2 * float(integrated[layout.column("p")])
    return energies


def _slack(aircraft: Aircraft, layout: Layout, coefficient: str, of: str) -> Array:
    """(W,) what the angle asked for is off by per unit of each signal; the offset's stands at its regressor k."""
    slack, slope = np.zeros(layout.width), aircraft.derivatives[f"{coefficient}_{of}"].value
    for name, derivative in aircraft.derivatives.items():
        of_coefficient, _, regressor = name.partition("_")
        if of_coefficient == coefficient and (regressor == "0" or regressor in layout.names):
            tolerance = _TOLERANCE * abs(derivative.value) if derivative.tolerance is None else derivative.tolerance
            slack[OFFSET if regressor == "0" else layout.column(regressor)] = tolerance / slope
    return slack


def _report(filter_: FlowAngleFilter, at: float) -> Report:
    """The report that stood ``at`` (s): a record at once completes samples long before they are looked at."""
    return next((report for report in reversed(filter_.reports) if report[0] <= at), (at, [0.0] * 3, [0.0] * 3))


def _kinematics(aircraft: Aircraft) -> Kinematics | None:
    """None where the file's lift does not depend on alpha, or its side force not on beta."""
    slopes = [aircraft.derivatives.get(name) for name in ("CL_alpha", "CY_beta")]
    if any(slope is None or slope.value == 0.0 for slope in slopes):
        return None
    velocity, attitude, bias = _WALKS
    noise, g, imu, probe = aircraft.noise, aircraft.geometry, aircraft.sensors.imu, aircraft.sensors.air_data
    integrated = (noise["gyro"] ** 2 + (noise["accel"] / aircraft.reference.airspeed) ** 2) / MIDDLE**2
    return Kinematics(
        lift=_linear(aircraft, "CL", "alpha"),
        side=_linear(aircraft, "CY", "beta"),
        imu=imu,
        probe=(probe[0] - imu[0], probe[1] - imu[1], probe[2] - imu[2]),
        mass_over_area=aircraft.mass / g.S,
        half_span=0.5 * g.b,
        half_chord=0.5 * g.cbar,
        airspeed=aircraft.reference.airspeed,
        airspeed_noise=noise["airspeed"],
        walks=np.array([velocity] * 3 + [attitude] * 2 + [bias] * 2) ** 2,
        interval=integrated / max(noise["alpha"], noise["beta"], FINEST) ** 2,
    )


def _linear(aircraft: Aircraft, coefficient: str, of: str) -> tuple[float, float, tuple[tuple[int, float], ...]]:
    """Slope, offset and the rest of a coefficient's model; places are those of ``_regressors``."""
    names = ("p", "q", "r", "V", *aircraft.control_symbols)
    values = linear_derivatives(aircraft)
    rest = tuple((i, values[f"{coefficient}_{n}"]) for i, n in enumerate(names) if f"{coefficient}_{n}" in values)
    return values[f"{coefficient}_{of}"], values.get(f"{coefficient}_0", 0.0), rest


def _angles(
    filter_: FlowAngleFilter, k: Kinematics, time: float, sample: Sequence[float], max_gap: float
) -> tuple[float, float]:
    """Alpha and beta (rad) at the probe, after this sample; NaN where it lacks what they need."""
    V = sample[6]
    if not (
        math.isfinite(time + sum(sample[:7]) + sample[AIR_INTERVAL] + sum(sample[_CONTROLS:]))
        and max(map(abs, sample[:6])) < _WILDEST
        and 0.5 < V < _FASTEST
        and sample[9] > _THINNEST
    ):
        return math.nan, math.nan
    step = time - filter_.time
    if not step <= max_gap or not filter_.state:
        _begin(filter_, k, time, sample)
    elif step > 0.0:
        filter_.step = step
        _integrate(filter_, step, sample)
        _compare(filter_, k, sample)
        if time - filter_.corrected >= EVERY:
            _correct(filter_, k, time, sample[AIR_INTERVAL])
        if not _sane(filter_.state):
            _begin(filter_, k, time, sample)
    filter_.time, filter_.imu = time, sample[:6]
    return _at_probe(filter_.state, k, sample)


def _begin(filter_: FlowAngleFilter, k: Kinematics, time: float, sample: Sequence[float]) -> None:
    """At the file's angle of attack, without sideslip, in a turn that neither slips nor speeds up."""
    ax, ay, az, _, _, r, V = sample[:7]
    alpha = max(min(_asked(k, sample, 0.0, (0.0, 0.0))[0], 0.3), -0.3)
    climb = max(min((ax * math.cos(alpha) + az * math.sin(alpha)) / GRAVITY, 0.5), -0.5)
    bank = math.atan2(V * r - ay, GRAVITY)
    filter_.state = [
        *velocity_of((V, alpha, 0.0), scalar),
        bank,
        alpha + math.asin(climb),
        *(filter_.state[5:] or (0.0, 0.0)),
    ]
    spread = [1.0, _FLOW * V, _FLOW * V, _ATTITUDE, _ATTITUDE, _BIAS, _BIAS]
    filter_.covariance = np.diag(np.square(spread))
    filter_.surprise, filter_.count, filter_.corrected = [0.0] * 3, 0, time


def _sane(state: Sequence[float]) -> bool:
    """Whether the state is that of an aircraft that flies."""
    u, v, w, _, pitch = state[:5]
    return u > 0.5 and abs(pitch) < _STEEPEST and math.hypot(v, w) < u * math.tan(_STEEPEST)


def _integrate(filter_: FlowAngleFilter, step: float, sample: Sequence[float]) -> None:
    """Heun's rule over the interval between two IMU messages: no half a sample's delay."""
    x = filter_.state
    first = _slopes(x, filter_.imu)
    ahead = [a + step * d for a, d in zip(x, first, strict=False)] + x[5:]
    second = _slopes(ahead, sample)
    moved = [a + 0.5 * step * (d + e) for a, d, e in zip(x, first, second, strict=False)]
    filter_.state = moved + x[5:]


def _slopes(x: Sequence[float], imu: Sequence[float]) -> tuple[float, float, float, float, float]:
    """Derivatives of u v w phi theta (Klein & Morelli 2006, eqs. 3.33, 3.34, over specific forces)."""
    u, v, w, phi, theta, bias_p, bias_q = x
    ax, ay, az, p, q, r = imu[:6]
    p, q = p - bias_p, q - bias_q
    sin_phi, cos_phi, sin_theta, cos_theta = math.sin(phi), math.cos(phi), math.sin(theta), math.cos(theta)
    return (
        ax - GRAVITY * sin_theta + r * v - q * w,
        ay + GRAVITY * sin_phi * cos_theta + p * w - r * u,
        az + GRAVITY * cos_phi * cos_theta + q * u - p * v,
        p + (q * sin_phi + r * cos_phi) * sin_theta / cos_theta,
        q * cos_phi - r * sin_phi,
    )


def _asked(k: Kinematics, sample: Sequence[float], alpha: float, biases: Sequence[float]) -> tuple[float, float]:
    """Alpha and beta (rad) that the aircraft file's lift and side force ask for; ``alpha`` turns the axes."""
    ax, ay, az, p, q, r, V = sample[:7]
    p, q = p - biases[0], q - biases[1]
    scale = k.mass_over_area / dynamic_pressure(sample[9], V)
    lift = scale * lift_and_drag(ax, az, math.cos(alpha), math.sin(alpha))[0]
    regressors = (p * k.half_span / V, q * k.half_chord / V, r * k.half_span / V, V / k.airspeed, *sample[_CONTROLS:])
    asked = []
    for found, (slope, offset, rest) in ((lift, k.lift), (scale * ay, k.side)):
        asked.append((found - offset - sum([value * regressors[i] for i, value in rest])) / slope)
    return asked[0], asked[1]


def _compare(filter_: FlowAngleFilter, k: Kinematics, sample: Sequence[float]) -> None:
    """Sum up by how much airspeed and the references differ from the filter's."""
    u, v, w = _at_cg(filter_.state, k, sample)
    alpha, V = math.atan2(w, u), math.sqrt(u * u + v * v + w * w)
    asked = _asked(k, sample, alpha, filter_.state[5:])
    surprise = filter_.surprise
    surprise[0] += sample[6] - V
    surprise[1] += asked[0] - alpha
    surprise[2] += asked[1] - math.asin(v / V)
    filter_.count += 1


def _correct(filter_: FlowAngleFilter, k: Kinematics, time: float, air_interval: float) -> None:
    """Predict the covariance over the time since the last correction and take the mean surprises in.

    The airspeed is new every ``air_interval`` s.
    """
    span, x = time - filter_.corrected, filter_.state
    transition = np.eye(7) + span * _jacobian(x, filter_.imu)
    P = transition @ filter_.covariance @ transition.T + span * np.diag(k.walks)  # P = F P F' + Q
    u, v, w = x[:3]
    V = math.sqrt(u * u + v * v + w * w)
    H = np.zeros((3, 7))
    H[0, :3] = u / V, v / V, w / V
    H[1, :3] = -w / (u * u + w * w), 0.0, u / (u * u + w * w)
    H[2, 1] = 1.0 / V
    R = np.array([_GUSTS * V * V, _GUSTS, _GUSTS]) / span
    gain = np.linalg.solve(H @ P @ H.T + np.diag(R), H @ P).T  # K = P H' (H P H' + R)^-1
    mean = np.array(filter_.surprise) / filter_.count
    filter_.state = (np.array(x) + gain @ mean).tolist()
    gains = (gain[2, 1] / (V * span)) ** 2, (gain[1, 2] / (V * span)) ** 2, 1.0
    filter_.followed = [a + b for a, b in zip(filter_.followed, gains, strict=True)]
    kept = np.eye(7) - gain @ H
    filter_.covariance = kept @ P @ kept.T + (gain * R) @ gain.T  # Joseph's form
    filter_.surprise, filter_.count, filter_.corrected = [0.0] * 3, 0, time
    _weigh(
        filter_,
        span,
        (mean[0] / V, math.atan2(w, u), math.asin(v / V)),
        k.airspeed_noise**2 * air_interval / (span * V * V),
    )


def _weigh(filter_: FlowAngleFilter, span: float, values: Sequence[float], noise: float) -> None:
    """Count the energies of gusts in the airspeed (gusts across are as strong) and of the angles, in the band.

    ``noise`` is the variance that the sensor alone gives the airspeed's share.
    """
    slow = filter_.slow or values
    fast = [value - mean for value, mean in zip(values, slow, strict=True)]
    left, share = math.exp(-span / _MEMORY), 1.0 - math.exp(-span * _SLOW)
    filter_.energies = [left * energy + float(x) ** 2 for energy, x in zip(filter_.energies, fast, strict=True)]
    filter_.energies[0] -= noise
    filter_.reports.append((filter_.corrected, filter_.followed, filter_.energies))
    filter_.slow = [mean + share * x for mean, x in zip(slow, fast, strict=True)]


def _jacobian(x: Sequence[float], imu: Sequence[float]) -> Array:
    """(7, 7) of ``_slopes`` by the state."""
    u, v, w, phi, theta, bias_p, bias_q = x
    p, q, r = imu[3] - bias_p, imu[4] - bias_q, imu[5]
    sp, cp, st, ct = math.sin(phi), math.cos(phi), math.sin(theta), math.cos(theta)
    tilt = st / ct
    return np.array(
        [
            [0.0, r, -q, 0.0, -GRAVITY * ct, 0.0, w],
            [-r, 0.0, p, GRAVITY * cp * ct, -GRAVITY * sp * st, -w, 0.0],
            [q, -p, 0.0, -GRAVITY * sp * ct, -GRAVITY * cp * st, v, -u],
            [0.0, 0.0, 0.0, tilt * (q * cp - r * sp), (q * sp + r * cp) / ct**2, -1.0, -tilt * sp],
            [0.0, 0.0, 0.0, -q * sp - r * cp, 0.0, 0.0, -cp],
            [0.0] * 7,
            [0.0] * 7,
        ]
    )


def _at(arm: Sequence[float], x: Sequence[float], sample: Sequence[float]) -> tuple[float, float, float]:
    """Velocity (m/s) of the point that lies ``arm`` (m) from the IMU."""
    p, q, r = sample[3] - x[5], sample[4] - x[6], sample[5]
    a, b, c = arm
    return x[0] + q * c - r * b, x[1] + r * a - p * c, x[2] + p * b - q * a


def _at_cg(x: Sequence[float], k: Kinematics, sample: Sequence[float]) -> tuple[float, float, float]:
    """Velocity of the centre of gravity, m/s."""
    a, b, c = k.imu
    return _at((-a, -b, -c), x, sample)


def _at_probe(x: Sequence[float], k: Kinematics, sample: Sequence[float]) -> tuple[float, float]:
    """Alpha and beta (rad) as vanes on the probe would show them."""
    u, v, w = _at(k.probe, x, sample)
    return math.atan2(w, u), math.atan2(v, math.hypot(u, w))
