"""Writes the reference that is made from the program itself, before Sphinx reads the pages.

Commands come from the argument parsers, parameters from ``config/*.yaml`` (which the nodes' own tables write), messages
from ``msg_defs/msg``. The Python interface is a page of autodoc a layer, and the map of the source holds the first
sentence of every module's docstring. All of it goes to ``docs/reference/generated``, which is not kept in the
repository.
"""

from __future__ import annotations

import argparse
import ast
import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "docs" / "reference" / "generated"


def setup(app: Sphinx) -> dict[str, Any]:
    """Has the pages written when the build begins."""
    app.connect("builder-inited", lambda app: write(FOLDER))
    return {"parallel_read_safe": True}


def write(folder: Path) -> None:
    """Writes all pages; one that would not change is left alone, so that Sphinx need not read it again."""
    wanted = {
        "commands.md": commands(),
        "parameters.md": parameters(),
        "messages.md": messages(),
        "map.md": source_map(),
        **{f"api/{name}": text for name, text in interface().items()},
    }
    (folder / "api").mkdir(parents=True, exist_ok=True)
    for old in [*folder.glob("*.*"), *folder.glob("api/*.*")]:
        if str(old.relative_to(folder)) not in wanted:
            old.unlink()
    for name, text in wanted.items():
        path = folder / name
        if not path.is_file() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


# Commands


def commands() -> str:
    """The page of commands, from the parsers."""
    main = import_module("sysid_node.cli.main")
    parts = [
        "# Commands\n",
        "This page is made from the argument parsers: `sysid COMMAND --help` prints the same. Every command ends with "
        "exit code 0 when it is done, 2 when the input is wrong (one line says what, where, and what to do), and 1 for "
        "any other error; 130 and 143 after Ctrl-C and SIGTERM. `--debug` adds the traceback of an error.\n",
    ]
    for name in main.COMMANDS:
        parts += _command(name, _subparser(main.build_parser(name), name), main.COMMANDS[name].meaning)
    return "\n".join(parts)


def _subparser(parser: argparse.ArgumentParser, name: str) -> argparse.ArgumentParser:
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            return action.choices[name]
    raise LookupError(name)


def _command(name: str, parser: argparse.ArgumentParser, meaning: str) -> list[str]:
    parser.formatter_class = lambda prog: argparse.HelpFormatter(prog, width=100)
    usage = parser.format_usage().removeprefix("usage: ").strip()
    rows = [
        f"| {_words(action)} | {_default(action)} | {_help(action)} |"
        for action in parser._actions
        if action.help != argparse.SUPPRESS and "-h" not in action.option_strings
    ]
    return [
        f"## sysid {name}\n",
        f"{meaning[0].upper()}{meaning[1:]}.\n",
        f"```text\n{usage}\n```\n",
        "| argument | default | meaning |\n|---|---|---|",
        *rows,
        "",
    ]


def _words(action: argparse.Action) -> str:
    shown = action.metavar or (action.dest.upper() if action.choices is None else "")
    if isinstance(shown, tuple):
        shown = " ".join(shown)
    value = "" if action.nargs == 0 else shown or "CHOICE"
    names = ", ".join(action.option_strings)
    words = f"{names}{' ' + value if value else ''}" if names else value or action.dest
    return f"`{words}`".replace("|", "\\|")


def _default(action: argparse.Action) -> str:
    if action.required and action.option_strings:
        return "needed"
    switch = isinstance(action, argparse._StoreConstAction)  # it is given or not: it has no value to fall back on
    if switch or action.default in (None, argparse.SUPPRESS, [], "") or not action.option_strings:
        return ""
    return f"`{action.default}`"


def _help(action: argparse.Action) -> str:
    text = (action.help or "") % {**vars(action), "prog": "sysid"}
    if action.choices is not None:
        text += f" ({', '.join(f'`{choice}`' for choice in action.choices)})"
    return _escaped(text)


def _escaped(text: str) -> str:
    """The text for a cell of a table, as it stands; what is in backticks stays code."""
    parts = re.split(r"(`[^`]+`)", text)
    return "".join(part if i % 2 else re.sub(r"([<>*_|\[\]#$])", r"\\\1", part) for i, part in enumerate(parts))


# Parameters


def parameters() -> str:
    """The page of the nodes' parameters, from ``config/*.yaml``."""
    parts = [
        "# Parameters of the nodes\n",
        "This page is made from the files in `config/`, which the nodes' own tables write. Each file can be given to a "
        "node with `--params-file`; `-p NAME:=VALUE` sets one parameter.\n",
    ]
    for path in sorted((ROOT / "config").glob("*.yaml")):
        parts += [f"## {path.stem}\n", "| parameter | default | allowed | meaning | when to change it |"]
        parts += ["|---|---|---|---|---|", *_parameter_rows(path.read_text(encoding="utf-8")), ""]
    return "\n".join(parts)


def _parameter_rows(text: str) -> Iterator[str]:
    comments: list[str] = []
    for line in text.partition("ros__parameters:")[2].splitlines():
        stripped = line.strip()
        if stripped.startswith("#"):
            content = stripped.removeprefix("#")
            if content.startswith("   ") and comments:  # the line before, continued
                comments[-1] += " " + content.strip()
            else:
                comments.append(content.strip())
        elif stripped:
            key, _, value = stripped.partition(":")
            yield _parameter_row(key, value.strip(), comments)
            comments = []


def _parameter_row(key: str, value: str, comments: list[str]) -> str:
    said = {"Change": "", "Values": "", "Unit": ""}
    meaning = []
    for comment in comments:
        head, _, rest = comment.partition(": ")
        if head in said:
            said[head] = rest
        else:
            meaning.append(comment)
    allowed = (said["Values"] or said["Unit"]).rstrip(".")
    cells = [f"`{key}`", f"`{value}`", *map(_escaped, (allowed, " ".join(meaning), said["Change"]))]
    return f"| {' | '.join(cells)} |"


# Messages


def messages() -> str:
    """The page of messages, from ``msg_defs/msg``."""
    parts = [
        "# Messages\n",
        "This page is made from the definitions in `msg_defs/msg` (package `sysid_msgs`). Other topics use standard "
        "types; [Topics and services](../topics.md) lists them all.\n",
    ]
    for path in sorted((ROOT / "msg_defs" / "msg").glob("*.msg")):
        lines = path.read_text(encoding="utf-8").splitlines()
        heading = [line.removeprefix("#").strip() for line in lines[: _first(lines)] if line.startswith("#")]
        parts += [f"## {path.stem}\n", f"{_escaped(' '.join(heading))}\n", "| field | type | meaning |\n|---|---|---|"]
        parts += [*_fields(lines[_first(lines) :]), ""]
    return "\n".join(parts)


def _first(lines: list[str]) -> int:
    return next(i for i, line in enumerate(lines) if line.strip() and not line.startswith("#"))


def _fields(lines: list[str]) -> Iterator[str]:
    rows: list[list[str]] = []
    for line in lines:
        definition, _, comment = line.partition("#")
        if definition.strip():
            kind, name = definition.split(maxsplit=1)
            rows.append([f"`{name.strip()}`", f"`{kind}`", _escaped(comment.strip())])
        elif comment.strip() and rows:
            rows[-1][2] += " " + _escaped(comment.strip())
    return (f"| {' | '.join(row)} |" for row in rows)


# The Python interface, and the map of the source

#: Layers whose own modules make up the interface to programs, upper layers last; their sub-packages are inner workings.
LAYERS = ("aircraft", "dynamics", "flight", "sim", "online", "batch", "control", "faults", "gap", "fleet")


def interface() -> dict[str, str]:
    """A page of autodoc for every layer that programs may use, and their list, by file name."""
    layers = [layer for layer in LAYERS if (ROOT / "sysid_node" / layer).is_dir()]
    pages = {f"{layer}.rst": _layer(ROOT / "sysid_node" / layer) for layer in layers}
    title = "Python API of the layers"
    everyday = "For everyday work the few functions of :doc:`/python_api` are enough. "
    said = (
        "These pages are made from the docstrings of each layer's own modules, lowest layer first. "
        + (everyday if (ROOT / "docs" / "python_api.md").is_file() else "")
        + ":doc:`../map` says what every module holds, inner ones included.\n"
    )
    entries = "\n".join(f"   {layer}" for layer in layers)
    head = f"{title}\n{'=' * len(title)}\n"
    pages["index.rst"] = f"{head}\n{said}\n.. toctree::\n   :maxdepth: 1\n\n{entries}\n"
    return pages


def _layer(folder: Path) -> str:
    name = _dotted(folder)
    modules = sorted(_dotted(path) for path in folder.glob("*.py") if not path.stem.startswith("__"))
    parts = [name, "=" * len(name), "", f".. automodule:: {name}", "   :no-members:", ""]
    for module in modules:
        parts += [module, "-" * len(module), "", f".. automodule:: {module}", ""]
    return "\n".join(parts)


def source_map() -> str:
    """The page that says in a line what each package and module holds: the first sentence of its docstring."""
    parts = [
        "# Map of the source\n",
        "This page is made from the first sentence of each docstring. It lists every package and module, so that a "
        "given thing is found in a minute. [Architecture](../../architecture.md) says how the layers use each other.\n",
    ]
    for package in sorted(path.parent for path in (ROOT / "sysid_node").rglob("__init__.py")):
        rows = [
            f"| `{path.stem}` | {_escaped(_first_sentence(path))} |"
            for path in sorted(package.glob("*.py"))
            if not path.stem.startswith("__")
        ]
        parts += [f"## {_dotted(package)}\n", f"{_escaped(_first_sentence(package / '__init__.py'))}\n"]
        if rows:
            parts += ["| module | holds |\n|---|---|", *rows, ""]
    return "\n".join(parts)


def _first_sentence(path: Path) -> str:
    said = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
    paragraph = re.sub(r"^(Layer `\w+`|sysid): ", "", " ".join(said.split("\n\n")[0].split()).replace("``", "`"))
    sentence = re.split(r"(?<=[.?])\s(?=[A-Z`])", paragraph, maxsplit=1)[0].rstrip(":;.")  # not after "sec."
    return sentence[:1].upper() + sentence[1:] + ("" if sentence.endswith("?") or not sentence else ".")


def _dotted(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts)
