"""``sysid``: exit codes, one line a mistake, and no import that is not needed."""

import os
import subprocess
import sys
from importlib.util import find_spec

import pytest

from sysid_node.cli.main import COMMANDS, exit_code, main, module_of
from sysid_node.errors import InputError

CONVERT = ["convert", "log.csv", "--out", "bag"]


def raising(error):
    def work():
        raise error

    return work


def said(capsys) -> str:
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    return captured.err.strip()


@pytest.mark.parametrize(
    ("error", "code", "line"),
    [
        (InputError("bag x: cut short;\n  try this"), 2, "sysid convert: bag x: cut short; try this"),
        (KeyboardInterrupt(), 130, "sysid convert: interrupted"),
        (
            ModuleNotFoundError("No module named 'jax.numpy'", name="jax.numpy"),
            2,
            "sysid convert: needs the package jax, which is not installed; run: pip install -r requirements/desk.txt",
        ),
        (
            ModuleNotFoundError("No module named 'mine'", name="mine"),
            1,
            "sysid convert: failed: ModuleNotFoundError: No module named 'mine' (more with --debug)",
        ),
        (RuntimeError("a\nb"), 1, "sysid convert: failed: RuntimeError: a b (more with --debug)"),
        (
            OSError(28, "No space left"),
            1,
            "sysid convert: failed: OSError: [Errno 28] No space left (more with --debug)",
        ),
    ],
)
def test_errors_are_one_line_and_a_code(capsys, error, code, line):
    assert exit_code("convert", raising(error)) == code
    assert said(capsys) == line


@pytest.mark.parametrize(
    "words",
    [
        ["check", "NAME"],
        ["replay", "NAME", "--aircraft", "cdrw", "--out", "o"],
        ["identify", "a.csv", "NAME", "--aircraft", "cdrw", "--method", "equation_error", "--out", "o"],
        ["convert", "NAME", "--out", "o"],
        ["import", "NAME", "--format", "jsbsim", "--out", "o"],
        ["report", "NAME"],
    ],
)
def test_a_name_that_no_file_can_have_is_one_line(capsys, tmp_path, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    assert main([word.replace("NAME", 300 * "x") for word in words]) == 2
    assert said(capsys) == f"sysid {words[0]}: {40 * 'x'}...: is longer than the 255 bytes that a name may have"


@pytest.mark.parametrize("arguments", [["--debug", *CONVERT], [*CONVERT, "--debug"]])
def test_debug_shows_the_traceback(capsys, arguments):
    """There is no log.csv."""
    assert main(arguments) == 2
    assert "Traceback" in capsys.readouterr().err


def test_done_is_zero():
    assert exit_code("convert", lambda: 0) == 0


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["convert"], "sysid convert: the following arguments are required: LOG, --out; see sysid convert --help"),
        ([*CONVERT, "--fast"], "sysid convert: unrecognized arguments: --fast; see sysid convert --help"),
        (["--fast", *CONVERT], "sysid: unrecognized arguments: --fast; see sysid --help"),
        ([*CONVERT, "--storage", "x"], "sysid convert: argument --storage: invalid choice: 'x'"),
        (["land"], "sysid: argument COMMAND: invalid choice: 'land'"),
    ],
)
def test_wrong_arguments_are_one_line(capsys, arguments, line):
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    assert caught.value.code == 2
    assert said(capsys).startswith(line)


def test_no_command_shows_what_there_is(capsys):
    assert main([]) == 2
    assert "replay" in capsys.readouterr().out


def test_help_is_quick_because_it_imports_no_command():
    code = "import sys; from sysid_node.cli.main import main\ntry: main(['--help'])\nexcept SystemExit: pass\n"
    code += "print([m for m in ('numpy', 'rosbags', 'jax', 'rclpy', 'rich') if m in sys.modules])"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip().endswith("[]")
    assert "convert" in result.stdout


def test_runs_as_a_module():
    command = [sys.executable, "-m", "sysid_node.cli", "convert", "none.csv", "--out", "bag"]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (result.returncode, result.stdout, result.stderr) == (
        2,
        "",
        "sysid convert: none.csv: does not exist\n",
    )


@pytest.mark.parametrize("command", [name for name in COMMANDS if find_spec(module_of(name))])
def test_every_command_has_help(command, capsys):
    with pytest.raises(SystemExit) as caught:
        main([command, "--help"])
    assert caught.value.code == 0
    assert f"usage: sysid {command}" in capsys.readouterr().out


def test_a_reader_that_leaves_is_no_error():
    code = (
        "import sys; from sysid_node.cli.main import exit_code\n"
        "def work():\n    print('x' * 10**6)\n    sys.stdout.flush()\n    return 0\n"
        "sys.exit(exit_code('convert', work))"
    )
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    process.stdout.close()
    assert process.stderr.read() == b""
    process.stderr.close()
    assert process.wait() == 1


@pytest.mark.parametrize(
    ("given", "expected"), [({}, "1"), ({"OPENBLAS_NUM_THREADS": "3"}, "3"), ({"OMP_NUM_THREADS": "2"}, None)]
)
def test_linear_algebra_has_one_thread_unless_told_otherwise(monkeypatch, capsys, given, expected) -> None:
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
        monkeypatch.setenv(name, "")  # whatever main sets is undone
        monkeypatch.delenv(name)
    for name, value in given.items():
        monkeypatch.setenv(name, value)
    assert main(["convert", "nowhere.csv", "--aircraft", "cdrw", "--out", "nowhere"]) == 2
    assert os.environ.get("OPENBLAS_NUM_THREADS") == expected


def test_linear_algebra_is_told_so_before_it_is_there() -> None:
    """The library reads the variable once, when NumPy is imported: by whichever module comes first."""
    program = """
import os, sys
class Watch:
    def find_spec(self, name, path=None, target=None):
        if name == "numpy":
            print("at numpy", os.environ.get("OPENBLAS_NUM_THREADS"))
sys.meta_path.insert(0, Watch())
from sysid_node.cli.main import main
main(["gap", "nowhere", "--aircraft", "cdrw"])
"""
    kept = {k: v for k, v in os.environ.items() if k not in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS")}
    done = subprocess.run([sys.executable, "-c", program], env=kept, capture_output=True, text=True, check=False)
    assert done.stdout.splitlines()[0] == "at numpy 1"


@pytest.mark.parametrize(
    ("command", "absent"),
    [("gap", {"scipy", "rich", "jax"}), ("replay", {"rich", "jax", "scipy.signal"})],
)
def test_the_help_of_a_command_loads_no_package_that_only_its_run_needs(command: str, absent: set[str]) -> None:
    code = f"import sys; from sysid_node.cli.main import build_parser; build_parser({command!r}); "
    code += f"print(sorted({absent!r} & sys.modules.keys()))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
