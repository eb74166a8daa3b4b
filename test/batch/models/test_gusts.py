"""The gusts' states against the simulator's air, which was written apart, and filter error in it."""

import dataclasses
from functools import cache

import numpy as np
import pytest
from made_flight import KESTREL

from sysid_node.batch.identify import identify
from sysid_node.batch.models.gusts import air_relative, gust_rates, gust_states
from sysid_node.batch.models.rigid_body import STATES, rigid_body
from sysid_node.batch.settings import BatchSettings
from sysid_node.dynamics.atmosphere import air_density
from sysid_node.excite.spec import parse_manoeuvre
from sysid_node.flight.record import FlightRecord
from sysid_node.sim import Simulator
from sysid_node.sim.flying.sortie import Sortie, SortieConditions, fly_sortie
from sysid_node.sim.model.layout import OUTPUTS

RATE = 100.0
TRUTH = {name: derivative.value for name, derivative in KESTREL.derivatives.items()}
SPAN = KESTREL.geometry.b


@cache
def simulator() -> Simulator:
    return Simulator(KESTREL, RATE)


def sortie(seed: int, **conditions: object) -> Sortie:
    manoeuvres = ["3211:elevator:amplitude=0.06:width=0.2:start=1:every=6:repeat=3"]
    plan = parse_manoeuvre(manoeuvres, KESTREL, RATE, 20.0)
    deflections = np.column_stack([plan.surfaces(), np.zeros(plan.time.size)])
    wanted = {"turbulence": "light", "seed": seed, "effects": {"actuator_lag": {"time_constant": 0.04}}}
    return fly_sortie(simulator(), deflections, SortieConditions(**wanted | conditions))  # type: ignore[arg-type]


def record(flown: Sortie) -> FlightRecord:
    outputs, states = np.asarray(flown.flight.outputs), np.asarray(flown.flight.states)
    columns = dict(zip(OUTPUTS, outputs.T, strict=True))
    columns |= dict(zip(("de", "da", "dr", "thrust"), np.asarray(flown.flight.surfaces).T, strict=True))
    columns["rho"] = np.asarray(air_density(-states[:, 2], np))
    return FlightRecord(np.arange(len(outputs)) / RATE, columns, "gusty")


def test_it_meets_the_air_as_the_simulator_does():
    flown = sortie(1, noise=0.0)
    measured = record(flown)
    model = rigid_body(KESTREL, tuple(STATES), ("ax", "ay", "az", "V", "alpha", "beta"), gusts=True)
    gusts = np.asarray(flown.inputs.turbulence) * flown.effects["turbulence"]["intensity"]
    path, air = (_flow(v) for v in (np.asarray(flown.flight.states)[:, 3:6] - g for g in (0.0, gusts[:, :3])))
    s = {**measured.columns, **path, **{f"gust_{name}": gusts[:, k] for k, name in enumerate("uvwp")}}
    s |= {"gust_pitching": 1.0, "gust_yawing": 1.0}
    # how the size of the aircraft sees the gusts follows from how the air turns
    pitch, yaw = (k * SPAN / (np.pi * air["V"]) for k in (4.0, 3.0))
    s["seen_w"] = s["gust_w"] + gusts[:, 4] * air["V"] * pitch
    s["seen_v"] = s["gust_v"] - gusts[:, 5] * air["V"] * yaw
    found = model.output([s[n] for n in model.states], [s[n] for n in model.inputs], model.start)
    for name, values in zip(model.outputs, found, strict=True):
        np.testing.assert_allclose(values, measured[name], atol=1e-9, err_msg=name)
    # and what it sees follows the gusts as frozen turbulence has it
    for name, rate in gust_rates(s, SPAN).items():
        if name.startswith("seen"):
            stepped = np.cumsum(0.5 / RATE * (rate[1:] + rate[:-1]))
            assert np.std(s[name][1:] - s[name][0] - stepped) < 0.1 * np.std(s[name]), name


def _flow(velocity: np.ndarray) -> dict[str, np.ndarray]:
    speed = np.linalg.norm(velocity, axis=1)
    alpha, beta = np.arctan2(velocity[:, 2], velocity[:, 0]), np.arcsin(velocity[:, 1] / speed)
    return {"V": speed, "alpha": alpha, "beta": beta}


def test_without_gusts_nothing_changes():
    s = dict.fromkeys(STATES, 1.0)
    assert air_relative(s, SPAN) == s
    assert gust_rates(s, SPAN) == {}
    assert gust_states(("q", "theta")) == ()


@pytest.mark.slow
@pytest.mark.parametrize("turning", [True, False], ids=["turning air", "air that does not turn"])
def test_filter_error_finds_the_truth_in_turbulence(turning):
    settings = BatchSettings(rate=50.0, segment=0.0, states=("V", "alpha", "q", "theta"))
    fit = identify("filter_error", KESTREL, [record(sortie(2, rotary_gusts=turning))], settings).fit
    assert fit.search.converged
    for name, within in {"CL_alpha": 0.03, "Cm_q": 0.05, "Cm_de": 0.03, "Cm_alpha": 0.06}.items():
        assert fit.values[name] == pytest.approx(TRUTH[name], rel=within), name
        assert abs(fit.values[name] - TRUTH[name]) < 3.5 * fit.estimates[name].standard_error, name
    assert fit.values["gust_pitching"] == pytest.approx(float(turning), abs=0.15)


def test_the_aircraft_alone_has_no_gusts():
    plain = rigid_body(KESTREL, ("alpha", "q"), ("alpha", "q"))
    gusty = rigid_body(KESTREL, ("alpha", "q"), ("alpha", "q"), gusts=True)
    assert plain.states == ("alpha", "q")
    assert gusty.states == ("alpha", "q", "gust_w", "seen_w")
    assert gusty.driven_states == ("q", "gust_w")
    assert set(gusty.names) - set(plain.names) == {"gust_pitching"}
    assert dataclasses.replace(gusty, driven=None).driven_states == gusty.states
