"""Instruments: the frequency response of the file's model, against formulas by hand and simulated flight."""

import numpy as np
import pytest
from plant import TRUTH, fly, made_aircraft, multisteps

from sysid_node.online.frequency import fourier_transform, regression_signals
from sysid_node.online.regression import instruments
from sysid_node.online.regression.information import about_mean
from sysid_node.online.regression.instruments import INSTRUMENTED
from sysid_node.online.replay import run
from sysid_node.online.settings import OnlineSettings

AIRCRAFT = made_aircraft()
LAYOUT = regression_signals.layout(AIRCRAFT, INSTRUMENTED)
OMEGA = 2.0 * np.pi * np.array([0.3, 1.0, 1.8])


def test_short_period_by_hand() -> None:
    """alpha and q answer the elevator as (s - Z_alpha)(s - M_q) - M_alpha (1 + Z_q) says, s = j omega + leak."""
    model = instruments.instrument_model(AIRCRAFT, LAYOUT, OMEGA)
    assert model is not None
    g, V = AIRCRAFT.geometry, AIRCRAFT.reference.airspeed
    qS, half = 0.5 * AIRCRAFT.reference.air_density * V**2 * g.S, g.cbar / (2.0 * V)
    force, moment = -qS / (AIRCRAFT.mass * V), qS * g.cbar / AIRCRAFT.inertia.Iyy
    Za, Zq, Zd = force * TRUTH["CL_alpha"], 1.0 + force * TRUTH["CL_q"] * half, force * TRUTH["CL_de"]
    Ma, Mq, Md = moment * TRUTH["Cm_alpha"], moment * TRUTH["Cm_q"] * half, moment * TRUTH["Cm_de"]
    s = 1j * OMEGA + 0.1
    below = (s - Za) * (s - Mq) - Ma * Zq
    de = LAYOUT.timed.index("de")
    alpha, q = (LAYOUT.instrumented.index(name) for name in ("alpha", "q"))
    np.testing.assert_allclose(model.gains[:, alpha, de], (Zd * (s - Mq) + Zq * Md) / below, rtol=1e-9)
    np.testing.assert_allclose(model.gains[:, q, de], half * (Md * (s - Za) + Ma * Zd) / below, rtol=1e-9)
    np.testing.assert_allclose(model.gains[:, [LAYOUT.instrumented.index(n) for n in ("beta", "p", "r")], de], 0.0)


def test_instruments_lie_behind_the_lines_they_are_made_of() -> None:
    model = instruments.instrument_model(AIRCRAFT, LAYOUT, OMEGA)
    assert model is not None
    lines = np.random.default_rng(0).normal(size=(6, LAYOUT.transformed))
    every = np.hstack([lines, np.full((len(lines), model.gains.shape[1]), np.nan)])
    instruments.fill_in(model, every)
    np.testing.assert_array_equal(every[:, : LAYOUT.transformed], lines)
    deflections = lines[:3, LAYOUT.deflections] + 1j * lines[3:, LAYOUT.deflections]
    for i, name in enumerate(LAYOUT.instrumented):
        made = every[:3, LAYOUT.instrument(name)] + 1j * every[3:, LAYOUT.instrument(name)]
        np.testing.assert_allclose(made, (model.gains[:, i] * deflections).sum(axis=1))


def test_none_are_made_where_none_are_asked_for() -> None:
    assert instruments.instrument_model(AIRCRAFT, regression_signals.layout(AIRCRAFT), OMEGA) is None


def test_they_follow_the_motion_of_a_flight() -> None:
    """Simulated flight in still air, rigid-body equations in full: correlated with every regressor by 0.85."""
    time, flights = fly(AIRCRAFT, multisteps(20.0, 100.0), noise=0.0, closed_loop=False)
    samples = flights[0]
    grid = fourier_transform.lines(0.2, 0.05, 1.5)
    rows, _ = regression_signals.array_signals(AIRCRAFT)(list(samples.T))
    rows.insert(regression_signals.OFFSET + 2, time)
    values, steps = np.stack(rows, axis=1), np.diff(time)
    state = fourier_transform.start(grid, LAYOUT.transformed, room=len(LAYOUT.instrumented))
    fourier_transform.add(
        state,
        time[:-1].tolist(),
        time[1:].tolist(),
        0.5 * steps[:, None] * (values[1:] + values[:-1]),
        0.5 * steps[:, None] ** 2 * np.diff(values, axis=0),
    )
    lines = about_mean(fourier_transform.current(state), instruments.instrument_model(AIRCRAFT, LAYOUT, grid.omega))
    for name in LAYOUT.instrumented:
        flown, made = lines[:, LAYOUT.column(name)], lines[:, LAYOUT.instrument(name)]
        assert flown @ made / np.linalg.norm(flown) / np.linalg.norm(made) > 0.85, name


@pytest.mark.slow
def test_the_file_need_not_be_right() -> None:
    """Instruments from derivatives that are 30 % off: the estimates are those of the flight."""
    wrong = made_aircraft({name: 1.3 * value for name, value in TRUTH.items()})
    time, flights = fly(AIRCRAFT, multisteps(40.0, 100.0), flights=4, seed=2, closed_loop=False)
    for samples in flights:
        found = run(wrong, OnlineSettings(method="iv_rft"), time, samples, time[-1:])[0].derivatives
        for name in ("CL_alpha", "Cm_alpha", "Cm_de", "Cl_p", "Cl_da", "Cn_beta", "Cn_dr"):
            assert abs(found[name].value - TRUTH[name]) < 4.0 * found[name].standard_error, name
            assert found[name].standard_error < 0.15 * abs(TRUTH[name]), name
