"""The folder of a diagnosis: ``gap.json``, tables, the corrected aircraft, the surrogate of a simulator, the report."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from sysid_node.aircraft.dump import dump_aircraft
from sysid_node.csv_table import write_table
from sysid_node.errors import InputError
from sysid_node.gap.correction import corrected_aircraft, effect_options
from sysid_node.gap.diagnose import Diagnosis
from sysid_node.gap.document import document
from sysid_node.gap.reflying import InSimulator, reflown_content
from sysid_node.report.files.gap_flights import FLIGHTS, write_flights
from sysid_node.report.pages.gap_page import write_gap_report

#: Folder in the results' that holds the finished steps of an interrupted diagnosis.
UNFINISHED = "unfinished"

#: The model of the user's simulator as an aircraft file, where it was identified from simulated flights.
SURROGATE = "surrogate.yaml"


#: Folder in the results' that holds the user's simulator's model with the correction.
CORRECTED_SIMULATOR = "corrected_simulator"


def write_gap(folder: Path, found: Diagnosis, flown: InSimulator | None = None, warnings: Sequence[str] = ()) -> None:
    """Writes gap.json, the tables, corrected.yaml, effects.txt and report.html. Raises InputError.

    ``flown`` is what the correction does in the user's simulator, whose corrected model is written as well.
    ``warnings`` are those about the flights, for the report.
    """
    content = {**document(found), **({} if flown is None else {"reflown": reflown_content(flown)})}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        text = json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False)
        (folder / "gap.json").write_text(text + "\n", encoding="utf-8")
        write_table(folder / "where.csv", ["station", "axis", "share"],
                   [[w["station"], w["axis"], w["share"]] for w in found.where])  # fmt: skip
        write_table(folder / "candidates.csv", ["effect", "probability", "share"],
                   [list(candidate.values()) for candidate in content["candidates"]])  # fmt: skip
        (folder / "corrected.yaml").write_text(dump_aircraft(corrected_aircraft(found)), encoding="utf-8")
        if found.surrogate:
            (folder / SURROGATE).write_text(dump_aircraft(found.surrogate.aircraft), encoding="utf-8")
        (folder / "effects.txt").write_text("".join(f"--effect {e}\n" for e in effect_options(found)), encoding="utf-8")
        write_flights(folder / FLIGHTS, found)
        if flown is not None:
            flown.write_model(found, folder / CORRECTED_SIMULATOR)
        write_gap_report(folder / "report.html", found, flown, warnings)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written ({error.strerror}); give another folder as --out") from None
