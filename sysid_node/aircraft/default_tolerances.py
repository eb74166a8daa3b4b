"""Default tolerances of everything that an aircraft file may state: 1 sigma, with unit, meaning and source.

They are what careful owners of small UAVs reach without a laboratory. A file that states a tolerance replaces the
default. ``ideal: true`` sets all that are not stated to zero.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from types import MappingProxyType


@dataclass(frozen=True)
class DefaultTolerance:
    """The default of all quantities whose dotted key matches ``pattern`` (``*`` stands for any text).

    It is ``absolute``, in the quantity's unit, or ``share`` times the quantity, whichever is larger.
    """

    pattern: str
    unit: str
    absolute: float
    share: float
    meaning: str
    source: str


_JARDIN = "Jardin & Mueller (2007), AIAA 2007-6822: bifilar pendulum; Lehmkuehler et al. (2016), Aeronaut. J. 121"
_PLACING = "a tape measure, and a CG found by balancing on two edges"
_GYRO = "TDK InvenSense DS-000176 (ICM-20602): sensitivity error 1 % of gyroscope and accelerometer"
_VANES = "Klein & Morelli (2006), ch. 10: upwash at boom vanes before a flight calibration"
_SERVO = "hobby servos turn 60 deg in 0.1 to 0.2 s; published lags of small UAVs' servos are 20 to 120 ms"

#: The first entry whose pattern matches holds.
DEFAULT_TOLERANCES: tuple[DefaultTolerance, ...] = (
    DefaultTolerance("mass", "kg", 0.0, 0.01, "mass as flown", "a kitchen scale, and a battery that was exchanged"),
    DefaultTolerance("inertia.Ixz", "kg m^2", 0.0, 0.02, "product of inertia: share of sqrt(Ixx Izz)", _JARDIN),
    DefaultTolerance("inertia.*", "kg m^2", 0.0, 0.05, "moment of inertia", _JARDIN),
    DefaultTolerance("geometry.S", "m^2", 0.0, 0.01, "reference area", "tape measure, 2 mm in 0.3 m of chord"),
    DefaultTolerance("geometry.*", "m", 0.002, 0.0, "span and chord", "tape measure"),
    DefaultTolerance("sensors.imu.*", "m", 0.01, 0.0, "place of the IMU from the CG", _PLACING),
    DefaultTolerance("sensors.air_data.*", "m", 0.02, 0.0, "place of the air-data probe from the CG", _PLACING),
    DefaultTolerance("cg_shift.x", "m", 0.005, 0.0, "CG forward of the file's", _PLACING),
    DefaultTolerance("cg_shift.y", "m", 0.003, 0.0, "CG to the right of the file's", _PLACING),
    DefaultTolerance("cg_shift.z", "m", 0.01, 0.0, "CG below the file's", _PLACING),
    DefaultTolerance(
        "controls.*.scale", "1", 0.03, 0.0, "deflection per joint's angle, relative", "throw gauge: 0.5 deg in 20 deg"
    ),
    DefaultTolerance("controls.*.offset", "rad", 0.0087, 0.0, "deflection at zero", "throw gauge: 0.5 deg"),
    DefaultTolerance(
        "throttle.max_thrust", "N", 0.0, 0.1, "thrust at full throttle",
        "static tests against thrust in flight and over a battery's charge: Selig & Ananda (2011), AIAA 2011-1286",
    ),
    DefaultTolerance("throttle.inclination", "rad", 0.01, 0.0, "angle of the thrust line", "protractor: 0.5 deg"),
    DefaultTolerance("throttle.arm", "m", 0.005, 0.0, "arm of the thrust line", _PLACING),
    DefaultTolerance(
        "delays.imu", "s", 0.005, 0.0, "lateness of the IMU's stamps",
        "gyroscope low-pass filters: PX4 IMU_GYRO_CUTOFF 30 Hz, two poles, is 7 ms late; ArduPilot INS_GYRO_FILTER "
        "20 Hz is 11 ms; MPU-9250 at 20 Hz is 9.9 ms",
    ),
    DefaultTolerance(
        "delays.air_data", "s", 0.01, 0.0, "lateness of the air data's stamps", "drivers that poll at 50 to 100 Hz"
    ),
    DefaultTolerance(
        "delays.actuators", "s", 0.006, 0.0, "lateness of the actuators' stamps",
        "a PWM frame of 20 ms: the time within it is evenly distributed, 1 sigma 20 / sqrt(12) ms",
    ),
    DefaultTolerance("air_density", "1", 0.01, 0.0, "air density, relative", "thermometer in the sun: 3 K"),
    DefaultTolerance("imu_scale.*", "1", 0.01, 0.0, "scale of accelerometers and gyroscopes", _GYRO),
    DefaultTolerance(
        "imu_misalignment.*", "rad", 0.01, 0.0, "mounting of the IMU", "levelling on the ground: 0.5 to 1 deg"
    ),
    DefaultTolerance(
        "airspeed_scale.error", "1", 0.02, 0.0, "scale of the airspeed",
        "TE MS4525DO: total error 1 % of full scale; ArduPilot ARSPD_RATIO 1.5 to 3 before its calibration in flight, "
        "a few per cent after it",
    ),
    DefaultTolerance("vane_scale.*", "1", 0.03, 0.0, "scale of the flow angles", _VANES),
    DefaultTolerance(
        "air_data_lag.time_constant", "s", 0.04, 0.2, "pneumatic lag of tubes and sensor",
        "Haering (1995), NASA TM-104316: 10 to 100 ms",
    ),
    DefaultTolerance("actuator_lag.damping", "1", 0.1, 0.0, "damping of servos of second order", _SERVO),
    DefaultTolerance("actuator_lag.*", "s", 0.005, 0.2, "time constant of a servo that the file states", _SERVO),
    DefaultTolerance("actuator_rate_limit.*", "rad/s", 0.0, 0.2, "largest rate of a servo", _SERVO),
    DefaultTolerance("command_delay.*", "s", 0.005, 0.2, "delay of a command", "a PWM frame of 20 ms"),
    DefaultTolerance("actuator_backlash.*", "rad", 0.005, 0.2, "free play of a linkage", "throw gauge: 0.3 deg"),
    DefaultTolerance("*", "", 0.0, 0.2, "any other parameter of an effect", "a value from a handbook or a computation"),
)  # fmt: skip

#: 1 sigma about zero of the lateness (s) of a servo of which the file says nothing: the root mean square of lags of 20
#: to 120 ms (see ``_SERVO``) together with delays of up to 40 ms (two PWM frames, a driver's queue).
UNKNOWN_SERVO_LAG = 0.09

#: 1 sigma of what stays constant in a flight, after the calibration on the ground: SI units.
DEFAULT_NOISE_BIAS: Mapping[str, float] = MappingProxyType(
    {
        "accel": 0.1,  # m/s^2; ICM-20602 after a six-position calibration: 10 mg
        "gyro": 0.003,  # rad/s; after the calibration at rest, over a change of 10 K at 0.02 deg/s/K
        "alpha": 0.01,  # rad; setting of a vane with a protractor: 0.5 deg
        "beta": 0.01,  # rad
        "airspeed": 0.3,  # m/s; drift of a differential pressure sensor's zero: 3 Pa at 15 m/s is 0.16 m/s
    }
)


def default_of(key: str) -> DefaultTolerance:
    """The default that holds for a dotted key."""
    return next(default for default in DEFAULT_TOLERANCES if fnmatchcase(key, default.pattern))


def tolerances(sizes: Mapping[str, float], stated: Mapping[str, float], *, ideal: bool) -> dict[str, float]:
    """1 sigma by dotted key, from the size of each quantity that a ``share`` refers to and what the file states."""
    complete = {}
    for key, size in sizes.items():
        default = default_of(key)
        complete[key] = 0.0 if ideal else max(default.absolute, default.share * abs(size))
    return complete | dict(stated)
