"""Mean lift tells another aircraft, but not one whose vane is off; truth: flights of this simulator."""

from dataclasses import replace

import pytest
from gap_flights import fly

from sysid_node.errors import InputError
from sysid_node.gap.residuals.admissibility import require_admissible
from sysid_node.gap.residuals.build import residual_model_of
from sysid_node.gap.thresholds import Admission
from sysid_node.sim import Simulator


def test_a_flight_of_another_aircraft_is_refused(aircraft, plain) -> None:
    heavier = replace(aircraft, mass=4.0 * aircraft.mass)
    with pytest.raises(InputError, match="another aircraft's flight"):
        require_admissible(residual_model_of(Simulator(heavier, 50.0), plain))


def test_a_vane_that_is_three_degrees_off_is_no_other_aircraft(aircraft) -> None:
    model = residual_model_of(Simulator(aircraft, 50.0), fly(aircraft, {"vane_bias": {"alpha": -0.055}}, seed=31))
    expected = model.predicted_series(model.simulator.neutral())[:, 0].mean()
    assert model.series[:, 0].mean() > 2.5 * expected
    assert require_admissible(model) is model


@pytest.mark.parametrize(("alpha", "stalled"), [(0.05, False), (0.2, True), (5.0, False)])
def test_a_third_of_the_lift_is_a_stall_at_large_angles_only(plain_model, alpha: float, stalled: bool) -> None:
    exact_vane = Admission(vane_error=0.0)
    record, series = plain_model.record, plain_model.series.copy()
    series[:, 0] = plain_model.predicted_series(plain_model.simulator.neutral())[:, 0] / 3.0
    turned = record["alpha"] - record["alpha"].mean() + alpha
    record = replace(record, columns={**record.columns, "alpha": turned})
    model = replace(plain_model, measurement=replace(plain_model.measurement, series=series, record=record))
    if stalled:
        assert require_admissible(model, exact_vane) is model
    else:
        with pytest.raises(InputError, match="another aircraft's flight"):
            require_admissible(model, exact_vane)
