"""A made-up run: numbers drawn from a seeded generator about round true values, of no aircraft that exists."""

import numpy as np

from sysid_node.flight.record import FlightRecord
from sysid_node.online.types import DerivativeEstimate, Estimates, FitQuality
from sysid_node.report.results.run_result import Prior, References, RunData, RunResult
from sysid_node.report.results.signals import Response, RunSignals, Spectra

TRUTH = {
    **{"CL_0": 0.05, "CL_alpha": 3.0, "CL_q": 4.0, "CL_de": 1.1},
    **{"CD_0": 0.02, "CD_alpha": 0.22, "CD_q": 0.25, "CD_de": 0.06},
    **{"Cm_0": 0.02, "Cm_alpha": -0.43, "Cm_q": -1.3, "Cm_de": -0.53},
    **{"CY_beta": -0.2, "CY_p": 0.14, "CY_r": 0.13, "CY_da": 0.06, "CY_dr": 0.16},
    **{"Cl_beta": -0.05, "Cl_p": -0.24, "Cl_r": 0.035, "Cl_da": -0.22, "Cl_dr": 0.0044},
    **{"Cn_beta": 0.046, "Cn_p": -0.057, "Cn_r": -0.032, "Cn_da": -0.025, "Cn_dr": -0.044},
}
STATUS = {"CD_q": "not excited", "CY_p": "collinear with CY_r", "CY_r": "collinear with CY_p", "Cl_dr": "converging"}
COEFFICIENTS = ("CL", "CD", "CY", "Cl", "Cm", "Cn")
START = 3.0  # s: nothing is known before


def run(seconds: float = 60.0, rate: float = 100.0, publish_rate: float = 5.0) -> RunResult:
    """A minute of a synthetic flight, with everything a run can hold."""
    random = np.random.default_rng(7)
    times = np.arange(1, int(seconds * publish_rate) + 1) / publish_rate
    flight = _flight(random, seconds, rate)
    return RunResult(
        aircraft="synthetic",
        method="sls_rft",
        history=_history(random, times, rate),
        data=RunData(
            seconds,
            len(flight),
            {"air_data: not finite": 12, "imu/data: duplicate stamp": 3, "actuators: out of order": 1},
        ),
        settings={"frequencies": (0.1, 0.04, 2.0), "method": "sls_rft", "forgetting_time": 0.0, "use_prior": False},
        references=References(
            {name: Prior(1.1 * value + 0.002, 0.12 * abs(value) + 0.001) for name, value in TRUTH.items()}, TRUTH
        ),
        signals=RunSignals(flight, _spectra(random), {name: _response(random, seconds) for name in ("CL", "Cm")}),
        holdout={"second flight": {"Cm": {"r_squared": 0.97, "theil": 0.08}, "CL": {"r_squared": 0.99, "theil": 0.05}}},
        remarks=["All numbers of this page are synthetic."],
    )


def _history(random: np.random.Generator, times: np.ndarray, rate: float) -> list[Estimates]:
    tracks = {name: _track(random, name, times) for name in TRUTH}
    return [
        Estimates(float(t), {name: track[i] for name, track in tracks.items()}, _fits(float(t), rate))
        for i, t in enumerate(times)
    ]


def _track(random: np.random.Generator, name: str, times: np.ndarray) -> list[DerivativeEstimate]:
    """An estimate that wanders within its shrinking standard error, and says so before it is known."""
    final = (0.35 if name in STATUS else 0.02) * (abs(TRUTH[name]) + 0.01)
    error = final * np.sqrt(times[-1] / times) * (1 + 8 * np.exp(-times / 4))
    walk = np.cumsum(random.normal(size=times.size) / np.sqrt(times.size)) + random.normal()
    value = TRUTH[name] + 0.8 * error * walk
    usable = (error < 0.3 * abs(TRUTH[name])) & (name not in STATUS)
    return [
        DerivativeEstimate(name, np.nan, np.nan, np.nan, np.nan, False, "not excited")
        if time < START
        else DerivativeEstimate(
            name, float(v), float(e), float(v - 2 * e), float(v + 2 * e), bool(ok), _status(name, bool(ok))
        )
        for time, v, e, ok in zip(times, value, error, usable, strict=True)
    ]


def _status(name: str, usable: bool) -> str:
    return "ok" if usable else STATUS.get(name, "converging")


def _fits(time: float, rate: float) -> dict[str, FitQuality]:
    explained = {"CL": 0.995, "CD": 0.87, "CY": 0.93, "Cl": 0.98, "Cm": 0.991, "Cn": 0.96}
    return {c: FitQuality(c, explained[c], 0.004, max(time * 2 - 4, 0.0), int(time * rate)) for c in COEFFICIENTS}


def _flight(random: np.random.Generator, seconds: float, rate: float) -> FlightRecord:
    time = np.arange(int(seconds * rate)) / rate
    steps = np.repeat([1.0, -1.0, 1.0, -1.0, 0.0, 0.0, 0.0, 0.0], [3, 2, 1, 1, 4, 2, 2, 1])
    multistep = steps[(time * 2).astype(int) % steps.size]
    later = np.roll(multistep, int(5 * rate))

    def noisy(scale: float, signal: np.ndarray, offset: float = 0.0) -> np.ndarray:
        smooth = np.convolve(signal, np.exp(-np.arange(200) / 30) / 30, mode="full")[: time.size]
        return offset + scale * (smooth + 0.04 * random.normal(size=time.size))

    columns = {
        **{"de": 0.06 * multistep, "da": 0.05 * later, "dr": 0.04 * np.roll(later, int(2 * rate))},
        **{"alpha": noisy(-0.08, multistep, 0.06), "beta": noisy(0.05, later)},
        **{"p": noisy(0.5, later), "q": noisy(-0.3, multistep), "r": noisy(0.15, later)},
        **{"V": noisy(0.6, multistep, 18.0), "thrust": np.full(time.size, np.nan)},
        **{"ax": noisy(0.4, multistep, 0.5), "ay": noisy(0.6, later), "az": noisy(4.0, multistep, -9.8)},
        **{"phi": noisy(0.3, later), "theta": noisy(-0.1, multistep, 0.06)},
    }
    return FlightRecord(time, columns)


def _spectra(random: np.random.Generator) -> Spectra:
    frequency = np.arange(0.1, 2.02, 0.04)
    inputs = {c: 0.02 / (1 + (frequency / f) ** 2) for c, f in (("de", 0.5), ("da", 0.7), ("dr", 0.6))}
    measured = dict.fromkeys(COEFFICIENTS, 0.03 / (1 + (frequency / 0.6) ** 2))
    residuals = {c: 0.0006 + 0.0002 * random.normal(size=frequency.size) ** 2 for c in COEFFICIENTS}
    return Spectra(frequency, inputs, measured, residuals)


def _response(random: np.random.Generator, seconds: float) -> Response:
    time = np.arange(0.0, seconds, 0.02)
    modelled = 0.05 * np.sin(0.7 * time) * np.sin(0.13 * time)
    return Response("", time, modelled + 0.004 * random.normal(size=time.size), modelled)
