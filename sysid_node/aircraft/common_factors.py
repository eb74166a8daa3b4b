"""Whether estimates are those of the aircraft file times one factor: a mass, an inertia, an area or a unit is wrong.

A mass that is twice the true one doubles every derivative of the forces, and nothing else does that to all of them
alike. Derivatives that the file has only roughly are off by factors of their own.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np

from sysid_node.aircraft.model import Aircraft

_LARGEST = 1.5  # factor, or its inverse, from which on something is wrong
_ALIKE = 0.1  # 1 sigma by which derivatives may be off the common factor by themselves, as a share
_APART = 2.0  # standard deviations by which one may be off
_CERTAIN = 5.0  # standard errors that an estimate is from zero at least
_FEWEST = 3  # derivatives that must agree
_FAR_SMALLER = 0.3  # share of the file's derivatives, where a reading in g would leave a tenth
_FORCES = ("CL", "CY")
_MOMENTS = {"Cl": ("rolling", "Ixx"), "Cm": ("pitching", "Iyy"), "Cn": ("yawing", "Izz")}


class Estimated(Protocol):
    """What is asked of an estimate."""

    @property
    def value(self) -> float:
        """The estimate, in the derivative's unit."""
        ...

    @property
    def standard_error(self) -> float:
        """Its standard error, in the same unit."""
        ...

    @property
    def valid(self) -> bool:
        """Whether it may be used."""
        ...


def common_factors(aircraft: Aircraft, estimates: Mapping[str, Estimated]) -> list[str]:
    """What valid estimates show of mass, inertias, areas and units, a sentence each; none where nothing is wrong."""
    forces = _factor(aircraft, estimates, _FORCES)
    moments = {name: _factor(aircraft, estimates, (name,)) for name in _MOMENTS}
    known = [factor for factor in (forces, *moments.values()) if factor]
    if forces and any(moments.values()) and _alike(known):
        return [
            f"derivatives of forces and moments are all {np.mean(known):.2g} times those of {aircraft.name!r}: are the "
            "wing area, the airspeed and the air density right, or is it another aircraft's flight?"
        ]
    found = [
        f"derivatives of the {name} moment are all {factor:.2g} times those of {aircraft.name!r}: is {inertia} right?"
        for (name, inertia), factor in zip(_MOMENTS.values(), moments.values(), strict=True)
        if factor
    ]
    if forces:
        found.append(
            f"derivatives of lift and side force are all {forces:.2g} times those of {aircraft.name!r}: is its mass "
            f"of {aircraft.mass:g} kg right?"
        )
    elif _side_force_in_g(aircraft, estimates):
        found.append(
            f"derivatives of the side force are all far smaller than those of {aircraft.name!r}: is the lateral "
            "acceleration in g? It must be in m/s^2"
        )
    return found


def _side_force_in_g(aircraft: Aircraft, estimates: Mapping[str, Estimated]) -> bool:
    """Whether all derivatives of the side force that are well known are far smaller than those of the file.

    An accelerometer off its place adds to what is read, so that they need not be smaller by exactly 9.8.
    """
    shares = [
        abs(estimate.value / aircraft.derivatives[name].value)
        for name, estimate in estimates.items()
        if name.startswith("CY_") and name != "CY_0" and estimate.valid and name in aircraft.derivatives
        if abs(aircraft.derivatives[name].value) > _CERTAIN * estimate.standard_error
    ]
    return len(shares) >= _FEWEST - 1 and max(shares) < _FAR_SMALLER


def _factor(aircraft: Aircraft, estimates: Mapping[str, Estimated], coefficients: Sequence[str]) -> float:
    """The factor that all certain derivatives of these coefficients have; 0 where there is none, or it is near one."""
    logs, errors, told = [], [], set[str]()
    for name, estimate in estimates.items():
        coefficient, _, regressor = name.partition("_")
        stated = aircraft.derivatives.get(name)
        if coefficient not in coefficients or regressor == "0" or not (stated and stated.value and certain(estimate)):
            continue
        if estimate.value * stated.value <= 0.0:
            return 0.0
        logs.append(math.log(estimate.value / stated.value))
        errors.append(math.hypot(estimate.standard_error / estimate.value, _ALIKE))
        told.add(coefficient)
    if len(logs) < _FEWEST or told != set(coefficients):
        return 0.0
    weights = np.array(errors) ** -2
    mean = float(weights @ logs / weights.sum())
    agree = np.all(np.abs(np.array(logs) - mean) < _APART * np.array(errors))
    return math.exp(mean) if agree and abs(mean) > math.log(_LARGEST) else 0.0


def certain(estimate: Estimated) -> bool:
    """Whether an estimate is valid and its sign certain."""
    return estimate.valid and abs(estimate.value) > _CERTAIN * estimate.standard_error


def _alike(factors: Sequence[float]) -> bool:
    return max(factors) / min(factors) < 1.0 + 2.0 * _APART * _ALIKE
