"""Instruments; truth: an oscillator that the commands drive, and what gusts cannot be correlated with."""

import numpy as np
import pytest
from scipy.signal import lsim

from sysid_node.gap.instruments.excitation import external_excitation
from sysid_node.gap.instruments.gust_free_signals import (
    command_instruments,
    gust_free_instruments,
    resonator_instruments,
)
from sysid_node.gap.residuals.build import residual_model_of
from sysid_node.gap.residuals.residual_model import ResidualModel
from sysid_node.sim import Simulator

EVERY = [gust_free_instruments, command_instruments, resonator_instruments]


def explained(table: np.ndarray, series: np.ndarray) -> float:
    """Share of a series' power that the signals of a table explain."""
    left = series - table @ np.linalg.lstsq(table, series, rcond=None)[0]
    return float(1.0 - left.var() / series.var())


@pytest.mark.parametrize("by", EVERY)
def test_signals_are_standardised(plain_model: ResidualModel, by) -> None:
    for table in by(plain_model):
        assert len(table) == len(plain_model.record) and table.shape[1] > 0
        np.testing.assert_allclose(table.mean(axis=0), 0.0, atol=1e-10)
        np.testing.assert_allclose(table.std(axis=0), 1.0)


def test_what_rings_after_a_step_is_explained_by_resonators_not_by_lags(plain_model: ResidualModel) -> None:
    """An oscillator at 1.15 Hz, between two of the resonators, of damping 0.08, driven by the elevator's command."""
    omega, damping, rate = 2.0 * np.pi * 1.15, 0.08, plain_model.simulator.rate
    driver = external_excitation(plain_model).all[:, 0]
    oscillator = ([omega**2], [1.0, 2.0 * damping * omega, omega**2])
    ringing = lsim(oscillator, driver - driver[0], np.arange(driver.size) / rate)[1]
    assert explained(resonator_instruments(plain_model)[0], ringing - ringing.mean()) > 0.9
    assert explained(command_instruments(plain_model)[0], ringing - ringing.mean()) < 0.75


def test_a_servos_response_is_explained_by_lags(plain_model: ResidualModel) -> None:
    """A first-order lag of 0.1 s, between two of those of the instruments."""
    rate, lag = plain_model.simulator.rate, 0.1
    driver = external_excitation(plain_model).all[:, 0]
    late = lsim(([1.0], [lag, 1.0]), driver - driver[0], np.arange(driver.size) / rate)[1]
    assert explained(command_instruments(plain_model)[0], late - late.mean()) > 0.99


def test_without_external_excitation_there_are_none(aircraft, make_flight) -> None:
    """In light turbulence an autopilot alone moves the surfaces."""
    wrong = {"derivative_error": {"Cm_alpha": 0.015, "Cl_p": 0.03}}
    flight = make_flight(wrong, seed=5, turbulence="light", manoeuvre=[], duration=29.0)
    model = residual_model_of(Simulator(aircraft, 50.0), flight)
    for by in EVERY:
        assert [table.size for table in by(model)] == [0, 0]
