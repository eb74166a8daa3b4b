"""``sysid convert``: a log becomes a bag that reads back as the same flight."""

import dataclasses

import numpy as np
import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.cli.main import main
from sysid_node.flight.bag.reader import read_streams
from sysid_node.flight.csv import read_csv, write_csv
from sysid_node.flight.logs.opening import load_flight_record
from sysid_node.flight.record import FlightRecord


@pytest.fixture
def log(tmp_path):
    rng = np.random.default_rng(1)
    names = ("ax", "ay", "az", "p", "q", "r", "phi", "theta", "psi", "alpha", "beta", "de", "da", "dr")
    columns = {name: rng.uniform(-0.3, 0.3, 100) for name in names}
    columns |= {"V": rng.uniform(15, 20, 100), "thrust": rng.uniform(1, 9, 100)}
    write_csv(tmp_path / "log.csv", FlightRecord(np.arange(100) / 50.0, columns))
    return tmp_path / "log.csv"


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
@pytest.mark.parametrize("frame", ["flu", "frd"])
def test_the_flight_comes_back(log, tmp_path, capsys, storage, frame):
    aircraft, out = load_aircraft("cdrw"), tmp_path / "bag"
    assert main(["convert", str(log), "--out", str(out), "--storage", storage, "--body-frame", frame]) == 0
    assert "2.0 s, 100 samples; joints elevator, aileron, rudder, throttle" in capsys.readouterr().out
    # cdrw's throttle goes from 0 to 1; the log's joint carries newtons
    in_newton = dataclasses.replace(aircraft, throttle=dataclasses.replace(aircraft.throttle, max_thrust=None))
    back, flight = load_flight_record(out, in_newton, frame=frame), read_csv(log)
    for name, values in flight.columns.items():
        np.testing.assert_allclose(back[name], values, atol=1e-9)


def test_with_an_aircraft_its_joints_are_used(log, tmp_path, capsys):
    out = tmp_path / "bag"
    assert main(["convert", str(log), "--aircraft", "cdrw", "--out", str(out), "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")
    aircraft, flight = load_aircraft("cdrw"), read_csv(log)
    joints = read_streams(out).actuators
    throttle = joints.positions[:, joints.names.index(aircraft.throttle.joint)]
    np.testing.assert_allclose(throttle * aircraft.throttle.max_thrust, flight["thrust"])
    np.testing.assert_allclose(load_flight_record(out, aircraft)["thrust"], flight["thrust"])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("t,ax\n0,1\n1,2\n", "no values in ay, az, p, q, r, V"),
        ("t,ax\n0,x\n", "line 2, column 'ax'"),
        ("", "no column"),
    ],
)
def test_bad_logs_are_one_line(tmp_path, capsys, text, said):
    (tmp_path / "log.csv").write_text(text)
    assert main(["convert", str(tmp_path / "log.csv"), "--out", str(tmp_path / "bag")]) == 2
    err = capsys.readouterr().err
    assert said in err
    assert len([line for line in err.splitlines() if "warning:" not in line]) == 1
    assert not (tmp_path / "bag").exists()


def test_an_existing_bag_is_kept(log, tmp_path, capsys):
    arguments = ["convert", str(log), "--out", str(tmp_path / "bag"), "--quiet"]
    assert main(arguments) == 0
    before = sorted((p.name, p.read_bytes()) for p in (tmp_path / "bag").iterdir())
    assert main(arguments) == 2
    assert "exists already" in capsys.readouterr().err
    assert sorted((p.name, p.read_bytes()) for p in (tmp_path / "bag").iterdir()) == before
