"""What reading and writing messages costs: a bag of 600 s (240,000 messages), and single messages as in flight.

A bag is read to columns of numbers in three ways: rosbags' deserialisation message by message; rosbags' raw messages,
decoded one by one by ``MessageReader``; rosbags' raw messages, decoded together (``read_streams``, what the program
does). In flight, ``MessageReader`` stands against rclpy's deserialisation into objects, and the template of estimates
against rclpy's objects and serialisation.

    python -m bench.speed.read [--seconds 600] [--repeat 3]
"""

from __future__ import annotations

import argparse
import tempfile
import timeit
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag2 import Reader

from bench.speed.replay import best, deserialise, make_streams
from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import Sensors
from sysid_node.flight.bag.message_types import definitions_of, type_store
from sysid_node.flight.bag.reader import read_streams
from sysid_node.flight.bag.writer import write_streams
from sysid_node.flight.cdr.layout import Definitions
from sysid_node.flight.cdr.message_reader import MessageReader
from sysid_node.flight.live.messages import ATTITUDE_PATHS, PATHS
from sysid_node.flight.topics import ACTUATORS, AIR_DATA, IMU, INPUT_TOPICS

READ = {**PATHS, IMU: ATTITUDE_PATHS}
NAMES, VALUES = [f"Cm_{i}" for i in range(27)], np.linspace(-1.0, 1.0, 27)


def readers(definitions: Definitions) -> dict[str, MessageReader]:
    """A reader of single messages for each input topic."""
    return {topic: MessageReader(definitions, INPUT_TOPICS[topic], *paths) for topic, paths in READ.items()}


def raw_messages(bag: Path) -> None:
    """rosbags' own loop over the messages, without a look into them."""
    with Reader(bag) as reader:
        for _ in reader.messages():
            pass


def one_by_one(bag: Path) -> None:
    """All numbers of the input topics by ``MessageReader``."""
    of_topic = readers(definitions_of(type_store()))
    rows: dict[str, list[tuple[Any, ...]]] = {topic: [] for topic in of_topic}
    with Reader(bag) as reader:
        for connection, _, raw in reader.messages():
            topic = connection.topic.lstrip("/")
            rows[topic].append(of_topic[topic].read(raw)[0])
    for numbers in rows.values():
        np.array(numbers)


def measure_bags(seconds: float, repeat: int) -> None:
    """Time to read a bag in both storages; the last column is relative to rosbags' deserialisation."""
    streams = make_streams(replace(load_aircraft("cdrw"), sensors=Sensors()), seconds)
    ways: dict[str, Callable[[Path], object]] = {
        "rosbags: deserialised message by message": deserialise,
        "raw messages of rosbags, not decoded": raw_messages,
        "raw messages, decoded one by one": one_by_one,
        "raw messages, decoded together: the program": read_streams,
    }
    for storage in ("sqlite3", "mcap"):
        with tempfile.TemporaryDirectory() as folder:
            bag = Path(folder) / "bag"
            write_streams(bag, streams, storage)
            print(f"{storage}: {seconds:g} s, {sum(len(s.arrival) for s in streams.by_topic.values())} messages")
            times = {name: best(partial(read, bag), repeat) for name, read in ways.items()}
        reference = next(iter(times.values()))
        for name, taken in times.items():
            print(f"  {name:52} {taken:6.2f} s  {taken / reference:5.2f}")


def microseconds(work: Callable[[], object], repeat: int, number: int = 300) -> float:
    """The shortest mean time of one call."""
    return 1e6 * min(timeit.repeat(work, number=number, repeat=repeat)) / number


def measure_messages(repeat: int) -> None:
    """Single messages; the last column is relative to rclpy."""
    from rclpy.serialization import deserialize_message, serialize_message  # noqa: PLC0415
    from sensor_msgs.msg import Imu, JointState  # noqa: PLC0415
    from sysid_msgs.msg import AirData, DerivativeEstimate, DerivativeEstimates  # noqa: PLC0415

    import sysid_node.ros  # noqa: F401, PLC0415
    from sysid_node.online.estimates.serialisation import EstimatesSerialiser  # noqa: PLC0415
    from sysid_node.online.types import DerivativeEstimate as Derivative  # noqa: PLC0415
    from sysid_node.online.types import Estimates, FitQuality  # noqa: PLC0415
    from sysid_node.ros.support.message_types import fields_of  # noqa: PLC0415

    print("one message: rclpy, then the program")
    of_topic = readers(fields_of)
    joints = JointState(name=["elevator", "aileron", "rudder", "throttle"], position=[0.1, 0.2, 0.3, 0.4])
    for topic, message in ((IMU, Imu()), (AIR_DATA, AirData()), (ACTUATORS, joints)):
        raw, kind = serialize_message(message), type(message)
        pair = (
            microseconds(lambda raw=raw, kind=kind: deserialize_message(raw, kind), repeat),
            microseconds(lambda raw=raw, topic=topic: of_topic[topic].read(raw), repeat),
        )
        print(f"  read {topic:47} {pair[0]:6.1f} us {pair[1]:6.1f} us  {pair[1] / pair[0]:5.2f}")

    derivatives = {n: Derivative(n, v, 0.1, v, v, True, "ok") for n, v in zip(NAMES, VALUES.tolist(), strict=True)}
    estimates = Estimates(1.0, derivatives, {"Cm": FitQuality("Cm", 0.9, 0.01, 30.0, 99)})
    serialiser = EstimatesSerialiser(fields_of, "cdrw", "sls_rft")

    def by_rclpy() -> bytes:
        rows = [DerivativeEstimate(**d._asdict()) for d in estimates.derivatives.values()]
        return serialize_message(DerivativeEstimates(aircraft="cdrw", method="sls_rft", derivatives=rows))

    pair = microseconds(by_rclpy, repeat), microseconds(lambda: serialiser.one(estimates, 1, "imu"), repeat)
    print(f"  write {'27 estimates':46} {pair[0]:6.1f} us {pair[1]:6.1f} us  {pair[1] / pair[0]:5.2f}")


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--repeat", type=int, default=3)
    args = parser.parse_args()
    measure_bags(args.seconds, args.repeat)
    measure_messages(args.repeat)


if __name__ == "__main__":
    main()
