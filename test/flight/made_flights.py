"""Made-up aircraft and message streams that several tests share; no physics, only plausible numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
from rosbags.typesys.store import Typestore

from sysid_node.aircraft.model import Aircraft, Control, Derivative, Geometry, Inertia, ReferenceCondition, Throttle
from sysid_node.flight.streams import AirDataStream, ImuStream, JointStream, Streams, arrivals_in_stamp_order

JOINTS = ("throttle", "elevator", "left", "right", "rudder", "flap")


def made_aircraft() -> Aircraft:
    """Two ailerons on one control, offsets and scales that are not round, throttle 0..1."""
    return Aircraft(
        name="made",
        source="made up",
        mass=2.0,
        inertia=Inertia(0.1, 0.15, 0.2, 0.01),
        geometry=Geometry(0.4, 1.5, 0.28),
        reference=ReferenceCondition(18.0, 1.19),
        controls={
            "elevator": Control("elevator", "de", {"elevator": 1.1}, 0.013),
            "aileron": Control("aileron", "da", {"left": -0.45, "right": 0.55}),
            "rudder": Control("rudder", "dr", {"rudder": -1.0}, -0.007),
        },
        derivatives={"Cm_0": Derivative(0.01), "Cm_alpha": Derivative(-0.6), "Cm_de": Derivative(-0.9)},
        throttle=Throttle("throttle", 30.0),
    )


def made_streams(seconds: float = 2.0, seed: int = 0, start_s: float = 100.0) -> Streams:
    """IMU 200 Hz, air data 100 Hz, joints 50 Hz with jitter and dropped messages; some densities not measured."""
    rng = np.random.default_rng(seed)

    def stamps(rate: float) -> np.ndarray:
        count = int(seconds * rate)
        jittered = start_s + (np.arange(count) + rng.uniform(-0.3, 0.3, count)) / rate
        return np.round(jittered[rng.random(count) > 0.02] * 1e9).astype(np.int64)

    times = [stamps(rate) for rate in (200.0, 100.0, 50.0)]
    imu, air, joints = arrivals_in_stamp_order(*times)
    density = np.where(rng.random(len(air)) < 0.1, np.nan, 1.2)
    return Streams(
        ImuStream(
            imu,
            np.column_stack([rng.normal(0, 3, (len(imu), 3)), rng.normal(0, 0.5, (len(imu), 3))]),
            rng.uniform(-1.2, 1.2, (len(imu), 3)),
            "imu",
        ),
        AirDataStream(air, np.column_stack([rng.normal(18, 1, len(air)), rng.normal(0, 0.1, (len(air), 2)), density])),
        JointStream(joints, JOINTS, np.column_stack([rng.random(len(joints)), rng.normal(0, 0.1, (len(joints), 5))])),
        "made flight",
    )


def header(store: Typestore, frame_id: str) -> Any:
    """A std_msgs/Header with a stamp of zero, as rosbags has it."""
    return store.types["std_msgs/msg/Header"](store.types["builtin_interfaces/msg/Time"](0, 0), frame_id)
