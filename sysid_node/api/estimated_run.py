"""What the results of a replay and of a batch method have in common: tables, figures and files of one run."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from markupsafe import Markup

from sysid_node.api.data_frames import data_frame
from sysid_node.errors import InputError
from sysid_node.online.types import DerivativeEstimate
from sysid_node.report.drawing.plotly_figure import plotly_figure
from sysid_node.report.results.comparison import half_width
from sysid_node.report.results.run_result import RunResult
from sysid_node.report.sections import excitation, fit, history, opening, residuals
from sysid_node.report.wording.names import short_meaning, symbol, unit
from sysid_node.report.wording.numbers import with_interval

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

#: What ``plot`` draws: the section of the report -> its titled figures.
_FIGURES = {
    "estimates": history.figures_of,
    "fit": fit.figures_of,
    "excitation": excitation.figures_of,
    "residuals": residuals.figures_of,
}

_COLUMNS = ("value", "standard_error", "statistical_error", "systematic_error", "lower", "upper", "valid", "status")


class EstimatedRun(ABC):
    """A result with derivatives. ``run`` holds everything that its report shows."""

    run: RunResult

    @property
    def derivatives(self) -> Mapping[str, DerivativeEstimate]:
        """The final estimates by name: value, standard error, 95 % interval, whether valid, and the status."""
        return self.run.final.derivatives if self.run.final else {}

    def plot(self, what: str = "") -> Figure:
        """A Plotly figure as the report draws it.

        ``what``: ``"estimates"`` against time with their 95 % intervals (of a replay), ``"fit"`` (measured and
        modelled), ``"excitation"`` or ``"residuals"``. By default the first of these that the result has.
        Raises InputError where it has no such figure.
        """
        found = {name: figures for name, make in _FIGURES.items() if (figures := make(self.run))}
        chosen = what or next(iter(found), "fit")
        if chosen not in found:
            raise InputError(f"plot {what!r}: this result has {', '.join(found) or 'no figure'}")
        return plotly_figure(found[chosen], columns=3 if chosen == "estimates" else 2)

    def to_pandas(self) -> Any:
        """The final estimates as a DataFrame, by name. Raises ImportError where pandas is not installed."""
        rows = self.derivatives.values()
        columns = {name: [getattr(d, name) for d in rows] for name in _COLUMNS}
        return data_frame(columns, index=list(self.derivatives), index_name="derivative")

    @abstractmethod
    def save(self, folder: str | Path) -> Path:
        """Write what the command writes; returns the path of the report."""

    def __repr__(self) -> str:
        head = Markup(opening.context(self.run)["paragraph"]).striptags()
        rows = [
            f"{d.name:10} {with_interval(d.value, half_width(d)):>20} {unit(d.name):10} {d.status}"
            for d in self.derivatives.values()
        ]
        return "\n".join([head, "", *rows])

    def _repr_html_(self) -> str:
        row = Markup('<tr><th style="text-align:left">{}</th><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>')
        rows = [
            row.format(
                symbol(d.name),
                short_meaning(d.name),
                with_interval(d.value, half_width(d)),
                unit(d.name),
                "valid" if d.valid and d.status == "ok" else d.status,
            )
            for d in self.derivatives.values()
        ]
        heads = Markup("").join(Markup("<th>{}</th>").format(h) for h in ("", "", "estimate, 95 %", "unit", "status"))
        table = Markup("<table><thead><tr>{}</tr></thead><tbody>{}</tbody></table>")
        lead = Markup("<p>{}</p>").format(opening.context(self.run)["paragraph"])
        return str(lead + table.format(heads, Markup("").join(rows)))
