"""What is drawn of a replay, against a flight whose forces and moments follow from a known model by hand."""

import json
from dataclasses import replace

import numpy as np
import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft, Sensors
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.types import SAMPLE_COLUMNS, DerivativeEstimate, Estimates
from sysid_node.report.drawing.spectrum import amplitude_spectrum
from sysid_node.report.files.runs.run_folder import rebuild_report, write_run
from sysid_node.report.results.from_replay import replay_result
from sysid_node.report.results.recorded_samples import RecordedSamples

SETTINGS = OnlineSettings()
LONGITUDINAL = ("CL", "CD", "Cm")


def flight(aircraft: Aircraft, seconds: float = 60.0) -> tuple[np.ndarray, np.ndarray]:
    """Samples (N, M) of a longitudinal flight: alpha and q chosen, forces and the elevator following from the model.

    Lift and drag by Newton's second law from body-axis specific force (no thrust), the elevator from
    Iyy dq/dt = qbar S cbar Cm.
    """
    t = np.arange(0.0, seconds, 0.01)
    value = {name: d.value for name, d in aircraft.derivatives.items()}
    V, rho = aircraft.reference.airspeed, aircraft.reference.air_density
    pressure = 0.5 * rho * V**2 * aircraft.geometry.S
    alpha = 0.08 + 0.03 * np.sin(2 * np.pi * 0.5 * t)
    q, qdot = 0.2 * np.sin(2 * np.pi * 0.7 * t), 0.2 * 2 * np.pi * 0.7 * np.cos(2 * np.pi * 0.7 * t)
    qhat = q * aircraft.geometry.cbar / (2 * V)
    Cm = aircraft.inertia.Iyy * qdot / (pressure * aircraft.geometry.cbar)
    de = (Cm - value["Cm_0"] - value["Cm_alpha"] * alpha - value["Cm_q"] * qhat) / value["Cm_de"]
    lift, drag = (
        pressure * (value[f"{c}_0"] + value[f"{c}_alpha"] * alpha + value[f"{c}_q"] * qhat + value[f"{c}_de"] * de)
        for c in ("CL", "CD")
    )
    ax = (lift * np.sin(alpha) - drag * np.cos(alpha)) / aircraft.mass
    az = (-lift * np.cos(alpha) - drag * np.sin(alpha)) / aircraft.mass
    known = {"ax": ax, "az": az, "q": q, "alpha": alpha, "V": V, "rho": rho, "thrust": np.nan, "de": de}
    names = (*SAMPLE_COLUMNS, *aircraft.control_symbols)
    return t, np.stack([np.broadcast_to(known.get(name, 0.0), t.shape) for name in names], axis=1)


def believed(aircraft: Aircraft, time: float) -> Estimates:
    derivatives = {
        name: DerivativeEstimate(name, d.value, 0.1, d.value - 0.2, d.value + 0.2, True, "ok")
        for name, d in aircraft.derivatives.items()
    }
    return Estimates(time, derivatives, {})


@pytest.fixture(scope="module")
def aircraft() -> Aircraft:
    return replace(load_aircraft("cdrw"), sensors=Sensors())


@pytest.fixture(scope="module")
def result(aircraft):
    time, samples = flight(aircraft)
    history = [believed(aircraft, 30.0), believed(aircraft, 60.0)]
    return replay_result(
        aircraft, SETTINGS, recorded=RecordedSamples.of(aircraft, time, samples), history=history, rejected={}
    )


@pytest.mark.parametrize("coefficient", LONGITUDINAL)
def test_measured_and_modelled_agree_where_the_model_is_true(result, coefficient):
    response = result.signals.responses[coefficient]
    motion = np.ptp(response.modelled)
    assert motion > 0.001
    assert np.abs(response.measured - response.modelled)[2:-2].max() < 0.01 * motion


@pytest.mark.parametrize("coefficient", LONGITUDINAL)
def test_nothing_is_left_where_the_model_is_true(result, coefficient):
    spectra = result.signals.spectra
    assert spectra.residuals[coefficient].max() < 0.01 * spectra.measured[coefficient].max()


def test_what_the_model_lacks_is_left_at_its_frequency(aircraft):
    time, samples = flight(aircraft)
    samples[:, SAMPLE_COLUMNS.index("az")] += 0.5 * np.sin(2 * np.pi * 1.3 * time)
    history = [believed(aircraft, 60.0)]
    spectra = replay_result(
        aircraft, SETTINGS, recorded=RecordedSamples.of(aircraft, time, samples), history=history, rejected={}
    ).signals.spectra
    assert spectra.frequency[np.argmax(spectra.residuals["CL"])] == pytest.approx(1.3)
    pressure = 0.5 * aircraft.reference.air_density * aircraft.reference.airspeed**2
    amplitude = 0.5 * aircraft.mass * np.cos(0.08) / (pressure * aircraft.geometry.S)
    assert spectra.residuals["CL"].max() == pytest.approx(amplitude, rel=0.02)


def test_signals_prior_and_settings_come_along(result, aircraft):
    assert result.signals.flight["de"].size == result.data.samples == 6000
    assert "air_interval" not in result.signals.flight.columns
    assert result.references.prior["Cm_alpha"].value == aircraft.derivatives["Cm_alpha"].value
    assert result.settings["frequencies"] == SETTINGS.frequencies


def test_it_goes_through_the_folder(result, tmp_path):
    write_run(tmp_path, result)
    first = (tmp_path / "report.html").read_bytes()
    assert rebuild_report(tmp_path).read_bytes() == first


@pytest.mark.parametrize("count", [0, 1, 9, 30])
def test_short_records_give_what_they_can(aircraft, count, tmp_path):
    time, samples = flight(aircraft)
    history = [believed(aircraft, 1.0)] if count else []
    recorded = RecordedSamples.of(aircraft, time[:count], samples[:count])
    short = {"recorded": recorded, "history": history, "rejected": {"imu/data: stale": 1}}
    write_run(tmp_path, replay_result(aircraft, SETTINGS, **short))
    assert json.loads((tmp_path / "summary.json").read_text(encoding="utf-8"))["samples"] == count
    assert "</html>" in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_incomplete_samples_are_left_out(aircraft):
    time, samples = flight(aircraft)
    samples[1000:1100, SAMPLE_COLUMNS.index("alpha")] = np.nan
    history = [believed(aircraft, 60.0)]
    result = replay_result(
        aircraft, SETTINGS, recorded=RecordedSamples.of(aircraft, time, samples), history=history, rejected={}
    )
    assert np.isfinite(result.signals.responses["CL"].measured).all()
    assert result.signals.spectra.residuals["CL"].max() < 0.01 * result.signals.spectra.measured["CL"].max()


@pytest.mark.parametrize("seconds", [10.0, 60.0, 500.0])
def test_a_sinusoid_shows_its_amplitude_whatever_the_length(seconds):
    jitter = np.random.default_rng(3).uniform(-0.003, 0.003, int(seconds * 50))
    time = np.arange(jitter.size) / 50.0 + jitter
    signals = np.stack([5.0 + 0.3 * np.sin(2 * np.pi * 0.9 * time), np.full(time.size, 2.0)], axis=1)
    frequency = np.arange(0.1, 2.02, 0.04)
    amplitude = amplitude_spectrum(time, signals, frequency)
    assert amplitude[:, 0].max() == pytest.approx(0.3, rel=0.02)
    assert frequency[np.argmax(amplitude[:, 0])] == pytest.approx(0.9)
    assert amplitude[:, 1].max() < 1e-12


def test_after_an_abrupt_change_only_what_follows_counts(aircraft):
    time, samples = flight(aircraft)
    samples[time < 30.0, SAMPLE_COLUMNS.index("az")] += np.sin(2 * np.pi * 1.3 * time[time < 30.0])
    changed = believed(aircraft, 31.0)
    derivatives = {n: d._replace(valid=False, status="changed") for n, d in changed.derivatives.items()}
    history = [believed(aircraft, 20.0), replace(changed, derivatives=derivatives), believed(aircraft, 60.0)]
    result = replay_result(
        aircraft, SETTINGS, recorded=RecordedSamples.of(aircraft, time, samples), history=history, rejected={}
    )
    assert result.signals.spectra.residuals["CL"].max() < 0.01 * result.signals.spectra.measured["CL"].max()
    assert "noticed at 31.0 s" in result.remarks[0]
