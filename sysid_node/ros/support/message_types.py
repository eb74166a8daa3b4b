"""The fields of ROS's message classes, as ``flight.bag.message_types.definitions_of`` gives them for bags."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from importlib import import_module
from typing import Any

from rosidl_parser.definition import AbstractNestedType, AbstractString, BasicType, NamespacedType
from rosidl_parser.definition import Array as FixedArray

from sysid_node.flight.cdr.layout import NUMBERS, Array, Kind, Part, String

#: IDL's names of numbers -> those of message definitions, where they differ.
_IDL = {"boolean": "bool", "octet": "byte", "double": "float64", "float": "float32"}


@cache
def fields_of(msgtype: str) -> Sequence[tuple[str, Kind]]:
    """The fields of a message type; a ``flight.cdr.layout.Definitions``."""
    kind = _class_of(msgtype)
    return [(name, _kind(slot)) for name, slot in zip(kind.get_fields_and_field_types(), kind.SLOT_TYPES, strict=True)]


def _class_of(msgtype: str) -> Any:
    package, _, name = msgtype.partition("/msg/")
    return getattr(import_module(f"{package}.msg"), name)


def _kind(slot: Any) -> Kind:
    if isinstance(slot, AbstractNestedType):
        return Array(_kind(slot.value_type), slot.size if isinstance(slot, FixedArray) else None)
    if isinstance(slot, AbstractString):
        return String()
    if isinstance(slot, NamespacedType):
        return Part("/".join(slot.namespaced_name()))
    assert isinstance(slot, BasicType)
    return NUMBERS[_IDL.get(slot.typename, slot.typename)]
