"""Mean lift tells another aircraft, but not one whose vane is off; truth: flights of this simulator."""

from dataclasses import replace

import pytest
from gap_flights import fly

from sysid_node.errors import InputError
from sysid_node.gap.admission import admitted
from sysid_node.gap.viewing import view_of
from sysid_node.sim import Simulator


def test_a_flight_of_another_aircraft_is_refused(aircraft, plain) -> None:
    heavier = replace(aircraft, mass=4.0 * aircraft.mass)
    with pytest.raises(InputError, match="another aircraft's flight"):
        admitted(view_of(Simulator(heavier, 50.0), plain))


def test_a_vane_that_is_three_degrees_off_is_no_other_aircraft(aircraft) -> None:
    view = view_of(Simulator(aircraft, 50.0), fly(aircraft, {"vane_bias": {"alpha": -0.055}}, seed=31))
    expected = view.predicted_series(view.simulator.neutral())[:, 0].mean()
    assert view.series[:, 0].mean() > 2.5 * expected
    assert admitted(view) is view
