"""Equation error in the frequency domain, against SIDPAC, and the bands that it refuses."""

import numpy as np
import pytest
from made_flight import KESTREL, clean
from reference_flights import TWIN_OTTER_FREQUENCY, twin_otter

from sysid_node.batch.methods.frequency_equation_error import frequency_equation_error, regress_in_band
from sysid_node.batch.regression.measured_coefficients import measured_coefficients
from sysid_node.errors import InputError

BAND = (0.1, 0.04, 1.5)


@pytest.fixture(scope="module")
def otter(flights):
    case = twin_otter(flights)
    found = measured_coefficients(case.aircraft, case.record)
    X = np.column_stack([found.regressors[name] for name in ("alpha", "q", "de", "0")])
    return found, X


@pytest.mark.parametrize("coefficient", ["CZ", "Cm"])
def test_frequency_domain_figures_are_sidpacs(otter, coefficient):
    found, X = otter
    fit = regress_in_band(["alpha", "q", "de"], [found.time], [found.coefficients[coefficient]], [X[:, :3]], BAND)
    for name, (value, error) in TWIN_OTTER_FREQUENCY[coefficient].items():
        assert abs(fit.estimates[name].value - value) < error, name


def test_errors_do_not_depend_on_how_dense_the_frequencies_are(otter):
    found, X = otter
    coarse, dense = (
        regress_in_band(["alpha", "q", "de"], [found.time], [found.coefficients["Cm"]], [X[:, :3]], (0.1, step, 1.5))
        for step in (0.04, 0.005)
    )
    for name in ("alpha", "q", "de"):
        ratio = dense.estimates[name].standard_error / coarse.estimates[name].standard_error
        assert ratio == pytest.approx(1.0, abs=0.05), name


@pytest.mark.parametrize(
    ("frequencies", "said"),
    [
        ((2.0, 0.1, 1.0), "expected 0 < start < stop"),
        ((0.1, 0.1, 60.0), "sampled at 100 Hz shows only up to 50 Hz"),
        ((0.5, 0.01, 0.6), "holds 2 independent values in these flights, too few for 3 regressors"),
    ],
)
def test_impossible_bands_are_refused(frequencies, said):
    with pytest.raises(InputError, match=said):
        frequency_equation_error(KESTREL, [clean()], frequencies)


def test_an_interruption_takes_no_more_than_the_missing_time():
    """Truth: the same samples without the pause. The two samples beside it would otherwise weigh as all of it."""
    rng, time = np.random.default_rng(5), np.arange(0.0, 40.0, 0.02)
    x = np.sin(2.0 * np.pi * 0.5 * time) + np.sin(2.0 * np.pi * 1.1 * time)
    y = 2.0 * x + 0.3 * rng.normal(size=time.size)
    paused = np.where(time > 20.0, time + 8.0, time)
    whole, cut = (regress_in_band(["x"], [t], [y], [x[:, None]], BAND).estimates["x"] for t in (time, paused))
    assert cut.standard_error < 1.3 * whole.standard_error
    assert abs(cut.value - 2.0) < 3.0 * cut.standard_error
