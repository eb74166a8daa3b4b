"""Every bench can be imported, and bench/README.md lists each of them. Truth: the files."""

from __future__ import annotations

import importlib
import re
from pathlib import Path

import pytest

from bench.batch import comparison
from bench.estimation import log_rates

ROOT = Path(__file__).resolve().parents[2]
MODULES = sorted(
    ".".join(path.relative_to(ROOT).with_suffix("").parts)
    for path in (ROOT / "bench").rglob("*.py")
    if path.name != "__init__.py"
)
PROGRAMS = [
    module
    for module in MODULES
    if 'if __name__ == "__main__"' in (ROOT / f"{module.replace('.', '/')}.py").read_text(encoding="utf-8")
]
README = (ROOT / "bench" / "README.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("module", MODULES)
def test_a_bench_can_be_imported(module: str) -> None:
    assert importlib.import_module(module).__doc__, "what it measures is said at the top of the module"


@pytest.mark.parametrize("module", PROGRAMS)
def test_a_bench_is_listed(module: str) -> None:
    name = module.removeprefix("bench.")
    assert f"`{name}`" in README or f"`{name}.py`" in README


def test_what_is_listed_is_there() -> None:
    listed = re.findall(r"^\| `([\w.]+)`", README, re.M)
    assert len(listed) > 30
    assert {f"bench.{name}" for name in listed} <= set(PROGRAMS)


def test_bundled_flights_that_benches_read_are_there() -> None:
    """The bench that compares all methods had looked one folder too high."""
    assert (comparison.BAGS / "cdrw_multistep").is_dir()
    assert (log_rates.BAGS / "cdrw_multistep").is_dir()
