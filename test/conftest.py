"""What all tests share."""

import ctypes
import gc
import html
import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import hypothesis
import pytest

# The same examples in every run: what a run finds, the next one finds too.
# No deadline: on a busy machine an example may take any time.
hypothesis.settings.register_profile("fixed", derandomize=True, deadline=None)
hypothesis.settings.load_profile("fixed")

ROOT = Path(__file__).resolve().parents[1]

_BROWSER_FLAGS = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--hide-scrollbars"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
    *("--enable-logging=stderr", "--virtual-time-budget=20000", "--host-resolver-rules=MAP * ~NOTFOUND"),
)


#: Folders, and files that begin alike, whose tests share compiled programs and costly fixtures. One worker runs all of
#: them, so that nothing is compiled or flown twice; all other tests are distributed by file.
_TOGETHER = ("test/gap/", "test/batch/", "test/sim/", "test/cli/flights/test_gap")

#: What takes longest. It begins first, so that no worker ends long after the other.
_FIRST = (
    *("test/gap/", "test/docs/test_snippets.py", "test/batch/", "test/sim/", "test/ros/test_closed_loop.py"),
    *("test/cli/live/", "test/ros/", "test/cli/", "test/fleet/", "test/bench/"),
)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """What takes longest first; the order is otherwise kept."""

    def rank(item: pytest.Item) -> int:
        return next((k for k, begin in enumerate(_FIRST) if item.nodeid.startswith(begin)), len(_FIRST))

    items.sort(key=rank)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """The distribution of ``--dist loadfile``, with whole folders in one worker."""
    from xdist.scheduler import LoadFileScheduling  # noqa: PLC0415

    class ByFolderOrFile(LoadFileScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return next(filter(nodeid.startswith, _TOGETHER), nodeid.split("::", 1)[0])

    if config.getoption("dist") != "loadfile":
        return None
    config.option.loadscopereorder = False  # by number of tests
    return ByFolderOrFile(config, log)


@pytest.fixture(scope="session")
def flights() -> Path:
    """Folder of real flight records beside the checkout; the test skips where it is absent."""
    folder = Path(os.environ.get("SYSID_FLIGHTS", ROOT.parent / "shared" / "flights"))
    if not folder.is_dir():
        pytest.skip(f"real flight records not found at {folder} (set SYSID_FLIGHTS to their folder)")
    return folder


@dataclass(frozen=True)
class Page:
    """What a browser made of a report."""

    complaints: list[str]
    plots: int
    drawn: int
    data_links: int


@pytest.fixture
def browse(tmp_path) -> Callable[[Path], Page]:
    """Opens a report in a real browser, without a network; the test skips where there is none."""
    chromium = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if chromium is None:
        pytest.skip("no Chromium or Chrome found")

    def page(path: Path) -> Page:
        command = [chromium, *_BROWSER_FLAGS, f"--user-data-dir={tmp_path / 'profile'}", "--dump-dom", path.as_uri()]
        done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
        drawn = done.stdout.count('class="user-select-none svg-container"')
        return Page(
            re.findall(r".*CONSOLE.*", done.stderr),
            len(re.findall(r'<div class="plot\b[^>]*role="img"', done.stdout)),
            drawn,
            done.stdout.count('<a class="data"'),
        )

    return page


#: Widths of a phone, a tablet or half a window, and a desk's screen, in CSS pixels.
WIDTHS = (360, 768, 1280)


@pytest.fixture
def looked_at(tmp_path) -> Callable[..., list[dict]]:
    """Opens reports in frames of every width of ``WIDTHS``, ``dark`` or light, and says what is seen in each."""
    chromium = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if chromium is None:
        pytest.skip("no Chromium or Chrome found")

    def look(*paths: Path, dark: bool = False) -> list[dict]:
        reports = json.dumps([[path.parent.name, path.read_text(encoding="utf-8")] for path in paths])
        given = "const reports = {}, widths = {};".format(reports.replace("</", r"<\/"), json.dumps(WIDTHS))
        host = tmp_path / "host.html"
        frames = (ROOT / "test" / "report" / "frames.html").read_text(encoding="utf-8")
        host.write_text(frames.replace("// given", given), encoding="utf-8")
        scheme = [f"--blink-settings=preferredColorScheme={0 if dark else 1}"]
        patient = ["--virtual-time-budget=120000", "--window-size=1400,900"]  # the time passes at once where it is idle
        command = [chromium, *_BROWSER_FLAGS, *scheme, *patient, f"--user-data-dir={tmp_path / 'look'}"]
        done = subprocess.run(
            [*command, "--dump-dom", host.as_uri()], capture_output=True, text=True, timeout=300, check=True
        )
        found = re.search(r'<pre id="found">(.*?)</pre>', done.stdout, re.DOTALL)
        assert found, done.stderr[-2000:]
        return list(json.loads(html.unescape(found[1])))

    return look


@pytest.fixture
def fit_everywhere(looked_at) -> Callable[..., None]:
    """Asserts that reports are whole at every width, light and dark: none overflows, no plot is empty or unlinked."""

    def look(*paths: Path) -> None:
        paper = set()
        for dark in (False, True):
            for page in looked_at(*paths, dark=dark):
                where = f"{page['name']}, {page['width']} px, {'dark' if dark else 'light'}"
                assert page["overflow"] <= 0 and not page["out"], f"{where}: {page['out']}"
                assert page["plots"] > 0 and not page["empty"], f"{where}: {page['empty']}"
                assert not page["labels"], f"{where}: {page['labels']}"
                assert page["linked"] == page["plots"], f"{where}: {page['plots'] - page['linked']} plots without data"
                paper.add((dark, page["paper"]))
        assert len(paper) == 2  # one colour of paper in the light, another in the dark

    return look


#: Memory of a test worker from which freed memory is given back, and from which compiled programs are let go, MB. The
#: programs of the gap for two lengths of flights take 700 MB beside 400 MB of libraries; to load them again costs 4 s.
_LARGE, _TOO_LARGE = 1000.0, 1300.0
#: Memory from which they are let go even within a module: a worker must stay below 2 GB.
_FAR_TOO_LARGE = 1450.0


@pytest.fixture(autouse=True)
def returned_memory() -> Iterator[None]:
    """Gives back, after a test whose worker has grown large, what was freed: the C library keeps it otherwise.

    Compiling leaves more than half of a worker's memory so. Only glibc can be asked for it.
    """
    yield
    if _resident_megabytes() > _LARGE:
        _trim()
    if _resident_megabytes() > _FAR_TOO_LARGE:
        _forget_programs()


@pytest.fixture(scope="module", autouse=True)
def bounded_memory() -> Iterator[None]:
    """Frees JAX's compiled programs after a module of tests whose worker has grown large; the disk keeps them."""
    yield
    if _resident_megabytes() > _TOO_LARGE:
        _forget_programs()


def _forget_programs() -> None:
    """Let JAX's compiled programs go, and give their memory back."""
    jax = sys.modules.get("jax")
    if jax is not None:
        jax.clear_caches()
        gc.collect()
        _trim()


def _trim() -> None:
    """Give freed memory back to the system, where the C library can (glibc)."""
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)


def _resident_megabytes() -> float:
    """Memory of this process now, MB; zero where the system does not tell (``/proc`` is Linux's)."""
    statm = Path("/proc/self/statm")
    return int(statm.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6 if statm.exists() else 0.0
