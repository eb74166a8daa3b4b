"""The truth file beside a bag."""

import json

import pytest

from sysid_node.errors import InputError
from sysid_node.flight.truth import read_truth, truth_at_end


def test_beside_the_bag_however_it_is_given(tmp_path):
    bag = tmp_path / "flight"
    bag.mkdir()
    (bag / "flight.mcap").write_bytes(b"")
    assert read_truth(bag) == {}
    (tmp_path / "flight.truth.json").write_text(json.dumps({"derivatives": {"Cm_alpha": -0.6}, "seed": 3}))
    assert read_truth(bag) == {"Cm_alpha": -0.6}
    assert read_truth(f"{bag}/") == {"Cm_alpha": -0.6}
    assert read_truth(bag / "flight.mcap") == {"Cm_alpha": -0.6}


def test_what_changed_in_flight(tmp_path):
    """A value at the end, since when, and none that would hold for the whole flight."""
    (tmp_path / "flight").mkdir()
    changes = [{"time": 20.0, "derivatives": {"Cm_de": -0.3}}, {"time": 40.0, "derivatives": {"Cm_de": -0.1}}]
    said = {"derivatives": {"Cm_alpha": -0.6, "Cm_de": -0.5}, "changes": changes}
    (tmp_path / "flight.truth.json").write_text(json.dumps(said))
    assert truth_at_end(tmp_path / "flight") == ({"Cm_alpha": -0.6, "Cm_de": -0.1}, {"Cm_de": 40.0})
    assert read_truth(tmp_path / "flight") == {"Cm_alpha": -0.6}


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"derivatives": 3}', '{"derivatives": {"Cm_alpha": "x"}}'])
def test_a_file_of_another_kind(tmp_path, text):
    (tmp_path / "flight").mkdir()
    (tmp_path / "flight.truth.json").write_text(text)
    with pytest.raises(InputError, match=r"flight\.truth\.json: expected JSON with derivatives"):
        read_truth(tmp_path / "flight")
