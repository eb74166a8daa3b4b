"""Small systems with known truth, and flights of them."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from sysid_node.batch.likelihood import rollout
from sysid_node.batch.models.manoeuvre import ManoeuvreData
from sysid_node.batch.models.model import ModelParameter, Scalars, StateSpaceModel
from sysid_node.flight.record import Array

#: Short period of a small aircraft at 18 m/s, dimensional: alpha' = q + Za alpha + Zd de, q' = Ma alpha + Mq q + Md de.
SHORT_PERIOD = {"Za": -5.0, "Zd": -0.4, "Ma": -40.0, "Mq": -6.0, "Md": -60.0}
SPEED = 18.0
NOISE = np.array([0.004, 0.003, 0.05])  # alpha rad, q rad/s, az m/s^2


def _derivative(x: Scalars, u: Scalars, theta: Scalars) -> Scalars:
    (alpha, q), (de,), (Za, Zd, Ma, Mq, Md) = x, u, theta
    return q + Za * alpha + Zd * de, Ma * alpha + Mq * q + Md * de


def _output(x: Scalars, u: Scalars, theta: Scalars) -> Scalars:
    (alpha, q), (de,) = x, u
    return alpha, q, SPEED * (theta[0] * alpha + theta[1] * de)


def short_period_model(start: dict[str, float] | None = None, **parameter: object) -> StateSpaceModel:
    """Linear short period, outputs alpha, q and the normal acceleration of the path; keywords go to all parameters."""
    values = SHORT_PERIOD | (start or {})
    return StateSpaceModel(
        name="short_period",
        states=("alpha", "q"),
        inputs=("de",),
        outputs=("alpha", "q", "az"),
        parameters=tuple(ModelParameter(name, value, **parameter) for name, value in values.items()),  # type: ignore[arg-type]
        derivative=_derivative,
        output=_output,
    )


def multistep(time: Array, start: float, width: float, amplitude: float) -> Array:
    """A 3-2-1-1."""
    edges = start + width * np.array([0.0, 3.0, 5.0, 6.0, 7.0])
    signs = (1.0, -1.0, 1.0, -1.0)
    return amplitude * sum(
        sign * ((time >= a) & (time < b)) for sign, a, b in zip(signs, edges, edges[1:], strict=False)
    )


def flown(
    model: StateSpaceModel, seconds: float = 10.0, rate: float = 50.0, initial: tuple[float, float] = (0.0, 0.0)
) -> ManoeuvreData:
    """A noise-free manoeuvre of ``model`` at its start values."""
    time = np.arange(int(seconds * rate)) / rate
    inputs = (multistep(time, 1.0, 0.25, 0.05) - multistep(time, 5.0, 0.15, 0.05))[:, None]
    blank = ManoeuvreData(time, inputs, np.zeros((time.size, len(model.outputs))), np.array(initial))
    return with_outputs(blank, rollout.outputs(model, blank, model.start))


def with_outputs(manoeuvre: ManoeuvreData, outputs: Array) -> ManoeuvreData:
    return ManoeuvreData(manoeuvre.time, manoeuvre.inputs, outputs, manoeuvre.initial_state, manoeuvre.name)


def noisy(
    manoeuvre: ManoeuvreData, rng: np.random.Generator, deviation: Array = NOISE, colour: float = 0.0
) -> ManoeuvreData:
    """With added noise; ``colour`` is the noise's correlation time, s (0: white)."""
    noise = rng.normal(size=(len(manoeuvre) + 500, deviation.size))
    if colour > 0.0:
        a = np.exp(-manoeuvre.step / colour)
        noise = lfilter([np.sqrt(1.0 - a * a)], [1.0, -a], noise, axis=0)
    return with_outputs(manoeuvre, manoeuvre.outputs + deviation * noise[500:])
