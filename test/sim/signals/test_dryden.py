"""Turbulence against the spectra of MIL-F-8785C (1980), sec. 3.7: Dryden form, low altitude."""

import numpy as np
import pytest
from scipy.signal import csd, welch

from sysid_node.errors import InputError
from sysid_node.sim.signals.dryden import INTENSITIES, Dryden

SPAN, SPEED, RATE = 1.8, 18.0, 100.0


def spectra(model: Dryden, frequency: np.ndarray) -> np.ndarray:
    """One-sided spectra (F, 6) over Hz, (m/s)^2/Hz and (rad/s)^2/Hz, at an airspeed: Phi(Omega) 2 pi / V."""
    omega = 2 * np.pi * frequency / SPEED
    (su, sv, sw), (lu, lv, lw), b = model.sigma, model.length, model.span
    u = su**2 * 2 * lu / np.pi / (1 + (lu * omega) ** 2)
    v, w = (
        s**2 * x / np.pi * (1 + 3 * (x * omega) ** 2) / (1 + (x * omega) ** 2) ** 2 for s, x in ((sv, lv), (sw, lw))
    )
    p = sw**2 / lw * 0.8 * (np.pi * lw / (4 * b)) ** (1 / 3) / (1 + (4 * b * omega / np.pi) ** 2)
    q = omega**2 / (1 + (4 * b * omega / np.pi) ** 2) * w
    r = omega**2 / (1 + (3 * b * omega / np.pi) ** 2) * v
    return np.column_stack([u, v, w, p, q, r]) * 2 * np.pi / SPEED


@pytest.mark.slow
@pytest.mark.parametrize("height", [60.0, 1000.0])
def test_periodogram_is_the_standards_spectrum(height):
    model = Dryden.at(height, SPAN)
    gusts = model.realisation(120_000, RATE, SPEED, seed=1)
    frequency, measured = welch(gusts, RATE, nperseg=8192, axis=0, detrend=False)
    band = (frequency > 0.1) & (frequency < 5.0)  # up to a tenth of the sampling rate: above it, aliases
    ratio = measured[band] / spectra(model, frequency[band])
    blocks = np.array([block.mean(axis=0) for block in np.array_split(ratio, 4)])
    # 29 half-overlapping segments and 100 lines a block: 2.7 % standard error
    assert np.abs(blocks - 1).max() < 0.1


def test_low_altitude_lengths_and_intensities():
    """h = 100 ft: L_u = h / (0.177 + 0.000823 h)^1.2 = 470.6 ft, L_w = h, sigma_u / sigma_w = (0.2593)^-0.4."""
    model = Dryden.at(100 * 0.3048, SPAN)
    shear = 0.177 + 0.000823 * 100
    assert model.length == pytest.approx((100 / shear**1.2 * 0.3048,) * 2 + (30.48,))
    assert model.sigma == pytest.approx((shear**-0.4, shear**-0.4, 1.0))
    assert INTENSITIES["light"] == pytest.approx(0.1 * 15 * 0.514444)


def test_rms_and_repeatability():
    model = Dryden.at(50.0, SPAN)
    first, again = (model.realisation(50_000, RATE, SPEED, seed=7) for _ in range(2))
    np.testing.assert_array_equal(first, again)
    assert first[:, 2].std() == pytest.approx(1.0, rel=0.1)
    assert first[:, 0].std() == pytest.approx(model.sigma[0], rel=0.2)  # long waves: few of them in 500 s


def test_rotation_follows_the_gradient():
    """Frozen gusts, d/dx = d/dt / V: q = -dw/dx and r = dv/dx, each through its span's lag."""
    gusts = Dryden.at(100.0, SPAN).realisation(60_000, RATE, SPEED, seed=2)
    for linear, angular, sign, reach in ((2, 4, -1.0, 4.0), (1, 5, 1.0, 3.0)):
        frequency, cross = csd(gusts[:, linear], gusts[:, angular], RATE, nperseg=4096)
        _, power = welch(gusts[:, linear], RATE, nperseg=4096)
        band = (frequency > 0.2) & (frequency < 3.0)
        s = 2j * np.pi * frequency[band]
        expected = sign * s / SPEED / (1.0 + s * reach * SPAN / (np.pi * SPEED))
        assert np.abs(cross[band] / power[band] / expected - 1.0).mean() < 0.02


def test_airspeed_must_be_positive():
    with pytest.raises(InputError, match="airspeed 0 m/s"):
        Dryden.at(50.0, SPAN).realisation(10, RATE, 0.0, 0)
