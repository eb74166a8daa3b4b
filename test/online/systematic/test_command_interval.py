"""The time of a step is not known within the interval between a log's commands, which the intervals must hold.

Truth: a plant of known derivatives, of whose commands in steps a log at 20 Hz tells 20 ms too late.
"""

import math

import numpy as np
import pytest
from plant import fly, made_aircraft, multisteps

from sysid_node.flight.logs.fractions import between_commands
from sysid_node.flight.streams import COMMANDS, Arrival, JointStream
from sysid_node.online import estimator
from sysid_node.online.estimates.published import estimate
from sysid_node.online.frequency.regression_signals import layout
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.systematic.imperfections import Imperfections, imperfections
from sysid_node.online.types import SAMPLE_COLUMNS

RATE, LATE = 50.0, 1  # Hz, samples
INTERVAL = 0.05  # s
AIRCRAFT = made_aircraft()


def test_intervals_hold_what_a_slow_log_does_not_tell():
    time, flights = fly(AIRCRAFT, multisteps(25.4, RATE), RATE, 1, noise=1.0)
    samples, controls = flights[0].copy(), len(SAMPLE_COLUMNS)
    samples[LATE:, controls:] = flights[0][:-LATE, controls:]
    state = estimator.init(AIRCRAFT, OnlineSettings(detect_changes=False), commanded=True, command_interval=INTERVAL)
    for moment, sample in zip(time.tolist(), samples.tolist(), strict=True):
        estimator.update(state, moment, sample)
    found = estimate(state)
    rows = [found.derivatives[name] for name in ("Cm_alpha", "Cm_q", "Cm_de", "Cl_beta", "Cl_p", "Cl_r", "Cl_da")]
    for row in rows:
        assert row.valid, row
        assert row.lower < AIRCRAFT.derivatives[row.name].value < row.upper, row
    for row in found.servos.values():  # there are none: the surfaces are where they were commanded
        assert row.lower < 0.0 < row.upper, row


def servos(interval: float) -> Imperfections | None:
    return imperfections(AIRCRAFT, layout(AIRCRAFT), commanded=True, positions=False, command_interval=interval)


def test_commands_of_50_hz_leave_nothing_unknown():
    """Truth: a uniform distribution's standard deviation, interval / sqrt(12)."""
    assert servos(0.0) is None  # the aircraft is exact
    assert servos(0.0204) is None
    slow = servos(0.1)
    assert slow is not None
    np.testing.assert_allclose(slow.sigmas, 0.1 / math.sqrt(12.0))


@pytest.mark.parametrize(("rate", "interval"), [(10, 0.1), (200, 0.0)])
def test_lines_between_commands_keep_the_logs_interval(rate, interval):
    stamps = np.arange(1, 21, dtype=np.int64) * (1_000_000_000 // rate)
    logged = JointStream(Arrival(stamps, stamps, np.arange(20)), ("elevator",), np.zeros((20, 1)), COMMANDS)
    assert between_commands(logged).interval == pytest.approx(interval)
