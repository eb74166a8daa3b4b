"""PX4's logs, of before and after 1.14: the flight that was written comes back, with the commands of its controls."""

from dataclasses import replace

import numpy as np
import pytest
from simulated_logs import FULL, FULL_RATES, PX4_DEFAULT, aircraft, px4_log

from sysid_node.errors import InputError
from sysid_node.flight.align import flight_record
from sysid_node.flight.logs.checks.survey import survey
from sysid_node.flight.logs.opening import load_flight_record, open_log, open_streams, read_autopilot_log
from sysid_node.flight.streams import COMMANDS


@pytest.mark.parametrize("kind", ["ailerons", "elevons", "before 1.14"])
def test_the_flight_comes_back(tmp_path, kind):
    """Truth: the record that was written. ULog holds single precision; pulses and fractions are exact to that."""
    record = px4_log(tmp_path / "renamed.dat", old=kind == "before 1.14", elevons=kind == "elevons")
    streams = open_streams(tmp_path / "renamed.dat", aircraft())
    assert streams.actuators.content == COMMANDS
    back = flight_record(aircraft(), streams, 0.2)
    at = np.searchsorted(record.time, record.time[0] + back.time + 1e-4) - 1
    for name, tolerance in {
        "ax": 1e-4,
        "q": 1e-5,
        "theta": 1e-5,
        "de": 1e-5,
        "da": 1e-5,
        "dr": 1e-5,
        "thrust": 1e-3,
    }.items():
        np.testing.assert_allclose(back[name], record[name][at], atol=tolerance, err_msg=name)
    np.testing.assert_allclose(back["V"][::2], record["V"][at][::2], atol=1e-4)
    np.testing.assert_allclose(back["rho"], record["rho"][at], atol=1e-4)
    assert not back.measured("alpha")


def test_the_part_that_was_flown_is_taken(tmp_path):
    """Truth: landed until 4 s and from 15 s on (vehicle_land_detected)."""
    record = px4_log(tmp_path / "flight.ulg", aloft=(4.0, 15.0))
    back = load_flight_record(tmp_path / "flight.ulg", aircraft())
    assert back.duration == pytest.approx(11.0, abs=0.05)
    first = np.searchsorted(record.time, record.time[0] + 4.0)
    assert np.abs(record["q"][first : first + 4] - back["q"][0]).min() < 1e-5
    (said,) = (remark for remark in open_log(tmp_path / "flight.ulg").remarks if "flown as a fixed wing" in remark)
    assert said == "flown as a fixed wing: 11.0 of 20.0 s (4.0 to 15.0 s); the rest is left out"


@pytest.mark.parametrize("bank", ["MAIN", "AUX"])
def test_servos_are_read_from_their_pulses(tmp_path, bank):
    """Truth: the record. Only the outputs' pulses are logged, of servos 1 to 4 at outputs of other numbers.

    PX4 maps -1..1 to PWM_*_MIN..MAX, the other way round where the output's bit of PWM_*_REV is set.
    """
    record = px4_log(tmp_path / "flight.ulg", pulses=bank)
    streams = open_streams(tmp_path / "flight.ulg", aircraft())
    assert streams.actuators.source == "actuator_outputs"
    back = flight_record(aircraft(), streams, 0.2)
    at = np.searchsorted(record.time, record.time[0] + back.time + 1e-4) - 1
    for name in ("de", "da", "dr"):
        np.testing.assert_allclose(back[name], record[name][at], atol=1e-4, err_msg=name)


def test_vanes_are_used_where_they_are_valid(tmp_path):
    """Truth: the record. A vane at its stop says ``valid`` = 0, and holds 1 rad there (PX4's airflow_aoa.msg)."""
    record = px4_log(tmp_path / "flight.ulg", vanes={"aoa": (5.0, 8.0), "slip": (30.0, 40.0)})
    back = load_flight_record(tmp_path / "flight.ulg", aircraft())
    at = np.searchsorted(record.time, record.time[0] + back.time + 1e-4) - 1
    out = (back.time > 4.99) & (back.time < 8.0)
    np.testing.assert_array_equal(np.isnan(back["alpha"]), out)
    for name in ("alpha", "beta"):  # vanes come at every second of the IMU's times
        known = np.isfinite(back[name])
        known[1::2] = False
        np.testing.assert_allclose(back[name][known], record[name][at][known], atol=1e-5)
        assert known.sum() > 800
    assert np.isfinite(back["beta"]).all()


def test_a_vane_that_was_never_valid_is_none(tmp_path):
    px4_log(tmp_path / "flight.ulg", vanes={"aoa": (0.0, 99.0)})
    log = read_autopilot_log(tmp_path / "flight.ulg")
    assert log.vanes is None
    px4_log(tmp_path / "other.ulg", vanes={"aoa": (0.0, 99.0), "slip": (99.0, 100.0)})
    back = load_flight_record(tmp_path / "other.ulg", aircraft())
    assert not back.measured("alpha")
    assert back.measured("beta")


def test_messages_are_in_the_order_in_which_they_were_logged(tmp_path):
    """A replay takes the messages in this order, and waits for a late topic for 5 s only."""
    px4_log(tmp_path / "flight.ulg")
    streams = open_streams(tmp_path / "flight.ulg", aircraft()).by_topic.values()
    order = np.concatenate([stream.arrival.order for stream in streams])
    stamps = np.concatenate([stream.arrival.stamp_ns for stream in streams])
    np.testing.assert_array_equal(np.sort(order), np.arange(order.size))
    assert np.all(np.diff(stamps[np.argsort(order)]) >= 0)


def test_the_torque_setpoint_stands_for_slow_servos(tmp_path):
    """Servos at PX4's default of 10 Hz, the torque at 50 Hz: commands are known as often as the torque."""
    record = px4_log(tmp_path / "flight.ulg", PX4_DEFAULT, torque=50.0)
    flight = open_log(tmp_path / "flight.ulg")
    assert flight.streams.actuators.source == "vehicle_torque_setpoint"
    assert any("reproduces actuator_servos" in remark for remark in flight.remarks)
    back = load_flight_record(tmp_path / "flight.ulg", aircraft())
    at = np.searchsorted(record.time, record.time[0] + back.time + 1e-4) - 1
    for name in ("de", "da", "dr"):
        assert np.std(back[name] - record[name][at]) < 0.1 * np.std(record[name])


def test_slow_airspeed_moves_as_the_imu_says(tmp_path):
    """Completed by the IMU, the airspeed is as near to the measured one as a line between the samples, or nearer."""
    record = px4_log(tmp_path / "flight.ulg", {**FULL_RATES, "airspeed": 2.0, "attitude": 20.0})
    back = load_flight_record(tmp_path / "flight.ulg", aircraft())
    at = np.searchsorted(record.time, record.time[0] + back.time + 1e-4) - 1
    every = np.arange(0, len(record), 50)
    line = np.interp(record.time[at], record.time[every], record["V"][every])
    completed, straight = (np.std(v - record["V"][at]) for v in (back["V"], line))
    assert completed <= straight * 1.02
    remarks = open_log(tmp_path / "flight.ulg").remarks
    assert any("airspeed_validated comes at 2 Hz" in remark for remark in remarks)


def test_a_sensor_that_px4_does_not_use_is_not_used(tmp_path):
    """Truth: the record's airspeed. The sensor is blocked from 8 to 12 s (airspeed_source 0, AirspeedValidated.msg)."""
    record = px4_log(tmp_path / "flight.ulg", {**FULL_RATES, "airspeed": 5.0}, blocked=(8.0, 12.0))
    air = open_streams(tmp_path / "flight.ulg", aircraft()).air_data
    since = (air.arrival.stamp_ns - air.arrival.stamp_ns[0]) / 1e9
    assert not np.any((since > 8.2) & (since < 11.99))
    at = np.searchsorted(record.time - record.time[0], since + 1e-4) - 1
    used = (since < 7.99) | (since > 12.2)
    np.testing.assert_allclose(air.values[used, 0], record["V"][at][used], rtol=0.02)
    assert used.sum() > 750


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (
            {"rates": {**FULL_RATES, "airspeed": 5.0}, "blocked": (0.0, 99.0)},
            "airspeed_validated never comes from a sensor; connect an airspeed sensor",
        ),
        ({"vehicle_type": 1}, "never flew as a fixed wing"),
        ({"drop": ("airspeed_validated",)}, "no airspeed in it; connect an airspeed sensor"),
        ({"drop": ("sensor_combined",)}, "no sensor_combined in it; SDLOG_PROFILE = 27"),
        ({"drop": ("actuator_servos",)}, r"ulg: no actuator_servos in it; SDLOG_PROFILE = 27 logs it in full [^)]*\)$"),
        (
            {"drop": ("actuator_controls_0",), "old": True},
            r"ulg: no actuator_controls_0 in it; SDLOG_PROFILE = 27 logs it in full \([^)]*\)$",
        ),
        (
            {"pulses": "MAIN", "parameters": {"PWM_MAIN_FUNC3": 0}},
            r"ulg: which output moves which surface is not known \(no actuator_servos in it, and no PWM_MAIN_FUNCn or",
        ),
        (
            {"rates": PX4_DEFAULT},
            "actuator_servos comes at 10 Hz; 20 Hz are needed; SDLOG_PROFILE = 27",
        ),
        ({"jump": -30.0}, "the stamps of sensor_combined go back by 30.0 s after 10.0 s"),
    ],
)
def test_what_a_log_lacks_is_one_line(tmp_path, options, said):
    px4_log(tmp_path / "flight.ulg", **options)
    with pytest.raises(InputError, match=said):
        load_flight_record(tmp_path / "flight.ulg", aircraft())


def test_a_clock_that_jumps_ahead_leaves_a_gap(tmp_path):
    record = px4_log(tmp_path / "flight.ulg", jump=40.0)
    back = load_flight_record(tmp_path / "flight.ulg", aircraft())
    assert back.duration == pytest.approx(record.duration + 40.0, abs=0.1)
    assert np.diff(back.time).max() > 39.0


def test_truncated_and_damaged_logs(tmp_path):
    """A log that was cut short is used as far as it goes; one without content is one line."""
    record = px4_log(tmp_path / "flight.ulg")
    whole = (tmp_path / "flight.ulg").read_bytes()
    (tmp_path / "short.ulg").write_bytes(whole[: len(whole) // 2 // 2 * 2 + 1])
    assert load_flight_record(tmp_path / "short.ulg", aircraft()).duration == pytest.approx(
        record.duration / 2, rel=0.1
    )
    for name in ("short", "flight"):
        said = [remark for remark in open_log(tmp_path / f"{name}.ulg").remarks if "cut short" in remark]
        assert len(said) == (name == "short")
    (tmp_path / "head.ulg").write_bytes(whole[:400])
    with pytest.raises(InputError, match=r"head\.ulg"):
        load_flight_record(tmp_path / "head.ulg", aircraft())
    middle = bytearray(whole)
    middle[len(whole) // 3 : len(whole) // 3 + 200] = bytes(200)
    (tmp_path / "damaged.ulg").write_bytes(middle)
    try:
        assert load_flight_record(tmp_path / "damaged.ulg", aircraft()).duration > 0.2 * record.duration
    except InputError as error:
        assert "\n" not in str(error)


def test_outputs_are_at_the_times_of_the_bank_that_is_named(tmp_path):
    """Truth: the record. The servos are logged at 100 Hz, the pulses of actuator_outputs at 10 Hz."""
    record = px4_log(tmp_path / "flight.ulg", slow_outputs=10.0)
    words = [f"{name}=servo{i}:0:{-FULL[name]}" for name, i in (("aileron", 2), ("elevator", 3), ("rudder", 4))]
    known = replace(aircraft(), outputs=f"{' '.join(words)} throttle=motor1:0:1")
    back = load_flight_record(tmp_path / "flight.ulg", known)
    at = np.searchsorted(record.time, record.time[0] + back.time + 1e-4) - 1
    for name in ("de", "da", "dr"):
        np.testing.assert_allclose(back[name], record[name][at], atol=1e-5, err_msg=name)
    rows = {row.signal: row for row in survey(tmp_path / "flight.ulg", known).rows}
    assert rows["controls"].source == "actuator_servos"
    assert rows["controls"].rate == pytest.approx(100.0, rel=1e-3)


def test_the_deflection_at_full_command_is_asked_for(tmp_path):
    px4_log(tmp_path / "flight.ulg")
    made = aircraft()
    controls = {**made.controls, "rudder": replace(made.controls["rudder"], full_deflection=None)}
    with pytest.raises(InputError, match=r"controls\.rudder\.full_deflection: missing"):
        load_flight_record(tmp_path / "flight.ulg", replace(made, controls=controls))
