"""Predicted standard errors: against the scatter of an estimator, finite differences, and scaling laws."""

from dataclasses import replace

import jax
import numpy as np
import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.errors import InputError
from sysid_node.excite.prediction import MEASURED, Predictor, outputs_of, slopes_of
from sysid_node.excite.spec import parse_manoeuvre
from sysid_node.sim.flying.lengths import padded, padded_length

CDRW = load_aircraft("cdrw")
SPEC = (
    "211:elevator:amplitude=0.04:start=0.5",
    "doublet:aileron:amplitude=0.05:start=3.5",
    "doublet:rudder:amplitude=0.1:start=5.5",
)
RATE, DURATION = 50.0, 10.0
COMPILED = jax.jit(outputs_of, static_argnums=0)


@pytest.fixture(scope="module")
def predictor():
    return Predictor(CDRW, RATE, autopilot=False)


@pytest.fixture(scope="module")
def prediction(predictor):
    return predictor.predict(parse_manoeuvre(SPEC, CDRW, RATE, DURATION))


def outputs_and_commands(prediction):
    """(N, 12) and (N, controls + 1)."""
    flight = prediction.flight
    outputs = [flight[name] for name in (*MEASURED[:8], "psi", *MEASURED[8:])]
    return np.column_stack(outputs), np.column_stack([flight[name] for name in ("de", "da", "dr", "thrust")])


def fly(predictor, commands, unknowns):
    """Arguments of ``outputs_of`` and ``slopes_of``, padded to the length that is compiled already."""
    simulator = predictor.simulator
    fixed = simulator.layout, simulator.model
    return *fixed, unknowns, predictor.trim.initial, padded(commands), simulator.step, simulator.neutral()


@pytest.mark.slow
def test_monte_carlo_scatter_is_what_was_predicted(predictor, prediction):
    """Thirty noisy flights, each fitted by two steps of Gauss-Newton from a start off by a sixtieth of the tolerances.

    Errors weighed by the predicted information are chi-square with 27 degrees of freedom a flight: their mean over 27
    is one within 1/sqrt(15 * 27) = 5 % (1 sigma); each scatter within 13 %. Bounds at four of these.
    """
    generator = np.random.default_rng(11)
    columns = [predictor.simulator.outputs.index(name) for name in MEASURED]
    sigma = np.asarray(predictor.simulator.model.noise)[columns]
    count = len(predictor.names)
    offset = np.array([d.tolerance for d in CDRW.derivatives.values()]) / 60
    outputs, commands = outputs_and_commands(prediction)
    clean, n = outputs[:, columns], len(outputs)
    errors = []
    for _ in range(30):
        measured = clean + sigma * generator.normal(size=clean.shape)
        unknowns = np.zeros(count + 8)
        unknowns[:count] = offset * generator.choice([-1.0, 1.0], count)
        for _ in range(2):
            arguments = fly(predictor, commands, unknowns)
            residual = (measured - np.asarray(COMPILED(*arguments))[:n, columns]) / sigma
            slopes = np.asarray(slopes_of(*arguments))[:n, columns] / sigma[:, None]
            unknowns = unknowns + np.linalg.lstsq(slopes.reshape(-1, unknowns.size), residual.ravel())[0]
        errors.append(unknowns[:count])
    scatter = np.array(errors)
    distance = np.einsum("ni,ij,nj->n", scatter, prediction.information.matrix, scatter) / count
    assert distance.mean() == pytest.approx(1.0, abs=4 * 0.05)
    ratio = np.sqrt(np.mean(scatter**2, axis=0)) / prediction.information.standard_errors
    assert np.all(np.abs(ratio - 1) < 4 * 0.13)


@pytest.mark.slow
def test_slopes_agree_with_differences(predictor, prediction):
    _, commands = outputs_and_commands(prediction)
    slopes = np.asarray(slopes_of(*fly(predictor, commands, np.zeros(35))))
    for i in (1, 9, 10, 11, 18, 27, 30, 34):
        step = np.zeros(35)
        step[i] = 1e-5
        high, low = (np.asarray(COMPILED(*fly(predictor, commands, s))) for s in (step, -step))
        difference = (high - low) / 2e-5
        assert np.allclose(slopes[:, :, i], difference, atol=1e-5 * np.abs(slopes[:, :, i]).max() + 1e-7)


def test_less_noise_tells_more_in_proportion(prediction):
    halved = replace(CDRW, noise={name: sigma / 2 for name, sigma in CDRW.noise.items()})
    other = Predictor(halved, RATE, autopilot=False).predict(prediction.manoeuvre)
    assert np.allclose(other.information.standard_errors, prediction.information.standard_errors / 2, rtol=1e-9)


def test_the_length_computed_does_not_show(predictor, prediction):
    """Flights are padded to a round length; a flight of exactly that length has the same beginning."""
    plan = prediction.manoeuvre
    n = plan.time.size
    length = padded_length(n)
    longer = predictor.predict(parse_manoeuvre(plan.spec, CDRW, RATE, (length - 1) / RATE))
    assert len(longer.flight) == length
    assert np.array_equal(longer.flight["alpha"][:n], prediction.flight["alpha"])
    assert np.all(longer.information.standard_errors <= prediction.information.standard_errors * (1 + 1e-6))


def test_an_axis_that_is_not_moved_is_not_known(predictor, prediction):
    pitch = predictor.predict(parse_manoeuvre("211:elevator:amplitude=0.04:start=0.5", CDRW, RATE, DURATION))
    known = dict(zip(prediction.information.names, prediction.information.standard_errors, strict=True))
    alone = dict(zip(pitch.information.names, pitch.information.standard_errors, strict=True))
    for name in ("Cl_p", "Cn_beta", "Cl_da", "CY_dr"):
        assert np.isinf(alone[name])
        assert np.isfinite(known[name])
    assert alone["Cm_alpha"] == pytest.approx(known["Cm_alpha"], rel=0.3)


def test_a_throttle_manoeuvre_moves_thrust(predictor):
    manoeuvre = parse_manoeuvre("doublet:throttle:amplitude=0.1", CDRW, RATE, DURATION)
    commands = predictor.commands(manoeuvre)
    assert np.ptp(commands[:, -1]) == pytest.approx(2 * 0.1 * 30.0)
    with pytest.raises(InputError, match=r"throttle reaches -0.05\d* at .* but cdrw allows 0 to 1;"):
        predictor.commands(parse_manoeuvre("doublet:throttle:amplitude=0.2", CDRW, RATE, DURATION))
    assert np.ptp(commands[:, :-1]) == pytest.approx(np.ptp(predictor.trim.command[:-1]))


def test_trim_counts_against_the_limit():
    aircraft = load_aircraft("cdfp")  # trims at -0.057 rad of 0.40
    predictor = Predictor(aircraft, RATE)
    manoeuvre = parse_manoeuvre("pulse:elevator:amplitude=-0.39:width=0.1", aircraft, RATE, DURATION)
    with pytest.raises(
        InputError, match=r"trim included, elevator reaches -0.44\d* at 1.00 s, but cdfp allows -0.4 to 0.4"
    ):
        predictor.predict(manoeuvre)


def test_a_sensor_without_noise_is_an_error():
    with pytest.raises(InputError, match="noise of alpha is zero"):
        Predictor(replace(CDRW, noise={**CDRW.noise, "alpha": 0.0}), RATE)


def test_the_autopilot_is_part_of_the_input(prediction):
    """Its corrections are in the commands, and those alone give the same flight again, open loop."""
    held = Predictor(CDRW, RATE).predict(prediction.manoeuvre)
    assert np.ptp(held.flight["da"]) > np.ptp(prediction.flight["da"])
    assert abs(held.flight["phi"][-1]) < 0.2 * abs(prediction.flight["phi"][-1]) + 0.02  # wings level again
    again = Predictor(CDRW, RATE, autopilot=False)
    outputs, commands = outputs_and_commands(held)
    flight = COMPILED(*fly(again, commands, np.zeros(35)))
    assert np.allclose(flight[: len(outputs)], outputs, atol=1e-9)


def test_an_airspeed_that_cannot_be_trimmed_is_an_error():
    with pytest.raises(InputError, match="no steady flight at 3 m/s"):
        Predictor(CDRW, RATE, airspeed=3.0)


@pytest.mark.slow
def test_a_flight_too_long_for_an_unstable_aircraft_is_an_error():
    """The sensitivities grow as exp(t / T) along the unstable mode; their squares leave the range of numbers."""
    with pytest.raises(InputError, match=r"has an unstable mode, .*; give a shorter duration"):
        predictor = Predictor(CDRW, 20.0)
        predictor.predict(parse_manoeuvre("doublet:elevator", CDRW, 20.0, 1000.0))
