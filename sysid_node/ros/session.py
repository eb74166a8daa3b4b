"""One identification, from messages to the estimates to publish; what the node does, without ROS."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence

from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.align import flat
from sysid_node.online import estimator, intake
from sysid_node.online.settings import Settings
from sysid_node.online.types import Estimates
from sysid_node.ros.monitor import Durations


class Session:
    """Aligns messages, updates the estimator at every sample, and estimates at the publish rate.

    Estimates fall due at multiples of the period in the time of the data, not of the clock on the wall: the first
    sample at or past k / rate gives one. So a replay of the same messages gives the same estimates.
    """

    def __init__(self, aircraft: Aircraft, settings: Settings, publish_rate: float) -> None:
        self.aircraft = aircraft
        self.settings = settings
        self.publish_rate = publish_rate  # Hz
        self.update_times = Durations()
        self.reset()

    def reset(self) -> None:
        """Forget all messages and estimates."""
        self.state = estimator.init(self.aircraft, self.settings)
        self.intake = intake.init(self.aircraft, self.settings.max_gap)
        self.samples = 0
        self._due = 1

    @property
    def rejected(self) -> dict[str, int]:
        """Messages left out: ``"<topic>: <reason>"`` -> count."""
        return flat(self.intake.rejected)

    def stamp_ns(self, moment: float) -> int:
        """The header stamp of the sample at ``moment`` s."""
        return intake.stamp_of(self.intake, moment)

    @property
    def estimates(self) -> Estimates:
        """What is known now."""
        return estimator.estimate(self.state)

    def imu(self, stamp_ns: int, values: tuple[float, ...]) -> list[Estimates]:
        """Take an IMU message: specific force (m/s^2) and rates (rad/s), FRD. Returns the estimates fallen due."""
        return self._take(intake.on_imu(self.intake, stamp_ns, values))

    def air_data(self, stamp_ns: int, values: tuple[float, ...]) -> list[Estimates]:
        """Take an air data message: true airspeed (m/s), flow angles (rad), air density (kg/m^3)."""
        return self._take(intake.on_air_data(self.intake, stamp_ns, values))

    def actuators(self, stamp_ns: int, names: Sequence[str], positions: Sequence[float]) -> list[Estimates]:
        """Take joint positions: rad, throttle 0..1 or N."""
        return self._take(intake.on_actuators(self.intake, stamp_ns, names, positions))

    def _take(self, samples: Iterable[tuple[float, Sequence[float]]]) -> list[Estimates]:
        due = []
        for moment, sample in samples:
            start = time.perf_counter()
            estimator.update(self.state, moment, sample)
            self.update_times.add(time.perf_counter() - start)
            self.samples += 1
            if moment >= self._due / self.publish_rate:
                due.append(self.estimates)
                while moment >= self._due / self.publish_rate:
                    self._due += 1
        return due
