"""Angle of attack and sideslip where no vane measures them: a kinematic filter on IMU, airspeed and the lift.

Within the lines' band the angles are the integrals of the kinematic equations (Klein & Morelli 2006, eqs. 3.33 and
3.34; flight path reconstruction: ibid., ch. 10): the velocity of the IMU's own point, so that no angular acceleration
is needed, with an attitude of the filter's own. What integration cannot know (biases, attitude, slow drift)
is estimated by an extended Kalman filter from three slow references: the airspeed, the angle of attack at which the
aircraft file's lift is the measured one, and the sideslip at which its side force is. The references' noise densities
are those of light to moderate gusts, which puts the filter's bandwidth well below the lines' band. The references, and
the file's errors in them, therefore have little effect in the band; ``flow_angle_errors`` bounds it.

Limits. The mean angle of attack is the aircraft file's: offsets, and the slopes of the drag (an error of the angle
turns lift into drag), cannot be estimated. The angles are those against the mean air: gusts move the aircraft without
showing in them. They are then noise of the regression, which the residual's density counts in the intervals. In open
loop the deflections are independent of the gusts, so instrumental variables are not biased by them.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.dynamics import scalar
from sysid_node.dynamics.airflow import velocity_of
from sysid_node.dynamics.atmosphere import GRAVITY
from sysid_node.online.alignment.flow_angle_equations import angles_at_probe, integrated, jacobian, velocity_at_cg
from sysid_node.online.alignment.flow_angle_model import CONTROLS, FlowAngleModel, flow_angle_model, reference_angles
from sysid_node.online.types import SAMPLE_COLUMNS

Array = NDArray[np.float64]

ALPHA, BETA = SAMPLE_COLUMNS.index("alpha"), SAMPLE_COLUMNS.index("beta")
AIR_INTERVAL = SAMPLE_COLUMNS.index("air_interval")
EVERY = 0.1  # s between corrections
HIDDEN = 10.0  # times the energy of the gusts in the airspeed that a reconstructed angle must move
#: Error of the references as white noise: gusts of 0.04 rad, or of as much of the airspeed, with a correlation time
#: of about 5 s. rad^2 s.
_GUSTS = 0.016
#: 1 sigma at the start: flow angles rad, attitude rad, biases rad/s.
_FLOW, _ATTITUDE, _BIAS = 0.05, 0.1, 0.01
_SLOW = 0.6  # rad/s under which gusts and motion are not in the band
_MEMORY = 60.0  # s over which their energies are counted
_WILDEST, _FASTEST, _THINNEST = 1e6, 1e4, 1e-6  # m/s^2 and rad/s, m/s, kg/m^3 of no flight: no readings
_STEEPEST = 1.4  # rad of pitch or flow angle beyond which the filter has diverged and begins anew


class BandReport(NamedTuple):
    """The energies and gains as they stood at a time (s)."""

    time: float
    gains: list[float]  # sums of squared gains on alpha and beta, 1/s^2, and their number
    energies: list[float]  # in the band, of airspeed (its share), alpha and beta, rad^2


@dataclass
class BandEnergies:
    """Energies in the band of gusts in the airspeed and of the angles, and the filter's gains."""

    slow: list[float] = field(default_factory=list)  # slow part of airspeed (its share), alpha, beta
    energies: list[float] = field(default_factory=lambda: [0.0] * 3)  # of the rest, rad^2
    gains: list[float] = field(default_factory=lambda: [0.0] * 3)  # sums of squares, 1/s^2, and their number
    reports: deque[BandReport] = field(default_factory=lambda: deque(maxlen=1024))

    def add(self, time: float, span: float, values: Sequence[float], noise: float, gains: Sequence[float]) -> None:
        """Count the energies of gusts in the airspeed (those across are as strong) and of the angles over a span (s).

        ``noise`` is the variance that the sensor alone gives the airspeed's share.
        """
        self.gains = [a + b for a, b in zip(self.gains, gains, strict=True)]
        slow = self.slow or values
        fast = [value - mean for value, mean in zip(values, slow, strict=True)]
        left, share = math.exp(-span / _MEMORY), 1.0 - math.exp(-span * _SLOW)
        self.energies = [left * energy + float(x) ** 2 for energy, x in zip(self.energies, fast, strict=True)]
        self.energies[0] -= noise
        self.reports.append(BandReport(time, self.gains, self.energies))
        self.slow = [mean + share * x for mean, x in zip(slow, fast, strict=True)]

    def report(self, at: float) -> BandReport:
        """The report that stood ``at`` (s): a whole record is completed long before its segments are evaluated."""
        none = BandReport(at, [0.0] * 3, [0.0] * 3)
        return next((report for report in reversed(self.reports) if report.time <= at), none)


@dataclass
class Innovations:
    """Airspeed (m/s), alpha and beta (rad) less the filter's, summed since the last correction."""

    since: float = math.nan  # s
    sums: list[float] = field(default_factory=lambda: [0.0] * 3)
    count: int = 0


@dataclass
class FlowAngleFilter:
    """The filter: u v w m/s of the IMU's point against the mean air, phi theta rad, biases: p, q rad/s, az m/s^2."""

    model: FlowAngleModel | None  # None: the aircraft file has no lift slope or no side-force slope
    missing: tuple[bool, bool] | None = None  # whether alpha, beta are not measured; None = no sample has come yet
    time: float = math.nan
    step: float = 0.0  # s between the last two samples
    state: list[float] = field(default_factory=list)
    covariance: Array = field(default_factory=lambda: np.empty((0, 0)))
    imu: Sequence[float] = ()  # the last reading
    innovations: Innovations = field(default_factory=Innovations)
    gain: NDArray[np.floating] = field(default_factory=lambda: np.empty((0, 0)))  # (8, 3) of the last correction
    band: BandEnergies = field(default_factory=BandEnergies)

    @property
    def active(self) -> bool:
        """Whether an angle is reconstructed."""
        return self.missing is not None and any(self.missing)


def init(aircraft: Aircraft) -> FlowAngleFilter:
    """A filter that has seen nothing."""
    return FlowAngleFilter(flow_angle_model(aircraft))


def complete(filter_: FlowAngleFilter, time: float, sample: Sequence[float], max_gap: float) -> Sequence[float]:
    """The sample (``SAMPLE_COLUMNS``, controls), with the angles that its aircraft does not measure.

    The first sample decides which those are. NaN where the sample lacks what reconstruction needs. After a gap
    longer than ``max_gap`` s the filter keeps its biases and begins anew.
    """
    if filter_.missing is None:
        filter_.missing = math.isnan(sample[ALPHA]), math.isnan(sample[BETA])
    model = filter_.model
    if not any(filter_.missing) or model is None:
        return sample
    angles = _angles(filter_, model, time, sample, max_gap)
    filled = list(sample)
    for column, missing, angle in zip((ALPHA, BETA), filter_.missing, angles, strict=True):
        if missing:
            filled[column] = angle
    if all(filter_.missing):
        filled[AIR_INTERVAL] = model.interval * filter_.step
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
    """Sentences for the reader of the estimates on reconstructed angles; none where vanes measure both."""
    missing = filter_.missing or (False, False)
    angles = [angle for angle, absent in zip(("angle of attack", "sideslip"), missing, strict=True) if absent]
    if not angles or filter_.model is None:
        return []
    return [f"Not measured, so reconstructed from IMU and airspeed: {' and '.join(angles)}."]


def why_unknown(filter_: FlowAngleFilter, at: float, name: str, regressors: Sequence[str]) -> str:
    """Why the derivative of this name and coefficient's regressors cannot be known ``at`` (s); "" where it can."""
    if not filter_.active or filter_.missing is None:
        return ""
    coefficient, _, regressor = name.partition("_")
    no_alpha, no_beta = filter_.missing
    if (coefficient == "CD" and no_alpha) or (regressor == "0" and (no_alpha or no_beta)):
        return "flow angle not measured"
    gusts, *motions = filter_.band.report(at).energies
    for angle, missing, motion in zip(("alpha", "beta"), filter_.missing, motions, strict=True):
        if missing and angle in regressors and motion < HIDDEN * gusts:
            return f"gusts hide {angle}"
    return ""


def _angles(
    filter_: FlowAngleFilter, model: FlowAngleModel, time: float, sample: Sequence[float], max_gap: float
) -> tuple[float, float]:
    """Alpha and beta (rad) at the probe, after this sample; NaN where it lacks what they need."""
    V = sample[6]
    if not (
        math.isfinite(time + sum(sample[:7]) + sample[AIR_INTERVAL] + sum(sample[CONTROLS:]))
        and max(map(abs, sample[:6])) < _WILDEST
        and 0.5 < V < _FASTEST
        and sample[9] > _THINNEST
    ):
        return math.nan, math.nan
    step = time - filter_.time
    if not step <= max_gap or not filter_.state:
        _begin(filter_, model, time, sample)
    elif step > 0.0:
        filter_.step = step
        filter_.state = integrated(filter_.state, step, filter_.imu, sample)
        _compare(filter_, model, sample)
        if time - filter_.innovations.since >= EVERY:
            _correct(filter_, model, time, sample[AIR_INTERVAL])
        if not _sane(filter_.state):
            _begin(filter_, model, time, sample)
    filter_.time, filter_.imu = time, sample[:6]
    return angles_at_probe(filter_.state, model, sample)


def _begin(filter_: FlowAngleFilter, model: FlowAngleModel, time: float, sample: Sequence[float]) -> None:
    """Start at the file's angle of attack, without sideslip, in a coordinated turn at constant airspeed."""
    ax, ay, az, _, _, r, V = sample[:7]
    alpha = max(min(reference_angles(model, sample, 0.0, (0.0, 0.0, 0.0))[0], 0.3), -0.3)
    climb = max(min((ax * math.cos(alpha) + az * math.sin(alpha)) / GRAVITY, 0.5), -0.5)
    bank = math.asin(max(min((V * r - ay) / GRAVITY, 0.9), -0.9))
    filter_.state = [
        *velocity_of((V, alpha, 0.0), scalar),
        bank,
        alpha + math.asin(climb),
        *(filter_.state[5:] or (0.0, 0.0, 0.0)),
    ]
    spread = [1.0, _FLOW * V, _FLOW * V, _ATTITUDE, _ATTITUDE, _BIAS, _BIAS, model.bias_az]
    filter_.covariance = np.diag(np.square(spread))
    filter_.innovations, filter_.gain = Innovations(time), np.empty((0, 0))


def _sane(state: Sequence[float]) -> bool:
    """Whether the state is possible in flight."""
    u, v, w, _, pitch = state[:5]
    return u > 0.5 and abs(pitch) < _STEEPEST and math.hypot(v, w) < u * math.tan(_STEEPEST)


def _compare(filter_: FlowAngleFilter, model: FlowAngleModel, sample: Sequence[float]) -> None:
    """Add the differences of the airspeed and the references from the filter's values."""
    u, v, w = velocity_at_cg(filter_.state, model, sample)
    alpha, V = math.atan2(w, u), math.sqrt(u * u + v * v + w * w)
    reference_alpha, reference_beta = reference_angles(model, sample, alpha, filter_.state[5:])
    sums = filter_.innovations.sums
    sums[0] += sample[6] - V
    sums[1] += reference_alpha - alpha
    sums[2] += reference_beta - math.asin(v / V)
    filter_.innovations.count += 1


def _correct(filter_: FlowAngleFilter, model: FlowAngleModel, time: float, air_interval: float) -> None:
    """Predict the covariance over the time since the last correction and correct the state by the mean innovations.

    The airspeed is new every ``air_interval`` s.
    """
    span, x = time - filter_.innovations.since, filter_.state
    transition = np.eye(8) + span * jacobian(x, filter_.imu)
    P = transition @ filter_.covariance @ transition.T + span * np.diag(model.walks)  # P = F P F' + Q
    u, v, w = x[:3]
    V = math.sqrt(u * u + v * v + w * w)
    H = np.zeros((3, 8))
    H[0, :3] = u / V, v / V, w / V
    H[1, :3] = -w / (u * u + w * w), 0.0, u / (u * u + w * w)
    H[2, 1] = 1.0 / V
    R = np.array([_GUSTS * V * V, _GUSTS, _GUSTS]) / span
    gain = np.linalg.solve(H @ P @ H.T + np.diag(R), H @ P).T  # K = P H' (H P H' + R)^-1
    mean = np.array(filter_.innovations.sums) / filter_.innovations.count
    filter_.state = (np.array(x) + gain @ mean).tolist()
    gains = (gain[2, 1] / (V * span)) ** 2, (gain[1, 2] / (V * span)) ** 2, 1.0
    kept = np.eye(8) - gain @ H
    filter_.covariance = kept @ P @ kept.T + (gain * R) @ gain.T  # Joseph's form
    filter_.innovations, filter_.gain = Innovations(time), gain
    noise = model.airspeed_noise**2 * air_interval / (span * V * V)
    filter_.band.add(time, span, (mean[0] / V, math.atan2(w, u), math.asin(v / V)), noise, gains)
