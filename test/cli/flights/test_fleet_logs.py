"""``sysid fleet`` of a folder of mixed logs that say themselves whose they are and of which day."""

import csv
import datetime
import json
from pathlib import Path

import pytest
from short_bags import short_bag
from simulated_logs import BAG, aircraft, dataflash_log, px4_log

from sysid_node.aircraft.dump import dump_aircraft
from sysid_node.cli.main import main

MAY = datetime.datetime(2026, 5, 3, 9, 30, tzinfo=datetime.UTC)
JUNE = datetime.datetime(2026, 6, 3, 9, 30, tzinfo=datetime.UTC)


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of a PX4 log, an ArduPilot log, a bag and a log without a date, all of the same flight."""
    folder = tmp_path_factory.mktemp("logs")
    (folder / "12").mkdir()
    px4_log(folder / "one.ulg", start=MAY, vehicle="000200000000383330")
    dataflash_log(folder / "two.bin", start=JUNE, board="CubeOrange 003B0034 30395104 37393833")
    px4_log(folder / "12" / "no_date.ulg")
    short_bag(BAG.name, 24.0, folder).rename(folder / "12" / "bag")
    (folder / "aircraft.yaml").write_text(dump_aircraft(aircraft()))
    given = ["fleet", str(folder), "--out", str(folder / "out"), "--workers", "1", "--quiet"]
    assert main([*given, "--frequencies", "0.2:0.2:2.0"]) == 0
    return folder / "out"


@pytest.mark.slow
def test_each_log_says_its_day_and_its_aircraft(out: Path) -> None:
    found = json.loads((out / "fleet.json").read_text())
    flights = {f["flight"]: (f["tail"], f["date"][:10]) for f in found["flights"]}
    assert flights == {
        "one.ulg": ("000200000000383330", "2026-05-03"),
        "two.bin": ("003B00343039510437393833", "2026-06-03"),
        "12/bag": ("12", "2026-01-01"),
    }
    (refusal,) = found["refusals"]
    assert refusal["flight"] == "12/no_date.ulg"
    assert "write its date into the catalogue" in refusal["reason"]


@pytest.mark.slow
def test_the_same_flight_gives_the_same_derivatives_from_every_log(out: Path) -> None:
    """The two autopilots' logs hold the same 20 s of the bag, rounded and sampled differently.

    Their stamps are rounded differently as well, and the lateness that they show counts as systematic.
    """
    with (out / "estimates.csv").open() as file:
        rows = {(row["flight"], row["derivative"]): row for row in csv.DictReader(file)}
    for name in ("Cm_alpha", "Cm_de", "Cl_p", "Cl_da"):
        one, two, bag = (rows[flight, name] for flight in ("one.ulg", "two.bin", "12/bag"))
        assert float(one["value"]) == pytest.approx(float(two["value"]), abs=0.1 * float(one["standard_error"]))
        assert float(one["value"]) == pytest.approx(float(bag["value"]), abs=float(one["standard_error"]))
