"""Errors of instruments and stamps that a file states, taken out of records. Truth: signals in closed form."""

from dataclasses import replace

import numpy as np
import pytest
from late_flight import UNCERTAIN
from made_flight import KESTREL, TRUTH, flight

from sysid_node.aircraft.model import Aircraft, UncertainValue
from sysid_node.batch.identify import identify
from sysid_node.batch.results.batch_fit import BatchFit
from sysid_node.batch.settings import BatchSettings
from sysid_node.batch.systematic.stated_errors import without_stated_errors
from sysid_node.flight.record import Array, FlightRecord

TIME = np.arange(0.0, 10.0, 0.01)


def wave(late: float, frequency: float = 3.0) -> Array:
    return np.sin(frequency * (TIME - late))


def late(aircraft: Aircraft, **delays: float) -> Aircraft:
    values = {topic: UncertainValue(delay, 0.001) for topic, delay in delays.items()}
    return replace(aircraft, delays={**aircraft.delays, **values})


def test_topics_are_read_later_by_how_much_later_than_the_imu_they_are_stamped() -> None:
    record = FlightRecord(TIME, {"q": wave(0.02), "alpha": wave(0.05), "de": wave(0.03), "thrust": wave(0.03)})
    found = without_stated_errors(late(KESTREL, imu=0.02, air_data=0.05, actuators=0.03), record)
    for name in record.columns:  # all as the IMU has them, whose stamps stay
        np.testing.assert_allclose(found[name][10:-10], wave(0.02)[10:-10], atol=1e-6, err_msg=name)
    assert found.columns.keys() == record.columns.keys()


def test_a_file_that_states_nothing_leaves_the_record() -> None:
    record = FlightRecord(TIME, {"q": wave(0.0)})
    assert without_stated_errors(KESTREL, record) is record


#: In which other instruments are wrong, too.
WRONG = {"airspeed_scale": {"error": 0.08}, "vane_scale": {"alpha": 0.25, "beta": 0.1}, "imu_bias": {"ax": 0.3}}
DELAYS = {"imu": 0.02, "air_data": 0.03, "actuators": -0.01}


def recorded(seed: int) -> FlightRecord:
    """A flight by instruments that read too much and are stamped late."""
    record = flight(seed)
    columns = dict(record.columns)
    columns["V"] = columns["V"] * 1.08
    columns["alpha"], columns["beta"], columns["ax"] = (
        columns["alpha"] * 1.25,
        columns["beta"] * 1.1,
        columns["ax"] + 0.3,
    )
    topics = {"air_data": ("V", "alpha", "beta"), "actuators": ("de", "da", "dr")}
    for topic, names in topics.items():
        for name in names:
            columns[name] = np.interp(record.time - (DELAYS[topic] - DELAYS["imu"]), record.time, columns[name])
    return replace(record, columns=columns)


def fit(aircraft: Aircraft) -> BatchFit:
    settings = BatchSettings(actuators="positions")
    return identify("equation_error", aircraft, [recorded(1), recorded(2)], settings).fit


def off(found: BatchFit) -> list[float]:
    """Errors of valid estimates, in standard errors."""
    return [abs(e.value - TRUTH[n]) / e.standard_error for n, e in found.estimates.items() if n in TRUTH and e.valid]


@pytest.mark.slow
def test_intervals_hold_with_a_file_that_states_what_is_off_and_not_with_a_silent_one() -> None:
    effects = {name: {key: UncertainValue(x, 0.005) for key, x in values.items()} for name, values in WRONG.items()}
    stated = off(fit(replace(late(UNCERTAIN, **DELAYS), effects=effects)))
    silent = off(fit(UNCERTAIN))
    assert max(stated) < 1.5
    assert max(silent) > 2.5
    assert len(stated) > len(silent)


def test_what_is_not_taken_into_account_is_said() -> None:
    file = replace(UNCERTAIN, effects={"stall_separation": {"depth": UncertainValue(1.0)}})
    found = identify("equation_error", file, [flight(1)], BatchSettings(actuators="positions")).fit
    assert [remark for remark in found.remarks if "do not correct for stall_separation" in remark]


def test_a_mass_that_the_file_states_as_an_effect_is_the_mass() -> None:
    heavier = replace(KESTREL, effects={"mass_error": {"error": UncertainValue(0.2)}})
    other = replace(KESTREL, mass=1.2 * KESTREL.mass)
    settings = BatchSettings(actuators="positions")
    by_effect, by_mass = (identify("equation_error", one, [flight(1)], settings).fit.values for one in (heavier, other))
    assert by_effect == pytest.approx(by_mass)
