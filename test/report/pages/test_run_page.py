"""The page: nothing from outside, everything said, and well formed whatever is missing."""

import base64
import json
import math
import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
import synthetic

from sysid_node.online.types import DerivativeEstimate, Estimates
from sysid_node.report.pages.render import render_page
from sysid_node.report.pages.run_page import SECTIONS
from sysid_node.report.results.run_result import Prior, References, RunData, RunResult
from sysid_node.report.results.signals import RunSignals, Spectra
from sysid_node.report.sections import budget, derivatives

VOID = {"meta", "link", "br", "rect", "line", "circle", "path"}


class Outline(HTMLParser):
    """Collects what the tests ask for, and fails where elements do not nest."""

    def __init__(self):
        super().__init__(convert_charrefs=True)
        self.open, self.links, self.ids, self.text, self.figures, self.labels = [], [], [], [], [], []

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        self.links += [value for key, value in attributes if key in ("src", "href", "xlink:href", "data", "action")]
        self.ids += [found["id"]] if "id" in found else []
        self.labels += [found.get("aria-label", "")] if found.get("class") == "plot" else []
        if tag not in VOID:
            self.open.append((tag, found))

    def handle_startendtag(self, tag, attributes):
        self.links += [value for key, value in attributes if key in ("src", "href", "xlink:href")]

    def handle_endtag(self, tag):
        assert self.open, f"</{tag}> closes nothing"
        assert self.open[-1][0] == tag, f"</{tag}> at {self.getpos()} closes <{self.open[-1][0]}>"
        self.open.pop()

    def handle_data(self, data):
        tag, attributes = self.open[-1] if self.open else ("", {})
        if tag == "script" and attributes.get("type") == "application/json":
            self.figures.append(json.loads(data))
        elif tag not in ("script", "style"):
            self.text.append(data)

    @property
    def words(self) -> str:
        return re.sub(r"\s+", " ", "".join(self.text))


def outline(run: RunResult) -> Outline:
    page = Outline()
    page.feed(render_page(run.heading, SECTIONS, run))
    page.close()
    assert page.open == []
    assert len(page.ids) == len(set(page.ids))
    return page


def single(d: DerivativeEstimate, **references) -> RunResult:
    history = [Estimates(8.0, {d.name: d}, {})]
    return RunResult("kestrel", "output_error", history, references=References(**references))


@pytest.fixture(scope="module")
def full() -> Outline:
    return outline(synthetic.run())


def test_nothing_comes_from_outside(full):
    assert full.links
    assert all(link.startswith(("#", "data:")) for link in full.links)
    html = render_page("title", SECTIONS, synthetic.run(seconds=10.0))
    ours = re.sub(r"<script>.*?</script>", "", html, flags=re.DOTALL)
    assert "http" not in ours
    assert "@import" not in ours
    assert "url(" not in ours


def test_every_link_of_the_contents_leads_somewhere(full):
    targets = {link[1:] for link in full.links if link.startswith("#")}
    assert targets <= set(full.ids)
    assert len(targets) == len(SECTIONS) - 1


def test_all_derivatives_and_statuses_are_said(full):
    for name in synthetic.TRUTH:
        assert f" {name} " in full.words.replace(name, f" {name} ")
    for status in synthetic.STATUS.values():
        assert status in full.words


def test_rejections_settings_and_remarks_are_said(full):
    assert "imu/data" in full.words
    assert "duplicate stamp" in full.words
    assert "0.1 : 0.04 : 2" in full.words
    assert "All numbers of this page are synthetic." in full.words


def test_every_plot_has_words_for_who_cannot_see_it(full):
    assert len(full.labels) == len(full.figures) > len(synthetic.TRUTH)
    assert all(len(label) > 10 for label in full.labels)


def test_the_opening_counts_what_is_known(full):
    final = synthetic.run().final.derivatives.values()
    valid = [d for d in final if d.valid]
    held = sum(d.lower <= synthetic.TRUTH[d.name] <= d.upper for d in valid)
    assert f"{len(valid)} of {len(synthetic.TRUTH)} derivatives are known" in full.words
    assert f"{held} of {len(valid)} valid intervals contain theirs" in full.words


@pytest.mark.parametrize(
    ("interval", "said", "not_said"),
    [
        ((-0.6, -0.4), "tends back to trim", "further away"),
        ((0.4, 0.6), "tends further away from trim", "back to trim"),
        ((-0.1, 0.1), "all 1 derivatives", "trim ("),
    ],
)
def test_handling_is_only_claimed_where_the_interval_has_one_sign(interval, said, not_said):
    low, high = interval
    d = DerivativeEstimate("Cm_alpha", (low + high) / 2, (high - low) / 4, low, high, True, "ok")
    opening = outline(single(d)).words.split("Aircraft")[0]
    assert said in opening
    assert not_said not in opening


def test_invalid_estimates_make_no_claims():
    d = DerivativeEstimate("Cm_alpha", -0.5, 0.01, -0.52, -0.48, False, "outside model")
    words = outline(single(d)).words
    assert "tends back" not in words
    assert "none of the 1 derivative is known" in words
    assert "flown where the model does not hold" in words


def test_a_difference_from_prior_and_truth_is_flagged():
    d = DerivativeEstimate("Cm_de", -0.5, 0.01, -0.52, -0.48, True, "ok")
    words = outline(single(d, prior={"Cm_de": Prior(-1.0, 0.05)}, truth={"Cm_de": -0.9})).words
    assert "−1.000 ± 0.098 differs" in words.replace("differs", " differs").replace("  ", " ")
    assert "outside" in words
    alike = outline(single(d, prior={"Cm_de": Prior(-0.52, 0.05)}, truth={"Cm_de": -0.5})).words
    assert "No estimate differs from the aircraft file" in alike


NOTHING = RunResult("kestrel", "sls_rft", [])


def spectral(spectra: Spectra) -> RunResult:
    """A run that holds spectra and nothing else."""
    return replace(NOTHING, signals=RunSignals(spectra=spectra))


NAN = DerivativeEstimate("Cm_q", math.nan, math.nan, math.nan, math.nan, False, "not excited")
WIDE = DerivativeEstimate("Cm_q", 1.0, math.inf, -math.inf, math.inf, False, "converging")
EXACT = DerivativeEstimate("bias <q>", 0.0, 0.0, 0.0, 0.0, True, "ok")


@pytest.mark.parametrize(
    "run",
    [
        NOTHING,
        replace(NOTHING, data=RunData(rejected={"no reason": 3, "imu/data: stale": 0})),
        single(NAN, prior={"Cm_q": Prior(-1.0)}, truth={"Cm_q": 0.0}),
        replace(single(NAN), history=[Estimates(t, {"Cm_q": NAN}, {}) for t in (1.0, 2.0)]),
        replace(single(WIDE), history=[Estimates(t, {"Cm_q": WIDE}, {}) for t in (1.0, 1.0)]),
        single(WIDE, prior={"Cm_q": Prior(0.0, 0.0)}),
        single(EXACT, truth={"bias <q>": 1.0}),
        spectral(Spectra(np.array([0.1]), {"de": np.array([np.nan])}, {}, {"Cm": np.array([0.0])})),
        spectral(Spectra(np.empty(0))),
        replace(synthetic.run(seconds=2.0), title="<script>alert(1)</script> & more"),
    ],
    ids=[
        "nothing",
        "rejected",
        "nan",
        "nan-history",
        "infinite",
        "zero-prior",
        "exact",
        "one-line",
        "no-line",
        "markup",
    ],
)
def test_whatever_is_missing_the_page_is_whole(run):
    page = outline(run)
    assert "alert(1)" not in [data for tag, data in ((t, d) for t, d in page.open)]
    assert not re.search(r"\b(nan|None|inf)\b", page.words)
    for figure in page.figures:
        assert_no_nan_limits(figure)


def assert_no_nan_limits(figure):
    for axis in ("xaxis", "yaxis"):
        low, high = figure["layout"][axis].get("range", (0, 1))
        assert math.isfinite(low)
        assert low < high or axis == "xaxis"


@pytest.mark.parametrize(
    ("value", "believed", "span", "place"),
    [
        *[(-0.5, -0.5, "100", 50.0), (-0.75, -0.5, "200", 62.5), (0.75, 0.5, "200", 62.5)],
        *[(0.25, 0.5, "200", 37.5), (-0.25, -0.5, "200", 37.5), (2.0, 0.5, "200", 100.0)],
    ],
)
def test_picture_shows_weaker_left_and_stronger_right(value, believed, span, place):
    wide = 0.6 * abs(believed)
    d = DerivativeEstimate("Cm_de", value, wide / 2, value - wide, value + wide, True, "ok")
    table = derivatives.context(single(d, truth={"Cm_de": believed}))
    mark = table["groups"][0][1][0].mark
    assert table["span"] == f"{span}\u202f%"
    assert mark.at == pytest.approx(place)
    assert mark.lower <= mark.at <= mark.upper
    assert mark.beyond == ("right" if place == 100.0 else "")


def test_an_abrupt_change_is_marked_when_it_was_noticed():
    ok = DerivativeEstimate("Cm_de", -0.5, 0.01, -0.52, -0.48, True, "ok")
    changed = ok._replace(valid=False, status="changed")
    history = [Estimates(float(t), {"Cm_de": changed if 3 <= t < 5 else ok}, {}) for t in range(9)]
    page = outline(RunResult("kestrel", "sls_rft", history))
    (panel,) = page.figures
    assert [shape["x0"] for shape in panel["layout"]["shapes"]] == [3.0]
    assert "an abrupt change was detected" in page.words


def test_titles_are_escaped():
    html = render_page("<script>alert(1)</script>", SECTIONS, NOTHING)
    assert "<script>alert" not in html


def test_without_plots_there_is_no_script():
    assert len(render_page("title", SECTIONS, NOTHING)) < 50_000


def test_drawn_lines_are_the_estimates(full):
    run = synthetic.run()
    label = next(i for i, label in enumerate(full.labels) if label.startswith("Cm_alpha against time"))
    solid = full.figures[label]["data"][-1]
    drawn = np.frombuffer(base64.b64decode(solid["y"]["bdata"]), dtype=solid["y"]["dtype"])
    valid = [(e.derivatives["Cm_alpha"].value, e.derivatives["Cm_alpha"].valid) for e in run.history]
    expected = np.array([value if ok else np.nan for value, ok in valid], dtype=np.float32)
    np.testing.assert_array_equal(drawn, expected)


def test_figures_are_valid_plotly(full):
    graph_objects = pytest.importorskip("plotly.graph_objects", reason="Plotly for Python checks the figures' keys")
    assert full.figures
    for figure in full.figures:
        assert graph_objects.Figure(figure).data, "a key that Plotly does not know raises"


def test_a_live_estimate_whose_errors_have_no_parts_is_not_called_exact():
    noise = DerivativeEstimate("Cm_q", -1.0, 0.1, -1.2, -0.8, True, "ok")
    live = noise._replace(systematic_error=0.05)
    for estimate, stated in ((noise, False), (live, True)):
        run = RunResult("kestrel", "iv_rft", [Estimates(1.0, {"Cm_q": estimate}, {})])
        assert budget.context(run) == {"rows": [], "stated": stated}


def test_rows_of_the_error_budget_name_the_largest_sources_and_what_reduces_the_first():
    """Three sources at most, and none of less than 5 %; a derivative without known shares has no row."""
    noise = DerivativeEstimate("Cm_q", -1.0, 0.1, -1.2, -0.8, True, "ok", 0.05, 0.087)
    shares = {
        "Cm_q": {"actuator_lag.elevator": 0.6, "statistical": 0.25, "delays.imu": 0.08, "mass": 0.06},
        "Cm_de": {"controls.elevator.scale": 0.93, "geometry.S": 0.04},
        "CD_0": {},
    }
    derivatives_found = {name: noise._replace(name=name) for name in shares}
    final = Estimates(1.0, derivatives_found, {}, {}, shares)
    rows = budget.context(RunResult("kestrel", "iv_rft", [final]))["rows"]
    assert [(row.name, row.sources, row.advice) for row in rows] == [
        (
            "Cm_q",
            "the elevator servo's time 60 %, noise and gusts 25 %, the delay of the IMU 8 %",
            "measure it on the bench, or record positions",
        ),
        ("Cm_de", "the elevator's throw 93 %", "measure it with a throw gauge"),
    ]
    words = outline(RunResult("kestrel", "iv_rft", [final])).words
    assert all(f"{row.name}{row.sources}{row.advice}" in words for row in rows)
