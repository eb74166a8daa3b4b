"""The launch files, without `launch` installed: they name executables, files and arguments that exist."""

import ast
import re
from pathlib import Path

import pytest

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
    used, declared = first_words(path, "LaunchConfiguration"), first_words(path, "DeclareLaunchArgument")
    assert used <= declared | {"imu", "air_data", "actuators"}
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
