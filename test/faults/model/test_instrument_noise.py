"""The least residual that the instruments' noise leaves. Truth: blocks of samples at rest with that noise."""

from dataclasses import replace

import numpy as np
import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.aircraft.names import COEFFICIENTS
from sysid_node.faults.model import blocks
from sysid_node.faults.model.blocks import PERIOD
from sysid_node.faults.model.instrument_noise import BETTER, least_variances
from sysid_node.online.types import SAMPLE_COLUMNS

RATE, SECONDS = 100.0, 200.0
SENSORS = {"accel": ("ax", "ay", "az"), "gyro": ("p", "q", "r")}


def outputs_with(aircraft: Aircraft, sensor: str) -> np.ndarray:
    """(blocks, 6) the outputs of blocks at rest, of which one sensor is noisy."""
    random = np.random.default_rng(7)
    time = np.arange(0.0, SECONDS, 1.0 / RATE)
    samples = np.zeros((time.size, len(SAMPLE_COLUMNS) + len(aircraft.controls)))
    for name, value in {"V": aircraft.reference.airspeed, "rho": aircraft.reference.air_density, "az": -9.8}.items():
        samples[:, SAMPLE_COLUMNS.index(name)] = value
    for name in SENSORS[sensor]:
        samples[:, SAMPLE_COLUMNS.index(name)] += aircraft.noise[sensor] * random.standard_normal(time.size)
    return np.array([block.outputs for block in blocks.of_record(aircraft, time, samples)])


def only(aircraft: Aircraft, sensor: str) -> Aircraft:
    """The aircraft with the noise of one sensor alone, its IMU at the centre of gravity."""
    sensors = replace(aircraft.sensors, imu=(0.0, 0.0, 0.0))
    return replace(
        aircraft, noise=dict.fromkeys(aircraft.noise, 0.0) | {sensor: aircraft.noise[sensor]}, sensors=sensors
    )


@pytest.mark.parametrize("name", ["cdrw", "kestrel"])
def test_forces_have_the_mean_of_the_accelerometers_noise(name: str) -> None:
    aircraft = only(load_aircraft(name), "accel")
    stated = BETTER**2 * least_variances(aircraft, RATE * PERIOD, PERIOD)
    forces = [COEFFICIENTS.index(c) for c in ("CL", "CD", "CY")]
    np.testing.assert_allclose(outputs_with(aircraft, "accel").var(axis=0)[forces], stated[forces], rtol=0.1)
    assert not stated[[COEFFICIENTS.index(c) for c in ("Cl", "Cm", "Cn")]].any()


@pytest.mark.parametrize("name", ["cdrw", "kestrel"])
def test_moments_have_what_the_gyroscope_adds_at_each_end_of_a_block(name: str) -> None:
    """The increments' variance is twice as large: neighbours have one of two readings in common."""
    aircraft = only(load_aircraft(name), "gyro")
    stated = BETTER**2 * least_variances(aircraft, RATE * PERIOD, PERIOD)
    moments = [COEFFICIENTS.index(c) for c in ("Cl", "Cm", "Cn")]
    np.testing.assert_allclose(outputs_with(aircraft, "gyro").var(axis=0)[moments], 2.0 * stated[moments], rtol=0.1)


def test_vanes_are_noise_of_what_their_angle_causes() -> None:
    aircraft = load_aircraft("cdrw")
    quiet = dict.fromkeys(aircraft.noise, 0.0)
    found = least_variances(replace(aircraft, noise=quiet | {"alpha": 0.004}), 20.0, PERIOD)
    for place, coefficient in enumerate(COEFFICIENTS):
        slope = aircraft.derivatives.get(f"{coefficient}_alpha")
        expected = (slope.value * 0.004 / BETTER) ** 2 / 20.0 if slope and coefficient in ("CL", "CD", "Cm") else 0.0
        assert found[place] == pytest.approx(expected, rel=1e-12)
