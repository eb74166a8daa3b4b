"""The launch files, without `launch` installed: they name executables, files and arguments that exist.

They are also run, with classes in the place of `launch`'s that keep what they are given.
"""

import ast
import re
import runpy
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
import yaml

ROOT = Path(__file__).resolve().parents[1]
FILES = sorted((ROOT / "launch").glob("*.launch.py"))
PROGRAMS = set(re.findall(r'"(\w+) = sysid_node', (ROOT / "setup.py").read_text(encoding="utf-8")))


def calls(path: Path, name: str) -> list[ast.Call]:
    """All calls of a name in a file."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return [n for n in ast.walk(tree) if isinstance(n, ast.Call) and isinstance(n.func, ast.Name) and n.func.id == name]


def first_words(path: Path, name: str) -> set[str]:
    """The first arguments that are plain text, of all calls of a name."""
    found = (call.args[0] for call in calls(path, name) if call.args)
    return {word.value for word in found if isinstance(word, ast.Constant)}


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_it_is_plain_and_uses_what_it_declares(path: Path) -> None:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    assert any(isinstance(n, ast.FunctionDef) and n.name == "generate_launch_description" for n in tree.body)
    modules = {n.module.partition(".")[0] for n in ast.walk(tree) if isinstance(n, ast.ImportFrom) and n.module}
    assert modules <= {"pathlib", "ament_index_python", "launch", "launch_ros"}
    used = first_words(path, "LaunchConfiguration") | first_words(path, "argument")
    assert used <= first_words(path, "DeclareLaunchArgument") | {"imu", "air_data", "actuators"}
    for call in calls(path, "DeclareLaunchArgument"):
        assert any(keyword.arg == "description" for keyword in call.keywords)


def test_executables_exist_and_have_a_file_of_parameters() -> None:
    text = {path.name: path.read_text(encoding="utf-8") for path in FILES}
    assert set(text) == {"identify.launch.py", "closed_loop.launch.py"}
    assert 'executable="identifier"' in text["identify.launch.py"]
    named = set(re.findall(r'described\("(\w+)"', text["closed_loop.launch.py"]))
    assert named == {"flight_simulator", "identifier", "exciter", "fault_monitor", "adaptive_controller"}
    for name in named:
        assert name in PROGRAMS
        assert (ROOT / "config" / f"{name}.yaml").is_file()


class Kept:
    """What stands for a class of `launch`: its name and what it was given."""

    def __init__(self, *words: Any, **given: Any) -> None:
        self.kind, self.words, self.given = type(self).__name__, words, given


MODULES = {
    "ament_index_python.packages": (),
    "launch": ("LaunchDescription",),
    "launch.actions": ("DeclareLaunchArgument", "ExecuteProcess", "Shutdown"),
    "launch.conditions": ("IfCondition",),
    "launch.substitutions": ("LaunchConfiguration", "PythonExpression"),
    "launch_ros.actions": ("LifecycleNode", "Node"),
    "launch_ros.parameter_descriptions": ("ParameterValue",),
}


@pytest.fixture(params=FILES, ids=lambda path: path.name)
def actions(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> list[Kept]:
    """The actions of a launch file."""
    for name, kinds in MODULES.items():
        module: Any = ModuleType(name)
        for kind in kinds:
            setattr(module, kind, type(kind, (Kept,), {}))
        module.get_package_share_directory = lambda _: str(ROOT)
        monkeypatch.setitem(sys.modules, name, module)
    described: Kept = runpy.run_path(str(request.param))["generate_launch_description"]()
    return list(described.words[0])


def test_a_node_that_ends_takes_the_others_along(actions: list[Kept]) -> None:
    """launch's ``on_exit``; without it four nodes flew on after the simulator could not start."""
    nodes = [one for one in actions if one.kind in ("Node", "LifecycleNode")]
    assert nodes
    for node in nodes:
        assert node.given["on_exit"].kind == "Shutdown"
        assert node.given["namespace"].words == ("namespace",)


def test_arguments_with_few_values_have_choices(actions: list[Kept]) -> None:
    declared = {one.words[0]: one.given for one in actions if one.kind == "DeclareLaunchArgument"}
    for name, given in declared.items():
        closed = name in ("adapt", "method", "surfaces", "turbulence", "use_sim_time", "autopilot")
        assert ("choices" in given) == closed, name
        if closed:
            assert given["default_value"] in given["choices"]


def test_values_have_the_types_of_the_nodes_tables(actions: list[Kept]) -> None:
    """A LaunchConfiguration is a text, which launch_ros would read as YAML: `speed:=2` would be an integer."""
    for node in (one for one in actions if one.kind in ("Node", "LifecycleNode")):
        file = ROOT / "config" / f"{node.given['executable']}.yaml"
        defaults = yaml.safe_load(file.read_text(encoding="utf-8"))["/**"]["ros__parameters"] | {"use_sim_time": False}
        for block in (one for one in node.given["parameters"] if isinstance(one, dict)):
            for name, value in block.items():
                kind = value.given["value_type"] if isinstance(value, Kept) else type(value)
                assert kind is type(defaults[name]), (node.given["executable"], name)


ARGUMENTS = {
    "identify.launch.py": {
        *("aircraft", "parameters", "namespace", "use_sim_time", "autopilot", "adapter_parameters", "joints"),
        *("imu", "air_data", "actuators"),
    },
    "closed_loop.launch.py": {
        *("aircraft", "namespace", "turbulence", "speed", "effects", "surfaces", "adapt", "method", "bag"),
    },
}


def test_arguments_are_those_of_the_documentation(request: pytest.FixtureRequest, actions: list[Kept]) -> None:
    name = request.node.callspec.params["actions"].name
    assert {one.words[0] for one in actions if one.kind == "DeclareLaunchArgument"} == ARGUMENTS[name]


def value(expression: Kept, given: dict[str, str]) -> Any:
    """A PythonExpression's value, as `launch` makes it: its parts put together, evaluated."""
    text = "".join(part if isinstance(part, str) else given[part.words[0]] for part in expression.words[0])
    return eval(text, {"float": float})


@pytest.mark.parametrize("actions", [ROOT / "launch" / "closed_loop.launch.py"], indirect=True)
@pytest.mark.parametrize(("speed", "simulated"), [("1.0", False), ("1", False), ("4.0", True), ("0.5", True)])
def test_at_another_speed_the_nodes_take_the_simulators_clock(actions: list[Kept], speed: str, simulated: bool) -> None:
    nodes = [one for one in actions if one.kind in ("Node", "LifecycleNode")]
    own = {node.given["name"]: node.given["parameters"][-1] for node in nodes}
    assert "use_sim_time" not in own.pop("flight_simulator"), "it makes the clock"
    assert len(own) == 4
    for given in own.values():
        assert value(given["use_sim_time"].words[0], {"speed": speed}) is simulated


@pytest.mark.parametrize("actions", [ROOT / "launch" / "closed_loop.launch.py"], indirect=True)
@pytest.mark.parametrize(
    ("namespace", "topic"), [("", "/imu/data"), ("uav1", "/uav1/imu/data"), ("/a/b/", "/a/b/imu/data")]
)
def test_what_is_recorded_is_in_the_namespace(actions: list[Kept], namespace: str, topic: str) -> None:
    recorder = next(one for one in actions if one.kind == "ExecuteProcess")
    prefix, first = next(word for word in recorder.given["cmd"] if isinstance(word, list))
    assert value(prefix, {"namespace": namespace}) + first == topic
    condition = recorder.given["condition"].words[0]
    assert value(condition, {"bag": "flight7"})
    assert not value(condition, {"bag": ""})


@pytest.mark.parametrize("actions", [ROOT / "launch" / "identify.launch.py"], indirect=True)
def test_the_adapter_is_started_where_an_autopilot_is_named(actions: list[Kept]) -> None:
    adapter = next(one for one in actions if one.given.get("executable") == "adapter")
    condition = adapter.given["condition"].words[0]
    assert value(condition, {"autopilot": "px4"})
    assert not value(condition, {"autopilot": ""})


@pytest.mark.parametrize("actions", [ROOT / "launch" / "closed_loop.launch.py"], indirect=True)
@pytest.mark.parametrize(("surfaces", "carried"), [("measured", "positions"), ("commanded", "commands")])
def test_the_identifier_is_told_what_the_actuators_carry(actions: list[Kept], surfaces: str, carried: str) -> None:
    (identifier,) = [one for one in actions if one.kind == "LifecycleNode"]
    given = identifier.given["parameters"][-1]["actuators"]
    assert value(given.words[0], {"surfaces": surfaces}) == carried
