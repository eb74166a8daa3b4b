"""A section of a report: a title, a template, and the function that fills it from the results."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

Results = TypeVar("Results")


@dataclass(frozen=True)
class Section(Generic[Results]):
    """One section of the page. ``context`` gives the template's variables."""

    anchor: str
    title: str
    template: str  # file in templates/sections
    context: Callable[[Results], Mapping[str, Any]]
