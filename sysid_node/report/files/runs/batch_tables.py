"""The tables that only batch methods have."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from sysid_node.batch.identify import Identification
from sysid_node.csv_table import write_table


def write_batch_tables(folder: Path, found: Identification) -> None:
    """Write them into the folder of a run.

    ``correlation.csv`` of the estimates; ``nuisance.csv``: initial states and biases of each piece of flight;
    ``noise.csv``: standard deviation of each output's residual, and of process and sensor noise where estimated;
    ``structure.csv``: the steps of stepwise regression.
    """
    fit = found.fit
    names = list(fit.estimates)
    _write(folder / "correlation.csv", ("", *names), zip(names, *fit.correlation.T.tolist(), strict=True))
    nuisances = [(i, name, value) for i, piece in enumerate(fit.nuisance) for name, value in piece.items()]
    _write(folder / "nuisance.csv", ("piece", "name", "value"), nuisances)
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
