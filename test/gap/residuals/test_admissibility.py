"""Mean lift tells another aircraft, but not one whose vane is off; truth: flights of this simulator."""

from dataclasses import replace

import pytest
from gap_flights import fly

from sysid_node.errors import InputError
from sysid_node.gap.residuals import admissibility
from sysid_node.gap.residuals.admissibility import admitted
from sysid_node.gap.residuals.build import view_of
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


@pytest.mark.parametrize(("alpha", "stalled"), [(0.05, False), (0.2, True)])
def test_a_third_of_the_lift_is_a_stall_at_large_angles_only(
    plain_view, monkeypatch: pytest.MonkeyPatch, alpha: float, stalled: bool
) -> None:
    monkeypatch.setattr(admissibility, "_VANE", 0.0)  # no vane is off
    record, series = plain_view.record, plain_view.series.copy()
    series[:, 0] = plain_view.predicted_series(plain_view.simulator.neutral())[:, 0] / 3.0
    turned = record["alpha"] - record["alpha"].mean() + alpha
    view = replace(plain_view, series=series, record=replace(record, columns={**record.columns, "alpha": turned}))
    if stalled:
        assert admitted(view) is view
    else:
        with pytest.raises(InputError, match="another aircraft's flight"):
            admitted(view)
