"""Intervals hold the truth, in a few simulated flights (`bench.estimation.coverage` flies hundreds).

Truth: the aircraft file.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bench.estimation.judging import LOWER, METHODS, UPPER, VALID, estimates, exact, judge
from bench.estimation.simulated_flights import AIR_INTERVAL, Setting, fly
from sysid_node.aircraft.load import load_aircraft
from sysid_node.online.replay import run
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.types import SAMPLE_COLUMNS

TRUTH = [d.value for d in load_aircraft("cdrw").derivatives.values()]
FLIGHTS = range(1, 9)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("turbulence", "method", "valid", "hold"),
    [
        ("none", "iv_rft", 0.9, (0.88, 0.99)),
        ("light", "iv_rft", 0.9, (0.88, 0.99)),
        ("light", "sls_rft", 0.8, (0.93, 1.0)),  # without the allowance for the bias by gusts 73 % hold
    ],
)
def test_intervals_hold_the_truth(turbulence, method, valid, hold):
    """Eight flights of 27 derivatives: the estimates of a flight depend on one another, so the bounds are wide."""
    setting = Setting("test", turbulence, seconds=15.0)
    found = estimates("cdrw", setting, [METHODS[method]], np.array([14.9]), FLIGHTS)[0, :, 0]
    verdicts = [judge(found[:, d], truth) for d, truth in enumerate(TRUTH)]
    assert np.mean([v.share_valid for v in verdicts]) > valid
    assert hold[0] < np.nanmean([v.coverage for v in verdicts]) <= hold[1]
    assert sum(v.far for v in verdicts) <= 0.005 * sum(v.valid for v in verdicts)


@pytest.mark.slow
def test_estimates_stay_valid_where_surfaces_only_answer_gusts():
    """Multisines for 20 s, then straight flight on the autopilot: what was learned stays valid, and holds."""
    sines = "multisine:elevator,aileron,rudder:amplitude=0.06,0.06,0.12:length=20:low=0.1:high=2:start=0.7"
    setting = Setting("straight flight", "light", manoeuvre=(sines,), seconds=50.0)
    found = estimates("cdrw", setting, [METHODS["iv_rft"]], np.arange(35.0, 50.0, 5.0), [1])[0]
    assert (found[..., VALID] > 0.0).mean() > 0.95
    inside = (found[..., LOWER] < TRUTH) & (np.array(TRUTH) < found[..., UPPER])
    assert inside[found[..., VALID] > 0.0].mean() > 0.9


@pytest.mark.slow
def test_gusts_that_surfaces_answer_are_not_taken_for_delays():
    """No instrument and no servo is late, which the estimator does not know. Truth: the aircraft file.

    Without the allowances 29 % of the valid intervals of this flight do not hold: servos seem early, and so do air
    data, because air that turns acts in proportion to the angles' rates.
    """
    aircraft = load_aircraft("kestrel")
    batch = fly("kestrel", Setting("delays are not known", "moderate", seconds=150.0), [1])
    found = run(aircraft, OnlineSettings(), batch.time, batch.samples[0], batch.time[-1:])[-1].derivatives
    hold = [found[name].lower < d.value < found[name].upper for name, d in aircraft.derivatives.items()]
    valid = [found[name].valid for name in aircraft.derivatives]
    assert sum(valid) >= 8
    assert np.mean(np.array(hold)[valid]) > 0.9


@pytest.mark.slow
def test_intervals_hold_the_bias_of_least_squares_where_instruments_of_one_axis_are_weak():
    """Elevator and rudder are moved on purpose, and the ailerons only answer gusts. Truth: the aircraft file.

    Roll is then solved by least squares, the pitch axis by instruments. Without the bias in the intervals `Cl_p` is 11
    standard errors off.
    """
    aircraft = load_aircraft("kestrel")
    moves = ("elevator:amplitude=0.05:width=0.35:start=5", "rudder:amplitude=0.1:width=0.35:start=7")
    setting = Setting("roll", "light", manoeuvre=[f"doublet:{m}:every=4:repeat=13" for m in moves], seconds=60.0)
    batch = fly("kestrel", setting, [1, 2])
    kept = {name: d for name, d in aircraft.derivatives.items() if name not in ("Cl_r", "Cl_dr")}
    known = replace(exact(aircraft), derivatives=kept)
    for samples in batch.samples:
        found = run(known, OnlineSettings(), batch.time, samples, batch.time[-1:])[-1].derivatives
        for name in ("Cl_beta", "Cl_p", "Cl_da"):
            assert found[name].lower < aircraft.derivatives[name].value < found[name].upper
            assert not found[name].valid
        assert found["CL_alpha"].valid


def test_a_verdict_knows_honest_estimates_from_bold_ones():
    random = np.random.default_rng(3)
    value = 2.0 + 0.1 * random.standard_normal(4000)

    def claimed(error):
        return np.column_stack([value, *np.broadcast_arrays(error, value - 1.96 * error, value + 1.96 * error, 1.0)])

    honest, bold = judge(claimed(np.full(4000, 0.1)), 2.0), judge(claimed(np.full(4000, 0.02)), 2.0)
    assert honest.coverage == pytest.approx(0.95, abs=0.015)
    assert honest.spread == pytest.approx(1.0, abs=0.05)
    assert not honest.off
    assert bold.off
    assert bold.far > 1000


def test_what_is_not_valid_does_not_count():
    rows = np.array([[1.0, 0.1, 0.8, 1.2, 1.0], [1.1, 0.1, 0.9, 1.3, 1.0], [99.0, 0.1, 98.0, 100.0, 0.0]])
    verdict = judge(rows, 1.0)
    assert verdict.share_valid == pytest.approx(2 / 3)
    assert verdict.coverage == 1.0
    assert verdict.far == 0


@pytest.mark.slow
def test_air_data_come_at_their_own_rate_and_are_interpolated():
    batch = fly("cdrw", Setting("test", "none", seconds=15.0), FLIGHTS)  # as above: compiled once
    alpha = batch.samples[..., SAMPLE_COLUMNS.index("alpha")]
    np.testing.assert_allclose(alpha[:, 1:-1:2], 0.5 * (alpha[:, :-2:2] + alpha[:, 2::2]), rtol=1e-12)
    assert np.all(batch.samples[..., SAMPLE_COLUMNS.index("air_interval")] == AIR_INTERVAL)
    assert not np.array_equal(batch.samples[0], batch.samples[1])
