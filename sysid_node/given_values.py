"""Values of parameters as they were given on the command line and in files, of which ROS keeps only some.

Where a parameter is given twice with values of different type, rcl (9.2, ``rcl_yaml_param_parser``) keeps both, and the
type that it looks for first wins: the `true` of a file beneath is used, and the `0` of ``-p adapt:=0`` is lost without
a word. The values are therefore read again here, and each must have its parameter's type.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import yaml

#: PyYAML raises ValueError for dates like 2026-13-45 and for numbers with too many digits.
_UNREADABLE = (yaml.YAMLError, ValueError, RecursionError)
_WORDS = {"y", "Y", "n", "N"}  # booleans to rcl, texts to PyYAML


class Given(NamedTuple):
    """A value that was given for a parameter, and where."""

    name: str
    value: Any
    source: str


def given_values(arguments: Sequence[str], full_name: str) -> Iterator[Given]:
    """All values for a node in ``-p`` and ``--params-file``. What ROS refuses itself is left out."""
    ours = _ros_arguments(arguments)
    for flag, word in pairwise(ours):
        if flag in ("-p", "--param"):
            yield from _of_rule(word, full_name)
        elif flag == "--params-file":
            yield from _of_file(Path(word), full_name)


def _ros_arguments(arguments: Sequence[str]) -> list[str]:
    found, inside = [], False
    for word in arguments:
        if word in ("--ros-args", "--"):
            inside = word == "--ros-args"
        elif inside:
            found.append(word)
    return found


def _of_rule(rule: str, full_name: str) -> Iterator[Given]:
    """The value of ``[node:]name:=value``."""
    left, separator, text = rule.partition(":=")
    node, _, name = left.rpartition(":")
    try:
        value = yaml.safe_load(text)
    except _UNREADABLE:
        return
    if separator and (not node or full_name.endswith(f"/{node}")):
        yield Given(name, value, "on the command line")


def _of_file(path: Path, full_name: str) -> Iterator[Given]:
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, *_UNREADABLE):
        return
    for pattern, block in _blocks(content, ""):
        if _matches(pattern, full_name):
            for name, value in _flat(block, ""):
                yield Given(name, value, f"in {path}")


def _blocks(content: Any, name: str) -> Iterator[tuple[str, Any]]:
    """Patterns of nodes' names, and what stands under their ``ros__parameters``."""
    if not isinstance(content, Mapping):
        return
    for key, value in content.items():
        if key == "ros__parameters":
            yield name, value
        else:
            yield from _blocks(value, f"{name}/{str(key).strip('/')}")


def _matches(pattern: str, full_name: str) -> bool:
    """Whether a pattern of ROS matches a node's name: ``*`` stands for one token, ``**`` for any number of them."""
    words = re.escape(pattern).replace(r"/\*\*/", "/(?:.*/)?").replace(r"\*\*", ".*").replace(r"\*", "[^/]+")
    return re.fullmatch(words, full_name) is not None


def _flat(block: Any, name: str) -> Iterator[tuple[str, Any]]:
    """Parameters' full names and values of nested ones."""
    if isinstance(block, Mapping):
        for key, value in block.items():
            yield from _flat(value, f"{name}.{key}" if name else str(key))
    elif name:
        yield name, block


def fits(value: Any, default: Any) -> bool:
    """Whether a value, read by PyYAML, is of the default's type to rcl, which also takes 1e3 for a number."""
    if isinstance(default, bool):
        return isinstance(value, bool) or (isinstance(value, str) and value in _WORDS)
    if isinstance(default, float):
        return isinstance(value, float) or (isinstance(value, str) and _is_number(value))
    if isinstance(default, list):
        return isinstance(value, list) and all(fits(one, 0.0) for one in value)
    return isinstance(value, str) or value is None  # rcl says itself that a value is missing


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
