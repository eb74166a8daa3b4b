"""The autopilots that have an adapter."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from sysid_node.flight.autopilots.base import Adapter
from sysid_node.flight.autopilots.mavros import Mavros
from sysid_node.flight.autopilots.px4 import Px4
from sysid_node.flight.autopilots.rosflight import Rosflight

ADAPTERS: Mapping[str, type[Adapter]] = MappingProxyType({"px4": Px4, "mavros": Mavros, "rosflight": Rosflight})
