"""``sysid identify``: bags or logs through a batch method to summary.json, tables and report.html."""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Aircraft
from sysid_node.batch.identify import METHODS, Identification, identify
from sysid_node.batch.models.rigid_body import OUTPUTS
from sysid_node.batch.results.batch_fit import ModelResponse, ParameterEstimate, goodness_of_fit
from sysid_node.batch.settings import BatchSettings
from sysid_node.cli.shared.terminal import progress_bar, show_estimates
from sysid_node.csv_table import write_table
from sysid_node.errors import InputError
from sysid_node.flight.frames import BODY_FRAMES
from sysid_node.flight.logs import load_flight
from sysid_node.flight.record import FlightRecord
from sysid_node.flight.topics import topic_names
from sysid_node.flight.truth import read_truth
from sysid_node.online.types import DerivativeEstimate, Estimates, FitQuality
from sysid_node.report.drawing.spectrum import amplitude_spectrum
from sysid_node.report.files.run_folder import write_run
from sysid_node.report.results.run_result import Response, RunResult, Spectra, prior_of

if TYPE_CHECKING:
    Commands = argparse._SubParsersAction[argparse.ArgumentParser]

#: Hz: what the drawn spectra show.
_SPECTRUM = np.arange(0.1, 5.01, 0.1)


def run_result(
    aircraft: Aircraft,
    records: Sequence[FlightRecord],
    found: Identification,
    settings: BatchSettings,
    truth: Mapping[str, float] | None = None,
) -> RunResult:
    """All that the report, the summary and the tables need. ``records`` are the flights that were fitted."""
    fit, first = found.fit, records[0]
    trusted = "ok" if fit.converged else f"not converged: {fit.message}"
    derivatives = {
        name: _derivative(name, fit.estimates.get(name), trusted, fit.remarks) for name in aircraft.derivatives
    }
    estimates = Estimates(sum(record.duration for record in records), derivatives, _fits(found))
    return RunResult(
        aircraft=aircraft.name,
        method=fit.method,
        history=[estimates],
        data_seconds=sum(record.duration for record in records),
        samples=sum(len(record) for record in records),
        settings=settings.as_dict(),
        prior=prior_of(aircraft),
        truth=truth or {},
        flight=first,
        spectra=_spectra(aircraft, first, found.coefficients),
        responses=_responses(found),
        response_note=_note(records, settings),
        rejected=_rejected(records),
        holdout=found.holdout,
        remarks=[_sentence(remark) for remark in (fit.message, *fit.remarks)],
    )


def _derivative(
    name: str, estimate: ParameterEstimate | None, trusted: str, remarks: Sequence[str]
) -> DerivativeEstimate:
    """One row of the table; a derivative that was not estimated is there with the reason."""
    if estimate is None:
        coefficient = name.partition("_")[0]
        reasons = [remark for remark in remarks if name in remark or coefficient in remark]
        status = reasons[0] if reasons else "not part of the model that these flights allow"
        return DerivativeEstimate(name, np.nan, np.nan, np.nan, np.nan, False, status)
    status = estimate.status if not estimate.valid or trusted == "ok" else trusted
    valid = estimate.valid and trusted == "ok"
    return DerivativeEstimate(
        name, estimate.value, estimate.standard_error, estimate.lower, estimate.upper, valid, status
    )


def _fits(found: Identification) -> dict[str, FitQuality]:
    """Quality by coefficient, then by the outputs of a method that integrates."""
    names = list(found.fit.estimates)
    table = {}
    for name, q in (goodness_of_fit(found.fit.responses) | goodness_of_fit(found.coefficients)).items():
        own = sum(key.startswith(f"{name}_") for key in names)
        freedom = float(q.samples - (own or len(names)))
        table[name] = FitQuality(name, q.r_squared, q.residual_std, freedom, q.samples)
    return table


def _responses(found: Identification) -> dict[str, Response]:
    """Of the first flight: its outputs, and its coefficients."""
    table = {}
    for response in (*found.fit.responses[:1], *found.coefficients[:1]):
        for name in response.names:
            table[name] = Response(OUTPUTS.get(name, ""), response.time, *response.column(name))
    return table


def _note(records: Sequence[FlightRecord], settings: BatchSettings) -> str:
    which = f"The first of {len(records)} flights. " if len(records) > 1 else ""
    return f"{which}Coefficients are shown below {settings.low_pass:g} Hz." if settings.low_pass else which


def _spectra(aircraft: Aircraft, record: FlightRecord, coefficients: Sequence[ModelResponse]) -> Spectra | None:
    """Of the first flight: the controls, the coefficients and what the model leaves of them."""
    if not coefficients:
        return None
    response = coefficients[0]
    frequency = _SPECTRUM[0.4 / float(np.median(np.diff(response.time))) > _SPECTRUM]
    complete = [symbol for symbol in aircraft.control_symbols if np.isfinite(record[symbol]).all()]
    inputs = amplitude_spectrum(record.time, np.column_stack([record[s] for s in complete]), frequency)
    measured = amplitude_spectrum(response.time, response.measured, frequency)
    residuals = amplitude_spectrum(response.time, response.residuals, frequency)
    return Spectra(
        frequency,
        dict(zip(complete, inputs.T, strict=True)),
        dict(zip(response.names, measured.T, strict=True)),
        dict(zip(response.names, residuals.T, strict=True)),
    )


def _rejected(records: Sequence[FlightRecord]) -> dict[str, int]:
    total: Counter[str] = Counter()
    for record in records:
        total.update(record.rejected)
    return dict(total)


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}{'' if text.endswith('.') else '.'}"


def write_tables(folder: Path, found: Identification) -> None:
    """The tables that only batch methods have.

    ``correlation.csv`` of the estimates; ``nuisance.csv``: initial states and biases of each piece of flight;
    ``noise.csv``: standard deviation of each output's residual, and of process and sensor noise where estimated;
    ``structure.csv``: the steps of stepwise regression.
    """
    fit = found.fit
    names = list(fit.estimates)
    _write(folder / "correlation.csv", ("", *names), zip(names, *fit.correlation.T.tolist(), strict=True))
    own = [(i, name, value) for i, piece in enumerate(fit.nuisance) for name, value in piece.items()]
    _write(folder / "nuisance.csv", ("piece", "name", "value"), own)
    noise = [(f"residual_{name}", value) for name, value in fit.noise.items()]
    _write(folder / "noise.csv", ("name", "standard_deviation"), [*noise, *fit.extras.items()])
    steps = [
        (name, s.change, s.r_squared, s.f_ratio, s.predicted_square_error, s.cross_validation)
        for name, selection in found.selections.items()
        for s in selection.steps
    ]
    merits = ("r_squared", "f_ratio", "predicted_square_error", "cross_validation")
    _write(folder / "structure.csv", ("coefficient", "change", *merits), steps)


def _write(path: Path, header: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    write_table(path, header, rows, keep_empty=False)


def parse_settings(texts: Iterable[str], frequencies: str | None = None) -> BatchSettings:
    """From ``key=value`` texts. Raises InputError naming the key or the value that is wrong."""
    values: dict[str, str] = {}
    for text in texts:
        key, separator, value = text.partition("=")
        if not separator:
            raise InputError(f"--set {text!r}: expected KEY=VALUE, e.g. segment=10")
        values[key.strip()] = value.strip()
    if frequencies is not None:
        values["frequencies"] = frequencies
    return BatchSettings.from_mapping(values)


def add_parser(commands: Commands) -> argparse.ArgumentParser:
    """The command's arguments."""
    parser = commands.add_parser("identify", help="identify an aircraft from bags with a batch method")
    parser.description = "Identify an aircraft from whole flights; writes summary.json, tables and report.html."
    parser.add_argument("bag", metavar="BAG", nargs="+", type=Path, help="rosbag2 folder, .mcap, .db3 or .csv file")
    parser.add_argument("--aircraft", required=True, metavar="FILE|NAME", help="aircraft file, or name as in cdrw")
    parser.add_argument("--method", required=True, choices=METHODS, help="how to estimate")
    parser.add_argument("--out", required=True, metavar="DIR", type=Path, help="folder for the results")
    parser.add_argument(
        "--holdout", action="append", default=[], metavar="BAG", type=Path, help="a flight to check the result on"
    )
    parser.add_argument("--frequencies", metavar="START:STEP:STOP", help="lines of frequency_equation_error, Hz")
    known = ", ".join(field.name for field in fields(BatchSettings))
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help=f"a setting: {known}")
    parser.add_argument(
        "--topic", action="append", default=[], metavar="OURS:=THEIRS", help="a topic's name in the bags"
    )
    parser.add_argument("--body-frame", choices=BODY_FRAMES, default="flu", help="of the IMU messages (default: flu)")
    parser.add_argument("--quiet", action="store_true", help="print nothing")
    return parser


def run(args: argparse.Namespace) -> None:
    """Identifies from bags."""
    aircraft, settings = load_aircraft(args.aircraft), parse_settings(args.set, args.frequencies)
    topics = topic_names(args.topic)

    def load(path: Path) -> FlightRecord:
        flight = load_flight(path, aircraft, topics=topics, frame=args.body_frame, max_gap=settings.max_gap)
        return replace(flight, name=path.name)

    with progress_bar(f"identify by {args.method.replace('_', ' ')}", quiet=args.quiet) as progress:
        records, holdout = [load(path) for path in args.bag], [load(path) for path in args.holdout]
        progress(0.2)
        found = identify(args.method, aircraft, records, settings, holdout)
        progress(0.9)
        truth = read_truth(args.bag[0])
        result = run_result(aircraft, records, found, settings, truth)
        write_run(args.out, result)
        write_tables(args.out, found)
    if not args.quiet:
        show_estimates(result.history[-1], truth)
        print(args.out / "report.html")
