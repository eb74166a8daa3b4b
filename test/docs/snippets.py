"""The snippets of the documentation: fenced blocks of the Markdown pages, and what the pages say of running them.

A block of ``bash``, ``python``, ``yaml`` or ``json`` is run, or parsed, by a test. The line
``<!-- not run: REASON -->`` above a block of ``bash`` or ``python`` says that it is only checked, and why. The line
``<!-- output -->`` above a block of ``text`` says that the commands above it print these lines. A block of ``yaml``
whose first line is ``# NAME.yaml`` is the file of that name for what follows on the page.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LANGUAGES = ("bash", "python", "yaml", "json", "text", "spec")

_FENCE = re.compile(r"^(?P<mark>```+|:::+)(?P<info>.*)$")
_NOT_RUN = re.compile(r"<!-- not run: (.+) -->")


@dataclass(frozen=True)
class Snippet:
    """One fenced block: where it begins, its language, its text, why it is not run, and whether it is an output."""

    page: str
    line: int
    language: str
    text: str
    not_run: str = ""
    is_output: bool = False

    @property
    def place(self) -> str:
        """Page and line, for messages."""
        return f"{self.page}:{self.line}"


def pages() -> list[Path]:
    """All pages that people read, but for those that are generated."""
    found = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "bags" / "README.md", ROOT / "bench" / "README.md"]
    found += sorted((ROOT / "docs").rglob("*.md"))
    return [page for page in found if "generated" not in page.parts and "_build" not in page.parts]


def snippets(page: Path) -> Iterator[Snippet]:
    """The page's blocks in order; directives of MyST (``{name}``) are none."""
    lines = page.read_text(encoding="utf-8").splitlines()
    name = str(page.relative_to(ROOT))
    i, above = 0, ""
    while i < len(lines):
        begin = _FENCE.match(lines[i])
        if not begin:
            above = lines[i] if lines[i].strip() else above
            i += 1
            continue
        end = next((j for j in range(i + 1, len(lines)) if lines[j].rstrip() == begin["mark"]), len(lines))
        if begin["mark"].startswith("`") and not begin["info"].startswith("{"):
            reason = _NOT_RUN.fullmatch(above.strip())
            text = "\n".join(lines[i + 1 : end]) + "\n"
            is_output = above.strip() == "<!-- output -->"
            yield Snippet(name, i + 1, begin["info"].strip(), text, reason[1] if reason else "", is_output)
        i, above = end + 1, ""


def commands(text: str) -> list[list[str]]:
    """The commands of a block of bash, each as its words; comments and settings of the environment are left out."""
    joined = text.replace("\\\n", " ")
    found = []
    for line in joined.splitlines():
        for part in line.split(" && "):
            words = shlex.split(part, comments=True)
            while words and re.fullmatch(r"[A-Z_]+=.*", words[0]):
                words = words[1:]
            if words:
                found.append(words)
    return found
