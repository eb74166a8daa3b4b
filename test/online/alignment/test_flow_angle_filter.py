"""Flow angles that no vane measures, against those of a small simulator written apart from the package."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from plant import TRUTH, fly, made_aircraft, multisteps
from scipy.signal import butter, sosfiltfilt

from sysid_node.aircraft.model import Aircraft, Derivative
from sysid_node.online import estimator, replay
from sysid_node.online.alignment import flow_angle_filter
from sysid_node.online.alignment.flow_angle_filter import ALPHA, BETA
from sysid_node.online.estimates.published import estimate
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.types import Estimates

Array = NDArray[np.float64]
AIRCRAFT = made_aircraft()
ANGLES = [ALPHA, BETA]
RATE = 100.0


@cache
def flown(noise: float = 1.0, gusts: float = 0.0) -> tuple[Array, Array]:
    """Half a minute of manoeuvres in closed loop, with vanes."""
    time, samples = fly(AIRCRAFT, multisteps(30.0, RATE), RATE, noise=noise, gusts=gusts)
    return time, samples[0]


def without(samples: Array, *columns: int) -> Array:
    """The same, not measured."""
    blind = samples.copy()
    blind[:, columns or ANGLES] = np.nan
    return blind


def wrong(name: str, tolerances: float) -> Aircraft:
    """The aircraft with a file that is off by so many tolerances."""
    d = AIRCRAFT.derivatives[name]
    assert d.tolerance is not None
    changed = Derivative(d.value + tolerances * d.tolerance, d.tolerance)
    return replace(AIRCRAFT, derivatives={**AIRCRAFT.derivatives, name: changed})


def identify(samples: Array, aircraft: Aircraft = AIRCRAFT) -> Estimates:
    time = flown()[0]
    return replay.run(aircraft, OnlineSettings(), time, samples, time[-1:])[0]


@cache
def identified_without_vanes() -> Estimates:
    """What is identified of the flight with the right file and without flow angles."""
    return identify(without(flown()[1]))


def completed(aircraft: Aircraft, time: Array, samples: Array) -> Array:
    return flow_angle_filter.complete_many(flow_angle_filter.init(aircraft), time, samples, 0.2)


@pytest.mark.parametrize(
    ("aircraft", "most"), [(AIRCRAFT, 0.03), (wrong("CL_alpha", 2.0), 0.05), (wrong("CY_beta", 2.0), 0.05)]
)
def test_in_the_band_the_angles_are_the_true_ones(aircraft: Aircraft, most: float) -> None:
    """Truth: the simulator's own angles. Of a file that is off by a fifth less than a quarter of that is left."""
    time, samples = flown(noise=0.0)
    made = completed(aircraft, time, without(samples))
    band = butter(2, [0.2, 2.0], "bandpass", fs=RATE, output="sos")
    error, true = (sosfiltfilt(band, x[:, ANGLES], axis=0)[300:-300] for x in (made - samples, samples))
    assert np.all(error.std(axis=0) < most * true.std(axis=0))


def test_a_biased_vertical_accelerometer_is_learnt() -> None:
    """0.15 m/s^2 holds the angle of attack 0.08 rad off its reference, if the file does not say that it may be biased.

    The roll rate turns such an error into the sideslip.
    """
    time, samples = flown(noise=0.0)
    biased = without(samples)
    biased[:, 2] += 0.15
    uncertain = replace(
        AIRCRAFT, noise_bias={**AIRCRAFT.noise_bias, "accel": 0.15}, stated_tolerances={"noise.bias.accel": 0.15}
    )
    exact, off, learnt = (
        completed(aircraft, time, readings)[-1000:, ALPHA].mean()
        for aircraft, readings in ((AIRCRAFT, without(samples)), (AIRCRAFT, biased), (uncertain, biased))
    )
    assert abs(off - exact) > 0.05
    assert abs(learnt - exact) < 0.015


def test_biased_gyros_are_learnt() -> None:
    """0.3 deg/s for half a minute would be 9 deg of alpha, and more of bank."""
    time, samples = flown()
    biased = without(samples)
    biased[:, 3:6] += 0.005
    made = completed(AIRCRAFT, time, biased)
    assert np.abs(made[:, ALPHA] - samples[:, ALPHA]).max() < 0.07
    assert np.abs(made[:, BETA] - samples[:, BETA])[-1000:].max() < 0.15


def test_estimates_hold_the_truth_and_say_what_is_lost() -> None:
    found = identified_without_vanes().derivatives
    for name, d in found.items():
        if name.startswith("CD") or name.endswith("_0"):
            assert (d.valid, d.status) == (False, "flow angle not measured")
        else:
            assert abs(d.value - TRUTH[name]) < 4.0 * d.standard_error
    assert all(found[name].valid for name in ("CL_alpha", "Cm_alpha", "Cm_q", "Cm_de", "Cl_p", "Cn_beta", "Cl_da"))


@pytest.mark.parametrize("name", ["CL_0", "CL_alpha", "CL_de", "CY_beta", "CY_dr"])
def test_a_wrong_file_moves_estimates_by_less_than_their_errors_say(name: str) -> None:
    """Moved by one tolerance of the file, no estimate moves by more than the standard error that counts it."""
    right, moved = identified_without_vanes().derivatives, identify(without(flown()[1]), wrong(name, 1.0)).derivatives
    for of, d in right.items():
        if d.status not in ("flow angle not measured", "contradicted"):
            assert abs(d.value - moved[of].value) < d.standard_error, of


def test_one_vane_is_used() -> None:
    """With the angle of attack measured, all longitudinal offsets and the drag are known as with both."""
    found = identify(without(flown()[1], BETA)).derivatives
    assert found["CD_alpha"].status == identify(flown()[1]).derivatives["CD_alpha"].status
    made = completed(AIRCRAFT, flown()[0], without(flown()[1], BETA))
    assert np.array_equal(made[:, ALPHA], flown()[1][:, ALPHA])


def test_gusts_hide_the_angle_of_attack() -> None:
    found = identify(without(flown(gusts=1.5)[1])).derivatives
    assert {found[name].status for name in ("CL_alpha", "Cm_alpha")} <= {"gusts hide alpha", "outside model"}
    assert not any(d.valid for name, d in found.items() if name[:2] in ("CL", "CD", "Cm"))


@pytest.mark.parametrize("columns", [(BETA,), (ALPHA, BETA)])
def test_a_record_at_once_equals_its_samples_one_by_one(columns: tuple[int, ...]) -> None:
    """With a gap, a column that fails for a while, and a sample that comes too early."""
    time, samples = flown()
    time, samples = np.delete(time, np.s_[900:960]), np.delete(without(samples, *columns), np.s_[900:960], axis=0)
    samples[1500:1510, 6] = math.nan
    time[1700] = time[1699]
    state = estimator.init(AIRCRAFT, OnlineSettings())
    for t, sample in zip(time.tolist(), samples.tolist(), strict=True):
        estimator.update(state, t, sample)
    whole = replay.run(AIRCRAFT, OnlineSettings(), time, samples, time[-1:])[0]
    assert repr(estimate(state, time[-1])) == repr(whole)


@pytest.mark.parametrize(("column", "reading"), [(9, 5e-324), (9, 0.0), (6, 1e200), (0, 1e200), (3, -1e200)])
def test_readings_of_no_flight_are_none(column: int, reading: float) -> None:
    time, samples = flown()
    time, samples = time[:800], without(samples[:800])
    for place in (0, 700):
        samples[place, column] = reading
    made = completed(AIRCRAFT, time, samples)[:, ANGLES]
    assert np.isnan(made[[0, 700]]).all()
    assert np.isfinite(np.delete(made, [0, 700], axis=0)).all()


def test_a_file_without_a_lift_slope_cannot_make_angles() -> None:
    known = {name: d for name, d in AIRCRAFT.derivatives.items() if name != "CL_alpha"}
    found = identify(without(flown()[1]), replace(AIRCRAFT, derivatives=known)).derivatives
    assert {d.status for d in found.values()} == {"alpha not measured"}


def test_vanes_are_believed() -> None:
    time, samples = flown()
    assert completed(AIRCRAFT, time, samples) is samples


@pytest.mark.parametrize(("columns", "said"), [((ALPHA,), "attack."), ((ALPHA, BETA), "sideslip."), ((6,), "")])
def test_it_says_what_is_reconstructed(columns: tuple[int, ...], said: str) -> None:
    filter_ = flow_angle_filter.init(AIRCRAFT)
    flow_angle_filter.complete(filter_, 0.0, without(flown()[1], *columns)[0].tolist(), 0.2)
    assert "".join(flow_angle_filter.remarks(filter_)).endswith(said) and bool(
        flow_angle_filter.remarks(filter_)
    ) == bool(said)


def test_it_starts_in_a_coordinated_turn_with_its_bank() -> None:
    """Truth: in a level coordinated turn at bank phi the yaw rate is g sin(phi) / V, and no side force is felt."""
    V, bank, g = 20.0, math.radians(50.0), 9.80665
    q, r = g * math.sin(bank) ** 2 / math.cos(bank) / V, g * math.sin(bank) / V
    measured = [0.0, 0.0, -g / math.cos(bank), 0.0, q, r, V, math.nan, math.nan, 1.2, math.nan, 0.01]
    sample = measured + [0.0] * len(AIRCRAFT.controls)
    filter_ = flow_angle_filter.init(AIRCRAFT)
    flow_angle_filter.complete(filter_, 0.0, sample, 0.2)
    assert filter_.state[3] == pytest.approx(bank, abs=0.02)
