"""The batch estimators on real flights beside the published analyses, which use the same models and data.

    python -m bench.batch.published [--records FOLDER] [--page docs/results/batch.md]

Needs the folder of flight records, which is not part of the project. The cases are those of the tests.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from bench.pages import publish, table
from sysid_node.batch.likelihood.joint_kalman_filter import FilterNoise
from sysid_node.batch.methods.extended_kalman_filter import extended_kalman_filter
from sysid_node.batch.methods.filter_error import filter_error
from sysid_node.batch.methods.output_error import output_error
from sysid_node.batch.methods.unscented_kalman_filter import unscented_kalman_filter
from sysid_node.batch.results.batch_fit import BatchFit
from sysid_node.batch.results.estimate import ParameterEstimate

ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "test" / "batch"))  # where the tests keep their cases
import reference_flights as published  # noqa: E402

Reference = Mapping[str, tuple[float, float]]
REPEAT = 5


def section(flights: Path) -> str:
    """All tables, then what they cost."""
    hfb, attas, otter = published.hfb_320(flights), published.attas_lateral(flights), published.twin_otter(flights)
    fits, costs = {}, []
    for name, case, elsewhere in (
        ("HFB-320", hfb, "9.4 s"),
        ("ATTAS lateral", attas, "65 s"),
        ("Twin Otter 018", otter, "35 to 55 s"),
    ):
        fits[name], wall, processor = _timed(lambda c=case: output_error(c.model, [c.manoeuvre]))  # type: ignore[misc]
        costs.append([name, f"{fits[name].search.iterations}", f"{wall:.2f}", f"{processor:.2f}", elsewhere])
    parts = ["### Output error"]
    for name, reference in (
        ("HFB-320", published.HFB_OUTPUT_ERROR),
        ("ATTAS lateral", published.ATTAS_OUTPUT_ERROR),
        ("Twin Otter 018", published.TWIN_OTTER_OUTPUT_ERROR),
    ):
        parts += [f"{name}:", _beside(reference, fits[name].estimates)]
    ratio = np.exp(fits["HFB-320"].log_det) / published.HFB_OUTPUT_ERROR_DET
    parts.append(f"HFB-320, det R here over there: {ratio:.5f}.")
    heads = ("converged, the program compiled", "rounds", "wall, s", "processor, s", "there, in Octave")
    parts += [table(heads, costs), "### The turbulent flight of the HFB-320", _filters(hfb, fits["HFB-320"])]
    return "\n\n".join(parts)


def _timed(call: Callable[[], BatchFit]) -> tuple[BatchFit, float, float]:
    """The fit, and the least wall-clock and processor time of several, compiled."""
    fit, times = call(), []
    for _ in range(REPEAT):
        begin = time.perf_counter(), time.process_time()
        call()
        times.append((time.perf_counter() - begin[0], time.process_time() - begin[1]))
    wall, processor = np.min(times, axis=0)
    return fit, float(wall), float(processor)


def _beside(reference: Reference, found: Mapping[str, ParameterEstimate]) -> str:
    rows = [
        [
            name,
            f"{value:.5g} ({error:.2g})",
            f"{found[name].value:.5g} ({found[name].white_error:.2g}; {found[name].standard_error:.2g})",
            f"{(found[name].value - value) / error:+.2f}",
        ]
        for name, (value, error) in reference.items()
    ]
    return table(("", "published", "here (s.e. for white; for coloured residuals)", "off, in published s.e."), rows)


def _filters(case: published.ReferenceCase, biased: BatchFit) -> str:
    """Filter error and the Kalman filters beside the published ones."""
    fit = filter_error(case.model, [case.manoeuvre])
    r, q = (np.array(variances) for variances in published.HFB_FILTER_NOISE)
    start = np.full(len(case.model.states) + len(case.model.names), np.sqrt(10.0))
    noise = FilterNoise(q / case.manoeuvre.step**2, r, start)
    filters = [
        method(case.model, [case.manoeuvre], noise).final
        for method in (extended_kalman_filter, unscented_kalman_filter)
    ]
    rows = []
    for name, value in published.HFB_FILTER_ERROR.items():
        e = fit.estimates[name]
        others = [published.HFB_EKF.get(name, ("", 0.0))[0], published.HFB_UKF.get(name, "")]
        rows.append(
            [
                name,
                f"{value:.4g}",
                f"{e.value:.4g} ({e.standard_error:.2g})",
                f"{(e.value - value) / e.standard_error:+.2f}",
                *(f"{known} / {here[name].value:.4g}" for known, here in zip(others, filters, strict=True)),
                f"{biased.values[name]:.4g}",
            ]
        )
    heads = ("", "filter error, published", "here", "off, in s.e.", "EKF, published / here", "UKF, published / here")
    return table((*heads, "output error, which knows no turbulence"), rows)


def main() -> None:
    """Print the tables, or put them in the documentation."""
    beside = ROOT.parent / "shared" / "flights"
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--records", type=Path, default=Path(os.environ.get("SYSID_FLIGHTS", beside)))
    parser.add_argument("--page", type=Path, help="Markdown file whose section to fill")
    args = parser.parse_args()
    if not args.records.is_dir():
        raise SystemExit(f"flight records not found at {args.records}; give their folder as --records")
    publish("bench/batch/published.py", section(args.records), args.page)


if __name__ == "__main__":
    main()
