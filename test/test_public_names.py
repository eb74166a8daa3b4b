"""Tests use what the package offers: no private names, and no function of a module replaced from outside."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent
#: Public by their definition: methods of named tuples, and the method that Jupyter calls.
PUBLIC = {"_replace", "_asdict", "_fields", "_make", "_repr_html_"}
#: What tests may replace: the interpreter's surroundings, as a test cannot uninstall a package or move the prefix.
SURROUNDINGS = {"sys", "os", "sys.modules"}
#: rclpy's callback of a service, which a test calls without DDS; rclpy has no public name for it.
OF_OTHERS = {"node._LifecycleNodeMixin__on_change_state"}


def private(name: str) -> bool:
    return name.startswith("_") and not name.startswith("__") and name not in PUBLIC


def offences(tree: ast.Module) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            yield from (f"import of {alias.name}" for alias in node.names if private(alias.name))
        elif isinstance(node, ast.Attribute) and private(node.attr) and ast.unparse(node) not in OF_OTHERS:
            if ast.unparse(node.value) not in ("self", "cls"):
                yield f"{node.lineno}: {ast.unparse(node)}"
        elif isinstance(node, ast.Call) and ast.unparse(node.func).startswith("monkeypatch.set"):
            replaced = ast.unparse(node.args[0])
            if replaced not in SURROUNDINGS and ast.unparse(node.func) != "monkeypatch.setenv":
                yield f"{node.lineno}: {ast.unparse(node)}"


@pytest.mark.parametrize("path", sorted(ROOT.rglob("*.py")), ids=lambda path: str(path.relative_to(ROOT)))
def test_a_test_reaches_into_nothing_private(path: Path) -> None:
    assert not list(offences(ast.parse(path.read_text(encoding="utf-8"))))


def test_offences_are_seen() -> None:
    lines = ("from a import _b", "c._d", "self._e", "f._replace()", "monkeypatch.setattr(g, 'h', 1)")
    source = "\n".join((*lines, "monkeypatch.setattr(sys, 'i', 1)"))
    assert len(list(offences(ast.parse(source)))) == 3
