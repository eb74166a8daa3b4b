"""The shifts by wrong air data beside the forces that an aircraft feels in the true flow."""

import math

import numpy as np
import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.names import COEFFICIENTS
from sysid_node.faults.hypotheses.catalogue import Hypothesis, hypotheses, linearised
from sysid_node.faults.model.lagged_controls import LAGS
from sysid_node.faults.model.terms import RATES, Terms, design_of, terms
from sysid_node.faults.types import AIRSPEED, VANE_OFFSET
from sysid_node.online.frequency.regression_signals import OFFSET, layout

AIRCRAFT = load_aircraft("cdrw")
LAYOUT = layout(AIRCRAFT)
TERMS: Terms = terms(AIRCRAFT, LAYOUT)
VALUES = TERMS.values
PROMPT = np.zeros(len(AIRCRAFT.controls) * len(LAGS))  # no control is behind its command


def hypothesis(kind: str, part: str) -> Hypothesis:
    return next(h for h in hypotheses(AIRCRAFT, TERMS, VALUES) if (h.kind, h.part) == (kind, part))


def measured(seed: int) -> np.ndarray:
    """Regressors at the measured dynamic pressure and angles."""
    row = 0.1 * np.random.default_rng(seed).standard_normal(LAYOUT.width)
    row[OFFSET] = 1.0
    return row


def forces(values: np.ndarray, row: np.ndarray) -> np.ndarray:
    return np.asarray(design_of(TERMS, values, row, PROMPT) @ values)


def shifted(found: Hypothesis, size: float, row: np.ndarray) -> np.ndarray:
    """The coefficients that the shift predicts of the measured regressors."""
    assert found.of_size is not None
    return forces(VALUES, row) + design_of(TERMS, VALUES, row, PROMPT) @ found.of_size(size)


@pytest.mark.parametrize("error", [-0.2, 0.05, 0.3])
def test_a_wrong_angle_of_attack_turns_the_true_force(error: float) -> None:
    """Accelerometers feel the force in the true flow; it is resolved into lift and drag by the measured angle."""
    row = measured(1)
    true = row.copy()
    true[LAYOUT.column("alpha")] += error
    felt = forces(VALUES, true)
    lift, drag = (COEFFICIENTS.index(name) for name in ("CL", "CD"))
    expected = felt.copy()
    expected[lift] = math.cos(error) * felt[lift] + math.sin(error) * felt[drag]
    expected[drag] = math.cos(error) * felt[drag] - math.sin(error) * felt[lift]
    np.testing.assert_allclose(shifted(hypothesis(VANE_OFFSET, "alpha"), error, row), expected, rtol=1e-12)


@pytest.mark.parametrize("more", [-0.4, 0.2, 1.0])
def test_a_wrong_airspeed_scales_forces_by_pressure_and_rates_by_speed(more: float) -> None:
    """With the true dynamic pressure ``1 + more`` times the measured one, q C is the force; rates are by 1 / V."""
    row = measured(2)
    true = row.copy()
    for rate in RATES:
        true[LAYOUT.column(rate)] /= math.sqrt(1.0 + more)
    np.testing.assert_allclose(
        shifted(hypothesis(AIRSPEED, "airspeed"), more, row), (1.0 + more) * forces(VALUES, true), rtol=1e-12
    )


@pytest.mark.parametrize(("kind", "part"), [(VANE_OFFSET, "alpha"), (AIRSPEED, "airspeed")])
def test_the_linear_shift_touches_the_curve_at_the_size(kind: str, part: str) -> None:
    found = hypothesis(kind, part)
    assert found.of_size is not None
    at = 0.2
    tangent = linearised(found, np.array([at]))
    off = [
        np.abs(tangent.fixed + tangent.free[:, 0] * (at + step) - found.of_size(at + step)).max()
        for step in (0.0, 1e-2, 1e-3)
    ]
    assert off[0] < 1e-15
    assert off[2] == pytest.approx(off[1] / 100.0, rel=0.1)  # of second order
    np.testing.assert_array_equal(found.shift.fixed, 0.0)
