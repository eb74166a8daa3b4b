"""The quality of fit: on the flight that was used, and on flights held out."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from sysid_node.report.drawing import figures
from sysid_node.report.drawing.figures import Figure
from sysid_node.report.drawing.thinning import MAX_POINTS, thin_curve
from sysid_node.report.results.run_result import RunResult
from sysid_node.report.results.signals import Response
from sysid_node.report.sections.section import Section
from sysid_node.report.wording.names import COEFFICIENT_WORDS, symbol, words_of
from sysid_node.report.wording.numbers import number


def context(run: RunResult) -> Mapping[str, Any]:
    """Quality by coefficient, measured against modelled, and figures of merit on held-out flights."""
    fits = run.final.fits.values() if run.final else ()
    return {
        "fits": [
            {
                "name": fit.coefficient,
                "symbol": symbol(fit.coefficient),
                "words": COEFFICIENT_WORDS.get(fit.coefficient, ""),
                "explained": _percent(fit.r_squared),
                "bar": min(max(100 * fit.r_squared, 0.0), 100.0) if math.isfinite(fit.r_squared) else 0.0,
                "residual": number(fit.residual_std, 2),
                "freedom": number(fit.degrees_of_freedom, 3),
                "samples": str(fit.samples),
            }
            for fit in fits
        ],
        "batch": not run.method.endswith("_rft"),
        "response_note": run.signals.response_note,
        "responses": [(name, symbol(name), r.unit, _figure(name, r)) for name, r in run.signals.responses.items()],
        "holdout": [_flight(name, outputs) for name, outputs in run.holdout.items()],
    }


def figures_of(run: RunResult) -> list[tuple[str, Figure]]:
    """Measured and modelled, under the name of each output or coefficient."""
    return [(f"{name}, {r.unit}" if r.unit else name, _figure(name, r)) for name, r in run.signals.responses.items()]


def _percent(share: float) -> str:
    """A share in percent; a share below one is never rounded up to 100 %."""
    if not math.isfinite(share):
        return number(share)
    return ">\u202f99.9\u202f%" if 0.9995 <= share < 1 else f"{number(100 * share, 3)}\u202f%"


def _figure(name: str, response: Response) -> Figure:
    time, measured, modelled = thin_curve(response.time, response.measured, response.modelled, points=2 * MAX_POINTS)
    traces = [
        figures.line(time, measured, "measured", colour=figures.MUTED, width=1.4),
        figures.line(time, modelled, "model", width=1.6),
    ]
    layout = {"xaxis": figures.axis("time, s"), "yaxis": figures.axis(response.unit)}
    return Figure(f"{name}: measured, and the model's answer to the same inputs", traces, layout)


def _flight(name: str, outputs: Mapping[str, Mapping[str, float]]) -> dict[str, Any]:
    """A table: outputs down, figures of merit across."""
    merits = list(dict.fromkeys(merit for figures_of in outputs.values() for merit in figures_of))
    rows = [(output, [number(found.get(m, math.nan)) for m in merits]) for output, found in outputs.items()]
    return {"name": name, "merits": [words_of(merit) for merit in merits], "rows": rows}


SECTION: Section[RunResult] = Section("fit", "Quality of fit", "fit.html.j2", context)
