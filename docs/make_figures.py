"""Draws the figures of *How it works* and of the architecture: ``python docs/make_figures.py``, half a minute.

Every curve is computed here, by NumPy and SciPy alone or from runs of ``sysid`` on the bundled flights. Seeds are
fixed; numbers that the pages quote are printed. Run ``docs/make_pictures.py`` first: it makes the tutorial's diagnosis.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.optimize import least_squares
from svg import BLUE, GREEN, GREY, INK, MUTED, ORANGE, Chart, arrow, box, document, legend, text

from sysid_node import load
from sysid_node.batch.methods.equation_error import equation_error

Array = NDArray[np.float64]

ROOT = Path(__file__).resolve().parents[1]
FIGURES = ROOT / "docs" / "figures"
WORK = ROOT / "out" / "figures"


def main() -> None:
    """Writes every figure."""
    FIGURES.mkdir(exist_ok=True)
    figures = {
        "transform": transform,
        "intervals": intervals,
        "instruments": instruments,
        "output_error": output_error,
        "gap_sizes": gap_sizes,
        "layers": layers,
        "datum": datum,
    }
    for name, draw in figures.items():
        (FIGURES / f"{name}.svg").write_text(draw(), encoding="utf-8")


# The short period, as an example


def short_period() -> tuple[Array, Array]:
    """A (2, 2) and B (2, 1) of alpha, q and the elevator: a UAV's, 1.6 Hz and well damped."""
    return np.array([[-3.0, 0.95], [-80.0, -5.0]]), np.array([[-0.3], [-110.0]])


def respond(a: Array, b: Array, u: Array, step: float) -> Array:
    """States (N, 2) from rest to an input (N,) that is held over each step, exactly."""
    transition = expm(np.block([[a, b], [np.zeros((1, 3))]]) * step)
    states = np.zeros((u.size, 2))
    for i in range(1, u.size):
        states[i] = transition[:2, :2] @ states[i - 1] + transition[:2, 2] * u[i - 1]
    return states


def steps(time: Array) -> Array:
    """A 3-2-1-1 of 0.06 rad and a quarter of a second, beginning at 1 s."""
    u = np.zeros(time.size)
    begin = 1.0
    for units, sign in ((3, 1), (2, -1), (1, 1), (1, -1)):
        u[(time >= begin) & (time < begin + 0.25 * units)] = 0.06 * sign
        begin += 0.25 * units
    return u


def transform() -> str:
    """What the recursive transform holds of a pitch rate after 2, 4 and 10 s."""
    step = 0.01
    time = np.arange(0.0, 10.0, step)
    q = respond(*short_period(), steps(time), step)[:, 1] + 0.02 * np.random.default_rng(1).standard_normal(time.size)
    lines = np.arange(0.1, 2.5, 0.04)
    left = Chart((60, 50, 320, 200), (0, 10), (-1.0, 1.0))
    left.frame("pitch rate, rad/s", "time, s", (0, 2, 4, 6, 8, 10), (-1, 0, 1))
    left.line(time[::2], q[::2], BLUE)
    right = Chart((460, 50, 320, 200), (0, 2.5), (0, 0.6))
    right.frame("|Q(f)| at the lines, rad", "frequency, Hz", (0, 0.5, 1, 1.5, 2, 2.5), (0, 0.2, 0.4, 0.6))
    for until, colour in ((2.0, GREY), (3.0, ORANGE), (10.0, BLUE)):
        part = time < until
        spectrum = np.abs(np.exp(-2j * np.pi * np.outer(lines, time[part])) @ q[part]) * step
        right.line(lines, spectrum, colour, 2.0)
        x, _ = left.at(until, 0.0)
        left.parts.append(
            f'<line x1="{x:.1f}" x2="{x:.1f}" y1="50" y2="250" stroke="{colour}" stroke-dasharray="4 3"/>'
        )
    keys = legend(460, 305, ((GREY, "after 2 s"), (ORANGE, "after 3 s"), (BLUE, "after 10 s")))
    return document(800, 320, "A pitch rate and its Fourier transform as it grows", [*left.parts, *right.parts, keys])


# Honest intervals


def intervals() -> str:
    """Intervals of one slope from 40 experiments with coloured residuals: as if white, and with their correlation."""
    random, truth, count = np.random.default_rng(3), 1.0, 300
    decay, found = 0.9, []
    x = np.sin(2 * np.pi * 0.02 * np.arange(count)) + 0.5 * np.sin(2 * np.pi * 0.007 * np.arange(count))
    lags = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    for _ in range(400):
        noise = np.zeros(count)
        for i in range(1, count):
            noise[i] = decay * noise[i - 1] + random.standard_normal()
        y = truth * x + 0.5 * noise
        slope = x @ y / (x @ x)
        residual = y - slope * x
        variance = residual @ residual / (count - 1)
        correlation = residual[1:] @ residual[:-1] / (residual @ residual)
        white = np.sqrt(variance / (x @ x))
        coloured = np.sqrt(variance * x @ (correlation**lags) @ x) / (x @ x)
        found.append((slope, 1.96 * white, 1.96 * coloured))
    parts = []
    for k, (name, column) in enumerate((("as if residuals were white", 1), ("with their correlation", 2))):
        held = sum(abs(row[0] - truth) < row[column] for row in found)
        print(f"intervals: {name}: {held} of {len(found)} hold the truth ({100 * held / len(found):.0f} %)")
        chart = Chart((50 + 380 * k, 60, 340, 200), (0, 41), (-0.5, 2.5))
        chart.frame(
            f"{name}: {100 * held / len(found):.0f} % hold", "experiment", (1, 10, 20, 30, 40), (0, 0.5, 1, 1.5, 2)
        )
        chart.line((0, 41), (truth, truth), ORANGE, 1.4)
        for i, row in enumerate(found[:40]):
            colour = BLUE if abs(row[0] - truth) < row[column] else INK
            chart.line((i + 1, i + 1), (row[0] - row[column], row[0] + row[column]), colour, 2.2)
            chart.dot(i + 1, row[0], colour, 2.4)
        parts += chart.parts
    parts.append(legend(50, 310, ((BLUE, "interval holds the truth"), (INK, "does not"), (ORANGE, "truth"))))
    return document(800, 325, "Intervals of forty experiments, white and coloured", parts)


# Runs of sysid


def run(*arguments: str) -> dict[str, Any]:
    """``summary.json`` of a run of ``sysid``, kept in ``out/figures``."""
    folder = WORK / "_".join(word for word in arguments if not word.startswith("-")).replace("/", "_")
    if not (folder / "summary.json").is_file():
        command = [sys.executable, "-m", "sysid_node.cli", *arguments, "--out", str(folder), "--quiet"]
        subprocess.run(command, cwd=ROOT, check=True)
    summary: dict[str, Any] = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    return summary


def instruments() -> str:
    """Estimates from a turbulent flight by equation error and by instrumental variables, against the truth.

    Equation error is taken by itself: ``sysid identify`` widens its intervals by what gusts do to it.
    """
    bag = "bags/cdrw_random"
    names = ("CL_alpha", "Cm_alpha", "Cm_q", "Cm_de", "Cl_beta", "Cl_p", "Cl_da")
    truth = json.loads((ROOT / f"{bag}.truth.json").read_text(encoding="utf-8"))["derivatives"]
    flown = load(str(ROOT / bag), "cdrw")
    alone = equation_error(flown.aircraft, [flown.record]).estimates
    least = {name: {"value": e.value, "statistical_error": e.standard_error} for name, e in alone.items()}
    instrumental = run("replay", bag, "--aircraft", "cdrw")["derivatives"]
    chart = Chart((60, 60, 700, 220), (0.4, len(names) + 0.6), (-40, 50))
    chart.frame("error of the estimate and 95 % interval of noise alone, % of the truth", "", (), (-40, -20, 0, 20, 40))
    for i, name in enumerate(names, 1):
        true = truth[name]["value"] if isinstance(truth[name], dict) else truth[name]
        for shift, found, colour in ((-0.12, least[name], ORANGE), (0.12, instrumental[name], BLUE)):
            value, half = 100 * (found["value"] / true - 1), 196 * found["statistical_error"] / abs(true)
            low, high = value - half, value + half
            print(f"instruments: {name}: {value:+.1f} % ({low:+.1f} to {high:+.1f})")
            chart.line((i + shift, i + shift), (low, high), colour, 3)
            chart.dot(i + shift, value, colour, 4.5)
        x, y = chart.at(i, -40)
        chart.parts.append(text(x, y + 18, name, 12, INK, "middle"))
    keys = legend(60, 325, ((ORANGE, "equation error (least squares)"), (BLUE, "instrumental variables")))
    return document(800, 340, "Errors of two methods in turbulence", [*chart.parts, keys])


def output_error() -> str:
    """Output error on a simulated short period: the response at the start values and at the estimate."""
    step = 0.02
    time = np.arange(0.0, 5.0, step)
    a, b = short_period()
    u = steps(time)
    measured = respond(a, b, u, step)[:, 1] + 0.04 * np.random.default_rng(5).standard_normal(time.size)

    def simulated(theta: Array) -> Array:
        return respond(np.array([[-3.0, 0.95], [theta[0], theta[1]]]), np.array([[-0.3], [theta[2]]]), u, step)[:, 1]

    start = np.array([-45.0, -2.5, -80.0])
    fit = least_squares(lambda theta: simulated(theta) - measured, start, x_scale=np.abs(start))
    sigma = np.sqrt(2 * fit.cost / (time.size - 3))
    errors = 1.96 * sigma * np.sqrt(np.diag(np.linalg.inv(fit.jac.T @ fit.jac)))
    for name, value, error, true in zip(("M_alpha", "M_q", "M_de"), fit.x, errors, (-80, -5, -110), strict=True):
        print(f"output error: {name} {value:.2f} +- {error:.2f}, true {true}")
    chart = Chart((60, 50, 700, 230), (0, 5), (-1.2, 1.2))
    chart.frame("pitch rate, rad/s", "time, s", (0, 1, 2, 3, 4, 5), (-1, -0.5, 0, 0.5, 1))
    chart.line(time, measured, GREY, 3)
    chart.line(time, simulated(start), ORANGE)
    chart.line(time, simulated(fit.x), BLUE)
    keys = legend(60, 325, ((GREY, "measured"), (ORANGE, "model at the start values"), (BLUE, "model at the estimate")))
    return document(800, 340, "Output error: measured and simulated pitch rate", [*chart.parts, keys])


def gap_sizes() -> str:
    """The gap of the tutorial's flight, reading by reading: before, within tolerances, after, and the noise floor."""
    found = json.loads((ROOT / "out" / "pictures" / "gap" / "gap.json").read_text(encoding="utf-8"))["gap"]
    channels = found["per_channel"]
    kinds = (("before", ORANGE), ("tolerances", GREY), ("after", BLUE), ("noise_floor", GREEN))
    chart = Chart((50, 60, 720, 220), (0, len(channels)), (0, 1))
    chart.frame("error over motion, root mean square, flight held out", "", (), (0, 0.25, 0.5, 0.75, 1))
    for i, (name, sizes) in enumerate(channels.items()):
        for k, (kind, colour) in enumerate(kinds):
            chart.bar(i + 0.2 + 0.18 * k, 0.16, sizes[kind], colour)
        x, y = chart.at(i + 0.47, 0)
        chart.parts.append(text(x, y + 18, name, 12, INK, "middle"))
    words = ("aircraft file", "derivatives within tolerances", "with the cause", "noise floor")
    keys = legend(50, 325, [(colour, word) for (_, colour), word in zip(kinds, words, strict=True)])
    return document(800, 340, "The gap by reading, before and after", [*chart.parts, keys])


# The architecture


def layers() -> str:
    """The layers of the source: imports point downwards only."""
    rows = (
        (("cli", "commands"),),
        (("api", "Python: load, replay, identify, diagnose"), ("view", "flights in 3-D, in the viewer Rerun")),
        (("report", "pages, figures, tables and files of a run"),),
        (("ros", "nodes: messages in and out, no mathematics"),),
        (("fleet", "many flights: catalogue, engine, statistics"),),
        (("gap", "flight data, residuals, estimation, instruments, selection, validation, verdict"),),
        (("faults", "surfaces, sensors, airframe"), ("control", "adaptive gains"), ("excite", "manoeuvres")),
        (("online", "recursive estimator"), ("batch", "estimators of whole flights")),
        (("sim", "rigid body and effects, one JAX function; models in and out"),),
        (("flight", "bags, logs, autopilots: time-aligned columns"),),
        (("dynamics", "coefficients, kinematics, equations of motion: written once, for NumPy and JAX"),),
        (("aircraft", "the aircraft file: geometry, mass, controls, derivatives and their tolerances"),),
    )
    parts, top = [], 20.0
    for row in rows:
        width = (760 - 10 * (len(row) - 1)) / len(row)
        for i, (name, says) in enumerate(row):
            parts.append(box(20 + i * (width + 10), top, width, 50, name, [says]))
        top += 58
    parts.append(
        text(400, top + 14, "A layer imports from the layers below it only; a test enforces it.", 12, MUTED, "middle")
    )
    return document(800, top + 30, "The layers of the source", parts)


def datum() -> str:
    """The way of a datum: from an IMU message to a published estimate, and from a bag to a verdict."""
    top = [
        ("messages", ("imu/data, air_data,", "actuators (ROS, or", "read from a bag)")),
        ("alignment", ("one sample per IMU", "message; others", "interpolated")),
        ("transform", ("coefficients and", "regressors; Fourier", "lines per segment")),
        ("regression", ("instruments, least", "squares, sandwich", "covariance")),
        ("judgement", ("status of every", "derivative: ok, or", "why not")),
    ]
    bottom = [
        ("flight data", ("fitted and held-out", "flights, on one clock")),
        ("residuals", ("flight minus the", "simulator's chain, by", "frequency")),
        ("estimation", ("each effect fitted;", "nuisances within", "their limits")),
        ("selection", ("Bayes factors,", "alternatives,", "misspecification")),
        ("validation", ("short flights on data", "not fitted")),
    ]
    parts = [text(20, 28, "In flight, and in a replay: sample by sample", 14, INK, font_weight="bold")]
    parts += _chain(top, 44, "~/derivatives", "value, interval, status", "#eaf2f9")
    parts.append(text(20, 196, "Diagnosis of the gap: whole flights", 14, INK, font_weight="bold"))
    parts += _chain(bottom, 212, "gap.json", "verdict, causes, sizes", "#fbf0e6")
    return document(960, 330, "From IMU message to published estimate, and from bag to verdict", parts)


def _chain(steps: list[tuple[str, tuple[str, ...]]], top: float, end: str, says: str, fill: str) -> list[str]:
    parts = []
    for i, (name, lines) in enumerate(steps):
        left = 20 + 158 * i
        parts.append(box(left, top, 140, 96, name, lines, fill))
        parts.append(arrow(left + 141, top + 48, left + 158, top + 48))
    left = 20 + 158 * len(steps)
    first, rest = says.split(", ", maxsplit=1)
    return [
        *parts,
        box(left, top, 130, 96, end, [f"{first},", rest], "#eef6ee"),
    ]


if __name__ == "__main__":
    main()
