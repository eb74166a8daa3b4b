"""The page in a real browser: every plot is drawn and nothing is complained of."""

import synthetic

from sysid_node.report.pages.run_page import write_report


def test_plots_are_drawn_without_a_complaint(tmp_path, browse):
    path = tmp_path / "report.html"
    write_report(path, synthetic.run(seconds=20.0))
    page = browse(path)
    assert page.complaints == []
    assert page.drawn == page.plots > len(synthetic.TRUTH)
    assert page.data_links == page.plots
