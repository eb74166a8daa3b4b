"""The page of effects is the one that the code writes, and it is complete."""

from pathlib import Path
from xml.etree.ElementTree import parse

import numpy as np

from sysid_node.sim import EFFECTS
from sysid_node.sim.pages.effects_page import EXAMPLES, page
from sysid_node.sim.pages.line_chart import LineChart, draw

DOCS = Path(__file__).resolve().parents[3] / "docs" / "reference"


def test_the_page_is_up_to_date():
    assert (DOCS / "effects.md").read_text(encoding="utf-8") == page(), (
        "run python -m sysid_node.sim.pages.effects_page"
    )


def test_every_effect_has_an_example_and_a_picture():
    assert set(EXAMPLES) == set(EFFECTS)
    for name in EFFECTS:
        assert parse(DOCS / "effects" / f"{name}.svg").getroot().findall(".//{*}polyline"), name


def test_a_flat_line_can_be_drawn():
    time = np.linspace(0.0, 1.0, 10)
    assert "NaN" not in draw([LineChart("flat", time, time * 0, time * 0)], "nothing").replace("nan", "NaN")
