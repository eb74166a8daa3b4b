"""A control axis: its linear model, its baseline gains, and its gains for other values of the derivatives.

The gains are those of a linear quadratic regulator with constant weights and the identified model, the indirect
self-tuning regulator of Astrom & Wittenmark, "Adaptive Control", 2nd ed. (1995), ch. 3 and 4. The weight on the
surfaces applies to the accelerations that they cause, not to their angles: a surface that lost half of its effect gets
twice the gain. With the file's derivatives the gains are the baseline's.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.control.design import plant, regulator
from sysid_node.dynamics.linear_model import Derivatives, DimensionalScales, LinearModel
from sysid_node.dynamics.linearised import table_derivatives, trimmed

Array = NDArray[np.float64]

#: Deviations with equal weight (Bryson's rule), rad, rad/s, rad s: alpha, q, theta and its integral; beta, p, r, phi
#: and its integral.
_PITCH = (math.inf, 1.0, 0.2, 0.2)
_LATERAL = (0.3, 2.0, 0.5, 0.3, 0.6)


@dataclass(frozen=True)
class ControlAxis:
    """D derivatives, n states (motion, the integral of an attitude, the surfaces), m surfaces."""

    name: str
    derivatives: tuple[str, ...]
    believed: Array  # (D,) the values of the aircraft file
    sizes: Array  # (D,) scale of errors: the file's value, or twice its tolerance where that is larger
    signals: Array  # (D,) plausible size of each derivative's regressor
    moments: slice  # the states whose equations hold the surfaces' moments
    motion: Callable[[Derivatives], LinearModel]  # without the surfaces' lag
    lag: float  # s, of the surfaces, first-order
    delay: float  # s, of the commands
    Q: Array  # (n,) weight on the states
    weight: float  # on the surfaces
    tabulated: Mapping[str, float]  # what lookup tables add to derivatives, in the file or not, near level flight

    @property
    def integral(self) -> int:
        """The place of the integral of an attitude among the states: the last before the surfaces."""
        return self.Q.size - len(range(*self.moments.indices(self.Q.size))) - 1

    @cached_property
    def baseline(self) -> Array:
        """Gains (m, n) for the aircraft file."""
        return self.gains(self.believed, 1.0)

    @cached_property
    def effect(self) -> Array:
        """(m, m) angular accelerations per rad of the surfaces, by the aircraft file."""
        return np.asarray(self.motion(self.named(self.believed)).B[self.moments])

    def named(self, values: Array) -> dict[str, Array]:
        """(..., D) values by name, on top of what the aircraft file's lookup tables add."""
        return _on_tables({name: values[..., i] for i, name in enumerate(self.derivatives)}, self.tabulated)

    def model(self, values: Array) -> LinearModel:
        """The linear model for derivatives (..., D), with the surfaces' lag."""
        return plant.behind_actuators(self.motion(self.named(values)), self.lag)

    def authority(self, values: Array) -> Array:
        """(m, m) effect of the surfaces for derivatives (D,), relative to the file's; the unit matrix if equal."""
        return np.asarray(np.linalg.solve(self.effect, self.motion(self.named(values)).B[self.moments]))

    def gains(self, values: Array, caution: float) -> Array:
        """Gains (m, n) for derivatives (D,), with ``caution`` times the baseline's weight on the surfaces.

        Raises LinAlgError where the regulator has no solution.
        """
        share = self.authority(values)
        return regulator.gains(self.model(values), self.Q, caution * self.weight * share.T @ share)


def axes(aircraft: Aircraft, lag: float, delay: float) -> tuple[ControlAxis, ControlAxis]:
    """Pitch and lateral axis at the reference condition.

    Raises InputError where the file is incomplete or none is stable.
    """
    plant.check(aircraft)
    reference = aircraft.reference
    condition = DimensionalScales.of(aircraft, reference.airspeed, reference.air_density)
    alpha, _ = trimmed(aircraft)

    def pitch(values: Derivatives) -> LinearModel:
        return plant.with_integral(plant.with_attitude(plant.longitudinal(values, condition)), 2)

    def lateral(values: Derivatives) -> LinearModel:
        return plant.with_integral(plant.lateral(values, condition, alpha), 3)

    return (
        _axis("pitch", aircraft, plant.LONGITUDINAL, slice(1, 2), pitch, _PITCH, lag, delay),
        _axis("lateral", aircraft, plant.LATERAL, slice(1, 3), lateral, _LATERAL, lag, delay),
    )


def _axis(
    name: str,
    aircraft: Aircraft,
    derivatives: tuple[str, ...],
    moments: slice,
    motion: Callable[[Derivatives], LinearModel],
    allowed: tuple[float, ...],
    lag: float,
    delay: float,
) -> ControlAxis:
    known = tuple(d for d in derivatives if d in aircraft.derivatives)
    file = [aircraft.derivatives[d] for d in known]
    values = np.array([derivative.value for derivative in file])
    tables = table_derivatives(aircraft)
    tabulated = {name: tables[name] for name in derivatives if name in tables}
    model = motion(_on_tables(dict(zip(known, values, strict=True)), tabulated))
    whole = plant.behind_actuators(model, lag)
    Q = np.zeros(whole.A.shape[-1])
    Q[: len(allowed)] = 1.0 / np.array(allowed) ** 2
    return ControlAxis(
        name=name,
        derivatives=known,
        believed=values,
        sizes=np.array([max(abs(b.value), 2.0 * (b.tolerance or 0.0), 1e-6) for b in file]),
        signals=np.array([_SIGNALS[d.partition("_")[2]] for d in known]),
        moments=moments,
        motion=motion,
        lag=lag,
        delay=delay,
        Q=Q,
        weight=regulator.least_weight(whole, Q, delay),
        tabulated=tabulated,
    )


def _on_tables(values: Mapping[str, Array], tabulated: Mapping[str, float]) -> dict[str, Array]:
    """The derivatives by name plus what lookup tables add to them."""
    added = {name: np.asarray(values.get(name, 0.0) + more) for name, more in tabulated.items()}
    return {**values, **added}


#: Plausible sizes of regressors in a manoeuvre: rad, and non-dimensional rates.
_SIGNALS = {"alpha": 0.05, "beta": 0.05, "p": 0.04, "q": 0.01, "r": 0.02, "de": 0.05, "da": 0.05, "dr": 0.05}
