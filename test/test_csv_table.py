"""CSV tables: floats come back to the last bit, and what is empty is as asked for."""

import csv
import math
from pathlib import Path

import pytest

from sysid_node.csv_table import write_table


def test_floats_read_back_as_the_same_bits(tmp_path: Path) -> None:
    numbers = [0.1, 1 / 3, 1e-300, -2.5e17]
    write_table(tmp_path / "table.csv", ["x"], [[x] for x in numbers])
    with (tmp_path / "table.csv").open(newline="") as file:
        assert [float(row["x"]) for row in csv.DictReader(file)] == numbers


@pytest.mark.parametrize(("blank", "cells"), [(True, ",,1.0"), (False, "nan,,1.0")])
def test_nan_is_an_empty_cell_only_where_asked_for(tmp_path: Path, blank: bool, cells: str) -> None:
    write_table(tmp_path / "table.csv", ["a", "b", "c"], [[math.nan, None, 1.0]], blank_nan=blank)
    assert (tmp_path / "table.csv").read_text() == f"a,b,c\n{cells}\n"


def test_a_table_without_rows_is_its_header_or_no_file(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    write_table(path, ["x"], [])
    assert path.read_text() == "x\n"
    write_table(path, ["x"], [], keep_empty=False)
    assert not path.exists()
