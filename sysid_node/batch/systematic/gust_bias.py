"""Gusts in the standard errors of methods that take the motion of turbulent air for that by the controls.

A gust turns the aircraft and makes a moment that no vane measures: residuals and regressors are correlated, and no
residual of a least-squares fit shows that (Ljung, "System Identification", 2nd ed. (1999), sect. 13.4). The online
estimator's instruments are made from the deflections, which gusts do not cause. The difference d of a method's estimate
from the online estimator's is therefore an estimate of the method's bias, as uncertain as the online estimate is. The
method's estimate is left as it is, and the bias is added to its variance (O'Donnell & Hibbert, Analyst 130 (2005),
721-729):

    sigma^2 = sigma_method^2 + g (d^2 + sigma_online^2) ,

g from 0 to 1 being the share of the residual that is not the sensors' noise. Where g is one and the online estimate is
normal about the truth, the 95 % interval holds it in 95 % of cases at least, whatever d is. In still air g is zero,
unless the model lacks an effect: what that leaves cannot be told from gusts here, and it biases in the same way.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from sysid_node.batch.results.batch_fit import BatchFit
from sysid_node.batch.results.estimate import NORMAL_95, ParameterEstimate
from sysid_node.batch.systematic.online_passes import OnlineEstimate
from sysid_node.flight.record import Array
from sysid_node.online.regression.gust_correlation import share_by_axis

CONTRADICTION = 2.0  # standard errors of both estimates together by which they differ at most
SAID = 0.1  # share of gusts in a residual from which a remark tells of them
#: Coefficients whose remainder a remark tells of, in words.
FELT = {"CL": "lift", "CY": "side force", "Cl": "rolling moment", "Cm": "pitching moment", "Cn": "yawing moment"}


def with_gust_bias(fit: BatchFit, online: Mapping[str, OnlineEstimate], moved: Array) -> BatchFit:
    """The ``fit``, its intervals widened by the bias of gusts; ``moved`` (P,): what will be added to its estimates."""
    shares = _shares(online)
    estimates = {
        name: _widened(estimate, online[name], shares[name], by) if name in online else estimate
        for (name, estimate), by in zip(fit.estimates.items(), moved.tolist(), strict=True)
    }
    before, after = (np.array([e.standard_error**2 for e in some.values()]) for some in (fit.estimates, estimates))
    return replace(
        fit,
        estimates=estimates,
        covariance=fit.covariance + np.diag(np.where(np.isfinite(after - before), after - before, 0.0)),
        remarks=(*fit.remarks, *_remark(fit, online)),
    )


def with_unconfirmed_named(fit: BatchFit, online: Mapping[str, OnlineEstimate]) -> BatchFit:
    """The ``fit`` of a method that estimates the motion of the air, with a remark on what nothing else confirms.

    It takes for gusts whatever the model lacks. In a flight near the stall in still air, its ``Cm_q`` was 14 standard
    errors off; gusts and a missing effect cannot be told apart by its residuals.
    """
    names = [
        name
        for name, estimate in fit.estimates.items()
        if estimate.valid and name in online and not online[name].valid and online[name].gusts > SAID
    ]
    if not names:
        return fit
    remark = (
        f"{fit.method} takes for gusts whatever the model lacks, such as a stall; the online estimator, which does "
        f"not, leaves {', '.join(names)} open: believe these only of a flight in gusts that keeps away from the stall"
    )
    return replace(fit, remarks=(*fit.remarks, remark))


def unless_contradicted(estimate: ParameterEstimate, online: OnlineEstimate | None) -> ParameterEstimate:
    """The estimate, not valid where a valid one of the online estimator contradicts it.

    Both have the same flights and tolerances.
    """
    if online is None or not online.valid or not estimate.valid:
        return estimate
    if abs(estimate.value - online.value) <= CONTRADICTION * math.hypot(estimate.standard_error, online.standard_error):
        return estimate
    half = NORMAL_95 * online.standard_error
    return estimate.invalid(f"contradicted: the online estimator finds {online.value:.3g} +- {half:.2g}")


def _shares(online: Mapping[str, OnlineEstimate]) -> dict[str, float]:
    """By derivative the largest share of gusts among the coefficients that tell of them."""
    gusts = {name.partition("_")[0]: one.gusts for name, one in online.items()}
    largest = dict(zip(gusts, share_by_axis(list(gusts), np.array(list(gusts.values()))).tolist(), strict=True))
    return {name: largest[name.partition("_")[0]] for name in online}


def _widened(estimate: ParameterEstimate, online: OnlineEstimate, share: float, moved: float) -> ParameterEstimate:
    """The estimate with its bias; not valid if that is most of its error, and the online estimator does not know it."""
    if share <= 0.0:
        return estimate
    judged = unless_contradicted(replace(estimate, value=estimate.value + moved), online)
    bias = math.sqrt(share) * math.hypot(judged.value - online.value, online.statistical_error)
    if judged.valid and not online.valid and not bias <= estimate.standard_error:
        judged = judged.invalid(f"unconfirmed: {online.status}")
    status = replace(estimate, valid=judged.valid, status=judged.status)
    return status.widened(bias) if math.isfinite(bias) else status


def _listed(words: list[str]) -> str:
    return " and ".join(filter(None, (", ".join(words[:-1]), words[-1])))


def _remark(fit: BatchFit, online: Mapping[str, OnlineEstimate]) -> tuple[str, ...]:
    """A sentence for the reader where a lift, side force or moment leaves more than the sensors' noise."""
    felt = {name.partition("_")[0]: online[name].gusts for name in fit.estimates if name in online}
    shaken = [words for coefficient, words in FELT.items() if felt.get(coefficient, 0.0) > SAID]
    if not shaken:
        return ()
    return (
        f"more than the sensors' noise is left of {_listed(shaken)}: gusts, or an effect that the model lacks. It "
        f"biases {fit.method}, whose intervals are widened by how far the online estimator differs. In gusts use "
        "filter_error, or sysid replay",
    )
