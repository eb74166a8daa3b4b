"""Pages in a real browser: every plot is drawn, nothing is complained of, and no page is wider than the window."""

import synthetic
from fleet_flights import fleet

from sysid_node.aircraft.load import load_aircraft
from sysid_node.fleet.results import FleetResults
from sysid_node.fleet.statistics.summarise import summarise
from sysid_node.report.fleet import write
from sysid_node.report.pages.run_page import write_report


def test_plots_are_drawn_without_a_complaint(tmp_path, browse):
    path = tmp_path / "report.html"
    write_report(path, synthetic.run(seconds=20.0))
    page = browse(path)
    assert page.complaints == []
    assert page.drawn == page.plots > len(synthetic.TRUTH)
    assert page.data_links == page.plots


def test_pages_fit_every_width_light_and_dark(tmp_path, looked_at):
    """A run's and a fleet's page on a phone, a tablet and a screen: no overflow, no empty plot, no label on another."""
    run, many = tmp_path / "run" / "report.html", tmp_path / "fleet"
    run.parent.mkdir()
    many.mkdir()
    write_report(run, synthetic.run(seconds=20.0))
    files = {"cdrw": load_aircraft("cdrw")}
    results = FleetResults(tuple(fleet(worn="t3", wear=-0.04, tails=6)), (), ())
    write(results, summarise(results, files), many, files)
    paper = set()
    for dark in (False, True):
        for page in looked_at(run, many / "report.html", dark=dark):
            where = f"{page['name']}, {page['width']} px, {'dark' if dark else 'light'}"
            assert page["overflow"] <= 0 and not page["out"], f"{where}: {page['out']}"
            assert page["plots"] > 0 and not page["empty"], f"{where}: {page['empty']}"
            assert not page["labels"], f"{where}: {page['labels']}"
            paper.add((dark, page["paper"]))
    assert len(paper) == 2  # one colour of paper in the light, another in the dark
