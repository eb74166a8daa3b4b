"""``sysid convert``: a log becomes a bag that reads back as the same flight."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from mavros_bag import OUTPUTS, mavros_bag
from simulated_logs import aircraft as simulated
from simulated_logs import dataflash_log, px4_log

from sysid_node.aircraft.dump import dump_aircraft
from sysid_node.aircraft.load import load_aircraft
from sysid_node.cli.main import main
from sysid_node.flight.bag.reader import read_streams
from sysid_node.flight.csv import read_csv, write_csv
from sysid_node.flight.logs.opening import load_flight_record
from sysid_node.flight.record import FlightRecord

BAG = Path(__file__).resolve().parents[3] / "bags" / "cdrw_multistep"


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


@pytest.mark.parametrize(
    ("kind", "options", "said"),
    [
        ("csv", ["--joints", OUTPUTS], "--joints is for a log or a bag of an autopilot; FILE is a CSV table; leave it"),
        ("csv", ["--autopilot", "px4"], "--autopilot is for a bag of an autopilot's topics; FILE is a CSV table"),
        ("ulg", ["--autopilot", "px4"], "--autopilot is for a bag of an autopilot's topics; FILE is a PX4 ULog"),
        ("ulg", ["--air-temperature", "15"], "--air-temperature is for a bag of an autopilot's topics; FILE is a PX4"),
        ("csv", ["--air-data-delay", "0"], "--air-data-delay is for a bag of an autopilot's topics; FILE is a CSV"),
        (
            "own",
            ["--joints", OUTPUTS],
            "--joints is for a log or a bag of an autopilot; FILE is a bag of our own topics",
        ),
        (
            "own",
            ["--air-data-delay", "0.1"],
            "--air-data-delay is for a bag of an autopilot's topics; FILE is a bag of",
        ),
        ("mavros", ["--joints", OUTPUTS, "--topic", "imu/data:=/mavros/imu/data"], "--joints is for a log or a bag of"),
        ("ulg", ["--topic", "imu/data:=/imu"], "--topic is for bags of ROS 2; FILE is a PX4 ULog; leave it out"),
        ("csv", ["--topic", "imu/data:=/imu"], "--topic is for bags of ROS 2; FILE is a CSV table; leave it out"),
        ("mavros", ["--joints", "a=out99:0:1"], "--joints: 'a=out99:0:1': no output 'out99'; expected out1 to out32"),
        (
            "mavros",
            ["--aircraft", "cdrw", "--joints", "elevater=out2:1500:0.001"],
            "--joints: 'elevater=out2:1500:0.001': aircraft cdrw has no joint 'elevater'; did you mean 'elevator'?",
        ),
    ],
)
def test_options_that_cannot_act_are_refused(log, tmp_path, capsys, kind, options, said):
    make = {
        "csv": lambda: log,
        "own": lambda: BAG,
        "ulg": lambda: tmp_path / "log.ulg",
        "mavros": lambda: tmp_path / "m",
    }
    path = make[kind]()
    if kind == "ulg":
        px4_log(path)
    elif kind == "mavros":
        mavros_bag(path, seconds=2.0)
    assert main(["convert", str(path), "--out", str(tmp_path / "bag"), *options]) == 2
    assert said.replace("FILE", str(path)) in capsys.readouterr().err
    assert not (tmp_path / "bag").exists()


@pytest.mark.parametrize("command", ["check", "replay", "identify", "gap"])
def test_every_command_refuses_topics_of_a_log(log, tmp_path, capsys, command):
    options = [] if command == "check" else ["--aircraft", "cdrw", "--out", str(tmp_path / "out"), "--quiet"]
    options += ["--method", "equation_error"] if command == "identify" else []
    dataflash_log(tmp_path / "flight.bin")
    for path, what in ((log, "CSV table"), (tmp_path / "flight.bin", "ArduPilot DataFlash log")):
        assert main([command, str(path), *options, "--topic", "imu/data:=/my/imu"]) == 2
        assert f"--topic is for bags of ROS 2; {path} is a {what}; leave it out" in capsys.readouterr().err


def test_axes_of_a_log_are_known(log, tmp_path, capsys):
    for command in (["check"], ["replay", "--aircraft", "cdrw", "--out", str(tmp_path / "out"), "--quiet"]):
        main([command[0], str(log), *command[1:], "--body-frame", "frd"])
        said = f"warning: --body-frame is for bags of our own topics; {log} is a CSV table, whose axes are known"
        assert capsys.readouterr().err.count(said) == 1


@pytest.mark.parametrize(
    ("outputs", "said"),
    [
        ("elevator=out2:1500", "aircraft cdrw: outputs: 'elevator=out2:1500' is not NAME=OUTPUT:TRIM:SCALE"),
        ("elevator=servo2:0:0.4", "aircraft cdrw: outputs: 'elevator=servo2:0:0.4': no output 'servo2'; expected out1"),
        ("elevater=out2:0:0.4", "aircraft cdrw: outputs: 'elevater=out2:0:0.4': aircraft cdrw has no joint 'elevater'"),
    ],
)
@pytest.mark.parametrize("command", ["convert", "replay"])
def test_wrong_outputs_are_named_by_their_key(tmp_path, capsys, command, outputs, said):
    dataflash_log(tmp_path / "flight.bin")
    text = dump_aircraft(dataclasses.replace(simulated(), outputs=outputs))
    (tmp_path / "aircraft.yaml").write_text(text, encoding="utf-8")
    options = ["--aircraft", str(tmp_path / "aircraft.yaml"), "--out", str(tmp_path / "out"), "--quiet"]
    assert main([command, str(tmp_path / "flight.bin"), *options]) == 2
    assert said in capsys.readouterr().err
