"""``replay`` and ``identify`` take logs of autopilots and recordings of topics as they are.

``test/test_api.py`` gives both of them a table.
"""

import json
from dataclasses import replace

import pytest
from mavros_bag import OUTPUTS, mavros_bag
from simulated_logs import aircraft, dataflash_log, px4_log

from sysid_node.aircraft.dump import dump_aircraft
from sysid_node.cli.main import main

ALWAYS = {"aoa": (99.0, 99.0), "slip": (99.0, 99.0)}


def made(kind, folder):
    """A flight's file, and the aircraft file that reads it."""
    known = aircraft()
    path = folder / {"ulg": "flight.ulg", "bin": "flight.bin", "mavros": "flight"}[kind]
    if kind == "ulg":
        px4_log(path, vanes=ALWAYS)
    elif kind == "bin":
        dataflash_log(path)
    else:
        mavros_bag(path, seconds=12.0)
        known = replace(known, outputs=OUTPUTS)
    (folder / "aircraft.yaml").write_text(dump_aircraft(known), encoding="utf-8")
    return path


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["ulg", "bin", "mavros"])
def test_replay_takes(tmp_path, kind):
    """The pitching moment of the elevator, which every one of these records shows, is estimated with its sign."""
    path, out = made(kind, tmp_path), tmp_path / "out"
    options = ["--aircraft", str(tmp_path / "aircraft.yaml"), "--out", str(out), "--quiet"]
    assert main(["replay", str(path), *options, "--set", "publish_rate=1"]) == 0
    estimate = derivatives(out)["Cm_de"]
    assert estimate["lower"] < estimate["upper"] < 0.0


@pytest.mark.slow
def test_identify_takes_a_log(tmp_path):
    path, out = made("ulg", tmp_path), tmp_path / "out"
    options = ["--aircraft", str(tmp_path / "aircraft.yaml"), "--out", str(out), "--quiet"]
    assert main(["identify", str(path), *options, "--method", "equation_error"]) == 0
    estimate = derivatives(out)["Cm_de"]
    assert estimate["lower"] < estimate["upper"] < 0.0


def derivatives(folder):
    return json.loads((folder / "summary.json").read_text(encoding="utf-8"))["derivatives"]
