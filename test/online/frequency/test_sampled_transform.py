"""Areas of sampled signals over their intervals. Truth: integrals of known functions."""

import numpy as np
import pytest

from sysid_node.online.frequency.regression_signals import OFFSET, OUTPUTS, SignalLayout
from sysid_node.online.frequency.sampled_transform import over_intervals

LAYOUT = SignalLayout(("alpha", "de"), ("de",), ())


def test_the_rate_of_a_control_is_that_of_the_control_times_k() -> None:
    """The signal is k de, its rate k d(de)/dt; that of the product would have de dk/dt in addition."""
    time = np.linspace(0.0, 2.0, 4001)
    k, de = 1.0 + 0.2 * np.sin(1.5 * time), 0.03 + 0.05 * np.sin(4.0 * time)
    rows = np.zeros((time.size, LAYOUT.width))
    rows[:, OFFSET], rows[:, LAYOUT.column("de")] = k, k * de
    steps, gains = np.diff(time)[:, None], np.zeros((time.size - 1, OUTPUTS))
    areas, _ = over_intervals(LAYOUT, steps, rows, gains)
    middle = 0.5 * (time[1:] + time[:-1])
    truth = (1.0 + 0.2 * np.sin(1.5 * middle)) * 0.2 * np.cos(4.0 * middle) * steps[:, 0]
    np.testing.assert_allclose(areas[:, LAYOUT.rates][:, 0], truth, rtol=0.0, atol=1e-9)
    assert areas[:, LAYOUT.column("de")].sum() == pytest.approx(np.trapezoid(k * de, time), rel=1e-9)


def test_a_control_that_stands_still_has_no_rate_whatever_the_airspeed_does() -> None:
    time = np.linspace(0.0, 1.0, 101)
    rows = np.zeros((time.size, LAYOUT.width))
    rows[:, OFFSET] = 1.0 + 0.3 * time
    rows[:, LAYOUT.column("de")] = 0.05 * rows[:, OFFSET]
    areas, _ = over_intervals(LAYOUT, np.diff(time)[:, None], rows, np.zeros((100, OUTPUTS)))
    np.testing.assert_allclose(areas[:, LAYOUT.rates], 0.0, atol=1e-16)
