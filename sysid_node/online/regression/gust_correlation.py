"""Allowance in the standard errors for a correlation between deflections and gusts.

Instruments made from the deflections are uncorrelated with gusts only if nobody answers gusts with the surfaces.
Pilots and autopilots do. The resulting bias cannot be estimated from the flight, but it can be allowed for: a
correlation rho between instruments and gusts shifts an estimate by rho times the square root of the degrees of freedom
in standard errors (Conley, Hansen & Rossi, "Plausibly exogenous", Review of Economics and Statistics 94, 2012).
Intervals therefore stop shrinking with more data at that bound. The sensors' noise hardly moves a surface, so only the
part of a residual beyond the sensors' noise counts as gusts.

The less the surfaces are moved on purpose, the more of their movement answers gusts, and the larger rho may be: the
share of gusts in the deflections grows with the energy of the gusts' moments over that of the moments by deflections
(Ljung, "System Identification", 2nd ed. (1999), sect. 13.4, of feedback without excitation). So rho is taken as
``ANSWERED`` times the root of that ratio, and as ``ALLOWED`` at least. All coefficients with the same regressors have
the same instruments, and so the largest ratio among their moments.

Where the surfaces do nothing but answer gusts, all of this is too little. What the surfaces do then is opposed to what
the gusts do: of the measured rate x = z + g, with the instrument z and the gusts' part g, a feedback of loop gain L
makes z = -L g / (1 + L), and the slope of x on z is -1 / L: without other excitation a closed loop shows the inverse of
its feedback (Soderstrom & Stoica, "System Identification" (1989), ch. 10). A flight in which the surfaces are moved on
purpose has a slope of about 1, whatever the gusts are; an error of the file by a third changes it by about as much.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.online.regression.heteroskedasticity import EXCESS_RATIO, NoiseMoments
from sysid_node.online.regression.least_squares import Solution, Uncertainty, residual_combinations
from sysid_node.online.regression.normal_equations import NormalEquations

Array = NDArray[np.float64]

#: Both were chosen so that intervals hold under the default loops of PX4 and ArduPilot (``stiff_autopilots`` in bench).
ALLOWED = 0.07  # correlation between instruments and gusts, where surfaces are moved on purpose
ANSWERED = 0.3  # that correlation where the gusts' moments have the energy of the moments by deflections
MOMENTS = ("Cl", "Cm", "Cn")
RATES = ("p", "q", "r")
OPPOSED = 0.1  # slope of a rate on its instrument under which the surfaces are said to answer gusts,
FOLLOWED = 0.75  # unless their correlation is above this, as where the file has a surface with the wrong sign
NOTABLE = 0.1  # share of gusts in the residuals of an axis from which on it matters that surfaces answer them
#: By coefficient those whose residuals tell of gusts in its regressors, which are the same for a whole axis. What is
#: left of the drag counts for the drag alone: most of it is of a polar that no derivative describes.
TELLING = {"CL": ("CL", "Cm"), "CD": ("CL", "CD", "Cm"), "Cm": ("CL", "Cm")}
TELLING |= dict.fromkeys(("CY", "Cl", "Cn"), ("CY", "Cl", "Cn"))


def share_of_gusts(density: Array, sensed: Array) -> Array:
    """(..., C) share of a residual's ``density`` that is not the sensors' noise, which has the density ``sensed``."""
    return np.asarray(np.clip(1.0 - EXCESS_RATIO * sensed / np.maximum(density, 1e-300), 0.0, 1.0))


def share_by_axis(coefficients: Sequence[str], gusts: Array) -> Array:
    """(C,) of each of the ``coefficients`` the largest share of ``gusts`` (C,) among those that tell of them there."""
    known = dict(zip(coefficients, gusts.tolist(), strict=True))
    return np.array([max(known.get(one, 0.0) for one in TELLING.get(c, (c,))) for c in coefficients])


def inflation(spread: Uncertainty, gusts: Array, answered: Array) -> Array:
    """(C,) factors of the covariance; ``gusts`` (C,): see ``share_of_gusts``, ``answered`` (C,): ``of_solution``."""
    return np.asarray(1.0 + np.maximum(answered, ALLOWED) ** 2 * spread.freedom * gusts)


def of_solution(equations: NormalEquations, solution: Solution, gram: Array, gusts: Array) -> Array:
    """(C,) correlation between instruments and gusts by the deflections of a flight.

    ``gram`` (W, W) of which the ``solution`` is; ``gusts`` (C,): see ``share_of_gusts``.
    """
    columns = equations.columns
    return by_deflections(equations, solution.theta, gram[columns[:, None], columns], gusts * solution.residual)


def only_answered(instrumented: NormalEquations, gram: Array, gusts: Array) -> NDArray[np.bool_]:
    """(C,) coefficients of an axis whose surfaces do nothing but answer gusts, by the ``gram`` (W, W).

    ``instrumented``: the equations with the instruments of all regressors that have one; ``gusts`` (C,): see
    ``share_of_gusts``.
    """
    structure, found = instrumented.structure, np.zeros(instrumented.structure.block.size, dtype=bool)
    for i, regressor in enumerate(structure.regressors):
        x, z = instrumented.columns[i], instrumented.instruments[i]
        if regressor not in RATES or x == z or gram[z, z] <= 0.0 or gram[x, x] <= 0.0:
            continue
        correlation = abs(gram[z, x]) / math.sqrt(gram[z, z] * gram[x, x])
        if gram[z, x] < OPPOSED * gram[z, z] and correlation < FOLLOWED:
            found |= structure.block == structure.group[i]
    return np.asarray(found & (share_by_axis(structure.coefficients, gusts) > NOTABLE))


def by_deflections(
    equations: NormalEquations, theta: Array, normal: Array, energy: Array, answered: float = ANSWERED
) -> Array:
    """(..., C) correlation between instruments and gusts by the ``energy`` (..., C) of the gusts' moments.

    ``theta`` (..., P, C): derivatives; ``normal`` (..., P, P): Gram matrix of the regressors; ``answered``: the
    correlation where the gusts' moments have the energy of the moments by deflections.
    """
    structure = equations.structure
    of_controls = theta * equations.deflected[:, None]
    moved = ((normal @ of_controls) * of_controls).sum(axis=-2)
    told = np.isin(structure.coefficients, MOMENTS) & (moved > 0.0)
    ratio = np.where(told, energy / np.where(told, moved, 1.0), 0.0)
    alike = structure.block[:, None] == structure.block
    of_block = np.where(alike, ratio[..., None, :], 0.0).max(axis=-1)
    return np.asarray(np.minimum(answered * np.sqrt(of_block), 1.0))


def sensed(
    aircraft: Aircraft,
    equations: NormalEquations,
    solution: Solution,
    bias: Array,
    noise_moments: NoiseMoments,
    step: float,
    omega: Array,
) -> Array:
    """(C,) density of the sensors' noise in the residuals.

    ``bias`` (W, W): noise of the regressors, per line and second (``regressor_noise.gram_bias``); ``step`` (s): IMU
    interval; ``omega`` (F,) rad/s: the lines, over which a rate's derivative has the noise of the rate times omega.
    """
    v = residual_combinations(equations, solution.theta)
    density: Array = ((bias @ v) * v).sum(axis=0)
    if noise_moments.duration > 0.0:
        density = density + (noise_moments.power + noise_moments.alpha_power) / noise_moments.duration
    reference, g, i = aircraft.reference, aircraft.geometry, aircraft.inertia
    qS = 0.5 * reference.air_density * reference.airspeed**2 * g.S
    force = aircraft.noise["accel"] * aircraft.mass / qS
    turning = aircraft.noise["gyro"] * math.sqrt(float(np.mean(omega**2))) / qS
    gains = {"CL": force, "CD": force, "CY": force}
    gains |= {"Cl": turning * i.Ixx / g.b, "Cm": turning * i.Iyy / g.cbar, "Cn": turning * i.Izz / g.b}
    return density + step * np.array([gains[c] for c in equations.structure.coefficients]) ** 2
