"""A batch method's estimates with their systematic errors, the servos, and the error budget.

The imperfections kappa are normal with mean m and covariance P after the flights (``flight_posterior``). A method's
estimates theta(kappa) move by G = d theta / d kappa. They are evaluated at m, and their covariance is

    cov theta = (noise's part) + G P G'                                      (GUM: JCGM 100:2008, eq. 16)

For lateness of servos and instruments G is the method's own (``sensitivities``), because fast signals weigh differently
in every method. So do slow ones, which the online estimator leaves out: a regression's G is its own for all that
``perturbations`` can change in a flight. For other methods, and other imperfections, the online estimator's G is taken:
what the derivatives can absorb, as a mass that scales those of all forces, moves every consistent estimator alike.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from sysid_node.aircraft.model import Aircraft
from sysid_node.aircraft.stated_effects import stated_cg
from sysid_node.batch.results.batch_fit import BatchFit, SystematicPart
from sysid_node.batch.results.estimate import ParameterEstimate, confidence_interval
from sysid_node.batch.systematic.clocks import LATE_COLUMNS, corrected, is_timing
from sysid_node.batch.systematic.flight_posterior import FlightPosterior, Imperfection
from sysid_node.batch.systematic.gust_bias import unless_contradicted, with_gust_bias, with_unconfirmed_named
from sysid_node.batch.systematic.online_passes import OnlineEstimate
from sysid_node.batch.systematic.perturbations import perturbed
from sysid_node.batch.systematic.sensitivities import RegressionResponse, Response
from sysid_node.flight.record import Array, FlightRecord
from sysid_node.online.estimates.published import SERVO_KNOWN
from sysid_node.online.systematic.budget import Budget
from sysid_node.online.systematic.imperfections import HELD_OR_NOT

SMALLEST = 1e-6  # s, or s^2: of a step


def on_time(aircraft: Aircraft, records: Sequence[FlightRecord], posterior: FlightPosterior) -> list[FlightRecord]:
    """The records with the estimated lateness of servos and instruments taken out."""
    return _records(aircraft, records, _timing(posterior))


def with_systematic_errors(
    aircraft: Aircraft,
    records: Sequence[FlightRecord],
    fit: BatchFit,
    posterior: FlightPosterior,
    response: Response,
    online: Mapping[str, OnlineEstimate],
    *,
    models_gusts: bool,
) -> BatchFit:
    """The ``fit`` to the records ``on_time``, moved by all other imperfections, with intervals that hold them all.

    ``records`` are those before any correction; ``response`` says how the method's estimates move. Estimates that a
    valid one of the ``online`` estimator contradicts are not valid. ``models_gusts``: whether the method estimates the
    motion of the air; otherwise gusts bias it, and its intervals hold that bias, too.
    """
    names = tuple(fit.estimates)
    G = _jacobian(aircraft, records, names, posterior, response)
    others = np.array([not is_timing(one) for one in posterior.imperfections])
    moved = ((posterior.mean - _taken_into_account(aircraft, posterior)) * others) @ G
    fit = with_unconfirmed_named(fit, online) if models_gusts else with_gust_bias(fit, online, moved)
    systematic = G.T @ posterior.covariance @ G
    errors = np.sqrt(np.maximum(np.diag(systematic), 0.0))
    estimates = {
        name: unless_contradicted(estimate.with_systematic(float(error), float(by)), online.get(name))
        for (name, estimate), error, by in zip(fit.estimates.items(), errors, moved, strict=True)
    }
    keys = tuple(one.key for one in posterior.imperfections)
    statistical = np.array([estimate.standard_error**2 for estimate in fit.estimates.values()])
    derivatives = np.array([name in aircraft.derivatives for name in names])
    budget = Budget(
        tuple(name for name in names if name in aircraft.derivatives),
        keys,
        G[:, derivatives],
        posterior.covariance,
        statistical[derivatives],
    )
    return replace(
        fit,
        estimates=estimates,
        covariance=fit.covariance + systematic,
        systematic=SystematicPart(servos(posterior), budget, systematic),
    )


def _taken_into_account(aircraft: Aircraft, posterior: FlightPosterior) -> Array:
    """(K,) values that the methods have from the file already: where it states the CG."""
    shift = {f"cg_shift.{axis}": value for axis, value in zip("xyz", stated_cg(aircraft), strict=True)}
    return np.array([shift.get(one.key, 0.0) for one in posterior.imperfections])


def servos(posterior: FlightPosterior) -> dict[str, ParameterEstimate]:
    """How late each control follows what is recorded of it, s; of commands where some flights have them.

    Where none is known to have them, the standard error contains what holding them would make it later.
    """
    rows: dict[str, ParameterEstimate] = {}
    found = zip(posterior.imperfections, posterior.mean.tolist(), posterior.errors.tolist(), strict=True)
    for one, value, alone in sorted(found, key=lambda item: item[0].commanded):
        if one.role == "lateness":
            error = alone if one.commanded else math.hypot(alone, HELD_OR_NOT)
            lower, upper = confidence_interval(value, error, np.inf)
            valid = error <= SERVO_KNOWN
            status = "ok" if valid else "converging"
            rows[one.control] = ParameterEstimate(one.control, value, error, lower, upper, valid, status, error)
    return rows


def _timing(posterior: FlightPosterior) -> dict[Imperfection, float]:
    pairs = zip(posterior.imperfections, posterior.mean.tolist(), strict=True)
    return {one: value for one, value in pairs if is_timing(one)}


def _records(
    aircraft: Aircraft, records: Sequence[FlightRecord], values: Mapping[Imperfection, float]
) -> list[FlightRecord]:
    return [corrected(aircraft, record, values) for record in records]


def _jacobian(
    aircraft: Aircraft,
    records: Sequence[FlightRecord],
    names: Sequence[str],
    posterior: FlightPosterior,
    response: Response,
) -> Array:
    """(K, P) by how much one unit of each imperfection moves the estimates."""
    G = np.zeros((len(posterior.imperfections), len(names)))
    for p, name in enumerate(names):
        if name in posterior.names:
            G[:, p] = posterior.jacobian[:, posterior.names.index(name)]
    timing, known = _timing(posterior), {}
    if isinstance(response, RegressionResponse):
        _own(G, aircraft, _records(aircraft, records, timing), names, posterior, response)
    for k, (one, error) in enumerate(zip(posterior.imperfections, posterior.errors.tolist(), strict=True)):
        if not is_timing(one):
            continue
        # a lag and a delay of the same columns do the same to them
        same = LATE_COLUMNS.get(one.key, one)
        if same not in known:
            step = max(error, SMALLEST)
            known[same] = response(_records(aircraft, records, timing | {one: timing[one] + step})) / step
        G[k] = known[same]
    return G


def _own(
    G: Array,
    aircraft: Aircraft,
    records: Sequence[FlightRecord],
    names: Sequence[str],
    posterior: FlightPosterior,
    response: RegressionResponse,
) -> None:
    """Replace rows of G (K, P) by the regression's own, where the flights can be changed accordingly."""
    formed = np.array([name in aircraft.derivatives for name in names])
    online, keys = G.copy(), [one.key if one.role == "source" else "" for one in posterior.imperfections]

    def own(key: str, step: float) -> Array | None:
        changed = [perturbed(aircraft, record, key, step) for record in records]
        if any(one is None for one in changed):
            return None
        flights = [one for one in changed if one is not None]
        return response([record for _, record in flights], flights[0][0]) / step

    for k, (key, error) in enumerate(zip(keys, posterior.errors.tolist(), strict=True)):
        if key and error > 0.0 and not is_timing(posterior.imperfections[k]) and (found := own(key, error)) is not None:
            G[k] = np.where(formed, found, G[k])
    for k, key in enumerate(keys):
        # a CG further along an axis makes the sensors' arms shorter, besides what it does to the moments
        for sensor in ("imu", "air_data") if key.startswith("cg_shift.") else ():
            arm = f"sensors.{sensor}.{key[-1]}"
            if arm in keys:
                G[k] += online[keys.index(arm)] - G[keys.index(arm)]
