"""Messages that came in since they were last asked for, as plain numbers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple


class FlightNews(NamedTuple):
    """Messages of the input topics, each with its stamp (ns). SI and radians, body axes forward-right-down.

    ``imu``: specific force, rates, and roll, pitch, heading (NaN = not given), nine numbers; ``air``: airspeed, angle
    of attack, sideslip, density; ``joints``: positions by name.
    """

    imu: list[tuple[int, tuple[float, ...]]]
    air: list[tuple[int, tuple[float, ...]]]
    joints: list[tuple[int, Mapping[str, float]]]
