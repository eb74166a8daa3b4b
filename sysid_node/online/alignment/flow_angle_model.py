"""What the reconstruction of flow angles takes from the aircraft file, and the angles that its forces ask for."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.dynamics.atmosphere import GRAVITY, dynamic_pressure
from sysid_node.dynamics.forces import lift_and_drag
from sysid_node.dynamics.linearised import linear_derivatives
from sysid_node.online.types import SAMPLE_COLUMNS

Array = NDArray[np.float64]

FINEST = 1e-5  # rad: no vane has less noise, whatever a file says
MIDDLE = 2.0 * math.pi * 0.5  # rad/s: middle of the band, where the integrated noise is compared with a vane's
CONTROLS = len(SAMPLE_COLUMNS)  # place of the first control in a sample
#: Random walks beyond the sensors' noise: velocity m/s, attitude rad, gyro biases rad/s, each per sqrt(s).
_WALKS = (0.02, 0.001, 5e-5)
_BIAS_CHANGES = 3600.0  # s in which the bias of az changes by as much as it is not known at the start


@dataclass(frozen=True)
class LinearForce:
    """A force coefficient that is linear in its angle and in other regressors."""

    slope: float  # 1/rad, of the angle
    offset: float
    others: tuple[tuple[int, float], ...]  # place in ``_regressors`` and derivative

    def angle(self, coefficient: float, regressors: Sequence[float]) -> float:
        """The angle (rad) at which the coefficient has this value."""
        return (coefficient - self.offset - sum([value * regressors[i] for i, value in self.others])) / self.slope


@dataclass(frozen=True)
class FlowAngleModel:
    """Properties of the aircraft that the filter uses."""

    lift: LinearForce  # over the angle of attack
    side: LinearForce  # over the sideslip
    imu: tuple[float, float, float]  # m from the CG
    probe: tuple[float, float, float]  # m from the IMU
    mass_over_area: float  # kg/m^2
    half_span: float  # m
    half_chord: float  # m
    airspeed: float  # m/s, reference
    airspeed_noise: float  # m/s
    bias_az: float  # m/s^2: 1 sigma of the constant error of az
    walks: Array  # (8,) densities of the states' random walks, per s
    interval: float  # s a squared s: between vane readings as noisy as the integrals, over the IMU's interval


def flow_angle_model(aircraft: Aircraft) -> FlowAngleModel | None:
    """The model; None where the file's lift does not depend on alpha, or its side force not on beta."""
    slopes = [aircraft.derivatives.get(name) for name in ("CL_alpha", "CY_beta")]
    if any(slope is None or slope.value == 0.0 for slope in slopes):
        return None
    velocity, attitude, bias = _WALKS
    noise, g, imu, probe = aircraft.noise, aircraft.geometry, aircraft.sensors.imu, aircraft.sensors.air_data
    integrated = (noise["gyro"] ** 2 + (noise["accel"] / aircraft.reference.airspeed) ** 2) / MIDDLE**2
    # the scale's error is a bias, too, for az is about the weight
    known = aircraft.tolerances
    bias_az = math.hypot(known.get("imu_bias.az", 0.0), GRAVITY * known.get("imu_scale.az", 0.0))
    return FlowAngleModel(
        lift=_linear(aircraft, "CL", "alpha"),
        side=_linear(aircraft, "CY", "beta"),
        imu=imu,
        probe=(probe[0] - imu[0], probe[1] - imu[1], probe[2] - imu[2]),
        mass_over_area=aircraft.mass / g.S,
        half_span=0.5 * g.b,
        half_chord=0.5 * g.cbar,
        airspeed=aircraft.reference.airspeed,
        airspeed_noise=noise["airspeed"],
        bias_az=bias_az,
        walks=np.array([velocity] * 3 + [attitude] * 2 + [bias] * 2 + [bias_az / math.sqrt(_BIAS_CHANGES)]) ** 2,
        interval=integrated / max(noise["alpha"], noise["beta"], FINEST) ** 2,
    )


def _linear(aircraft: Aircraft, coefficient: str, angle: str) -> LinearForce:
    """A coefficient's linear model; places are those of the regressors of ``reference_angles``."""
    names = ("p", "q", "r", "V", *aircraft.control_symbols)
    values = linear_derivatives(aircraft)
    others = tuple((i, values[f"{coefficient}_{n}"]) for i, n in enumerate(names) if f"{coefficient}_{n}" in values)
    return LinearForce(values[f"{coefficient}_{angle}"], values.get(f"{coefficient}_0", 0.0), others)


def reference_angles(
    model: FlowAngleModel, sample: Sequence[float], alpha: float, biases: Sequence[float]
) -> tuple[float, float]:
    """Alpha and beta (rad) at which the file's lift and side force are those that the IMU measures.

    ``alpha`` (rad) turns the body axes to the stability axes; ``biases`` are those of p and q (rad/s) and az (m/s^2).
    """
    ax, ay, az, p, q, r, V = sample[:7]
    p, q, az = p - biases[0], q - biases[1], az - biases[2]
    scale = model.mass_over_area / dynamic_pressure(sample[9], V)
    lift = scale * lift_and_drag(ax, az, math.cos(alpha), math.sin(alpha))[0]
    rates = (p * model.half_span / V, q * model.half_chord / V, r * model.half_span / V)
    regressors = (*rates, V / model.airspeed, *sample[CONTROLS:])
    return model.lift.angle(lift, regressors), model.side.angle(scale * ay, regressors)
