"""Tables are read back to the last bit, and a damaged one is named with its line."""

import math

import numpy as np
import pytest

from sysid_node.errors import InputError
from sysid_node.flight.record import FlightRecord
from sysid_node.online.types import DerivativeEstimate, Estimates, FitQuality
from sysid_node.report.files.runs import run_tables as tables
from sysid_node.report.results.run_result import Prior, References
from sysid_node.report.results.signals import Response, Spectra

HARD = (1.0 / 3.0, -5e-324, 1.7976931348623157e308, math.inf, -0.1)


def estimate(name: str, *numbers: float, valid: bool = True, status: str = "ok") -> DerivativeEstimate:
    return DerivativeEstimate(name, *numbers, valid, status)


def test_history_reads_back_to_the_last_bit(tmp_path):
    history = [
        Estimates(
            time,
            {
                "Cm_q": estimate("Cm_q", HARD[i], 0.1, HARD[-1 - i], math.inf),
                "CL_0": estimate("CL_0", 2.0, 0.3, 1.0, 3.0, valid=False, status='collinear with "CL_q", CL_de'),
            },
            {"Cm": FitQuality("Cm", 1.0 / 7.0, 3e-3, 12.5, 4000 + i)},
        )
        for i, time in enumerate((0.1, 0.2, 0.1 + 0.2, 10.0, 1e5))
    ]
    tables.write_estimates(tmp_path / "estimates.csv", history)
    tables.write_fits(tmp_path / "fits.csv", history)
    assert tables.read_history(tmp_path / "estimates.csv", tmp_path / "fits.csv") == history


@pytest.mark.parametrize(("damage", "said"), [(b"\xb8", "is no table of text"), (b"abc", "line 2: could not convert")])
def test_a_damaged_response_is_one_line(tmp_path, damage, said):
    path = tmp_path / "responses.csv"
    tables.write_responses(path, {"CL": Response("1", *np.array([[0.25], [0.5], [0.75]]))})
    path.write_bytes(path.read_bytes().replace(b"0.5", damage))
    with pytest.raises(InputError, match=said):
        tables.read_responses(path)


def test_nan_is_an_empty_cell(tmp_path):
    path = tmp_path / "estimates.csv"
    unknown = estimate("Cm_q", *[math.nan] * 4, valid=False, status="not excited")
    tables.write_estimates(path, [Estimates(1.0, {"Cm_q": unknown}, {})])
    assert path.read_text().splitlines()[1] == "1.0,Cm_q,,,,,false,not excited,,0.0"
    (back,) = tables.read_history(path, tmp_path / "none.csv")
    assert math.isnan(back.derivatives["Cm_q"].value)


def test_references_read_back(tmp_path):
    path = tmp_path / "derivatives.csv"
    prior = {"Cm_q": Prior(-1.3, 0.2), "CL_0": Prior(0.1)}
    known = [estimate(name, 1.0, 0.1, 0.8, 1.2) for name in ("Cm_q", "CL_0", "CL_q")]
    tables.write_derivatives(path, known, References(prior, {"CL_q": 4.0}, {"CL_q": 30.0}))
    back = tables.read_references(path)
    assert back.prior["Cm_q"] == prior["Cm_q"]
    assert math.isnan(back.prior["CL_0"].tolerance)
    assert back.truth == {"CL_q": 4.0}
    assert back.truth_since == {"CL_q": 30.0}


def test_signals_spectra_and_responses_read_back(tmp_path):
    random = np.random.default_rng(1)
    flight = FlightRecord(np.cumsum(random.random(50)), {"q": random.normal(size=50), "V": np.full(50, np.nan)})
    tables.write_signals(tmp_path / "signals.csv", flight)
    back = tables.read_signals(tmp_path / "signals.csv")
    np.testing.assert_array_equal(back.time, flight.time)
    assert list(back.columns) == ["q", "V"]
    np.testing.assert_array_equal(back["q"], flight["q"])

    spectra = Spectra(np.arange(3.0), {"de": random.random(3)}, {"Cm": random.random(3)}, {"Cm": random.random(3)})
    tables.write_spectra(tmp_path / "spectra.csv", spectra)
    again = tables.read_spectra(tmp_path / "spectra.csv")
    np.testing.assert_array_equal(again.inputs["de"], spectra.inputs["de"])
    np.testing.assert_array_equal(again.residuals["Cm"], spectra.residuals["Cm"])
    np.testing.assert_array_equal(again.measured["Cm"], spectra.measured["Cm"])

    responses = {"q, rad/s": Response("rad/s", *random.random((3, 9)))}
    tables.write_responses(tmp_path / "responses.csv", responses)
    (name, response), *_ = tables.read_responses(tmp_path / "responses.csv").items()
    assert (name, response.unit) == ("q, rad/s", "rad/s")
    np.testing.assert_array_equal(response.modelled, responses[name].modelled)


def test_nothing_to_write_leaves_no_file(tmp_path):
    path = tmp_path / "estimates.csv"
    path.write_text("from before")
    tables.write_estimates(path, [])
    tables.write_signals(tmp_path / "signals.csv", None)
    assert not any(tmp_path.iterdir())
    assert tables.read_history(path, path) == []
    assert tables.read_signals(tmp_path / "signals.csv") is None


@pytest.mark.parametrize(
    ("row", "wrong"),
    [
        ("1.0,Cm_q,abc,,,,true,ok,,", "could not convert string to float: 'abc'"),
        ("1.0,Cm_q,1.0", "3 cells, expected 10"),
        ("1.0,Cm_q,,,,,perhaps,ok,,", "valid is 'perhaps'"),
    ],
)
def test_a_damaged_row_is_named(tmp_path, row, wrong):
    path = tmp_path / "estimates.csv"
    path.write_text(",".join(("time", *tables.ESTIMATE_COLUMNS)) + f"\n0.5,Cm_q,1,1,1,1,true,ok,1,0\n{row}\n")
    with pytest.raises(InputError, match=r"estimates\.csv, line 3: ") as error:
        tables.read_history(path, tmp_path / "fits.csv")
    assert wrong in str(error.value)


def test_a_wrong_header_is_named(tmp_path):
    (tmp_path / "spectra.csv").write_text("Hz,input_de\n1,2\n")
    with pytest.raises(InputError, match="expected 'frequency'"):
        tables.read_spectra(tmp_path / "spectra.csv")
    (tmp_path / "fits.csv").write_text("a,b\n1,2\n")
    with pytest.raises(InputError, match=r"fits\.csv: columns 'a,b'"):
        tables.read_history(tmp_path / "estimates.csv", tmp_path / "fits.csv")


def test_signals_out_of_order_are_named(tmp_path):
    (tmp_path / "signals.csv").write_text("time,q\n0,1\n2,1\n1,1\n")
    with pytest.raises(InputError, match=r"signals\.csv: .* time must increase"):
        tables.read_signals(tmp_path / "signals.csv")
