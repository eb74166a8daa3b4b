"""A flight recorded behind the adapter, or before it, replays to the estimates that were made in flight."""

from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer

from sysid_node.aircraft.load import load_aircraft
from sysid_node.api import load, replay
from sysid_node.cli.main import main
from sysid_node.errors import InputError
from sysid_node.flight.autopilots.base import AdapterSettings, AirSample, ImuSample
from sysid_node.flight.autopilots.px4 import AIRSPEED, IMU, MOTORS, SERVOS, Px4
from sysid_node.flight.autopilots.recorded import LoggedSample, read_recorded, streams_of_samples
from sysid_node.flight.bag.reader import read_streams
from sysid_node.flight.bag.writer import write_streams
from sysid_node.online.session import Session
from sysid_node.online.settings import OnlineSettings as Estimator

JOINTS = "elevator=servo2:0:0.4 aileron=servo1:0:0.4 rudder=servo3:0:0.4 throttle=motor1:0:1"
CHANNELS = {"aileron": 0, "elevator": 1, "rudder": 2}
SECONDS = 11.0
BAG = Path(__file__).resolve().parents[3] / "bags" / "cdrw_multistep"


def px4_messages(make) -> list:
    """``(log_ns, topic, message)`` of the bundled flight's first seconds, as PX4 would have sent them."""
    flight = read_streams(BAG)
    end = flight.imu.arrival.stamp_ns[0] + SECONDS * 1e9
    out = []

    def add(arrival, i, topic, **fields) -> None:
        if arrival.stamp_ns[i] < end:
            message = make(Px4.topics[topic], timestamp=int(arrival.stamp_ns[i]) // 1000, **fields)
            out.append((int(arrival.order[i]), int(arrival.log_ns[i]), topic, message))

    for i, row in enumerate(flight.imu.values.astype(np.float32)):
        add(flight.imu.arrival, i, IMU, accelerometer_m_s2=row[:3], gyro_rad=row[3:])
    for i, row in enumerate(flight.air_data.values):
        add(flight.air_data.arrival, i, AIRSPEED, true_airspeed_m_s=row[0], airspeed_source=1)
    joints = {name: flight.actuators.positions[:, i] for i, name in enumerate(flight.actuators.names)}
    for i in range(len(flight.actuators.arrival)):
        servos, motors = np.zeros(8, np.float32), np.zeros(12, np.float32)
        servos[list(CHANNELS.values())] = [joints[name][i] / 0.4 for name in CHANNELS]
        motors[0] = joints["throttle"][i]
        add(flight.actuators.arrival, i, MOTORS, control=motors)
        add(flight.actuators.arrival, i, SERVOS, control=servos)
    return [message[1:] for message in sorted(out, key=lambda one: one[0])]


def write(path: Path, store, messages, storage: StoragePlugin = StoragePlugin.MCAP) -> Path:
    with Writer(path, version=9, storage_plugin=storage) as writer:
        topics = {t: writer.add_connection(t, k, typestore=store) for t, k in Px4.topics.items()}
        for log_ns, topic, message in messages:
            writer.write(topics[topic], log_ns, store.serialize_cdr(message, Px4.topics[topic]))
    return path


def bits(estimates) -> list:
    """Every number so that equality is to the last bit, NaN included."""
    return [
        (d.name, *(x.hex() for x in (d.value, d.standard_error, d.lower, d.upper)), d.status)
        for d in estimates.derivatives.values()
    ]


@pytest.fixture(scope="module")
def messages(make) -> list:
    return px4_messages(make)


@pytest.fixture(scope="module")
def said(messages) -> list[LoggedSample]:
    """What the adapter makes of them."""
    adapter = Px4(AdapterSettings(joints=JOINTS))
    heard = [(order, log_ns, adapter.hear(topic, message)) for order, (log_ns, topic, message) in enumerate(messages)]
    return [LoggedSample(order, log_ns, sample) for order, log_ns, sample in heard if sample is not None]


def estimated(logged: list[LoggedSample]) -> list:
    """The estimates at 5 Hz that the identifier makes of samples as they come."""
    session = Session(load_aircraft("cdrw"), Estimator(), 5.0)
    estimates = []
    for _, _, sample in logged:
        if isinstance(sample, ImuSample):
            estimates += session.imu(sample.stamp_ns, (*sample.force, *sample.rates))
        elif isinstance(sample, AirSample):
            flow = sample.true_airspeed, sample.angle_of_attack, sample.sideslip, sample.air_density
            estimates += session.air_data(sample.stamp_ns, flow)
        else:
            estimates += session.actuators(sample.stamp_ns, sample.names, sample.positions)
    return [due.estimates for due in estimates]


def with_vanes(logged: list[LoggedSample]) -> list[LoggedSample]:
    """Flow angles from vanes that the autopilot knows nothing of: here those of the bundled flight."""
    flow = iter(read_streams(BAG).air_data.values[:, 1:3].tolist())
    angles = ("angle_of_attack", "sideslip")
    return [
        one._replace(sample=one.sample._replace(**dict(zip(angles, next(flow), strict=True))))
        if isinstance(one.sample, AirSample)
        else one
        for one in logged
    ]


@pytest.mark.slow
@pytest.mark.parametrize("vanes", [True, False])
def test_a_bag_of_what_the_adapter_said_replays_to_the_same(said, tmp_path, vanes: bool) -> None:
    logged = with_vanes(said) if vanes else said
    live = estimated(logged)
    write_streams(tmp_path / "bag", streams_of_samples(logged, "flight"))
    replayed = replay(load(tmp_path / "bag", "cdrw"), {"publish_rate": 5.0}).history
    assert len(replayed) == len(live) > 50
    assert [bits(one) for one in replayed] == [bits(one) for one in live]
    if vanes:
        assert all(d.valid for d in live[-1].derivatives.values() if d.name in ("Cm_alpha", "Cm_de", "CL_alpha"))


@pytest.mark.parametrize("storage", [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
def test_a_bag_of_the_autopilots_own_topics_converts_to_the_same(messages, said, store, tmp_path, storage) -> None:
    bag = write(tmp_path / "own", store, messages, storage)
    options = ["--autopilot", "px4", "--joints", JOINTS, "--quiet"]
    assert main(["convert", str(bag), "--out", str(tmp_path / "ours"), *options]) == 0
    back, direct = read_streams(tmp_path / "ours"), streams_of_samples(said, "flight")
    np.testing.assert_array_equal(back.imu.values, direct.imu.values)
    np.testing.assert_array_equal(back.air_data.values, direct.air_data.values)
    np.testing.assert_array_equal(back.actuators.positions, direct.actuators.positions)
    for topic, stream in direct.by_topic.items():
        np.testing.assert_array_equal(back.by_topic[topic].arrival.stamp_ns, stream.arrival.stamp_ns)
        np.testing.assert_array_equal(np.argsort(back.by_topic[topic].arrival.order), np.arange(len(stream.arrival)))
    assert back.actuators.names == ("elevator", "aileron", "rudder", "throttle")


def test_what_is_wrong_is_said_in_a_line(messages, store, tmp_path, capsys) -> None:
    adapter = Px4(AdapterSettings(joints=JOINTS))
    imu_alone = write(tmp_path / "imu", store, [m for m in messages[:200] if m[1] == IMU])
    for bag, words in (
        (BAG, "none of the autopilot's topics in it; expected /fmu/out/sensor_combined"),
        (tmp_path / "missing", "bag missing: cannot be read"),
        (imu_alone, "no messages on air_data"),
    ):
        with pytest.raises(InputError) as error:
            read_recorded(bag, adapter)
        assert words in str(error.value)
        assert "\n" not in str(error.value)
    for options, words in (((), "joints is empty"), (("--air-temperature", "288"), "288.0: expected -60 to 60")):
        assert main(["convert", str(BAG), "--out", str(tmp_path / "out"), "--autopilot", "px4", *options]) == 2
        assert words in capsys.readouterr().err
