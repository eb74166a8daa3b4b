"""Flow angles without vanes follow the instruments' errors; truth: the vanes that were taken away."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from gap_flights import RATE, fly, whole

from sysid_node.flight.record import Array
from sysid_node.gap.estimation.candidates import candidates_of
from sysid_node.gap.flightdata.gap_flight import GapFlight, resampled
from sysid_node.gap.flightdata.inferred_flow import filter_steps
from sysid_node.gap.flightdata.manoeuvre_window import cut_to_manoeuvre
from sysid_node.gap.flightdata.time_scales import highest_frequency
from sysid_node.gap.residuals.air_motion import LONGEST_MEMORY
from sysid_node.gap.residuals.build import noiseless_model, residual_model_of
from sysid_node.gap.residuals.flight_path_reconstruction import corrected_motion
from sysid_node.gap.residuals.predictions import CHANNELS, ObserverMemory
from sysid_node.gap.residuals.residual_model import ResidualModel
from sysid_node.gap.residuals.windowed_spectra import Windows
from sysid_node.sim import Simulator
from sysid_node.sim.model.chain import Chain

ANALYSIS = 50.0  # Hz


def blind(aircraft, flight: GapFlight, *lost: str) -> GapFlight:
    """The flight as an aircraft without these vanes has it."""
    columns = {**flight.record.columns, **{name: np.full(len(flight.record), np.nan) for name in lost}}
    return whole(aircraft, replace(flight, record=replace(flight.record, columns=columns)))


def model_of(aircraft, flight: GapFlight) -> ResidualModel:
    """The flight's residual model without its noise and its air, on which the angles do not depend."""
    record, highest = resampled(flight, ANALYSIS), highest_frequency(aircraft, lateral=True)
    windows = Windows.over(len(record), ANALYSIS, highest=highest)
    measured = np.array([name not in flight.inferred for name in CHANNELS])
    memory = ObserverMemory(LONGEST_MEMORY, LONGEST_MEMORY)
    return noiseless_model(Simulator(aircraft, ANALYSIS), flight, record, windows, measured, memory)


def angles_of(model: ResidualModel, effects: dict[str, dict[str, float]]) -> list[Array]:
    """Alpha and beta (N,) at the probe, with the instruments' errors as these effects have them."""
    simulator, motion = model.simulator, model.inputs.motion
    assert motion is not None
    theta, step = jnp.asarray(simulator.vector(effects)), jnp.asarray(simulator.step)
    chain = Chain.of(simulator.layout, simulator.model, theta, step, jnp.zeros(()))
    found = np.asarray(corrected_motion(chain, motion).flow)[: len(model.record)]
    return [found[:, 1], found[:, 2]]


def rms(error: Array) -> float:
    return float(np.sqrt((error**2).mean()))


def at_analysis_rate(series: Array, samples: int) -> Array:
    return series[:: round(RATE / ANALYSIS)][:samples]


@pytest.mark.slow
@pytest.mark.parametrize(
    "effect",
    [{"imu_bias": {"q": 0.04}}, {"imu_bias": {"p": 0.03}}, {"airspeed_scale": {"error": 0.15}},
     {"imu_scale": {"az": 0.1}}],
)  # fmt: skip
def test_an_error_of_an_instrument_is_taken_out_of_the_angles(aircraft, effect) -> None:
    seen = fly(aircraft, effect, seed=5)
    model = model_of(aircraft, blind(aircraft, seen, "alpha", "beta"))
    truth = [at_analysis_rate(seen.record[name], len(model.record)) for name in ("alpha", "beta")]
    wrong, right = (
        [rms(angle - true) for angle, true in zip(angles_of(model, errors), truth, strict=True)]
        for errors in ({}, effect)
    )
    assert max(right) < 0.012 and max(right) < 0.5 * max(wrong), (wrong, right)


@pytest.mark.slow
def test_with_the_instruments_as_the_file_has_them_the_angles_are_the_filters(aircraft, plain) -> None:
    flight = blind(aircraft, plain, "alpha", "beta")
    model = model_of(aircraft, flight)
    for angle, name in zip(angles_of(model, {}), ("alpha", "beta"), strict=True):
        assert rms(angle - at_analysis_rate(flight.record[name], len(angle))) < 0.002


@pytest.mark.slow
def test_an_angle_that_a_vane_measures_stays(aircraft, plain) -> None:
    flight = blind(aircraft, plain, "beta")
    with_vanes, without = (model_of(aircraft, f) for f in (plain, flight))
    (alpha, _), (kept, _) = angles_of(with_vanes, {}), angles_of(without, {})
    assert rms(kept - alpha) < 1e-6


def test_the_filter_stands_still_beyond_the_record(aircraft, plain) -> None:
    flight = blind(aircraft, plain, "alpha", "beta")
    model = model_of(aircraft, flight)
    assert flight.history is not None
    steps = filter_steps(aircraft, flight.history, model.record, ANALYSIS, len(model.record) + 100)
    beyond = [np.asarray(part)[len(model.record) :] for part in (steps.interval, steps.corrects, steps.gains)]
    assert all(not part.any() for part in beyond)
    assert np.asarray(steps.corrects).sum() == pytest.approx(flight.history.corrects.sum(), abs=1)


@pytest.mark.slow
def test_the_part_of_a_flight_begins_with_what_the_filter_knew_there(aircraft) -> None:
    seen = fly(aircraft, {}, manoeuvre=["3211:elevator:start=20:width=0.3"], duration=50.0)
    cut = cut_to_manoeuvre(blind(aircraft, seen, "alpha", "beta"), ("de", "da", "dr"))
    assert cut.left_out > 30.0
    model = model_of(aircraft, cut)
    for angle, name in zip(angles_of(model, {}), ("alpha", "beta"), strict=True):
        assert rms(angle - at_analysis_rate(cut.record[name], len(angle))) < 0.002


@pytest.mark.slow
@pytest.mark.parametrize("turbulence", ["none", "light"])
def test_drag_is_not_compared_in_gusts_that_no_vane_measures(aircraft, make_flight, turbulence) -> None:
    seen = make_flight({}, seed=3, turbulence=turbulence)
    flights = [(blind(aircraft, seen, "alpha", "beta"), turbulence == "none")]
    flights += [(seen, True)] if turbulence == "light" else []
    for flight, compared in flights:
        model = residual_model_of(Simulator(aircraft, ANALYSIS), flight)
        assert bool(model.axes[CHANNELS.index("CD")]) is compared
        effects = {candidate.effect for candidate in candidates_of(model.simulator, [model])}
        assert ("drag_rise" in effects) is compared
