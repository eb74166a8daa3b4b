"""What all tests share."""

import os
from pathlib import Path

import hypothesis
import pytest

# The same examples in every run: what a run finds, the next one finds too.
hypothesis.settings.register_profile("fixed", derandomize=True)
hypothesis.settings.load_profile("fixed")

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def flights() -> Path:
    """Folder of real flight records beside the checkout; the test skips where it is absent."""
    folder = Path(os.environ.get("SYSID_FLIGHTS", ROOT.parent / "shared" / "flights"))
    if not folder.is_dir():
        pytest.skip(f"real flight records not found at {folder} (set SYSID_FLIGHTS to their folder)")
    return folder
