"""Declares a node's parameters to ROS, and keeps wrong values out; by default those of the identifier."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rclpy import Parameter as RosParameter
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node

from sysid_node.errors import InputError
from sysid_node.ros.parameters import LIVE, PARAMETERS, Parameter, check


def declare(
    node: Node, table: Sequence[Parameter] = PARAMETERS, check: Callable[[Mapping[str, Any]], None] = check
) -> None:
    """Declare all parameters. Raises InputError on one whose type or value was overridden wrongly."""
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


def values_of(node: Node, table: Sequence[Parameter] = PARAMETERS) -> dict[str, Any]:
    """All parameters' values."""
    return {parameter.name: node.get_parameter(parameter.name).value for parameter in table}


def refusal(node: Node, state: str, changes: Iterable[RosParameter]) -> str:
    """Why parameters cannot be changed so, in the lifecycle state; empty where they can."""
    ours = {change.name: change.value for change in changes if any(p.name == change.name for p in PARAMETERS)}
    fixed = sorted(ours.keys() - LIVE)
    if fixed and state != "unconfigured":
        return f"{fixed[0]} takes effect when the node is configured; it is {state}: deactivate and clean it up first"
    try:
        check(values_of(node) | ours)
    except InputError as error:
        return str(error)
    return ""


def _descriptor(parameter: Parameter) -> ParameterDescriptor:
    unit = f" [{parameter.unit}]" if parameter.unit else ""
    descriptor = ParameterDescriptor(
        description=f"{parameter.meaning}{unit} Default: {parameter.default}. Change: {parameter.change}",
        additional_constraints=parameter.constraint,
    )
    if isinstance(parameter.default, float):
        descriptor.floating_point_range = [FloatingPointRange(from_value=parameter.lower, to_value=parameter.upper)]
    return descriptor


def _warn_of_unknown(node: Node, table: Sequence[Parameter]) -> None:
    """A misspelt parameter would otherwise be ignored without a word."""
    known = [parameter.name for parameter in table]
    for name in node._parameter_overrides:
        if name in known or node.has_parameter(name) or name.startswith("qos_overrides."):
            continue
        near = difflib.get_close_matches(name, known, n=1)
        meant = f"; did you mean {near[0]!r}?" if near else ""
        node.get_logger().warning(f"parameter {name!r} is not known and has no effect{meant}")
