"""Links between pages, and between benches and the pages that they fill. Truth: the files. Sphinx checks the rest."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from snippets import ROOT, pages

OUTSIDE = [page for page in pages() if ROOT / "docs" not in page.parents]  # what Sphinx does not see
BENCHES = sorted((ROOT / "bench").rglob("*.py"))
MARKERS = [
    (page, name)
    for page in sorted((ROOT / "docs").rglob("*.md"))
    for name in re.findall(r"^<!-- (bench/\S+\.py.*?) -->$", page.read_text(encoding="utf-8"), re.M)
]


def anchors(page: Path) -> set[str]:
    heads = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), re.M)
    return {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}


@pytest.mark.parametrize("page", OUTSIDE, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_of_pages_outside_the_site_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8")):
        if target.startswith(("http://", "https://")):
            continue
        path, _, anchor = target.partition("#")
        file = (page.parent / path).resolve() if path else page
        assert file.exists(), f"{page.name}: {target}"
        assert not anchor or anchor in anchors(file), f"{page.name}: {target}: no such heading"


@pytest.mark.parametrize(("page", "name"), MARKERS, ids=lambda value: value if isinstance(value, str) else value.stem)
def test_every_table_has_its_bench_and_its_end(page: Path, name: str) -> None:
    assert (ROOT / name.split(maxsplit=1)[0]).is_file()
    assert f"<!-- /{name} -->" in page.read_text(encoding="utf-8")


@pytest.mark.parametrize("bench", BENCHES, ids=lambda bench: str(bench.relative_to(ROOT)))
def test_pages_that_a_bench_fills_hold_its_marker(bench: Path) -> None:
    for page in re.findall(r"--page (docs/\S+\.md)", bench.read_text(encoding="utf-8")):
        assert f"<!-- {bench.relative_to(ROOT)}" in (ROOT / page).read_text(encoding="utf-8"), page


def test_every_page_of_the_documentation_that_the_program_names_is_there() -> None:
    for folder in ("sysid_node", "bench", "test", "config", "launch"):
        for path in (ROOT / folder).rglob("*"):
            if path.suffix in (".py", ".yaml") and path != Path(__file__):
                for page in re.findall(r"docs/[\w/-]+\.md", path.read_text(encoding="utf-8")):
                    assert (ROOT / page).is_file(), f"{path.relative_to(ROOT)}: {page}"
