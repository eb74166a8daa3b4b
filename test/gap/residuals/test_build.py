"""From a flight to its residual model; truth: what is missing in the flight, and noise of known power."""

from dataclasses import replace

import numpy as np
import pytest

from sysid_node.gap.residuals.build import padded_length, residual_model_like, residual_model_of
from sysid_node.gap.residuals.residual_model import CHANNELS
from sysid_node.sim import Simulator


def lacking(flight, *names: str):
    columns = {**flight.record.columns, **{name: np.full(len(flight.record), np.nan) for name in names}}
    return replace(flight, record=replace(flight.record, columns=columns))


@pytest.mark.slow
def test_without_attitude_forces_are_compared_and_nothing_else(aircraft, plain) -> None:
    model = residual_model_of(Simulator(aircraft, 50.0), lacking(plain, "phi", "theta", "psi"))
    assert [c for c, measured in zip(CHANNELS, model.axes, strict=True) if measured] == list(CHANNELS[:6])
    residual = model.residual(model.simulator.neutral())
    assert np.isfinite(residual).all() and not residual[:, :, 6:].any()


def test_a_heading_that_was_not_measured_is_not_compared(aircraft, plain) -> None:
    model = residual_model_of(Simulator(aircraft, 50.0), lacking(plain, "psi"))
    assert [c for c, measured in zip(CHANNELS, model.axes, strict=True) if not measured] == ["psi"]


def test_the_same_flight_seen_alike_is_the_same_model(plain_model) -> None:
    again = residual_model_like(plain_model, plain_model.flight)
    neutral = plain_model.simulator.neutral()
    np.testing.assert_array_equal(again.noise, plain_model.noise)
    np.testing.assert_allclose(again.residual(neutral), plain_model.residual(neutral), atol=1e-12)


@pytest.mark.parametrize("seed", [0, 1])
def test_the_seed_makes_the_noise_reproducible(aircraft, plain, plain_model, seed: int) -> None:
    model = residual_model_of(Simulator(aircraft, 50.0), plain, seed)
    assert np.array_equal(model.noise, plain_model.noise) is (seed == 0)


@pytest.mark.parametrize(
    ("samples", "padded"), [(2, 1500), (1500, 1500), (1501, 3000), (3001, 6000), (6001, 12000), (12001, 18000)]
)
def test_flights_of_many_lengths_share_few_programs(samples: int, padded: int) -> None:
    assert padded_length(samples) == padded
