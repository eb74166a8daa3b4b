"""Docstrings are plain text with ``code``: what reStructuredText would take for markup in them is escaped for autodoc.

An indented block is shown as it stands (an equation, an example); lines that begin with ``- `` are a list.
"""

from __future__ import annotations

import re
from typing import Any

from sphinx.application import Sphinx

_CODE = re.compile(r"(``.+?``|`[^`]+`)")
_MARKUP = re.compile(r"([*|\\]|_(?=\W|$))")


def setup(app: Sphinx) -> dict[str, Any]:
    """Has every docstring go through ``escaped``."""
    app.connect("autodoc-process-docstring", lambda app, what, name, obj, options, lines: _replace(lines))
    return {"parallel_read_safe": True}


def _replace(lines: list[str]) -> None:
    lines[:] = escaped(lines)


def escaped(lines: list[str]) -> list[str]:
    """The docstring's lines as reStructuredText that shows them as they are."""
    out: list[str] = []
    literal = in_list = False
    for line in lines:
        indented = line.startswith("  ")
        if not line.strip():
            out.append("")
            literal = False
        elif line.lstrip().startswith("- ") and not literal:
            if out and out[-1] and not in_list:
                out.append("")
            in_list = True
            out.append(_inline(line.strip()))
            continue
        elif in_list and indented:
            out.append("  " + _inline(line.strip()))
            continue
        elif indented:
            if not literal:
                out += ["", "::", ""]
            literal = True
            out.append("    " + line.rstrip())
            continue
        else:
            if literal:
                out.append("")
            out.append(_inline(re.sub(r"::$", ":", line.strip())))
            literal = False
        in_list = False if line.strip() else in_list
    return [*out, ""]


def _inline(text: str) -> str:
    parts = _CODE.split(text)
    return "".join(f"``{part.strip('`')}``" if i % 2 else _MARKUP.sub(r"\\\1", part) for i, part in enumerate(parts))
