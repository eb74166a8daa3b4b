"""The flow where the air-data probe sits, carried to the centre of gravity. Truth: rigid-body kinematics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Sensors
from sysid_node.online.frequency.regression_signals import array_signals, layout, scalar_signals
from sysid_node.online.types import SAMPLE_COLUMNS

ARM = np.array([0.55, 0.3, -0.2])  # m
AIRCRAFT = replace(load_aircraft("cdrw"), sensors=Sensors(air_data=(0.55, 0.3, -0.2)))


def flow(velocity):
    """Airspeed, alpha, beta of a velocity through the air, body axes: Stevens, Lewis & Johnson (2016), eq. 2.3-5."""
    u, v, w = velocity
    V = np.linalg.norm(velocity)
    return V, np.arctan2(w, u), np.arcsin(v / V)


def sample(rates, V, alpha, beta):
    values = dict.fromkeys(SAMPLE_COLUMNS, 0.0) | {"az": -9.8, "V": V, "alpha": alpha, "beta": beta, "rho": 1.2}
    values |= dict(zip("pqr", rates, strict=True))
    return [*values.values(), *(0.0 for _ in AIRCRAFT.controls)]


def test_rotation_is_taken_out_of_what_the_probe_measures():
    velocity, rates = np.array([17.0, 2.5, 3.0]), np.array([1.5, -1.2, 0.9])
    V, alpha, beta = flow(velocity)
    at_probe = flow(velocity + np.cross(rates, ARM))
    row, (ca, sa) = scalar_signals(AIRCRAFT)(sample(rates, *at_probe))
    k = 1.2 * V**2 / (AIRCRAFT.reference.air_density * AIRCRAFT.reference.airspeed**2)
    named = dict(zip((n for n in layout(AIRCRAFT).names if n != "t"), row, strict=True))
    np.testing.assert_allclose([named["0"], named["alpha"], named["beta"]], [k, k * alpha, k * beta], rtol=1e-12)
    np.testing.assert_allclose([ca, sa], [np.cos(alpha), np.sin(alpha)], rtol=1e-12)


def test_one_by_one_and_in_bulk_give_the_same_bits():
    random = np.random.default_rng(1)
    samples = np.array(
        [sample(random.normal(size=3), 18 + random.normal(), *random.normal(0, 0.2, 2)) for _ in range(50)]
    )
    rows, angles = array_signals(AIRCRAFT)(list(samples.T))
    single = [scalar_signals(AIRCRAFT)(one) for one in samples.tolist()]
    assert np.array_equal(np.array(rows).T, [row for row, _ in single])
    assert np.array_equal(np.array(angles).T, [pair for _, pair in single])
