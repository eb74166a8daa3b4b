"""Instruments for the regressors: the motion that the aircraft file's model makes of the measured deflections.

The instrumental variables of Larsson & Enqvist, "Sequential aerodynamic model parameter identification" (SYSID 2012),
used by Larsson et al., "A method for improved flight testing of remotely piloted aircraft using multisine inputs"
(Aerospace 7(9), 2020): regressors made from the inputs hold neither the sensors' noise nor the motion that gusts
excite, which plain least squares takes for the effect of its regressors. The model is linear, about trim, with the
derivatives of the aircraft file; it need not be right, only correlated with the flight. Its frequency response makes
the lines of the instruments from the lines of the deflections, so that nothing has to be simulated.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft, Inertia
from sysid_node.dynamics.linear_model import STATES, DimensionalScales, linear_model
from sysid_node.dynamics.linearised import linear_derivatives
from sysid_node.online.frequency.regression_signals import SignalLayout

Array = NDArray[np.float64]

#: Regressors that have an instrument of their own; controls are their own.
INSTRUMENTED = ("alpha", "q", "beta", "p", "r")
_LEAK = 0.1  # 1/s: keeps spiral and phugoid, which are not in question, off the axis


@dataclass(frozen=True)
class InstrumentModel:
    """Frequency response of the instruments to the controls, and of the controls to what is recorded of them."""

    gains: NDArray[np.complex128]  # (F, I, m)
    controls: slice  # columns of the m controls
    rates: slice = field(default_factory=lambda: slice(0, 0))  # columns of their rates, right behind them
    #: (F, m) ``servo_model.lateness``: what the rates bring to the controls' lines; None where controls are exact.
    servos: NDArray[np.complex128] | None = None
    #: (2, m, 2, 2, F) to controls and rates: what their real and imaginary parts get of those of the rates' lines.
    following: Array = field(default_factory=lambda: np.zeros((2, 0, 2, 2, 0)))


def instrument_model(aircraft: Aircraft, layout: SignalLayout, omega: Array) -> InstrumentModel | None:
    """Response at omega (F,) rad/s of the ``layout``'s instruments; None where it has none."""
    if not layout.instrumented:
        return None
    A, B, rows, scales = _linear(aircraft, layout)
    resolvent = np.linalg.inv(1j * omega[:, None, None] * np.eye(len(STATES)) - A)
    gains = scales[:, None] * (resolvent[:, rows] @ B)
    return InstrumentModel(gains, layout.deflections, layout.rates)


def with_servos(
    model: InstrumentModel | None, layout: SignalLayout, omega: Array, servos: NDArray[np.complex128]
) -> InstrumentModel:
    """The model with the controls' response to what is recorded of them, ``servos`` (F, m)."""
    none = np.zeros((omega.size, 0, len(layout.timed)), dtype=complex)
    model = model or InstrumentModel(none, layout.deflections, layout.rates)
    both = np.array([servos.T, (1j * omega[:, None] * servos).T])  # (2, m, F)
    following = np.stack([np.stack([both.real, -both.imag], -2), np.stack([both.imag, both.real], -2)], -3)
    return replace(model, servos=servos, following=following)


def fill_in(model: InstrumentModel, lines: Array) -> None:
    """Write the instruments of lines (..., 2F, W) into their last columns, by the deflections' columns.

    Where the model has servos, controls and their rates are first moved to where the servos have them.
    """
    F, made, controls = model.gains.shape
    if model.servos is not None:
        _follow(model, lines, F)
    if not made:
        return
    deflections = np.empty((*lines.shape[:-2], F, controls, 1), dtype=complex)
    deflections.real[..., 0] = lines[..., :F, model.controls]
    deflections.imag[..., 0] = lines[..., F:, model.controls]
    answers = (model.gains @ deflections)[..., 0]
    lines[..., :F, -made:] = answers.real
    lines[..., F:, -made:] = answers.imag


def _follow(model: InstrumentModel, lines: Array, F: int) -> None:
    """Move controls and their rates by the servos' lateness: X + g R, and R + j omega g R, of the rates' lines R."""
    signals = lines.swapaxes(-1, -2)
    rates = signals[..., model.rates, :]
    more = model.following * rates.reshape(*rates.shape[:-2], 1, -1, 1, 2, F)
    moved = more[..., 0, :] + more[..., 1, :]
    both = signals[..., model.controls.start : model.rates.stop, :]
    both += moved.reshape(both.shape)


def _linear(aircraft: Aircraft, layout: SignalLayout) -> tuple[Array, Array, NDArray[np.intp], Array]:
    """x' = A x + B u about trim, x = alpha, q, beta, p, r, phi; rows of x and scales that the instruments are."""
    reference, inertia = aircraft.reference, aircraft.inertia
    Ixx, Iyy, Izz = (m if math.isfinite(m) else math.inf for m in (inertia.Ixx, inertia.Iyy, inertia.Izz))
    # an unknown moment of inertia leaves its axis at rest, and Ixz, which couples roll and yaw, is left out: the
    # instruments need not be exact, and those of all results so far are without it
    uncoupled = replace(aircraft, inertia=Inertia(Ixx, Iyy, Izz, Ixz=0.0))
    condition = DimensionalScales.of(uncoupled, reference.airspeed, reference.air_density)
    model = linear_model(linear_derivatives(aircraft), condition, 0.0, STATES, layout.timed)
    scales = {"q": condition.chord, "p": condition.span, "r": condition.span}
    rows = np.array([STATES.index(r) for r in layout.instrumented], dtype=np.intp)
    A = model.A - _LEAK * np.eye(len(STATES))
    return A, model.B, rows, np.array([scales.get(r, 1.0) for r in layout.instrumented])
