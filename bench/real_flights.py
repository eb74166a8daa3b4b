"""The estimator on real flights, beside the field's own programs. `python bench/real_flights.py [--flights FOLDER]`

DHC-6 Twin Otter, VFW-614 ATTAS, HFB-320 and the small UAV Thor, replayed as a user would, and regressed in the form in
which the references are stated. Needs the folder of flight records, which is not part of the project.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from monte_carlo.pages import publish, table
from numpy.typing import NDArray
from real import aircraft, references
from real.dimensional import Frequencies, Value, regress
from real.replaying import Found, replay
from scipy.signal import butter, filtfilt

from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.csv import read_csv
from sysid_node.flight.record import FlightRecord

Array = NDArray[np.float64]

GRID: Frequencies = (0.1, 0.04, 1.5)  # Hz, of the references
DENSE: Frequencies = (0.3, 0.01, 1.3)
METHODS = ("sls_rft", "iv_rft")
BOOM = 13.08  # m from the CG to ATTAS's nose boom, where the references' sideslip is measured
JOINT = 30.02  # s: after this sample ATTAS's second run begins


def option(grid: Frequencies) -> tuple[str, str]:
    """The grid as the commands take it."""
    return "--frequencies", ":".join(str(f) for f in grid)


def show(value: Value | Found) -> str:
    """An estimate, its standard error in brackets."""
    digits = int(np.clip(2 - np.floor(np.log10(value.error)), 0, 5)) if 0.0 < value.error < np.inf else 3
    return f"{value.value:.{digits}f} ({value.error:.{digits}f})"


def off(value: Value | Found, reference: Value) -> str:
    """How far from the reference, in the reference's standard errors."""
    return f"{(value.value - reference.value) / reference.error:+.2f}"


def twin_otter_rates(flight: FlightRecord, grid: Frequencies) -> dict[str, Value]:
    """Rates of angle of attack and pitch rate on angle of attack, pitch rate and elevator."""
    motion = {name: flight[name] for name in ("alpha", "q", "de")}
    return regress(flight.time, {"Z": flight["alpha"], "M": flight["q"]}, motion, grid, rates=True)


def twin_otter_coefficients(flight: FlightRecord, known: Aircraft, grid: Frequencies) -> dict[str, Value]:
    """CZ on angle of attack, pitch rate and elevator."""
    V, g = flight["V"], known.geometry
    CZ = known.mass * flight["az"] / (0.5 * flight["rho"] * V**2 * g.S)
    motion = {"alpha": flight["alpha"], "q": flight["q"] * g.cbar / (2.0 * V), "de": flight["de"]}
    return regress(flight.time, {"CZ": CZ}, motion, grid)


def textbook_errors(flight: FlightRecord, grid: Frequencies) -> dict[str, float]:
    """Standard errors that take the lines for independent: what ``rtpid`` does, plain sums and all."""
    omega = 2.0 * np.pi * np.arange(grid[0], grid[2] + 1e-9, grid[1])
    motion = {name: flight[name] - flight[name][0] * (name != "q") for name in ("alpha", "q", "de")}
    X = np.exp(-1j * np.outer(omega, flight.time)) @ np.column_stack(list(motion.values()))
    inverse = np.linalg.inv((X.conj().T @ X).real)
    errors = {}
    for equation, y in (("Z", 1j * omega * X[:, 0]), ("M", 1j * omega * X[:, 1])):
        residual = y - X @ (inverse @ (X.conj().T @ y).real)
        spread = np.sqrt(np.sum(np.abs(residual) ** 2) / (omega.size - 3) * inverse.diagonal())
        errors |= {f"{equation}_{name}": float(e) for name, e in zip(motion, spread, strict=True)}
    return errors


def twin_otter(folder: Path) -> str:
    """Section of the page."""
    flight, known = read_csv(folder / "twin_otter_018.csv"), aircraft.twin_otter(folder)
    grids = [(twin_otter_rates(flight, grid), textbook_errors(flight, grid)) for grid in (GRID, DENSE)]
    (ours, theirs), (dense, theirs_dense) = grids
    rates = table(
        (
            "",
            "SIDPAC rtpid",
            "here",
            "off, in its s.e.",
            "here, dense grid",
            "s.e. of lines taken as independent: grid",
            "dense grid",
        ),
        (
            [n, show(r), show(ours[n]), off(ours[n], r), show(dense[n]), f"{theirs[n]:.3f}", f"{theirs_dense[n]:.3f}"]
            for n, r in references.TWIN_OTTER_RATES.items()
        ),
    )
    CZ, replayed = twin_otter_coefficients(flight, known, GRID), _replays(flight, known, option(GRID))
    rows = []
    for name, reference in references.TWIN_OTTER_COEFFICIENTS.items():
        found = {method: CZ[name] if name in CZ else replayed[method][name] for method in METHODS}
        numbers = [x for method in METHODS for x in (show(found[method]), off(found[method], reference))]
        rows.append([name, show(reference), *numbers[: 2 if name in CZ else 4], *["", ""] * (name in CZ)])
    heads = ("", "SIDPAC", "here, sls_rft", "off", "here, iv_rft", "off")
    return f"{rates}\n\n{table(heads, rows)}"


def _replays(flight: FlightRecord, known: Aircraft, grid: Sequence[str] = ()) -> dict[str, dict[str, Found]]:
    """Derivatives by each method."""
    return {method: replay(flight, known, "--set", f"method={method}", *grid)[0] for method in METHODS}


def at_boom(flight: FlightRecord) -> FlightRecord:
    """With the sideslip as the vane on the nose boom sees it, in place of that at the CG."""
    V, alpha, beta = flight["V"], flight["alpha"], flight["beta"]
    u, w = V * np.cos(beta) * np.cos(alpha), V * np.cos(beta) * np.sin(alpha) - BOOM * flight["q"]
    v = V * np.sin(beta) + BOOM * flight["r"]
    return replace(flight, columns={**flight.columns, "beta": np.arctan2(v, np.hypot(u, w))})


def attas_rates(flight: FlightRecord) -> dict[str, Value]:
    """Rates of roll and yaw rate on sideslip, both rates, aileron and rudder."""
    motion = {name: flight[name] for name in ("beta", "p", "r", "da", "dr")}
    sides = {"L": flight["p"], "N": flight["r"]}
    return regress(flight.time, sides, motion, GRID, rates=True, breaks=[JOINT + 0.01])


def dimensional(found: Mapping[str, Found], flight: FlightRecord, known: Aircraft) -> dict[str, Value]:
    """Cl and Cn derivatives as angular accelerations for each rad and rad/s, Ixz coupling both."""
    i, b = known.inertia, known.geometry.b
    moment = float(np.mean(0.5 * flight["rho"] * flight["V"] ** 2)) * known.geometry.S * b
    determinant = i.Ixx * i.Izz - i.Ixz**2
    weights = {"L": (i.Izz, i.Ixz), "N": (i.Ixz, i.Ixx)}
    values = {}
    for regressor in ("beta", "p", "r", "da", "dr"):
        gain = moment / determinant * (b / (2.0 * float(np.mean(flight["V"]))) if regressor in ("p", "r") else 1.0)
        Cl, Cn = found[f"Cl_{regressor}"], found[f"Cn_{regressor}"]
        for axis, (roll, yaw) in weights.items():
            error = float(np.hypot(roll * Cl.error, yaw * Cn.error))
            values[f"{axis}_{regressor}"] = Value(gain * (roll * Cl.value + yaw * Cn.value), gain * error)
    return values


def attas(folder: Path) -> str:
    """Section of the page."""
    flight, known = read_csv(folder / "attas_lateral_1.csv"), aircraft.attas(folder)
    boom = at_boom(flight)
    regressed, at_cg = attas_rates(boom), attas_rates(flight)
    replayed = {m: dimensional(d, boom, known) for m, d in _replays(boom, known, option(GRID)).items()}
    rows = [
        [
            name,
            show(reference),
            show(regressed[name]),
            off(regressed[name], reference),
            *(x for method in METHODS for x in (show(replayed[method][name]), off(replayed[method][name], reference))),
            show(at_cg[name]),
            off(at_cg[name], reference),
        ]
        for name, reference in references.ATTAS.items()
    ]
    heads = (
        "",
        "ftr",
        "here",
        "off, in its s.e.",
        "replay, sls_rft",
        "off",
        "replay, iv_rft",
        "off",
        "sideslip at the CG",
        "off",
    )
    return table(heads, rows)


def earlier(flight: FlightRecord, column: str, seconds: float) -> FlightRecord:
    """With one column as it stands so much later in the record."""
    moved = np.interp(flight.time + seconds, flight.time, flight[column])
    return replace(flight, columns={**flight.columns, column: moved})


def hfb320(folder: Path) -> str:
    """Section of the page."""
    flight, known = read_csv(folder / "hfb320.csv"), aircraft.hfb320(folder)
    found = _replays(flight, known, option(GRID))
    early = {
        s: replay(earlier(flight, "alpha", s), known, "--set", "method=sls_rft", *option(GRID))[0] for s in (0.05, 0.1)
    }
    rows = [
        [
            name,
            *(show(d[name]) for d in (*found.values(), *early.values())),
            show(references.HFB_FILTER_ERROR[name]),
            show(references.HFB_EKF[name]),
            show(reference),
        ]
        for name, reference in references.HFB_OUTPUT_ERROR.items()
    ]
    heads = ("", *(f"here, {m}" for m in METHODS), *(f"sls_rft, alpha {s:g} s earlier" for s in early))
    text = table((*heads, "filter error", "EKF", "output error"), rows)
    lift, moment = lift_delay(flight, known)
    return f"{text}\n\nAngle of attack after lift: {show(lift)} s; after the pitching moment: {show(moment)} s."


def lift_delay(flight: FlightRecord, known: Aircraft) -> tuple[Value, Value]:
    """By how much (s) the angle of attack lags behind what it makes: lift, and the pitching moment."""
    V, g, alpha = flight["V"], known.geometry, flight["alpha"]
    pressure = 0.5 * flight["rho"] * V**2 * g.S
    angle = {"alpha": alpha, "rate": np.gradient(alpha, flight.time), "de": flight["de"]}
    Z = regress(flight.time, {"CZ": known.mass * flight["az"] / pressure}, angle, GRID)
    assert known.throttle is not None
    turning = known.inertia.Iyy * np.gradient(flight["q"], flight.time) - known.throttle.arm * flight["thrust"]
    motion = {**angle, "q": flight["q"] * g.cbar / (2.0 * V), "V": V}
    M = regress(flight.time, {"Cm": turning / (pressure * g.cbar)}, motion, GRID)
    return _ratio(Z["CZ_rate"], Z["CZ_alpha"]), _ratio(M["Cm_rate"], M["Cm_alpha"])


def _ratio(part: Value, whole: Value) -> Value:
    return Value(part.value / whole.value, part.error / abs(whole.value))


LAG = 0.05  # s: Thor's commands, as far as they are ahead of the surfaces


def thor(folder: Path) -> str:
    """Section of the page."""
    flight, known = read_csv(folder / "thor_75a.csv"), aircraft.thor(folder)
    pairs = (("da", "p"), ("de", "q"), ("dr", "r"))
    heads = ("command, response", "strongest correlation", "response after command, s")
    lags = table(heads, ([f"{command}, d{rate}/dt", *_correlation(flight, command, rate)] for command, rate in pairs))
    late = flight
    for command, _ in pairs:
        late = earlier(late, command, -LAG)
    columns = {**_replays(flight, known), f"sls_rft, commands {LAG:g} s later": _replays(late, known)["sls_rft"]}
    rows = []
    for name in known.derivatives:
        rows.append([name, *(x for d in columns.values() for x in (show(d[name]), d[name].status))])
    names = [x for column in columns for x in (column, "status")]
    return f"{lags}\n\n{table(('', *names), rows)}"


def _correlation(flight: FlightRecord, command: str, rate: str) -> tuple[str, str]:
    """The strongest correlation of a command with an angular acceleration, both in 0.5 to 5 Hz, and at what lag."""
    step = float(np.median(np.diff(flight.time)))
    band = butter(2, [0.5, 5.0], "band", fs=1.0 / step)
    u, y = (filtfilt(*band, x) for x in (flight[command], np.gradient(flight[rate], flight.time)))
    reach = round(0.3 / step)
    u, y = u / np.linalg.norm(u), y / np.linalg.norm(y)
    found = {lag: float(np.roll(u, lag)[reach:-reach] @ y[reach:-reach]) for lag in range(-reach, reach + 1)}
    best = max(found, key=lambda lag: abs(found[lag]))
    return f"{found[best]:+.2f}", f"{best * step:+.2f}"


SECTIONS = {"twin_otter": twin_otter, "attas": attas, "hfb320": hfb320, "thor": thor}


def main() -> None:
    """Print the sections, or put them in the documentation."""
    beside = Path(__file__).resolve().parents[2] / "shared" / "flights"
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flights", type=Path, default=Path(os.environ.get("SYSID_FLIGHTS", beside)))
    parser.add_argument("--only", choices=SECTIONS, help="one aircraft")
    parser.add_argument("--page", type=Path, help="Markdown file whose sections to fill")
    args = parser.parse_args()
    if not args.flights.is_dir():
        raise SystemExit(f"flight records not found at {args.flights}; give their folder as --flights")
    for name, section in SECTIONS.items():
        if args.only in (None, name):
            publish(f"bench/real_flights.py {name}", section(args.flights), args.page)


if __name__ == "__main__":
    main()
