"""The tables of parameters of the loop's nodes agree with their settings and with the files that users read."""

from dataclasses import fields
from types import ModuleType

import pytest
import yaml
from harness import ROOT

from sysid_node.cli.live import markers, viewing
from sysid_node.control.settings import ControllerSettings as Control
from sysid_node.excite.exciter_settings import ExcitationSettings
from sysid_node.faults.settings import FaultMonitorSettings as Faults
from sysid_node.parameter import BODY_FRAME, annotated_yaml, check_each
from sysid_node.ros import adaptive_controller, exciter, fault_monitor
from sysid_node.ros.support import simulated_flight
from sysid_node.ros.support.loop_node import EFFECT

NODES = [adaptive_controller, exciter, fault_monitor, simulated_flight]


@pytest.mark.parametrize("node", NODES, ids=lambda node: node.__name__)
def test_shipped_file_is_the_table(node: ModuleType) -> None:
    name = node.__name__.rpartition(".")[2].replace("simulated_flight", "flight_simulator")
    text = (ROOT / "config" / f"{name}.yaml").read_text(encoding="utf-8")
    assert text == annotated_yaml(name, node.PARAMETERS, EFFECT)
    values = yaml.safe_load(text)["/**"]["ros__parameters"]
    assert values == {parameter.name: parameter.default for parameter in node.PARAMETERS}
    check_each(node.PARAMETERS, values)


@pytest.mark.parametrize(("name", "program"), [("markers", markers), ("view", viewing)])
def test_shipped_file_of_a_program_is_its_table(name: str, program: ModuleType) -> None:
    text = (ROOT / "config" / f"{name}.yaml").read_text(encoding="utf-8")
    assert text == annotated_yaml(name, program.PARAMETERS, "They take effect when the program starts.")


@pytest.mark.parametrize("node", [adaptive_controller, exciter, fault_monitor, markers, viewing])
def test_every_reader_of_imu_messages_is_told_their_axes(node: ModuleType) -> None:
    assert BODY_FRAME in node.PARAMETERS


@pytest.mark.parametrize("node", NODES, ids=lambda node: node.__name__)
def test_every_parameter_is_explained(node: ModuleType) -> None:
    for parameter in node.PARAMETERS:
        assert parameter.meaning.endswith("."), parameter.name
        assert parameter.change.endswith("."), parameter.name


def test_every_setting_is_a_parameter_with_the_same_default() -> None:
    values = {parameter.name: parameter.default for parameter in adaptive_controller.PARAMETERS}
    assert {field.name for field in fields(Control)} <= values.keys()
    assert Control.from_mapping(values) == Control()
    names = {parameter.name for parameter in exciter.PARAMETERS}
    assert {field.name for field in fields(ExcitationSettings)} <= names
    assert {field.name for field in fields(Faults)} <= {parameter.name for parameter in fault_monitor.PARAMETERS}
