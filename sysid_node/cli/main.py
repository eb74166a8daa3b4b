"""``sysid``: finds the command, runs it, and turns an error into one line and an exit code.

A command is a module of its name in a package beside this module; that of ``import`` is ``import_model``. It has
``add_parser(commands)``, which adds its parser to argparse's ``commands`` and returns it, and ``run(args)``. Only the
module of the command that is run is imported.
"""

from __future__ import annotations

import argparse
import os
import re
import signal
import sys
import traceback
import warnings
from collections.abc import Callable, Sequence
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

from sysid_node.errors import InputError, InputWarning, ModelWarning
from sysid_node.interruption import end_on_signals
from sysid_node.linear_algebra import one_thread_for_linear_algebra
from sysid_node.suggestion import did_you_mean


class Command(NamedTuple):
    """A command of ``sysid``."""

    module: str  # within ``sysid_node.cli``
    meaning: str


COMMANDS = {
    "replay": Command("flights.replay", "identify an aircraft from a bag, as the live node does"),
    "identify": Command("flights.identify", "identify an aircraft from bags with a batch method"),
    "simulate": Command("models.simulate", "fly a simulated aircraft into a bag"),
    "excite": Command("models.excite", "design a manoeuvre and predict its accuracy"),
    "gap": Command("flights.gap", "find why the simulator does not fly like the aircraft"),
    "fleet": Command("flights.fleet", "identify many flights of many aircraft, and say what they tell together"),
    "aircraft": Command("models.aircraft", "say what an aircraft file means, as a handbook would"),
    "check": Command("flights.check", "say what a flight's file is good for"),
    "convert": Command("flights.convert", "turn a flight log into a bag"),
    "export": Command("models.export", "write an estimate as another simulator's model"),
    "import": Command("models.import_model", "read another simulator's model as an aircraft file"),
    "report": Command("flights.report", "write report.html again from the files of a run"),
    "view": Command("flights.view", "show a flight in 3-D and against time"),
    "demo": Command("live.demo", "identify a recorded flight live, over DDS"),
    "loop": Command("live.loop", "an adaptive controller in closed loop, over DDS"),
}

#: The file under ``requirements/`` that brings a package which not every command needs.
REQUIREMENTS = {
    "jax": "desk",
    "jaxlib": "desk",
    "jinja2": "run",
    "plotly": "run",
    "rich": "run",
    "rosbags": "run",
    "scipy": "run",
    "yaml": "run",
}

LONGEST_NAME = 255  # bytes of a file's name
_OUTPUTS = ("out", "save")  # arguments that have their own checks
_NAMES_OR_FILES = ("model", "estimate")  # arguments that are no paths to argparse, but may be

DONE, FAILED, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130
ENDINGS = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated"}


class Parser(argparse.ArgumentParser):
    """An argument parser whose errors are one line."""

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """As argparse does, but a command's parser refuses what it does not know itself, and names its own help."""
        found, unknown = super().parse_known_args(args, namespace)
        if unknown:
            self.error(f"unrecognized arguments: {' '.join(unknown)}")
        return found, unknown

    def error(self, message: str) -> NoReturn:
        """Print what is wrong and how to get help, and exit with code 2."""
        choice = re.search(r"invalid choice: '(.*?)' \(choose from (.*)\)", message)
        if choice:
            message += did_you_mean(choice[1], re.findall(r"[\w-]+", choice[2]))
        self.exit(BAD_INPUT, f"{self.prog}: {message}; see {self.prog} --help\n")


def main(argv: Sequence[str] | None = None) -> int:
    """Runs a command; returns the exit code: 0 done, 2 bad input, 130 interrupted, 143 terminated, 1 anything else.

    Without ``argv`` the arguments are those of the process, which a signal ends, and which ends with the command.
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    command = next((word for word in arguments if not word.startswith("-")), "")
    debug = "--debug" in arguments
    if argv is not None:
        return exit_code(command, lambda: _run(command, arguments), debug=debug)
    end_on_signals(lambda number: print(f"sysid {command}: {ENDINGS[signal.Signals(number)]}", file=sys.stderr))
    try:
        code = exit_code(command, lambda: _run(command, arguments), debug=debug)
    except SystemExit as end:  # argparse has said what is wrong, or printed its help
        code = end.code if isinstance(end.code, int) else DONE
    return _leave(code)


def _leave(code: int) -> NoReturn:
    """End the process. Compiled libraries' threads may crash while Python shuts down, so it does not."""
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        code = code or FAILED
    sys.stderr.flush()
    os._exit(code)


def _run(command: str, arguments: Sequence[str]) -> int:
    one_thread_for_linear_algebra()  # before the command's module imports NumPy
    parser = build_parser(command)
    args = parser.parse_args(arguments)
    if not args.command:
        parser.print_help()
        return BAD_INPUT
    _refuse_long_names(args)
    with warnings.catch_warnings():
        warnings.simplefilter("always", InputWarning)
        if not args.debug:  # of NumPy, about numbers that are checked where they matter
            warnings.simplefilter("ignore", RuntimeWarning)
        later: list[str] = []
        warnings.showwarning = _show_warning(command, warnings.showwarning, later)
        import_module(module_of(command)).run(args)
    for line in dict.fromkeys(later):
        print(line, file=sys.stderr)
    return DONE


def _refuse_long_names(args: argparse.Namespace) -> None:
    """Raise InputError where an input's name is longer than any that a file has.

    The system says so in whatever place first looks for the file, as an error of another kind.
    """
    for name, value in vars(args).items():
        for one in value if isinstance(value, list) else [value]:
            place = Path(one) if isinstance(one, Path) or name in _NAMES_OR_FILES else Path()
            too_long = any(len(os.fsencode(part)) > LONGEST_NAME for part in place.parts)
            if too_long and name not in _OUTPUTS:
                raise InputError(f"{one!s:.40}...: is longer than the {LONGEST_NAME} bytes that a name may have")


def exit_code(command: str, work: Callable[[], int], *, debug: bool = False) -> int:
    """The exit code of ``work``; an error becomes one line on stderr, after its traceback where ``debug``."""
    try:
        return work()
    except KeyboardInterrupt:
        return _say(command, "interrupted", INTERRUPTED)
    except BrokenPipeError:  # the reader of our output has ended; Python must not complain about it at exit
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FAILED
    except Exception as error:  # whatever else goes wrong is one line for the user
        if debug:
            traceback.print_exc()
        if isinstance(error, InputError):
            return _say(command, str(error), BAD_INPUT)
        missing = (error.name or "").partition(".")[0] if isinstance(error, ModuleNotFoundError) else ""
        if missing in REQUIREMENTS:
            needs = f"needs the package {missing}, which is not installed; run: pip install -r requirements/"
            return _say(command, f"{needs}{REQUIREMENTS[missing]}.txt", BAD_INPUT)
        return _say(command, f"failed: {type(error).__name__}: {error} (more with --debug)", FAILED)


def module_of(command: str) -> str:
    """The full name of a command's module."""
    return f"sysid_node.cli.{COMMANDS[command].module}"


def build_parser(command: str) -> Parser:
    """The parser of all commands, with the arguments of one."""
    parser = Parser(prog="sysid", description="Identify a fixed-wing aircraft in flight and at the desk.")
    parser.add_argument("--debug", action="store_true", help="print the traceback of an error")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", title="commands")
    for name, (_, meaning) in COMMANDS.items():
        if find_spec(module_of(name)) is None:
            continue  # this command belongs to a layer that is not installed
        if name == command:
            one = import_module(module_of(name)).add_parser(commands)
            one.add_argument("--debug", action="store_true", default=argparse.SUPPRESS, help=argparse.SUPPRESS)
        else:
            commands.add_parser(name, help=meaning)
    return parser


def _show_warning(command: str, usual: Callable[..., None], later: list[str]) -> Callable[..., None]:
    """A ``warnings.showwarning``: a warning about a model is one line, any of another kind is as usual.

    One about an input is put into ``later``, to be shown after the results; an error is then one line.
    """

    def show(message: Warning | str, category: type[Warning], *place: object) -> None:
        line = f"sysid {command}: warning: {' '.join(str(message).split())}"
        if issubclass(category, InputWarning):
            later.extend({line} - {*later})
        elif issubclass(category, ModelWarning):
            print(line, file=sys.stderr)
        else:
            usual(message, category, *place)

    return show


def _say(command: str, message: str, code: int) -> int:
    """The code, after the message as one line on stderr."""
    print(" ".join(f"sysid {command}: {message}".split()), file=sys.stderr, flush=True)
    return code
