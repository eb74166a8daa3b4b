"""The rigid-body model against the simulator, which was written apart, and what it refuses."""

import dataclasses

import numpy as np
import pytest
from made_flight import KESTREL, MODEL, clean, trim

from sysid_node.aircraft.model import UncertainValue
from sysid_node.aircraft.stated_effects import with_places_from_cg
from sysid_node.batch.likelihood import rollout
from sysid_node.batch.models.manoeuvres import manoeuvre_data, with_forces_at_cg
from sysid_node.batch.models.rigid_body import STATES, rigid_body
from sysid_node.dynamics.atmosphere import air_density
from sysid_node.errors import InputError
from sysid_node.flight.record import FlightRecord
from sysid_node.sim import Simulator

SHIFT = {"cg_shift": {"x": UncertainValue(0.02), "y": UncertainValue(-0.005), "z": UncertainValue(0.03)}}


@pytest.mark.slow
@pytest.mark.parametrize("effects", [{}, SHIFT])
def test_it_flies_as_the_simulator_does(effects):
    """Also where the file states that the CG is elsewhere."""
    file = dataclasses.replace(KESTREL, effects=effects)
    model = rigid_body(with_places_from_cg(file), MODEL.states, MODEL.outputs)
    record = clean(seconds=6.0)
    simulator = Simulator(file, rate=100.0)
    commands = np.column_stack([record[symbol] for symbol in KESTREL.control_symbols] + [record["thrust"]])
    alpha, airspeed = trim()[0], KESTREL.reference.airspeed
    start = simulator.initial(airspeed, alpha, 0.0, (0.0, alpha, 0.0))
    flown = simulator.rollout(simulator.neutral(), start, simulator.inputs(commands))
    outputs = dict(zip(simulator.outputs, np.asarray(flown.outputs).T, strict=True))
    # the simulator's air thins as it climbs
    density = np.asarray(air_density(-np.asarray(flown.states[:, 2]), np))
    inputs = dataclasses.replace(record, columns={**record.columns, **outputs, "rho": density})
    start_here = {"V": airspeed, "alpha": alpha, "theta": alpha, **dict.fromkeys(("beta", "p", "q", "r", "phi"), 0.0)}
    mine = rollout.outputs(model, manoeuvre_data(model, inputs, start_here), model.start)
    for name, values in zip(MODEL.outputs, mine.T, strict=True):
        assert np.abs(values - outputs[name]).max() < 1e-4 * np.ptp(outputs[name]), name


@pytest.mark.parametrize("states", [("alpha", "q"), ("V", "alpha", "q", "theta"), ("beta", "p", "r", "phi")])
def test_states_taken_as_measured_change_nothing_where_the_measurement_is_exact(states):
    record = with_forces_at_cg(KESTREL, clean())
    model = rigid_body(KESTREL, states, states)
    # air data at the CG, where a state that is not integrated must be given
    at_cg = dataclasses.replace(KESTREL, sensors=dataclasses.replace(KESTREL.sensors, air_data=(0.0, 0.0, 0.0)))
    exact = rollout.outputs(
        rigid_body(at_cg, tuple(STATES), tuple(STATES)), manoeuvre_data(MODEL, clean(), _start()), MODEL.start
    )
    columns = {**record.columns, **dict(zip(STATES, exact.T, strict=True))}
    piece = manoeuvre_data(model, FlightRecord(record.time, columns, "exact"), _start())
    found = rollout.outputs(rigid_body(at_cg, states, states), piece, model.start)
    for column, name in enumerate(states):
        # measured inputs are linear between samples, and the forces at the CG hold differentiated rates
        assert np.abs(found[:, column] - columns[name]).max() < 0.01 * np.ptp(columns[name]), name


def _start():
    alpha, airspeed = trim()[0], KESTREL.reference.airspeed
    return {**dict.fromkeys(STATES, 0.0), "V": airspeed, "alpha": alpha, "theta": alpha}


def test_what_is_not_modelled_becomes_an_input():
    assert rigid_body(KESTREL, ("alpha", "q"), ()).inputs == (
        *("V", "beta", "p", "r", "phi", "theta"),
        *("de", "rho", "thrust", "ax_cg", "az_cg", "ay_cg"),
    )
    assert rigid_body(KESTREL, tuple(STATES), ()).inputs == ("de", "da", "dr", "rho", "thrust")
    assert "thrust" not in rigid_body(KESTREL, tuple(STATES), (), thrust=False).inputs


def test_the_aircraft_files_tolerances_are_priors_where_wanted():
    priors = {p.name: p.prior for p in rigid_body(KESTREL, ("alpha", "q"), (), use_prior=True).parameters}
    assert priors["Cm_q"] == (-18.97, 4.7)
    assert all(p.prior is None for p in rigid_body(KESTREL, ("alpha", "q"), ()).parameters)


def test_equations_are_the_same_ones_unless_the_aircraft_is_another():
    """Compiled programs belong to the equations; the derivatives' values are parameters."""
    derivative = dataclasses.replace(KESTREL.derivatives["Cm_q"], value=-1.0)
    other = dataclasses.replace(KESTREL, derivatives={**KESTREL.derivatives, "Cm_q": derivative})
    known = rigid_body(KESTREL, ("alpha", "q"), ("alpha", "q")).dynamics
    assert rigid_body(other, ("alpha", "q"), ("alpha", "q")).dynamics == known
    for changed in (
        rigid_body(dataclasses.replace(KESTREL, mass=2.0 * KESTREL.mass), ("alpha", "q"), ("alpha", "q")),
        rigid_body(KESTREL, ("alpha", "q"), ("alpha", "az")),
        rigid_body(KESTREL, ("alpha", "q"), ("alpha", "q"), reference_rates=True),
    ):
        assert changed.dynamics != known


def test_what_cannot_be_is_refused():
    with pytest.raises(InputError, match="state 'speed' is not known"):
        rigid_body(KESTREL, ("speed",), ())
    with pytest.raises(InputError, match="outputs qdott are not known"):
        rigid_body(KESTREL, ("alpha", "q"), ("qdott",))
    with pytest.raises(InputError, match="phi and theta alone"):
        rigid_body(KESTREL, ("theta",), ())
    glider = dataclasses.replace(
        KESTREL, derivatives={n: d for n, d in KESTREL.derivatives.items() if not n.startswith("Cm")}
    )
    with pytest.raises(InputError, match="state q needs derivatives of Cm"):
        rigid_body(glider, ("alpha", "q"), ())
