"""``sysid replay``: the live functions on a bag, the files it leaves, and one line for whatever is wrong."""

import csv
import dataclasses
import json
import warnings
from dataclasses import replace

import numpy as np
import pytest
from made_flights import JOINTS, made_aircraft, made_streams
from rosbags.rosbag2 import Reader
from short_bags import short_bag

from sysid_node.aircraft.dump import dump_aircraft
from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import LookupTable, UncertainValue
from sysid_node.api import load, replay
from sysid_node.api.replaying import replay_settings
from sysid_node.cli.flights.verdicts import refusals_tried
from sysid_node.cli.main import main
from sysid_node.cli.shared.options import settings_of
from sysid_node.errors import InputError, InputWarning
from sysid_node.flight.bag.message_types import type_store
from sysid_node.flight.bag.reader import read_streams
from sysid_node.flight.bag.writer import write_streams
from sysid_node.flight.streams import Arrival
from sysid_node.online import estimator
from sysid_node.online.alignment import streaming
from sysid_node.online.alignment.schedule import Schedule, due
from sysid_node.online.estimates import published
from sysid_node.online.session import Session
from sysid_node.online.settings import OnlineSettings

AIRCRAFT = made_aircraft()
LINES = {"frequencies": (0.2, 0.2, 2.0)}
SETTINGS = OnlineSettings.from_mapping(LINES)
KEYS = {"aircraft", "method", "data_seconds", "samples", "rejected", "settings", "derivatives", "fits", "holdout"}


@pytest.fixture(scope="module")
def flight():
    return made_streams(12.0)


@pytest.fixture(scope="module")
def bag(tmp_path_factory, flight):
    path = tmp_path_factory.mktemp("replay") / "flight"
    write_streams(path, flight)
    return path


@pytest.fixture(scope="module")
def replayed(bag, tmp_path_factory):
    """The replay of the bag in one piece, and the folder of its files."""
    done, folder = replay(load(bag, AIRCRAFT), LINES, at_once=10**9), tmp_path_factory.mktemp("replayed") / "out"
    done.save(folder)
    return done, folder


@pytest.fixture
def arguments(tmp_path, bag):
    """Of a replay of the bag into a new folder."""
    (tmp_path / "made.yaml").write_text(dump_aircraft(AIRCRAFT))
    aircraft, out = str(tmp_path / "made.yaml"), str(tmp_path / "out")
    return ["replay", str(bag), "--aircraft", aircraft, "--out", out, "--frequencies", "0.2:0.2:2.0"]


def one_by_one(path, settings, rate):
    """The live node's loop: each message through the intake, each sample into the estimator."""
    streams = read_streams(path)
    state, taken, schedule = (
        estimator.init(AIRCRAFT, settings),
        streaming.init(AIRCRAFT, settings.max_gap),
        Schedule(rate),
    )
    imu, air, joints = streams.imu, streams.air_data, streams.actuators
    calls = [
        *((streaming.on_imu, imu.arrival, i, (tuple(v),)) for i, v in enumerate(imu.values.tolist())),
        *((streaming.on_air_data, air.arrival, i, (tuple(v),)) for i, v in enumerate(air.values.tolist())),
        *(
            (streaming.on_actuators, joints.arrival, i, (list(JOINTS), v))
            for i, v in enumerate(joints.positions.tolist())
        ),
    ]
    history = []
    for on_message, arrival, i, values in sorted(calls, key=lambda call: call[1].order[call[2]]):
        for time, sample, wait in on_message(taken, int(arrival.stamp_ns[i]), *values):
            estimator.update(state, time, sample)
            if due(schedule, time, wait):
                history.append((streaming.stamp_of(taken, time), published.estimate(state)))
    return history


def bits(known):
    """Everything that estimates say, as text that shows every bit."""
    rows = (*known.derivatives.values(), *known.fits.values(), *known.servos.values())
    return [known.time.hex(), *map(repr, rows)]


@pytest.mark.parametrize("rate", [20.0, 3.0])
def test_a_replay_is_the_live_run_to_the_last_bit(bag, rate):
    done = replay(load(bag, AIRCRAFT), LINES | {"publish_rate": rate}, judge_faults=False)
    live = one_by_one(bag, SETTINGS, rate)
    assert len(done.history) == len(live) > 10
    assert done.stamps_ns.tolist() == [stamp for stamp, _ in live]
    for ours, (_, theirs) in zip(done.history, live, strict=True):
        assert bits(ours) == bits(theirs)


def test_a_file_that_states_errors_and_delays_gives_the_same_live_and_in_a_replay(tmp_path, bag, flight):
    """To the last bit, in pieces; and another than a silent file, in which all else is the same."""
    effects = {
        "vane_scale": {"alpha": UncertainValue(0.1, 0.01)},
        "airspeed_scale": {"error": UncertainValue(0.05, 0.01)},
        "imu_misalignment": {"pitch": UncertainValue(0.02, 0.001)},
        "imu_lever_arm": {"z": UncertainValue(0.03, 0.001)},
        "stall_separation": {"depth": UncertainValue(0.5)},
    }
    delays = {**AIRCRAFT.delays, "imu": UncertainValue(0.02, 0.001), "air_data": UncertainValue(0.05, 0.002)}
    aircraft = replace(AIRCRAFT, effects=effects, delays=delays)
    done = replay(load(bag, aircraft), LINES | {"publish_rate": 10.0}, judge_faults=False, at_once=701)
    live = flown(Session(aircraft, SETTINGS, 10.0), flight, flight.actuators.positions)
    assert [bits(one) for one in done.history] == [bits(one) for one in live]
    assert len(live) > 50
    silent = replay(load(bag, AIRCRAFT), LINES | {"publish_rate": 10.0}, judge_faults=False)
    assert bits(silent.final) != bits(done.final)
    assert any("do not correct for stall_separation" in remark for remark in done.run.remarks)
    assert not any("do not correct for" in remark for remark in silent.run.remarks)


@pytest.mark.slow
@pytest.mark.parametrize("at_once", [97, 1500])
def test_a_replay_in_pieces_is_the_whole_one(bag, replayed, tmp_path, at_once):
    """Files as bytes: estimates over time as a bag, tables, faults and what is drawn."""
    _, whole = replayed
    replay(load(bag, AIRCRAFT), LINES, at_once=at_once).save(tmp_path / "pieces")
    files = sorted(f.relative_to(whole) for f in whole.rglob("*") if f.is_file())
    assert len(files) >= 8
    for file in files:
        assert (tmp_path / "pieces" / file).read_bytes() == (whole / file).read_bytes(), file


def flown(session, streams, joints):
    """The estimates of the node's session that hears the messages in their order."""
    calls = [
        *((session.imu, streams.imu, i, (tuple(v),)) for i, v in enumerate(streams.imu.values.tolist())),
        *((session.air_data, streams.air_data, i, (tuple(v),)) for i, v in enumerate(streams.air_data.values.tolist())),
        *((session.actuators, streams.actuators, i, (JOINTS, v)) for i, v in enumerate(joints.tolist())),
    ]
    live = []
    for take, stream, i, values in sorted(calls, key=lambda call: call[1].arrival.order[call[2]]):
        live += [due.estimates for due in take(int(stream.arrival.stamp_ns[i]), *values)]
    return live


@pytest.mark.parametrize("carried", ["auto", "commands"])
def test_commands_are_followed_in_flight_as_in_a_replay(tmp_path, flight, carried):
    """Joints that jump are commands; from then on, servos of the file follow, and the estimator begins anew."""
    lags = {"elevator": UncertainValue(0.04), "aileron": UncertainValue(0.02), "damping": UncertainValue(0.7)}
    aircraft = replace(AIRCRAFT, effects={"actuator_lag": lags, "command_delay": {"rudder": UncertainValue(0.03)}})
    steps = flight.actuators.positions.copy()
    steps[:, 1:] = 0.05 * ((np.arange(len(steps)) // 40) % 2)[:, None]
    streams = replace(flight, actuators=replace(flight.actuators, positions=steps))
    write_streams(tmp_path / "steps", streams)
    told = LINES | {"actuators": carried, "publish_rate": 10.0}
    done = replay(load(tmp_path / "steps", aircraft), told, judge_faults=False, at_once=701)
    live = flown(Session(aircraft, replace(SETTINGS, actuators=carried), 10.0), streams, steps)
    assert [bits(one) for one in done.history] == [bits(one) for one in live]
    assert set(done.final.servos) == {"elevator"}  # the model's only control
    assert done.run.settings["actuators_carry"] == "commands"
    assert (done.commands_from > done.samples.last[0][0]) == (carried == "auto")
    assert any("elevator 40 ms" in remark for remark in done.run.remarks)


def test_files_and_summary_are_the_contracts(arguments, tmp_path, capsys):
    assert main([*arguments, "--quiet", "--set", "publish_rate=10", "--set", "settle_time=1"]) == 0
    assert capsys.readouterr() == ("", "")
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary.keys() >= KEYS
    assert summary["aircraft"] == "made"
    assert summary["settings"]["publish_rate"] == 10.0
    assert summary["settings"]["settle_time"] == 1.0
    assert summary["settings"]["frequencies"] == [0.2, 0.2, 2.0]
    assert summary["derivatives"].keys() == AIRCRAFT.derivatives.keys()
    errors = {"standard_error", "statistical_error", "systematic_error"}
    wanted = {"value", *errors, "lower", "upper", "valid", "status"}
    assert all(d.keys() == wanted for d in summary["derivatives"].values())
    assert summary["samples"] > 2000
    for name in ("report.html", "derivatives.csv", "estimates.csv", "signals.csv", "estimates/estimates.mcap"):
        assert (tmp_path / "out" / name).stat().st_size > 100


def test_the_bag_of_estimates_holds_every_one(replayed):
    (done, out), store = replayed, type_store()
    with Reader(out / "estimates") as reader:
        assert {c.topic for c in reader.connections} == {"/identifier/derivatives", "/fault_monitor/faults"}
        chosen = [c for c in reader.connections if c.topic == "/identifier/derivatives"]
        messages = [(t, store.deserialize_cdr(raw, c.msgtype)) for c, t, raw in reader.messages(chosen)]
    assert len(messages) == len(done.history)
    for (log_ns, m), known, stamp in zip(messages, done.history, done.stamps_ns.tolist(), strict=True):
        assert log_ns == m.header.stamp.sec * 10**9 + m.header.stamp.nanosec == stamp
        assert (m.aircraft, m.method, m.header.frame_id) == ("made", OnlineSettings().method, "imu")
        for told, d in zip(m.derivatives, known.derivatives.values(), strict=True):
            assert (told.name, told.status, told.valid) == (d.name, d.status, d.valid)
            ours, theirs = ([getattr(x, f) for f in ("value", "standard_error", "lower", "upper")] for x in (told, d))
            np.testing.assert_array_equal(ours, theirs)
        for told, f in zip(m.fits, known.fits.values(), strict=True):
            assert (told.coefficient, told.samples, told.r_squared) == (f.coefficient, f.samples, f.r_squared)
            assert (told.residual_std, told.degrees_of_freedom) == (f.residual_std, f.degrees_of_freedom)


def test_a_second_replay_replaces_the_first(arguments, tmp_path, capsys):
    for rate in (2, 1):
        assert main([*arguments, "--quiet", "--set", f"publish_rate={rate}"]) == 0
    with Reader(tmp_path / "out" / "estimates") as reader:
        assert {c.topic: c.msgcount for c in reader.connections}["/identifier/derivatives"] == 11
    (tmp_path / "out" / "estimates" / "mine.txt").write_text("keep me")
    assert main([*arguments, "--quiet"]) == 2
    assert "holds mine.txt, which sysid replay did not write" in capsys.readouterr().err
    assert (tmp_path / "out" / "estimates" / "mine.txt").read_text() == "keep me"


def test_it_shows_the_estimates_and_the_truth_beside_the_bag(arguments, tmp_path, bag, flight, capsys):
    own = tmp_path / "own"
    write_streams(own, flight)
    (tmp_path / "own.truth.json").write_text(json.dumps({"derivatives": {"Cm_alpha": -0.4242}}))
    assert main(["replay", str(own), *arguments[2:]]) == 0
    captured = capsys.readouterr()
    assert "-0.4242" in captured.out
    assert "report.html" in captured.out
    assert "faults: no faults were looked for: the flight is too short" in captured.out
    with (tmp_path / "out" / "derivatives.csv").open() as file:
        assert {row["name"]: row["truth"] for row in csv.DictReader(file)}["Cm_alpha"] == "-0.4242"


def test_frame_and_topics_are_options(arguments, replayed, tmp_path, flight):
    write_streams(tmp_path / "frd", flight, "sqlite3", "frd")
    options = ["--body-frame", "frd", "--topic", "air_data:=/air_data", "--quiet"]
    assert main(["replay", str(tmp_path / "frd"), *arguments[2:], *options]) == 0
    frd, flu = (json.loads((out / "summary.json").read_text()) for out in (tmp_path / "out", replayed[1]))
    assert frd["derivatives"] == flu["derivatives"]


@pytest.mark.slow
def test_what_failed_in_flight_is_in_the_terminal_the_summary_and_the_report(tmp_path, capsys):
    """The elevator of this flight loses half its effect at 30 s; the report drawn anew from the files says the same."""
    out = tmp_path / "out"
    flight = ["replay", str(short_bag("cdrw_failed_elevator", 40.0, tmp_path)), "--aircraft", "cdrw"]
    assert main([*flight, "--out", str(out), "--set", "publish_rate=2"]) == 0
    terminal = capsys.readouterr().out
    assert "faults: elevator: loss of effectiveness, " in terminal
    assert "-0.2303 since 30.0 s" in terminal  # half of the file's Cm_de
    found = json.loads((out / "summary.json").read_text())["faults"]
    (fault,) = found["found"]
    assert (fault["kind"], fault["part"], fault["until"]) == ("loss of effectiveness", "elevator", None)
    assert fault["lower"] <= 0.5 <= fault["upper"]
    assert 30.0 < fault["found"] < 36.0
    with Reader(out / "estimates") as reader:
        chosen = [c for c in reader.connections if c.topic == "/fault_monitor/faults"]
        said = [type_store().deserialize_cdr(raw, c.msgtype) for c, _, raw in reader.messages(chosen)]
    assert len(said) >= 39  # once a second, and when it is news
    assert said[0].status == []
    assert (said[-1].status[0].name, said[-1].status[0].hardware_id) == ("fault_monitor: elevator", "cdrw")
    assert {pair.key: pair.value for pair in said[-1].status[0].values}["size"] == f"{fault['size']:.6g}"
    with (out / "derivatives.csv").open() as file:
        (row,) = (row for row in csv.DictReader(file) if row["name"] == "Cm_de")
    assert float(row["lower"]) <= float(row["truth"]) <= float(row["upper"])
    assert (row["truth"], row["truth_since"]) == ("-0.2303", "30.0")
    page = (out / "report.html").read_text()
    assert "<td>elevator: loss of effectiveness</td>" in page
    assert main(["report", str(out), "--quiet"]) == 0
    assert (out / "report.html").read_text() == page


def line_of(capsys, arguments) -> str:
    assert main(arguments) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert captured.err.startswith("sysid replay: ")
    return captured.err


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--set", "windoww=3"], "'windoww' is not known"),
        (["--set", "window"], "'window': expected KEY=VALUE"),
        (["--set", "window=-3"], "window -3.0: expected"),
        (["--set", "publish_rate=0"], "publish_rate = '0': expected 0.01 to 1000 Hz"),
        (["--set", "publish_rate=fast"], "publish_rate = 'fast'"),
        (["--frequencies", "1:2"], "frequencies = '1:2': expected START:STEP:STOP"),
        (["--topic", "imu:=x"], "'imu' is none of imu/data"),
        (["--topic", "imu/data:=/none"], "no topic /none"),
        (["--aircraft", "nonesuch"], "'nonesuch' is not known"),
    ],
)
def test_wrong_options_are_one_line(arguments, capsys, options, said):
    assert said in line_of(capsys, [*arguments, *options])


def replaced(flight, topic, **fields):
    return dataclasses.replace(flight, **{topic: dataclasses.replace(getattr(flight, topic), **fields)})


def test_what_is_wrong_with_a_bag_is_one_line(arguments, tmp_path, flight, capsys):
    joints, air = flight.actuators, flight.air_data
    later = Arrival(air.arrival.stamp_ns + 10**12, air.arrival.log_ns, air.arrival.order)
    cases = {
        "degrees": (replaced(flight, "actuators", positions=joints.positions * 57.3 + 3), "joint 'elevator' over pi/2"),
        "joint": (
            replaced(flight, "actuators", names=("a", "b", *joints.names[2:])),
            "no joint 'elevator'; they have 'a'",
        ),
        "apart": (replaced(flight, "air_data", arrival=later), "header stamps do not overlap"),
    }
    for name, (streams, said) in cases.items():
        write_streams(tmp_path / name, streams)
        assert said in line_of(capsys, ["replay", str(tmp_path / name), *arguments[2:]])
        assert not (tmp_path / "out").exists()


def test_an_out_that_is_a_file(arguments, tmp_path, capsys):
    (tmp_path / "out").write_text("mine")
    assert main([*arguments, "--quiet"]) == 2
    assert "out" in capsys.readouterr().err
    assert (tmp_path / "out").read_text() == "mine"


def test_settings_from_texts():
    texts = ["window = 12", "publish_rate=5", "detect_changes=false"]
    settings, rate = replay_settings(settings_of(texts, "0.1:0.1:1", "window=20"))
    assert (settings.window, settings.detect_changes, settings.frequencies, rate) == (12.0, False, (0.1, 0.1, 1.0), 5.0)
    with pytest.raises(InputError):
        replay_settings(settings_of(["="], None, "window=20"))


@pytest.mark.slow
def test_every_parameter_of_the_node_is_taken(arguments, tmp_path, capsys):
    """Axes as by the option, what matters in flight alone with a warning, and one line where a value is wrong."""
    assert main([*arguments, "--quiet", "--set", "body_frame=flu", "--set", "stale_after=2"]) == 0
    assert "setting stale_after = '2' changes nothing in a replay" in line_of_warning(capsys)
    for given, said in (("body_frame=ned", "expected flu or frd"), ("aircraft=cdrw", "give it as --aircraft")):
        assert said in line_of(capsys, [*arguments, "--set", given])


def line_of_warning(capsys):
    """The one line on stderr."""
    (line,) = capsys.readouterr().err.splitlines()
    return line


def test_faulty_messages_are_counted_in_the_summary(arguments, tmp_path, flight):
    values = flight.air_data.values.copy()
    values[100:103, 0] = np.nan
    write_streams(tmp_path / "faulty", replaced(flight, "air_data", values=values))
    assert main(["replay", str(tmp_path / "faulty"), *arguments[2:], "--quiet"]) == 0
    rejected = json.loads((tmp_path / "out" / "summary.json").read_text())["rejected"]
    assert rejected["air_data: true_airspeed not measured"] == 3


def test_a_real_flight_through_the_two_commands(tmp_path, flights, capsys):
    """Twin Otter 018, converted and replayed: Cm_alpha as SIDPAC's recursive transform finds it, -1.466 (.018)."""
    aircraft = {
        "name": "twin_otter",
        "ideal": True,  # SIDPAC takes all but noise as exact, too
        "mass": 4944.0,
        "inertia": {"Ixx": 28353.0, "Iyy": 32910.0, "Izz": 52168.0, "Ixz": 1528.0},
        "geometry": {"S": 39.250, "b": 19.810, "cbar": 1.980},
        "reference": {"airspeed": 72.0, "air_density": 1.03},
        "controls": {"elevator": {"joint": "elevator"}, "throttle": {"joint": "throttle", "unit": "newton"}},
        "derivatives": {f"Cm_{name}": {"value": 0.0} for name in ("0", "alpha", "q", "de")},
    }
    (tmp_path / "twin.yaml").write_text(json.dumps(aircraft))
    bag, out = str(tmp_path / "bag"), tmp_path / "out"
    assert main(["convert", str(flights / "twin_otter_018.csv"), "--out", bag, "--quiet"]) == 0
    options = ["--frequencies", "0.1:0.04:1.5", "--set", "settle_time=0", "--quiet"]
    assert main(["replay", bag, "--aircraft", str(tmp_path / "twin.yaml"), "--out", str(out), *options]) == 0
    found = json.loads((out / "summary.json").read_text())
    assert found["samples"] == 401
    assert found["rejected"] == {}
    assert found["derivatives"]["Cm_alpha"]["value"] == pytest.approx(-1.466, abs=2 * 0.018)


@pytest.mark.slow
def test_derivatives_are_estimated_on_top_of_the_files_tables(tmp_path):
    """A flight of ``sysid simulate`` without noise; without the tables these are 20 % off and more.

    The file states that all else is exact: eleven seconds do not tell an air-data lag from other derivatives.
    """
    plain = dataclasses.replace(load_aircraft("cdrw"), ideal=True)
    bends = (-0.1, 0.05, 0.1, 0.3)
    lift = LookupTable("CL", ("alpha",), (bends,), (0.2, 0.0, -0.05, -0.4))
    both = ((-0.05, -0.02, -0.1), (0.0, 0.0, -0.05), (0.03, 0.0, -0.06), (0.2, 0.1, 0.0))
    pitch = LookupTable("Cm", ("alpha", "de"), (bends, (-0.3, 0.0, 0.3)), both)
    bent = tmp_path / "bent.yaml"
    bent.write_text(dump_aircraft(dataclasses.replace(plain, tables=(lift, pitch))))
    flown = ["--noise", "0", "--rate", "100", "--duration", "11", "--manoeuvre", "3211:elevator:amplitude=0.05:start=1"]
    flown += ["--manoeuvre", "3211:elevator:amplitude=0.07:start=5"]
    assert main(["simulate", "--aircraft", str(bent), "--out", str(tmp_path / "bag"), *flown]) == 0
    assert main(["replay", str(tmp_path / "bag"), "--aircraft", str(bent), "--out", str(tmp_path / "out")]) == 0
    found = json.loads((tmp_path / "out" / "summary.json").read_text())["derivatives"]
    for name in ("CL_alpha", "Cm_alpha", "Cm_de"):
        assert found[name]["value"] == pytest.approx(plain.derivatives[name].value, rel=0.05), name


@pytest.mark.slow
def test_a_reading_that_stands_still_is_warned_of(tmp_path):
    """Sideslip that is always zero, as a driver leaves it that has no vane."""
    still = read_streams(short_bag("cdrw_multistep", 15.0, tmp_path))
    still.air_data.values[:, 2] = 0.0
    write_streams(tmp_path / "still", still)
    with pytest.warns(InputWarning, match=r"still: sideslip: no change for 10 s.* not measured must be NaN"):
        found = replay(load(tmp_path / "still", "cdrw"), judge_faults=False)
    assert {d.status for d in found.final.derivatives.values()} == {"stale input"}


def test_an_air_density_that_was_not_recorded_is_warned_of(tmp_path):
    """Truth: two flights that differ in nothing else; one density that was measured is enough for no warning."""
    thin = read_streams(short_bag("cdrw_multistep", 12.0, tmp_path))
    thin.air_data.values[1:, 3] = np.nan
    write_streams(tmp_path / "once", thin)
    thin.air_data.values[0, 3] = np.nan
    write_streams(tmp_path / "never", thin)
    said = r"never: no air density was recorded; the aircraft file's 1\.\d+ kg/m\^3 is taken"
    with pytest.warns(InputWarning, match=said):
        replay(load(tmp_path / "never", "cdrw"), judge_faults=False)
    with pytest.warns(InputWarning, match=said):
        load(tmp_path / "never", "cdrw").aligned(0.2)
    with warnings.catch_warnings(record=True) as other:
        replay(load(tmp_path / "once", "cdrw"), judge_faults=False)
        load(tmp_path / "once", "cdrw").aligned(0.2)
    assert not [one for one in other if "air density" in str(one.message)]


@pytest.mark.slow
def test_an_imu_that_is_interrupted_every_second_is_warned_of(tmp_path):
    """Truth: a quarter of every second is missing, and nothing can be estimated from what is left."""
    whole = read_streams(short_bag("cdrw_multistep", 20.0, tmp_path))
    kept = (whole.imu.arrival.stamp_ns - whole.imu.arrival.stamp_ns[0]) % 1_000_000_000 >= 250_000_000
    arrival = Arrival(*(getattr(whole.imu.arrival, name)[kept] for name in ("stamp_ns", "log_ns", "order")))
    imu = replace(whole.imu, arrival=arrival, values=whole.imu.values[kept], attitude=whole.imu.attitude[kept])
    write_streams(tmp_path / "holed", replace(whole, imu=imu))
    with pytest.warns(InputWarning, match=r"holed: \d+ interruptions of up to 0\.2. s .*set max_gap \(0\.2 s\) to"):
        found = replay(load(tmp_path / "holed", "cdrw"), judge_faults=False)
    assert {d.status for d in found.final.derivatives.values()} == {"converging"}
    assert len(found.warnings) == 1 and found.warnings[0] in found.run.remarks
    counted = found.warnings[0].partition(" s in ")[0]
    with pytest.warns(InputWarning, match=counted):  # before replaying
        assert refusals_tried(tmp_path / "holed", load_aircraft("cdrw"))["replay"] == ""
