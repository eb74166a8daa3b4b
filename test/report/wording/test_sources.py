"""Words for the sources of uncertainty."""

from sysid_node.aircraft.load import load_aircraft
from sysid_node.online.frequency.regression_signals import layout
from sysid_node.online.systematic.imperfections import imperfections
from sysid_node.report.wording.sources import source_words


def test_every_source_of_a_file_has_words():
    aircraft = load_aircraft("cdrw")
    found = imperfections(aircraft, layout(aircraft), commanded=True, positions=False)
    assert found is not None
    for key in ("statistical", *found.keys):
        name, advice = source_words(key)
        assert name != key, key
        assert "{" not in name
        assert advice


def test_the_last_part_of_a_key_is_named():
    assert source_words("actuator_lag.aileron")[0] == "the aileron servo's time"
    assert source_words("controls.rudder.scale")[0] == "the rudder's throw"
