"""YAML values with file, line and dotted key, which error messages name."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass

import yaml

from sysid_node.errors import InputError
from sysid_node.suggestion import did_you_mean


@dataclass(frozen=True)
class DocumentEntry:
    """One value of the file. ``key`` is its dotted path, empty at the top."""

    node: yaml.Node
    key: str
    file: str

    @property
    def is_mapping(self) -> bool:
        """Whether the value is a mapping."""
        return isinstance(self.node, yaml.MappingNode)

    def truth(self, expected: str) -> bool:
        """The value as true or false."""
        word = str(self.node.value).lower() if self._is_plain() else ""
        if word not in ("true", "false"):
            raise self.mismatch(expected)
        return word == "true"

    def error(self, problem: str) -> InputError:
        """The error about this value: ``file:line: dotted.key: problem``."""
        return InputError(f"{self.file}:{self.node.start_mark.line + 1}: {self.key or 'top level'}: {problem}")

    def mismatch(self, expected: str) -> InputError:
        """The error that gives the value and what was expected."""
        return self.error(f"got {self._got()}, expected {expected}")

    def number(self, expected: str, accept: Callable[[float], bool] = math.isfinite) -> float:
        """The value as a finite number for which ``accept`` holds; ``expected`` says so in words."""
        try:
            value = float(self.node.value) if self._is_plain() else math.nan
        except ValueError:
            value = math.nan
        if not (math.isfinite(value) and accept(value)):
            raise self.mismatch(expected)
        return value

    def text(self, expected: str) -> str:
        """The value as text that is not empty."""
        if not isinstance(self.node, yaml.ScalarNode) or not str(self.node.value).strip():
            raise self.mismatch(expected)
        return str(self.node.value)

    def items(self, expected: str) -> list[DocumentEntry]:
        """The entries of a list."""
        if not isinstance(self.node, yaml.SequenceNode):
            raise self.mismatch(expected)
        return [DocumentEntry(node, f"{self.key}[{i}]", self.file) for i, node in enumerate(self.node.value)]

    def mapping(self, expected: str) -> dict[str, DocumentEntry]:
        """The entries of a mapping with keys of any name; a key given twice is an error."""
        if not isinstance(self.node, yaml.MappingNode):
            raise self.mismatch(expected)
        entries: dict[str, DocumentEntry] = {}
        for key_node, node in self.node.value:
            if not isinstance(key_node, yaml.ScalarNode):
                raise DocumentEntry(key_node, self.key, self.file).mismatch("a name as key")
            key = str(key_node.value)
            entry = DocumentEntry(node, f"{self.key}.{key}" if self.key else key, self.file)
            if key in entries:
                raise DocumentEntry(key_node, entry.key, self.file).error("given twice; keep one")
            entries[key] = entry
        return entries

    def fields(self, required: Mapping[str, str], optional: Collection[str] = ()) -> dict[str, DocumentEntry]:
        """The entries of a mapping with known keys. ``required`` says of each needed key what it is."""
        known = (*required, *optional)
        entries = self.mapping(f"a mapping with {', '.join(known)}")
        for key, entry in entries.items():
            if key not in known:
                raise entry.error(f"unknown key; expected one of {', '.join(known)}{did_you_mean(key, known)}")
        for key, meaning in required.items():
            if key not in entries:
                raise self.error(f"key {key!r} is missing; expected {meaning}")
        return entries

    def _is_plain(self) -> bool:
        return isinstance(self.node, yaml.ScalarNode) and self.node.style is None

    def _got(self) -> str:
        if isinstance(self.node, yaml.MappingNode):
            return "a mapping"
        if isinstance(self.node, yaml.SequenceNode):
            return "a list"
        if self._is_plain():
            return str(self.node.value) or "nothing"
        return f"the text {self.node.value!r}"


def parse_document(text: str, file: str) -> DocumentEntry:
    """The top-level entry of a YAML text. Raises InputError, with the line, where it is not YAML."""
    try:
        node = yaml.compose(text, Loader=yaml.SafeLoader)
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 1
        raise InputError(f"{file}:{line}: not valid YAML: {error.problem or error.context}") from error
    except (yaml.YAMLError, RecursionError) as error:
        raise InputError(f"{file}: not valid YAML: {str(error).splitlines()[0]}") from error
    if node is None:
        raise InputError(f"{file}: the file is empty")
    return DocumentEntry(node, "", file)
