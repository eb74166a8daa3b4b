"""What commands show in the terminal: progress on stderr, a table of estimates on stdout."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING

from sysid_node.interruption import on_interrupt

if TYPE_CHECKING:
    from sysid_node.faults.recorded_flight import FaultVerdict
    from sysid_node.online.types import Estimates


@contextmanager
def progress_bar(title: str, *, quiet: bool = False) -> Iterator[Callable[[float, str], None]]:
    """A bar on stderr that shows the share done (0..1) and what is being done.

    Nothing is shown where ``quiet`` or where stderr is a file.
    """
    from rich.console import Console  # noqa: PLC0415  # a tenth of a second that no --help needs
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn  # noqa: PLC0415

    columns = (TextColumn(title), BarColumn(), TimeElapsedColumn(), TextColumn("{task.description}"))
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True, disable=quiet or not console.is_terminal) as progress:
        task = progress.add_task("", total=1.0)
        with on_interrupt(progress.stop):
            yield lambda share, doing: progress.update(task, completed=share, description=doing)


def show_estimates(final: Estimates, truth: Mapping[str, float], since: Mapping[str, float] | None = None) -> None:
    """Print the final estimates as a table: value, 95 % interval, status, and the truth where it is known.

    ``since``: s from which on it is that, of those that have changed.
    """
    from rich.console import Console  # noqa: PLC0415
    from rich.table import Table  # noqa: PLC0415

    table = Table(box=None, header_style="bold", padding=(0, 1, 0, 0))
    for heading, justify in (("derivative", "left"), ("estimate", "right"), ("95 % interval", "left")):
        table.add_column(heading, justify=justify)  # type: ignore[arg-type]
    table.add_column("status")
    if truth:
        table.add_column("true", justify="right", no_wrap=True)
    for d in final.derivatives.values():
        cells = [d.name, plain(d.value), f"{plain(d.lower)} to {plain(d.upper)}", d.status]
        known = [_true(d.name, truth, since or {})] if truth else []
        table.add_row(*cells, *known, style="" if d.valid else "dim")
    Console().print(table)


def plain(value: float, sign: str = "") -> str:
    """A derivative to four decimals; one that is too large for any, as of what was not excited, by three digits."""
    return f"{value:{sign}.4f}" if not abs(value) >= 1e4 else f"{value:{sign}.2e}"


def _true(name: str, truth: Mapping[str, float], since: Mapping[str, float]) -> str:
    if name not in truth:
        return ""
    return f"{truth[name]:.4f}" + (f" since {since[name]:.1f} s" if name in since else "")


def show_faults(verdict: FaultVerdict) -> None:
    """Print the faults that the fault monitor would have reported in flight."""
    from rich.console import Console  # noqa: PLC0415

    style = "bold yellow" if verdict.episodes else "dim"
    for sentence in verdict.sentences:
        Console().print(f"faults: {sentence}", style=style, highlight=False, soft_wrap=True)
