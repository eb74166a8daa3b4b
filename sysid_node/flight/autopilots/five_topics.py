"""An autopilot with five topics: IMU, attitude, static pressure, airspeed and outputs."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping
from typing import Any, ClassVar

from sysid_node.flight.autopilots.base import Adapter, AirSample, ImuSample, JointSample, Sample


class FiveTopics(Adapter):
    """``parts`` are the topics of IMU, attitude, static pressure, airspeed and outputs."""

    parts: ClassVar[tuple[str, str, str, str, str]]

    def listeners(self) -> Mapping[str, Callable[[Any], Sample | None]]:
        """See ``Adapter``."""
        ours = (self._imu, self._attitude, self._pressure, self._air, self._joints)
        return dict(zip(self.parts, ours, strict=True))

    @abstractmethod
    def _imu(self, message: Any) -> ImuSample: ...

    @abstractmethod
    def _attitude(self, message: Any) -> None: ...

    @abstractmethod
    def _pressure(self, message: Any) -> None: ...

    @abstractmethod
    def _air(self, message: Any) -> AirSample: ...

    @abstractmethod
    def _joints(self, message: Any) -> JointSample: ...
