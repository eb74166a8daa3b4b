"""The imperfections that an aircraft may have within its tolerances; ``source_changes`` says what each changes.

An imperfection is the true quantity less the one that was taken, with the 1 sigma of ``Aircraft.tolerances``. Its mean
is zero; that of a lag, or of a shift of the CG, for which no reading can be corrected, is what the file states. They
are the "consider parameters" of Schmidt (1966) and Bierman ("Factorization Methods for Discrete Sequential Estimation",
1977, ch. VIII), with tolerances by type B evaluation (GUM: JCGM 100:2008, sec. 4.3).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from sysid_node.aircraft.model import Aircraft
from sysid_node.aircraft.stated_effects import sizes_as_uncertainty
from sysid_node.dynamics.linearised import trimmed
from sysid_node.online.systematic.column_changes import ColumnChanges
from sysid_node.online.systematic.source_changes import change_of

#: Share of a stated value that its 1 sigma is at least: an exact value must be taken out of the signals, too.
SMALLEST = 1e-3

#: Lags and low-pass filters, which make a signal late.
_LATE_ONLY = ("air_data_lag.time_constant", "delays.imu")
#: What is estimated from where the file has it, as no reading can be corrected for it.
_IN_THE_MODEL = ("air_data_lag", "cg_shift")


@dataclass(frozen=True)
class ErrorSource:
    """One imperfection: its key among the tolerances, its 1 sigma, and the value about which it lies."""

    key: str
    sigma: float
    expected: float = 0.0
    stated: float = 0.0  # by the aircraft file, where the alignment has not taken it out: where the estimate begins


def sources(aircraft: Aircraft, reconstructed: tuple[bool, bool] = (False, False)) -> tuple[ErrorSource, ...]:
    """All imperfections of an aircraft but its servos.

    Without those of the vanes for alpha, beta where these are ``reconstructed``.
    """
    absent = [angle for angle, missing in zip(("alpha", "beta"), reconstructed, strict=True) if missing]
    no_vanes = {f"{kind}.{angle}" for kind in ("vane_scale", "vane_bias") for angle in absent}
    found = []
    tolerances, sizes = aircraft.tolerances, sizes_as_uncertainty(aircraft)
    for key in dict.fromkeys((*tolerances, *sizes)):
        sigma = float(tolerances.get(key, 0.0))
        source = _expected(aircraft, key, math.hypot(sigma, sizes[key]) if key in sizes else sigma)
        seen = change_of(source.key) is not None and key not in no_vanes
        if source.sigma > 0.0 and math.isfinite(source.sigma) and seen:
            found.append(source)
    if reconstructed[0]:
        found.append(ErrorSource("mean_alpha", _mean_alpha_error(aircraft)))
    bias = aircraft.noise_bias.get("airspeed", 0.0)
    if bias > 0.0 and not (aircraft.ideal and "noise.bias.airspeed" not in aircraft.stated_tolerances):
        found.append(ErrorSource("airspeed_bias", bias))
    return tuple(found)


def _mean_alpha_error(aircraft: Aircraft) -> float:
    """1 sigma (rad) of the mean angle of attack in level flight by the file's lift, whose derivatives are not exact."""
    alpha, elevator = trimmed(aircraft)
    means = {"0": 1.0, "alpha": alpha, "V": 1.0, "de": elevator}
    parts = []
    for regressor, mean in means.items():
        derivative = aircraft.derivatives.get(f"CL_{regressor}")
        if derivative is not None:
            parts.append(mean * derivative.uncertainty)
    return math.hypot(*parts) / abs(aircraft.derivatives["CL_alpha"].value)


def _expected(aircraft: Aircraft, key: str, sigma: float) -> ErrorSource:
    """A source about what the file states of it.

    What the file states of stamps and of the instruments' readings has been taken out by the alignment.
    """
    effect, _, parameter = key.rpartition(".")
    item = aircraft.effects.get(effect, {}).get(parameter) if effect in _IN_THE_MODEL else None
    stated = item.value if item else 0.0
    if key not in _LATE_ONLY or sigma == 0.0:
        return ErrorSource(key, max(sigma, SMALLEST * abs(stated)), stated, stated)
    taken_out = aircraft.stamp_delays[parameter].value if effect == "delays" else 0.0
    mean, spread = not_negative(stated + taken_out, sigma)
    return ErrorSource(key, spread, mean - taken_out, stated)


def not_negative(mean: float, sigma: float) -> tuple[float, float]:
    """Mean and standard deviation of a normal distribution that is cut off below zero.

    Johnson, Kotz & Balakrishnan, "Continuous Univariate Distributions", vol. 1, 2nd ed., 1994, sec. 13.10.1.
    """
    cut = -mean / sigma
    ratio = math.sqrt(2.0 / math.pi) * math.exp(-0.5 * cut * cut) / max(math.erfc(cut / math.sqrt(2.0)), 1e-300)
    return mean + sigma * ratio, sigma * math.sqrt(max(1.0 + cut * ratio - ratio * ratio, 0.0))


def describe(changes: ColumnChanges, source: ErrorSource) -> None:
    """Put what one unit of a source changes into the ``changes``."""
    change = change_of(source.key)
    assert change is not None
    change(changes, source.key.rpartition(".")[2], source.key)
