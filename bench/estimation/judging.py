"""How estimates from many flights compare with the truth, and with what they say of themselves."""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import get_context

import numpy as np
from numpy.typing import NDArray

from bench.estimation.simulated_flights import Setting, fly, noisier
from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.online.replay import run
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.types import Estimates

Array = NDArray[np.float64]

FLIGHTS_A_TASK = 10
FAR = 4.0  # standard errors beyond which an estimate is a confident wrong one
VALUE, ERROR, LOWER, UPPER, VALID = range(5)


@dataclass(frozen=True)
class Method:
    """One way to estimate; ``compensated``: whether the sensors' noise is made up for."""

    name: str
    settings: OnlineSettings
    compensated: bool = True

    def aircraft(self, aircraft: Aircraft, setting: Setting) -> Aircraft:
        """The aircraft as the estimator knows it: with the vanes' noise, or with next to none at all."""
        if self.compensated:
            return noisier(aircraft, setting.vane_noise)
        return replace(aircraft, noise=dict.fromkeys(aircraft.noise, 1e-9))


METHODS = {
    "sls_rft": Method("sls_rft", OnlineSettings(method="sls_rft")),
    "plain": Method("plain least squares", OnlineSettings(method="sls_rft"), compensated=False),
    "iv_rft": Method("iv_rft", OnlineSettings(method="iv_rft")),
}


def exact(aircraft: Aircraft) -> Aircraft:
    """The aircraft as its simulator's file has it: all but noise and gusts is as stated."""
    return replace(aircraft, ideal=True, noise_bias=dict.fromkeys(aircraft.noise_bias, 0.0))


def estimates(aircraft: str, setting: Setting, methods: Sequence[Method], times: Array, seeds: Sequence[int]) -> Array:
    """(methods, F, K, D, 5) value, standard error, lower, upper, valid of the file's D derivatives at K times (s)."""
    batch, known = fly(aircraft, setting, seeds), exact(load_aircraft(aircraft))
    return np.array(
        [
            [
                [_numbers(known, found) for found in run(seen, method.settings, batch.time, samples, times)]
                for samples in batch.samples
            ]
            for method in methods
            for seen in [method.aircraft(known, setting)]
        ]
    )


def _numbers(known: Aircraft, found: Estimates) -> list[list[float]]:
    derivatives = [found.derivatives[name] for name in known.derivatives]
    return [[d.value, d.standard_error, d.lower, d.upper, float(d.valid)] for d in derivatives]


def many(
    aircraft: str, setting: Setting, methods: Sequence[Method], times: Array, flights: int, pool: ProcessPoolExecutor
) -> Array:
    """``estimates`` of so many flights."""
    seeds = np.arange(flights) + 1
    parts = [seeds[i : i + FLIGHTS_A_TASK].tolist() for i in range(0, flights, FLIGHTS_A_TASK)]
    return np.concatenate(list(pool.map(partial(estimates, aircraft, setting, methods, times), parts)), axis=1)


def processes(count: int = 2) -> ProcessPoolExecutor:
    """Processes that fly and estimate."""
    return ProcessPoolExecutor(count, mp_context=get_context("spawn"))


@dataclass(frozen=True)
class Verdict:
    """One derivative over many flights, among those in which it is valid; NaN where it hardly ever is."""

    share_valid: float
    coverage: float  # of the 95 % interval
    doubt: float  # one standard deviation of the coverage of so many flights, were it 95 %
    bias: float  # in standard errors (their mean)
    spread: float  # mean standard error over the estimates' scatter
    far: int  # estimates more than FAR standard errors off
    valid: int
    mean: float  # of the estimates

    @property
    def off(self) -> bool:
        """Whether the coverage is outside 93 to 97 % by more than chance allows (two standard deviations)."""
        return self.valid > 1 and not 0.93 - 2 * self.doubt <= self.coverage <= 0.97 + 2 * self.doubt


def judge(estimated: Array, truth: float) -> Verdict:
    """From (F, 5) estimates of one derivative."""
    said = estimated[estimated[:, VALID] > 0]
    n = len(said)
    if n < 2:
        return Verdict(n / len(estimated), *(math.nan,) * 4, 0, n, math.nan)
    error, claimed = said[:, VALUE] - truth, said[:, ERROR]
    inside = (said[:, LOWER] <= truth) & (truth <= said[:, UPPER])
    return Verdict(
        share_valid=n / len(estimated),
        coverage=float(inside.mean()),
        doubt=math.sqrt(0.95 * 0.05 / n),
        bias=float(error.mean() / claimed.mean()),
        spread=float(claimed.mean() / error.std(ddof=1)),
        far=int(np.count_nonzero(np.abs(error) > FAR * claimed)),
        valid=n,
        mean=float(said[:, VALUE].mean()),
    )
