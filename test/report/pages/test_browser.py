"""Pages in a real browser: every plot is drawn, nothing is complained of, and no page is wider than the window."""

import pytest
import synthetic
import synthetic_loop
from fleet_flights import fleet

from sysid_node.aircraft.load import load_aircraft
from sysid_node.fleet.results import FleetResults
from sysid_node.fleet.statistics.summarise import summarise
from sysid_node.report.fleet import write
from sysid_node.report.pages.closed_loop_page import write_loop
from sysid_node.report.pages.run_page import write_report


@pytest.mark.slow
def test_plots_are_drawn_without_a_complaint(tmp_path, browse):
    path = tmp_path / "report.html"
    write_report(path, synthetic.run(seconds=20.0))
    page = browse(path)
    assert page.complaints == []
    assert page.drawn == page.plots > len(synthetic.TRUTH)
    assert page.data_links == page.plots


@pytest.mark.slow
def test_pages_fit_every_width_light_and_dark(tmp_path, fit_everywhere):
    """A run's, a closed loop's and a fleet's page on a phone, a tablet and a screen."""
    run, flown, many = (tmp_path / name for name in ("run", "loop", "fleet"))
    for folder in (run, flown, many):
        folder.mkdir()
    write_report(run / "report.html", synthetic.run(seconds=20.0))
    write_loop(flown, synthetic_loop.episode())
    files = {"cdrw": load_aircraft("cdrw")}
    results = FleetResults(tuple(fleet(worn="t3", wear=-0.04, tails=6)), (), ())
    write(results, summarise(results, files), many, files)
    fit_everywhere(*(folder / "report.html" for folder in (run, flown, many)))
