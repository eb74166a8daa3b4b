"""Declares a table of parameters to ROS and refuses wrong values."""

from __future__ import annotations

import difflib
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rclpy import Parameter as RosParameter
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node

from sysid_node.errors import InputError
from sysid_node.given_values import fits, given_values
from sysid_node.parameter import NodeParameter

Check = Callable[[Mapping[str, Any]], None]  # raises InputError on wrong values


def declare(node: Node, table: Sequence[NodeParameter], check: Check) -> None:
    """Declare all parameters. Raises InputError where the user gave one of them a wrong type or value."""
    refuse_mistyped(sys.argv[1:], node.get_fully_qualified_name(), table)
    for parameter in table:
        try:
            node.declare_parameter(parameter.name, parameter.default, _descriptor(parameter))
        except (InvalidParameterTypeException, InvalidParameterValueException):
            given = node._parameter_overrides[parameter.name]
            kind = given.type_.name.lower().replace("_", " ")
            raise InputError(
                f"parameter {parameter.name} = {given.value!r} ({kind}): expected {parameter.expected}"
            ) from None
    check(values_of(node, table))
    _warn_of_unknown(node, table)


def refuse_mistyped(arguments: Sequence[str], full_name: str, table: Sequence[NodeParameter]) -> None:
    """Raise InputError where a value given in ``arguments`` to the node (``/namespace/name``) has a wrong type."""
    known = {parameter.name: parameter for parameter in table}
    for name, value, source in given_values(arguments, full_name):
        if name in known and not fits(value, known[name].default):
            kind = "string" if isinstance(value, str) else type(value).__name__.replace("int", "integer")
            raise InputError(f"parameter {name} = {value!r} ({kind}): expected {known[name].expected}; given {source}")


def values_of(node: Node, table: Sequence[NodeParameter]) -> dict[str, Any]:
    """The values of all parameters by name."""
    return {parameter.name: node.get_parameter(parameter.name).value for parameter in table}


def refusal(
    node: Node,
    table: Sequence[NodeParameter],
    live: frozenset[str],
    changes: Iterable[RosParameter],
    check: Check,
    fixed_because: str = "",
) -> str:
    """Why parameters cannot be changed like this; empty where they can.

    Those that are not ``live`` are refused for the reason ``fixed_because``, unless that is empty.
    """
    ours = {change.name: change.value for change in changes if any(p.name == change.name for p in table)}
    fixed = sorted(ours.keys() - live)
    if fixed and fixed_because:
        return f"{fixed[0]} takes effect {fixed_because}"
    try:
        check(values_of(node, table) | ours)
    except InputError as error:
        return str(error)
    return ""


def _descriptor(parameter: NodeParameter) -> ParameterDescriptor:
    unit = f" [{parameter.unit}]" if parameter.unit else ""
    descriptor = ParameterDescriptor(
        description=f"{parameter.meaning}{unit} Default: {parameter.default}. Change: {parameter.change}",
        additional_constraints=parameter.constraint,
    )
    if isinstance(parameter.default, float):
        descriptor.floating_point_range = [FloatingPointRange(from_value=parameter.lower, to_value=parameter.upper)]
    return descriptor


def _warn_of_unknown(node: Node, table: Sequence[NodeParameter]) -> None:
    """Log a warning for each parameter that is not in the table: ROS would ignore a misspelt one silently."""
    known = [parameter.name for parameter in table]
    for name in node._parameter_overrides:
        if name in known or node.has_parameter(name) or name.startswith("qos_overrides."):
            continue
        near = difflib.get_close_matches(name, known, n=1)
        meant = f"; did you mean {near[0]!r}?" if near else ""
        node.get_logger().warning(f"parameter {name!r} is not known and has no effect{meant}")
