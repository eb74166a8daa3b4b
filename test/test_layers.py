"""Imports point downwards only, ROS stays in its layer, and the online path starts light."""

import ast
import json
import re
import subprocess
import sys
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[1] / "sysid_node"

#: What each layer may import of the package, besides itself.
BELOW = {
    "aircraft": set(),
    "dynamics": {"aircraft"},
    "flight": {"aircraft", "dynamics"},
    "sim": {"aircraft", "dynamics", "flight"},
    "online": {"aircraft", "dynamics", "flight"},
    "control": {"aircraft", "dynamics", "flight", "online"},
    "batch": {"aircraft", "dynamics", "flight", "sim", "online"},
    "excite": {"aircraft", "dynamics", "flight", "sim", "online"},
    "faults": {"aircraft", "dynamics", "flight", "online"},
    "gap": {"aircraft", "dynamics", "flight", "sim", "online", "batch", "control", "excite"},
    "fleet": {"aircraft", "dynamics", "flight", "sim", "online", "batch", "gap"},
    "ros": {"aircraft", "dynamics", "flight", "sim", "online", "batch", "control", "excite", "faults", "gap", "fleet"},
}
BELOW["report"] = {*BELOW["ros"], "ros"}
BELOW["api"] = {*BELOW["report"], "report"}
BELOW["view"] = {*BELOW["report"], "report"}
BELOW["cli"] = {*BELOW["api"], "api", "view"}

#: The rooms of a layer (sub-packages and modules), lowest first: a room may import itself and those before it.
ROOMS = {
    "batch": (
        "settings", "results", "regression", "models", "likelihood", "methods", "systematic", "data_compatibility",
        "identify",
    ),
    "gap": (
        "thresholds", "flightdata", "residuals", "estimation", "instruments", "short_flights", "selection",
        "validation", "verdict", "surrogate", "diagnose", "document", "correction", "reflying",
    ),
    "control": ("settings", "types", "design", "adaptation", "inputs", "law", "controller"),
    "cli": ("shared", "live", "models", "flights", "main", "__main__"),
}  # fmt: skip

#: Modules in one folder, beside its ``__init__``.
MOST_MODULES = 14

ROS_PACKAGES = {
    "rclpy",
    "ament_index_python",
    "rosidl_runtime_py",
    "launch",
    "launch_ros",
    "rosidl_parser",
    "sysid_msgs",
}
# the last two are SciPy's own and, where it happens to be installed, what NumPy's f2py takes along
ONLINE_PACKAGES = {"numpy", "scipy", "cython_runtime", "charset_normalizer"}


def modules() -> list[Path]:
    return sorted(PACKAGE.rglob("*.py"))


@cache
def imports(path: Path) -> tuple[str, ...]:
    """Names of all modules that a file imports, inside functions too."""
    names: list[str] = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names += (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import; write the full name"
            names += (f"{node.module}.{alias.name}" for alias in node.names)
    return tuple(names)


def layer_of(path: Path) -> str:
    return path.relative_to(PACKAGE).parts[0]


def is_ros(name: str) -> bool:
    top = name.partition(".")[0]
    return top in ROS_PACKAGES or top.endswith(("_msgs", "_interfaces", "_srvs"))


@pytest.mark.parametrize("layer", sorted(p.name for p in PACKAGE.iterdir() if p.is_dir() and p.name != "__pycache__"))
def test_imports_point_downwards(layer: str) -> None:
    assert layer in BELOW, f"{layer} is no layer; say in BELOW what it may import"
    for path in (PACKAGE / layer).rglob("*.py"):
        for name in imports(path):
            parts = name.split(".")
            if parts[0] == "sysid_node" and len(parts) > 1 and (PACKAGE / parts[1]).is_dir():
                assert parts[1] in {layer, *BELOW[layer]}, f"{path.relative_to(PACKAGE)} imports {name}"


@pytest.mark.parametrize("layer", sorted(ROOMS))
def test_rooms_of_a_layer_import_in_one_direction(layer: str) -> None:
    order = ROOMS[layer]
    for path in (PACKAGE / layer).rglob("*.py"):
        room = path.relative_to(PACKAGE / layer).with_suffix("").parts[0]
        if room == "__init__":
            continue
        assert room in order, f"{layer}/{room} has no place in ROOMS"
        for name in imports(path):
            parts = name.split(".")
            if parts[:2] == ["sysid_node", layer] and len(parts) > 2 and parts[2] in order:
                assert order.index(parts[2]) <= order.index(room), f"{path.relative_to(PACKAGE)} imports {name}"


def test_no_room_holds_more_modules_than_one_can_survey() -> None:
    """But for the effects of the simulator, of which each is a module of its own."""
    counts: dict[str, int] = {}
    for path in modules():
        if path.stem != "__init__":
            room = str(path.parent.relative_to(PACKAGE))
            counts[room] = counts.get(room, 0) + 1
    assert counts.pop("sim/effects") > MOST_MODULES
    assert {room: count for room, count in counts.items() if count > MOST_MODULES} == {}


def test_no_modules_import_each_other_in_a_circle() -> None:
    parts = {path: path.relative_to(PACKAGE.parent).with_suffix("").parts for path in modules()}
    names = {".".join(part for part in words if part != "__init__"): path for path, words in parts.items()}
    graph = {}
    for name, path in names.items():
        imported = {part for full in imports(path) for part in (full, full.rpartition(".")[0])}
        graph[name] = imported & names.keys() - {name}
    try:
        list(TopologicalSorter(graph).static_order())
    except CycleError as error:
        pytest.fail(f"a circle of imports: {' -> '.join(error.args[1])}")


def test_modules_outside_layers_import_none() -> None:
    for path in PACKAGE.glob("*.py"):
        within = [name for name in imports(path) if name.startswith("sysid_node.")]
        api = {name for name in within if path.stem == "__init__" and name.startswith("sysid_node.api")}
        assert set(within) - api <= {"sysid_node.errors.InputError"}, path.name


def test_only_ros_and_above_import_ros() -> None:
    for path in modules():
        if layer_of(path) not in {"ros", "cli"}:
            assert not [name for name in imports(path) if is_ros(name)], path.relative_to(PACKAGE)


def test_what_imports_no_ros_is_not_in_ros() -> None:
    """Every module of the layer imports ROS, directly or through another module of the layer."""
    found = {
        ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts): set(imports(path))
        for path in (PACKAGE / "ros").rglob("*.py")
        if path.stem != "__init__"
    }
    with_ros = {module for module, names in found.items() if any(map(is_ros, names))}
    before: set[str] = set()
    while with_ros != before:
        before = set(with_ros)
        with_ros |= {
            m for m, names in found.items() if names & with_ros or {n.rpartition(".")[0] for n in names} & with_ros
        }
    assert found.keys() - with_ros == set()


def test_modules_directly_in_ros_are_the_programs() -> None:
    text = (PACKAGE.parent / "setup.py").read_text(encoding="utf-8")
    programs = {path.stem for path in (PACKAGE / "ros").glob("*.py")} - {"__init__", "session"}
    assert programs == set(re.findall(r'"(\w+) = sysid_node\.ros\.\1:main"', text))


def test_online_imports_numpy_and_scipy_only() -> None:
    """Directly by its own text, and in all by what is loaded once every module of the layer is."""
    paths = [path for path in (PACKAGE / "online").rglob("*.py") if path.stem != "__init__"]
    names = [".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts) for path in paths]
    program = (
        "import importlib, json, sys\n"
        "before = set(sys.modules)\n"
        f"for name in {names!r}: importlib.import_module(name)\n"
        "print(json.dumps(sorted({name.partition('.')[0] for name in set(sys.modules) - before})))"
    )
    loaded = json.loads(
        subprocess.run(
            [sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=PACKAGE.parent
        ).stdout
    )
    foreign = {name for name in loaded if name not in sys.stdlib_module_names and not name.startswith("_")}
    assert foreign <= {"sysid_node", *ONLINE_PACKAGES}


@pytest.mark.slow
def test_nodes_in_flight_need_no_library_beyond_ros_numpy_scipy_and_yaml() -> None:
    """What apt and rosdep install is enough to identify in flight: the nodes together load nothing else."""
    nodes = ", ".join(f"sysid_node.ros.{n}" for n in ("identifier", "adaptive_controller", "exciter", "fault_monitor"))
    code = f"import sys, json, {nodes}; print(json.dumps(sorted(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = {name.partition(".")[0] for name in json.loads(done.stdout)}
    assert "rclpy" in loaded
    assert not loaded & {"rosbags", "jax", "rich", "plotly", "jinja2", "pyulog", "lz4", "zstandard"}
