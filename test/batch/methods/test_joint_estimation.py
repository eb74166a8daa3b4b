"""The Kalman filters of state and parameters on whole flights: truth recovered, holdouts, and what is refused."""

import dataclasses

import numpy as np
import pytest
from made_flight import KESTREL, TRUTH, clean, flight, scores

from sysid_node.batch.identify import identify
from sysid_node.batch.methods.joint_estimation import KALMAN_FILTERS, PROCESS_NOISE, filter_noise
from sysid_node.batch.models.model_for_flights import model_for_flights
from sysid_node.batch.settings import BatchSettings
from sysid_node.errors import InputError

STILL = BatchSettings(process_noise=0.02)
METHODS = pytest.mark.parametrize("method", KALMAN_FILTERS)

#: An aircraft file that is wrong: each derivative off by its tolerance times a random number.
WRONG = dataclasses.replace(
    KESTREL,
    derivatives={
        name: dataclasses.replace(d, value=d.value + (d.tolerance or 0.0) * float(draw))
        for (name, d), draw in zip(
            KESTREL.derivatives.items(),
            np.random.default_rng(5).standard_normal(len(KESTREL.derivatives)),
            strict=True,
        )
    },
)


@pytest.mark.slow
@METHODS
def test_a_wrong_aircraft_file_is_put_right(method):
    found = identify(method, WRONG, [flight(1)], STILL, [flight(2, turn=-1)])
    assert set(found.fit.estimates) == set(TRUTH)
    assert np.mean(np.abs(scores(found.fit.estimates)) < 2.2) > 0.8
    assert np.abs(scores(found.fit.estimates)).max() < 4.0
    # well within the file's tolerance where the flight excites the derivative
    for name in ("CL_alpha", "Cm_alpha", "Cm_de", "Cl_da", "Cn_dr"):
        assert found.fit.values[name] == pytest.approx(TRUTH[name], rel=0.05), name
    (figures,) = found.holdout.values()
    assert {"alpha", "q", "az", "Cm"} <= set(figures)
    assert figures["q"]["r_squared"] > 0.95
    track = found.fit.track
    assert track is not None
    assert len(track.time) == len(flight(1))
    assert track.final["Cm_q"].value == found.fit.values["Cm_q"]


@pytest.mark.slow
def test_what_the_flight_does_not_excite_is_not_valid():
    still = clean()
    quiet = dataclasses.replace(still, columns={**still.columns, "dr": np.zeros(len(still))})
    fit = identify("extended_kalman_filter", KESTREL, [quiet], STILL).fit
    assert not fit.estimates["Cn_dr"].valid
    assert fit.estimates["Cn_dr"].status == "not excited"
    assert fit.values["Cn_dr"] == pytest.approx(TRUTH["Cn_dr"])


def test_the_filter_is_told_the_aircraft_files_noise_and_tolerances():
    model, _ = model_for_flights(KESTREL, [clean()], BatchSettings())
    noise = filter_noise(model, KESTREL, averaged=4, process_noise=2.0)
    at = model.outputs.index("q")
    assert np.sqrt(noise.sensor[at]) == pytest.approx(KESTREL.noise["gyro"] / 2.0)
    assert np.sqrt(noise.process[model.states.index("q")]) == pytest.approx(2.0 * PROCESS_NOISE["q"])
    tolerances = dict(zip(model.names, noise.start[len(model.states) :], strict=True))
    assert tolerances["Cm_q"] == KESTREL.derivatives["Cm_q"].tolerance
    unsure = dataclasses.replace(
        KESTREL, derivatives={n: dataclasses.replace(d, tolerance=None) for n, d in KESTREL.derivatives.items()}
    )
    loose = dict(zip(model.names, filter_noise(model, unsure, 1, 1.0).start[len(model.states) :], strict=True))
    assert loose["Cm_q"] == pytest.approx(0.5 * abs(TRUTH["Cm_q"]))
    assert loose["CY_p"] >= 0.05


def test_biases_are_refused_in_one_line():
    with pytest.raises(InputError, match="setting biases: extended_kalman_filter estimates no biases"):
        identify("extended_kalman_filter", KESTREL, [clean()], BatchSettings(biases=("az",)))


def test_an_output_that_is_missing_most_of_the_time_is_refused():
    whole = clean()
    rare = np.where(np.arange(len(whole)) % 10 == 0, whole["alpha"], np.nan)
    with pytest.raises(InputError, match=r"output alpha has gaps, the first at 0\.01 s; a Kalman filter needs every"):
        record = dataclasses.replace(whole, columns={**whole.columns, "alpha": rare})
        identify("unscented_kalman_filter", KESTREL, [record], BatchSettings())
