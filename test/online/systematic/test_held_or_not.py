"""Servos' times where the messages do not show whether they are commands, which are held, or measured positions.

Truth: a plant whose controls follow the lines between the messages half an interval later, as held commands of 50 Hz
make them, and no servo besides.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from plant import fly, made_aircraft, multisteps

from sysid_node.online import estimator
from sysid_node.online.estimates.published import estimate
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.types import SAMPLE_COLUMNS, Estimates

RATE, HALF_INTERVAL = 100.0, 1  # Hz, samples
HELD_OR_NOT = 0.01 / math.sqrt(3.0)  # s: of a rectangular distribution of half an interval of 50 Hz to both sides
AIRCRAFT = replace(made_aircraft(), ideal=False)
SURFACES = ("elevator", "aileron", "rudder")


def estimated(actuators: str, commanded: bool) -> Estimates:
    time, flights = fly(AIRCRAFT, multisteps(30.0, RATE), RATE, 1, noise=1.0)
    samples, controls = flights[0][:-HALF_INTERVAL].copy(), len(SAMPLE_COLUMNS)
    samples[:, controls:] = flights[0][HALF_INTERVAL:, controls:]
    state = estimator.init(AIRCRAFT, OnlineSettings(actuators=actuators), commanded=commanded)
    for moment, sample in zip(time.tolist(), samples.tolist(), strict=False):
        estimator.update(state, moment, sample)
    return estimate(state)


@pytest.mark.slow
def test_the_intervals_of_servos_hold_what_holding_the_commands_would_make():
    servos = estimated("auto", commanded=False).servos
    assert set(servos) == set(SURFACES)
    for row in servos.values():
        assert row.standard_error > HELD_OR_NOT
        assert row.lower < 0.0 < row.upper, row


@pytest.mark.slow
def test_where_commands_are_stated_nothing_is_added():
    """The flight shows their lateness as well as it did where nothing was stated."""
    servos, unsaid = estimated("commands", commanded=True).servos, estimated("auto", commanded=False).servos
    for name, row in servos.items():
        assert row.valid, row
        assert row.value == pytest.approx(HALF_INTERVAL / RATE, abs=3.0 * row.standard_error)
        assert np.hypot(row.standard_error, HELD_OR_NOT) == pytest.approx(unsaid[name].standard_error, rel=0.05)


@pytest.mark.slow
def test_measured_positions_have_no_servos_after_them():
    assert estimated("positions", commanded=False).servos == {}


@pytest.mark.slow
def test_derivatives_do_not_depend_on_what_is_added():
    """Their own intervals contain the lateness that the flight shows, whatever it stems from."""
    found = estimated("auto", commanded=False).derivatives
    for name in ("Cm_alpha", "Cm_q", "Cm_de", "Cl_p", "Cl_da", "Cn_beta", "Cn_dr"):
        row, truth = found[name], AIRCRAFT.derivatives[name].value
        assert np.abs(row.value - truth) < 3.0 * row.standard_error, row
