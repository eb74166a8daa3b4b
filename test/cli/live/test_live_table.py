"""The live table says what is known, what is not, and what it should be."""

import io
import math

from rich.console import Console

from sysid_node.cli.live.live_table import LiveStatus, ReferenceValues, live_table
from sysid_node.online.types import DerivativeEstimate, Estimates

NAMES = ("CL_alpha", "Cm_q", "Cl_p", "Cn_r", "CY_beta")
ESTIMATES = Estimates(
    12.0,
    {
        "CL_alpha": DerivativeEstimate("CL_alpha", 3.0, 0.1, 2.8, 3.2, True, "ok"),
        "Cm_q": DerivativeEstimate("Cm_q", -2.0, 0.1, -2.2, -1.8, True, "ok"),
        "Cl_p": DerivativeEstimate("Cl_p", 0.4, 0.5, -0.6, 1.4, False, "collinear with r"),
        "Cn_r": DerivativeEstimate("Cn_r", math.nan, math.inf, -math.inf, math.inf, False, "converging"),
    },
    {},
)


def shown(estimates: Estimates | None, width: int, height: int | None = None, seconds: float = 12.0) -> list[str]:
    """The table's lines without colours."""
    console = Console(width=width, record=True, file=io.StringIO())
    moment = LiveStatus("cdrw, a flight", seconds, 60.0, "imu/data 200 Hz", estimates)
    reference = ReferenceValues("true", {"CL_alpha": 3.1, "Cm_q": -1.0, "Cl_p": 0.2})
    console.print(live_table(moment, NAMES, reference, width, height))
    return console.export_text().splitlines()


def row(lines: list[str], name: str) -> str:
    return next(line for line in lines if f" {name} " in line)


def test_every_derivative_has_its_row() -> None:
    lines = shown(ESTIMATES, 100)
    assert row(lines, "CL_alpha").split() == ["CL_alpha", "+3.0000", "+2.8000", "to", "+3.2000", "+3.1000", "✓", "ok"]
    assert row(lines, "Cm_q").split()[-2:] == ["✗", "ok"]
    assert row(lines, "Cl_p").split()[-4:] == ["+0.2000", "collinear", "with", "r"], "no judgement of what is not valid"
    assert row(lines, "Cn_r").split() == ["Cn_r", "converging"]
    assert row(lines, "CY_beta").split() == ["CY_beta"]
    assert "12.0 of 60 s" in lines[0]
    assert "2 valid" in lines[0]


def test_halves_stand_side_by_side_where_there_is_room() -> None:
    assert "Cl_p" in row(shown(ESTIMATES, 200), "CL_alpha")
    assert "Cl_p" not in row(shown(ESTIMATES, 100), "CL_alpha")


def test_halves_come_by_turns_where_a_terminal_is_too_low_for_both() -> None:
    assert len(shown(ESTIMATES, 100)) == 9
    for seconds, here, there in ((12.0, "Cm_q", "Cl_p"), (15.0, "Cl_p", "Cm_q")):
        lines = shown(ESTIMATES, 100, height=9, seconds=seconds)
        assert row(lines, here) and not any(f" {there} " in line for line in lines)
        assert len(lines) < 9
    assert row(shown(ESTIMATES, 100, height=10), "Cl_p") and row(shown(ESTIMATES, 100, height=10), "Cm_q")


def test_before_anything_is_known() -> None:
    lines = shown(None, 100)
    assert row(lines, "CL_alpha").split() == ["CL_alpha", "+3.1000"]
    assert "0 valid" in lines[0]
