"""What errors of the aircraft file's derivatives do to the estimates through reconstructed flow angles.

Errors of the instruments, which the angles are integrals of, are among the imperfections (``systematic.sources``).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.online.alignment.flow_angle_filter import FlowAngleFilter
from sysid_node.online.frequency.regression_signals import OFFSET, SignalLayout
from sysid_node.online.regression.information import Information, Spectrum
from sysid_node.online.regression.least_squares import Solution
from sysid_node.online.regression.normal_equations import NormalEquations

Array = NDArray[np.float64]


def reconstruction_covariance(
    filter_: FlowAngleFilter,
    at: float,
    aircraft: Aircraft,
    layout: SignalLayout,
    lines: Spectrum,
    equations: NormalEquations,
    solution: Solution,
    info: Information,
    *,
    mean_bounded: bool,
) -> Array:
    """(C, P, P) covariance by which errors of the file reach the unknowns through the reconstructed angles.

    An error e of a regressor moves the solution by theta (Z'A)^-1 Z'e. Only the energy of e is known, so its largest
    possible effect (the Cauchy-Schwarz inequality) is counted. ``at``: time in s. ``mean_bounded``: whether an error of
    the mean angle of attack is counted so, too, which else is among the imperfections.
    """
    structure = equations.structure
    covariance = np.zeros((len(structure.coefficients), equations.columns.size, equations.columns.size))
    if filter_.missing is None or not filter_.active or not solution.usable:
        return covariance
    gram = info.grams.sum(axis=0)
    outer = gram[equations.instruments[:, None], equations.instruments] * structure.same_block
    reach = solution.inverse @ outer @ solution.inverse.T
    energies = _error_energies(filter_, at, aircraft, layout, lines, info, mean_bounded=mean_bounded)
    for name, missing, energy in zip(("alpha", "beta"), filter_.missing, energies, strict=True):
        if missing:
            theta = np.array([regressor == name for regressor in structure.regressors]) @ solution.theta
            covariance += (energy * theta**2)[:, None, None] * reach
    return covariance * structure.belongs.T[:, :, None] * structure.belongs.T[:, None, :]


def _error_energies(
    filter_: FlowAngleFilter,
    at: float,
    aircraft: Aircraft,
    layout: SignalLayout,
    lines: Spectrum,
    info: Information,
    *,
    mean_bounded: bool,
) -> list[float]:
    """Energies over the lines of the errors of alpha and beta that the file's errors make.

    In the band the angles follow the references with the filter's gain divided by the frequency. A mean alpha that is
    off by d also adds d times the integral of the roll rate to the sideslip.
    """
    # an integral's energy is the signal's over the squared frequency; s^2
    inverse_squares = np.array([np.mean(lines.omega[band] ** -2.0) for band in lines.bands])
    integrated = inverse_squares @ info.grams.diagonal(axis1=1, axis2=2)
    errors = _angle_errors(aircraft, layout, "CL", "alpha"), _angle_errors(aircraft, layout, "CY", "beta")
    *gains, count = filter_.band.report(at).gains
    energies = [
        gain / max(count, 1.0) * float(integrated @ error**2) for gain, error in zip(gains, errors, strict=True)
    ]
    if mean_bounded and "p" in layout.names:
        means = info.integrals / max(float(info.integrals[OFFSET]), 1e-9)
        per_rate = 2.0 * aircraft.reference.airspeed / aircraft.geometry.b
        energies[1] += float(means**2 @ errors[0] ** 2) * per_rate**2 * float(integrated[layout.column("p")])
    return energies


def _angle_errors(aircraft: Aircraft, layout: SignalLayout, coefficient: str, angle: str) -> Array:
    """(W,) error of the reference angle per unit of each signal; that of the offset stands at its regressor k."""
    error, slope = np.zeros(layout.width), aircraft.derivatives[f"{coefficient}_{angle}"].value
    for name, derivative in aircraft.derivatives.items():
        of_coefficient, _, regressor = name.partition("_")
        if of_coefficient == coefficient and (regressor == "0" or regressor in layout.names):
            error[OFFSET if regressor == "0" else layout.column(regressor)] = derivative.uncertainty / slope
    return error
