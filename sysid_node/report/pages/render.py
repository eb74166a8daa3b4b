"""One self-contained HTML page from a list of sections: style, script, data and plotly.js inside, no network."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import TypeVar

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from sysid_node.report.sections.section import Section

Results = TypeVar("Results")

TEMPLATES = Path(__file__).parents[1] / "templates"


def render_page(title: str, sections: Sequence[Section[Results]], results: Results) -> str:
    """The page: a title, then each section's template filled by its context function."""
    environment = _environment()
    filled = [
        {
            "anchor": section.anchor,
            "title": section.title,
            "body": _body(environment, section, results),
        }
        for section in sections
    ]
    return environment.get_template("page.html.j2").render(
        title=title,
        sections=filled,
        style=Markup(_text("style.css")),
        script=Markup(_text("page.js")),
        plotly=Markup(_text("vendor/plotly-basic.min.js")) if any('class="plot"' in f["body"] for f in filled) else "",
    )


def _body(environment: Environment, section: Section[Results], results: Results) -> Markup:
    """A section's template, filled; no line ends between a number and its percent sign."""
    text = environment.get_template(f"sections/{section.template}").render(section.context(results)).strip()
    return Markup(re.sub(r"(?<=\d) %", "\N{NARROW NO-BREAK SPACE}%", text))


@cache
def _environment() -> Environment:
    return Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )


def _text(name: str) -> str:
    return (TEMPLATES / name).read_text(encoding="utf-8")
