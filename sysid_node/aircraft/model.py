"""The contents of an aircraft file: geometry, mass, controls, derivatives. SI units, radians, body axes FRD."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from sysid_node.aircraft.names import model_structure

Vector3 = tuple[float, float, float]


@dataclass(frozen=True)
class Inertia:
    """Moments of inertia about the centre of gravity, body axes, kg m^2. NaN = not known."""

    Ixx: float
    Iyy: float
    Izz: float
    Ixz: float = 0.0


@dataclass(frozen=True)
class Geometry:
    """Reference area (m^2), span (m) and mean aerodynamic chord (m)."""

    S: float
    b: float
    cbar: float


@dataclass(frozen=True)
class Reference:
    """The flight condition for which the derivatives hold: true airspeed (m/s), air density (kg/m^3)."""

    airspeed: float
    air_density: float


@dataclass(frozen=True)
class Control:
    """One aerodynamic control, a linear map from actuator joints: value = offset + sum scale_j joint_j."""

    name: str
    symbol: str  # "de": the regressor's name in Cm_de
    joints: Mapping[str, float]  # joint name -> scale
    offset: float = 0.0  # rad
    limit: float | None = None  # rad, both ways


@dataclass(frozen=True)
class Throttle:
    """Thrust = max_thrust * joint (0..1), or the joint's value itself where it is in newtons."""

    joint: str
    max_thrust: float | None = None  # N at 1.0; None: the joint is thrust in N
    inclination: float = 0.0  # rad, thrust line above the body x axis
    arm: float = 0.0  # m: pitching moment about the CG per newton of thrust, nose up positive


@dataclass(frozen=True)
class Derivative:
    """A derivative's value (per radian, or per unit of its regressor) and its 1-sigma tolerance."""

    value: float
    tolerance: float | None = None


@dataclass(frozen=True)
class Sensors:
    """Positions of the sensors relative to the CG, body axes FRD, m."""

    imu: Vector3 = (0.0, 0.0, 0.0)
    air_data: Vector3 = (0.0, 0.0, 0.0)


#: Typical 1-sigma noise of sensors of small UAVs, used where the aircraft file gives none.
DEFAULT_NOISE: Mapping[str, float] = MappingProxyType(
    {
        "accel": 0.05,  # m/s^2
        "gyro": 0.003,  # rad/s
        "airspeed": 0.3,  # m/s
        "alpha": 0.005,  # rad
        "beta": 0.005,  # rad
        "attitude": 0.005,  # rad
    }
)


@dataclass(frozen=True)
class Aircraft:
    """The validated contents of an aircraft file."""

    name: str
    source: str
    mass: float  # kg
    inertia: Inertia
    geometry: Geometry
    reference: Reference
    controls: Mapping[str, Control]  # aerodynamic controls by name, in the file's order
    derivatives: Mapping[str, Derivative]  # by name, in the file's order
    throttle: Throttle | None = None
    sensors: Sensors = field(default_factory=Sensors)
    noise: Mapping[str, float] = field(default_factory=lambda: dict(DEFAULT_NOISE))

    @property
    def control_symbols(self) -> tuple[str, ...]:
        """Symbols of the aerodynamic controls in the file's order, e.g. ``("de", "da", "dr")``."""
        return tuple(control.symbol for control in self.controls.values())

    @property
    def model_structure(self) -> dict[str, tuple[str, ...]]:
        """Regressors of each coefficient: ``{"Cm": ("0", "alpha", "q", "de"), ...}``."""
        return model_structure(self.derivatives)
