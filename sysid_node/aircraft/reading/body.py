"""The blocks of an aircraft file that describe its body: inertia, geometry, reference condition, sensors and noise."""

from __future__ import annotations

import math
import warnings

from sysid_node.aircraft.default_tolerances import DEFAULT_NOISE_BIAS
from sysid_node.aircraft.document import DocumentEntry
from sysid_node.aircraft.model import AIRSPEEDS, DEFAULT_NOISE, Geometry, Inertia, ReferenceCondition, Sensors, Vector3
from sysid_node.aircraft.reading.quantities import GREATEST, Quantities, any_number, positive
from sysid_node.errors import ModelWarning


def read_inertia(entry: DocumentEntry | None, quantities: Quantities, *, ideal: bool) -> Inertia:
    """The inertia. A moment that is left out is NaN (unknown); Ixz is then zero, as in a symmetric aircraft.

    Raises InputError; warns instead where an ``ideal`` file's moments are those of no rigid body, because a simulator
    can fly with them.
    """
    if entry is None:
        return Inertia(math.nan, math.nan, math.nan, math.nan)
    fields = entry.fields({}, optional=("Ixx", "Iyy", "Izz", "Ixz"))
    Ixx, Iyy, Izz = (
        quantities.read(fields[k], f"inertia.{k}", positive("kg m^2")) if k in fields else math.nan
        for k in ("Ixx", "Iyy", "Izz")
    )
    Ixz = quantities.read(fields["Ixz"], "inertia.Ixz", any_number("kg m^2")) if "Ixz" in fields else 0.0
    inertia = Inertia(Ixx, Iyy, Izz, Ixz)
    _check_inertia(entry, inertia, ideal=ideal)
    return inertia


def _check_inertia(entry: DocumentEntry, inertia: Inertia, *, ideal: bool) -> None:
    """Raise an error where no rigid body has these moments. Unknown moments (NaN) are not checked."""
    moments = {"Ixx": inertia.Ixx, "Iyy": inertia.Iyy, "Izz": inertia.Izz}
    for name, moment in moments.items():
        others = {k: v for k, v in moments.items() if k != name}
        if moment > sum(others.values()):
            problem = entry.error(
                f"no rigid body has {name} = {moment:g} > {' + '.join(others)} = "
                f"{sum(others.values()):g} kg m^2; check the three moments"
            )
            if not ideal:
                raise problem
            warnings.warn(f"{problem}; they are taken as the simulator takes them", ModelWarning, stacklevel=2)
    square = inertia.Ixz * inertia.Ixz  # infinite where it is too large; ``**`` would raise OverflowError
    if square >= inertia.Ixx * inertia.Izz:
        raise entry.error(f"no rigid body has Ixz^2 = {square:g} >= Ixx Izz = {inertia.Ixx * inertia.Izz:g}; check Ixz")


def read_geometry(entry: DocumentEntry, quantities: Quantities, *, ideal: bool = False) -> Geometry:
    """The reference area, span and chord. Raises InputError.

    Sizes that do not go together are an error; where the file is ``ideal`` they are a warning, because a simulator's
    coefficients are what they are by its own sizes.
    """
    fields = entry.fields({"S": "the reference area in m^2", "b": "the span in m", "cbar": "the mean chord in m"})
    S, b, cbar = (
        quantities.read(fields[k], f"geometry.{k}", positive(unit))
        for k, unit in (("S", "m^2"), ("b", "m"), ("cbar", "m"))
    )
    # S is b times a mean chord; whichever mean was meant, a factor of 3 shows a wrong unit.
    if not 1 / 3 < S / (b * cbar) < 3:
        problem = entry.error(f"S = {S:g} m^2 does not go with b cbar = {b * cbar:g} m^2; check the units")
        if not ideal:
            raise problem
        warnings.warn(f"{problem}; they are taken as the simulator takes them", ModelWarning, stacklevel=2)
    return Geometry(S, b, cbar)


def read_reference(entry: DocumentEntry, quantities: Quantities) -> ReferenceCondition:
    """The flight condition of the derivatives. Raises InputError."""
    fields = entry.fields({"airspeed": "the true airspeed in m/s", "air_density": "the air density in kg/m^3"})
    return ReferenceCondition(
        airspeed=positive("m/s", *AIRSPEEDS)(fields["airspeed"]),
        air_density=quantities.read(fields["air_density"], "reference.air_density", _density),
    )


def _density(entry: DocumentEntry) -> float:
    return entry.number("an air density (0.001 to 2 kg/m^3)", lambda x: 1e-3 <= x < 2)


def read_sensors(entry: DocumentEntry | None, quantities: Quantities) -> Sensors:
    """The places of the sensors. Raises InputError."""
    fields = entry.fields({}, optional=("imu", "air_data")) if entry is not None else {}
    return Sensors(**{name: _place(item, f"sensors.{name}", quantities) for name, item in fields.items()})


def _place(entry: DocumentEntry, key: str, quantities: Quantities) -> Vector3:
    expected = "three numbers [x, y, z] in m from the CG, forward, right, down"
    items = entry.items(expected)
    if len(items) != 3:
        raise entry.error(f"got {len(items)} values, expected {expected}")
    x, y, z = (quantities.read(item, f"{key}.{axis}", any_number("m")) for item, axis in zip(items, "xyz", strict=True))
    return x, y, z


def _sigma(entry: DocumentEntry) -> float:
    return entry.number("a number, 1 sigma, not negative (up to 1e9)", lambda x: 0 <= x <= GREATEST)


def read_noise(entry: DocumentEntry | None) -> dict[str, float]:
    """1 sigma of each sensor's noise; the default where it is left out. Raises InputError."""
    fields = entry.fields({}, optional=(*DEFAULT_NOISE, "bias")) if entry is not None else {}
    return {**DEFAULT_NOISE, **{name: _sigma(item) for name, item in fields.items() if name != "bias"}}


def read_noise_bias(entry: DocumentEntry | None, *, ideal: bool) -> dict[str, float]:
    """1 sigma of what stays constant in a flight; where it is left out the default, or zero where ``ideal``."""
    bias = entry.mapping("a mapping").get("bias") if entry is not None else None
    fields = bias.fields({}, optional=tuple(DEFAULT_NOISE_BIAS)) if bias is not None else {}
    return {**default_noise_bias(ideal=ideal), **{name: _sigma(item) for name, item in fields.items()}}


def default_noise_bias(*, ideal: bool) -> dict[str, float]:
    """The noise's ``bias`` of a file that states none."""
    return dict.fromkeys(DEFAULT_NOISE_BIAS, 0.0) if ideal else dict(DEFAULT_NOISE_BIAS)
