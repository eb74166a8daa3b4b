"""A simulator identified from its own flights; truth: the simulator that flew them, and a file that is off."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from gap_flights import fly

from sysid_node.aircraft.dump import dump_aircraft
from sysid_node.aircraft.load import parse_aircraft
from sysid_node.aircraft.model import Aircraft, UncertainValue
from sysid_node.errors import InputError
from sysid_node.gap.flightdata.gap_flight import GapFlight
from sysid_node.gap.residuals.simulator_error import with_simulator_error
from sysid_node.gap.surrogate.identify import Surrogate, identify_simulator, require_same_aircraft

SERVOS = {"elevator": UncertainValue(0.09), "aileron": UncertainValue(0.04), "rudder": UncertainValue(0.04)}


@pytest.fixture(scope="module")
def simulator(aircraft: Aircraft) -> Aircraft:
    """An aircraft with servos, which its owner's file does not state."""
    return replace(aircraft, effects={"actuator_lag": SERVOS})


@pytest.fixture(scope="module")
def file(aircraft: Aircraft) -> Aircraft:
    """First guesses: every derivative off by a tenth of itself on average."""
    random = np.random.default_rng(2)
    values = {n: d.value * (1.0 + 0.1 * random.standard_normal()) for n, d in aircraft.derivatives.items()}
    return replace(aircraft, derivatives={n: replace(aircraft.derivatives[n], value=v) for n, v in values.items()})


@pytest.fixture(scope="module")
def simulated(simulator: Aircraft) -> list:
    return [fly(simulator, {}, seed=seed) for seed in (21, 22)]


@pytest.fixture(scope="module")
def surrogate(file: Aircraft, simulated: list) -> Surrogate:
    return identify_simulator(file, simulated, [], lambda share, text: None)


@pytest.mark.slow
def test_the_servos_are_found(surrogate: Surrogate) -> None:
    lag = surrogate.aircraft.effects["actuator_lag"]
    assert surrogate.effects == ("actuator_lag",)
    assert {name: item.value for name, item in lag.items()} == pytest.approx(
        {name: item.value for name, item in SERVOS.items()}, abs=0.006
    )


@pytest.mark.slow
def test_derivatives_are_the_simulators_within_their_tolerances(surrogate: Surrogate, simulator: Aircraft) -> None:
    found = surrogate.aircraft.derivatives
    deviations = [(found[n].value - d.value) / found[n].tolerance for n, d in simulator.derivatives.items()]
    assert np.median(np.abs(deviations)) < 2.0
    main = ("CL_alpha", "Cm_alpha", "Cm_de", "Cl_da", "Cl_p", "Cn_beta")
    assert [found[n].value for n in main] == pytest.approx([simulator.derivatives[n].value for n in main], rel=0.03)


@pytest.mark.slow
def test_what_is_left_on_flight_held_out_is_small(surrogate: Surrogate) -> None:
    assert 0.0 < surrogate.error.total < 0.08
    assert set(surrogate.error.per_channel) >= {"q", "p", "alpha", "az"}
    assert (surrogate.fitted_seconds, surrogate.held_out_seconds) == pytest.approx((26.0, 26.0), abs=0.1)


def test_the_surrogate_is_an_aircraft_file(surrogate: Surrogate) -> None:
    again = parse_aircraft(dump_aircraft(surrogate.aircraft))
    assert again.derivatives == surrogate.aircraft.derivatives
    assert again.effect_values() == surrogate.aircraft.effect_values()


def test_its_error_counts_as_noise_of_the_real_flight(surrogate: Surrogate, plain_model) -> None:
    bounded = with_simulator_error(plain_model, surrogate.error)
    assert (bounded.noise >= plain_model.noise).all() and bounded.noise.sum() > plain_model.noise.sum()
    np.testing.assert_array_equal(bounded.simulator_error, surrogate.error.channels)


def test_other_masses_are_said(aircraft: Aircraft, plain: GapFlight) -> None:
    """Moments by an inertia of a third are a third of the file's."""
    thirds = {
        n: replace(d, value=d.value / 3.0) for n, d in aircraft.derivatives.items() if n[:2] in {"Cl", "Cm", "Cn"}
    }
    found = replace(aircraft, derivatives={**aircraft.derivatives, **thirds})
    require_same_aircraft(aircraft, aircraft, [plain])
    with pytest.raises(InputError, match=r"flight 1: by the inertia .* simulated moments are 0.33 times"):
        require_same_aircraft(aircraft, found, [plain])


def test_the_real_flight_is_no_simulated_one(file: Aircraft, simulated: list) -> None:
    with pytest.raises(InputError, match="is the same recording"):
        identify_simulator(file, simulated, simulated[:1], lambda share, text: None)
