"""Errors of the instruments that the aircraft file states, against the simulator's instruments and late stamps."""

from dataclasses import replace

import numpy as np
import pytest
from made_flights import made_aircraft, made_streams

from sysid_node.aircraft.model import DELAY_EFFECTS, Aircraft, UncertainValue
from sysid_node.dynamics.vector import Vector
from sysid_node.flight.streams import Streams
from sysid_node.online.alignment.in_pieces import align_streams
from sysid_node.online.alignment.stated_errors import StatedErrors
from sysid_node.sim.stations import sensors

IMU = ("ax", "ay", "az", "p", "q", "r")
ERRORS = {
    "imu_bias": dict(zip(IMU, (0.3, -0.2, 0.1, 0.02, -0.03, 0.01), strict=True)),
    "imu_scale": dict(zip(IMU, (0.05, -0.04, 0.03, -0.1, 0.2, 0.07), strict=True)),
    "imu_misalignment": {"roll": 0.1, "pitch": -0.2, "yaw": 0.3},
    "airspeed_scale": {"error": 0.12},
    "vane_scale": {"alpha": -0.3, "beta": 0.25},
    "vane_bias": {"alpha": 0.03, "beta": -0.02},
}


def stating(effects: dict[str, dict[str, float]]) -> Aircraft:
    given = {name: {key: UncertainValue(x, 0.01) for key, x in values.items()} for name, values in effects.items()}
    return replace(made_aircraft(), effects=given)


@pytest.mark.parametrize("left_out", [*ERRORS, ""])
def test_readings_become_what_they_were_made_of(left_out):
    """Truth: the simulator's station ``sensors``, which makes readings of the motion."""
    stated = {name: values for name, values in ERRORS.items() if name != left_out}
    effects = {name: values if name in stated else dict.fromkeys(values, 0.0) for name, values in ERRORS.items()}
    rng = np.random.default_rng(1)
    force, rates, air = rng.normal(0, 9, 3), rng.normal(0, 1, 3), np.array([18.0, 0.1, -0.05])
    imu = (*sensors.accelerometers(effects, Vector(*force)), *sensors.gyroscopes(effects, Vector(*rates)))
    errors = StatedErrors.of(stating(stated))
    np.testing.assert_allclose(errors.imu(imu), [*force, *rates], rtol=0, atol=1e-13)
    found = errors.air_data((*sensors.air_data(effects, *air), 1.2))
    np.testing.assert_allclose(found, [*air, 1.2], rtol=0, atol=1e-14)


def test_numbers_and_columns_give_the_same_bits():
    errors, rng = StatedErrors.of(stating(ERRORS)), np.random.default_rng(2)
    imu, air = rng.normal(0, 5, (6, 50)), rng.normal(0, 5, (4, 50))
    by_column = np.array(errors.imu(tuple(imu))), np.array(errors.air_data(tuple(air)))
    singly = [[change(tuple(row)) for row in x.T.tolist()] for change, x in ((errors.imu, imu), (errors.air_data, air))]
    for columns, rows in zip(by_column, singly, strict=True):
        assert columns.T.tobytes() == np.array(rows).tobytes()


def test_a_file_that_states_nothing_changes_nothing():
    errors, values = StatedErrors.of(made_aircraft()), (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
    assert errors.none
    assert errors.imu(values) is values
    assert errors.air_data(values) is values


def late(streams: Streams, topic: str, by: float) -> Streams:
    stream = getattr(streams, topic)
    arrival = replace(stream.arrival, stamp_ns=stream.arrival.stamp_ns + round(by * 1e9))
    return replace(streams, **{topic: replace(stream, arrival=arrival)})


@pytest.mark.parametrize("as_effects", [False, True])
@pytest.mark.parametrize("carried", ["positions", "commands"])
@pytest.mark.parametrize(
    "delays", [{"imu": 0.02}, {"air_data": 0.3}, {"imu": -0.01, "air_data": 0.04, "actuators": 0.03}]
)
def test_stamps_that_are_late_as_stated_give_the_samples_of_those_that_are_not(delays, carried, as_effects):
    streams = made_streams(3.0)
    stamped = streams
    for topic, by in delays.items():
        stamped = late(stamped, topic, by)
    values = {topic: UncertainValue(by, 0.001) for topic, by in delays.items()}
    made = made_aircraft()
    if as_effects:
        aircraft = replace(made, effects={DELAY_EFFECTS[topic]: {"delay": value} for topic, value in values.items()})
    else:
        aircraft = replace(made, delays={**made.delays, **values})
    wanted = align_streams(made, streams, 0.2, carried)
    found = align_streams(aircraft, stamped, 0.2, carried)
    assert found.samples.tobytes() == wanted.samples.tobytes()
    assert found.time.tobytes() == wanted.time.tobytes()
    assert found.rejected == wanted.rejected
    np.testing.assert_array_equal(found.stamps, wanted.stamps + round(delays.get("imu", 0.0) * 1e9))


def test_a_message_without_a_stamp_does_not_get_one_by_a_delay():
    """A stamp of zero less a negative delay would be one of 1970."""
    made, streams = made_aircraft(), made_streams(1.0)
    streams.air_data.arrival.stamp_ns[5] = 0
    aircraft = replace(made, delays={**made.delays, "air_data": UncertainValue(-0.1)})
    assert (
        align_streams(aircraft, streams, 0.2).rejected["air_data"]
        == align_streams(made, streams, 0.2).rejected["air_data"]
    )
