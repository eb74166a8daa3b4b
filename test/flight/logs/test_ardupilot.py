"""ArduPilot's DataFlash logs: the flight that an independent writer wrote comes back."""

from dataclasses import replace

import numpy as np
import pytest
from simulated_logs import FULL_RATES, aircraft, dataflash_log

from sysid_node.errors import InputError
from sysid_node.flight.logs.opening import load_flight_record, open_log


def test_the_flight_comes_back(tmp_path):
    """Truth: the record that was written. A pulse is known to 0.5 us, which is 0.0005 of 0.5 rad or less."""
    record = dataflash_log(tmp_path / "flight.xyz")
    back = load_flight_record(tmp_path / "flight.xyz", aircraft())
    at = np.searchsorted(record.time, record.time[0] + back.time + 1e-4) - 1
    tolerances = {"ax": 1e-4, "q": 1e-5, "theta": 1e-5, "de": 5e-4, "da": 5e-4, "dr": 5e-4, "thrust": 0.03, "rho": 1e-4}
    for name, tolerance in tolerances.items():
        np.testing.assert_allclose(back[name], record[name][at], atol=tolerance, err_msg=name)
    np.testing.assert_allclose(back["V"][::2], record["V"][at][::2], atol=1e-3)
    assert not back.measured("alpha"), "AOA is an estimate of the attitude filter"


@pytest.mark.parametrize("layout", ["elevons", "V-tail"])
@pytest.mark.parametrize("mixing", [None, {"MIXING_GAIN": 0.6, "MIXING_OFFSET": -50.0}])
def test_mixed_surfaces_come_back_as_controls(tmp_path, layout, mixing):
    """Truth: the record. Two pulses known to 0.5 us of 400, through a gain of 0.5, give 0.0025 of 0.5 rad."""
    record = dataflash_log(tmp_path / "flight.bin", layout=layout, mixing=mixing)
    back = load_flight_record(tmp_path / "flight.bin", aircraft())
    at = np.searchsorted(record.time, record.time[0] + back.time + 1e-4) - 1
    for name in ("de", "da", "dr"):
        np.testing.assert_allclose(back[name], record[name][at], atol=1.3e-3, err_msg=name)
        assert np.ptp(record[name]) > 0.1


def test_the_primary_imu_and_the_estimated_angle_of_attack_are_said(tmp_path):
    dataflash_log(tmp_path / "flight.bin")
    flight = open_log(tmp_path / "flight.bin")
    assert flight.streams.imu.source == "IMU[1]"
    assert any(remark.startswith("AOA is computed") for remark in flight.remarks)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"flying": 0}, "never flew as a fixed wing"),
        ({"states": {"MODE": [(0.0, 18)]}}, "never flew as a fixed wing"),
        ({"drop": ("ARSP",)}, "no ARSP in it; connect an airspeed sensor, and log it"),
        ({"drop": ("BARO",)}, "no BARO in it, by whose density ARSP becomes the true airspeed; LOG_BITMASK: set bit 7"),
        ({"drop": ("IMU",)}, "no IMU in it; LOG_BITMASK: set bit 7"),
        ({"drop": ("RCOU",)}, r"bin: no RCOU in it; LOG_BITMASK: set bit 13 \(RC\)[^(]*$"),
        (
            {"rates": {**FULL_RATES, "controls": 10.0, "imu": 10.0}, "more": {"LOG_BITMASK": 65535}},
            r"LOG_BITMASK has bits 0 and 7 set; raise SCHED_LOOP_RATE.*LOG_BITMASK has bit 13 \(RC\) set, which",
        ),
        ({"drop": ("PARM",)}, "which output moves which surface is not known .the log holds no parameters SERVOn"),
        (
            {"rates": {**FULL_RATES, "controls": 10.0}},
            r"RCOU comes at 10 Hz; 20 Hz are needed; LOG_BITMASK: set bit 13",
        ),
    ],
)
def test_what_a_log_lacks_is_one_line(tmp_path, options, said):
    dataflash_log(tmp_path / "flight.bin", **options)
    with pytest.raises(InputError, match=said):
        load_flight_record(tmp_path / "flight.bin", aircraft())


def test_all_that_a_log_lacks_is_said_at_once(tmp_path):
    rates = {**FULL_RATES, "imu": 10.0}
    dataflash_log(tmp_path / "flight.bin", rates, drop=("ARSP", "PARM"))
    with pytest.raises(InputError) as caught:
        load_flight_record(tmp_path / "flight.bin", aircraft())
    for words in ("no ARSP in it", "IMU[1] comes at 10 Hz; 20 Hz are needed", "which output moves which surface"):
        assert words in str(caught.value)


def test_a_text_log_is_the_binary_one(tmp_path):
    """Truth: the binary log of the same messages, whose floats have 24 bits."""
    dataflash_log(tmp_path / "flight.bin")
    dataflash_log(tmp_path / "flight.log", text=True)
    binary, text = (load_flight_record(tmp_path / f"flight.{kind}", aircraft()) for kind in ("bin", "log"))
    np.testing.assert_array_equal(text.time, binary.time)
    for name in ("ax", "q", "theta", "V", "rho", "de", "da", "dr", "thrust"):
        np.testing.assert_allclose(text[name], binary[name], atol=2e-5, err_msg=name)


def test_a_text_log_that_was_cut_short_is_used_as_far_as_it_goes(tmp_path):
    record = dataflash_log(tmp_path / "flight.log", text=True)
    whole = (tmp_path / "flight.log").read_bytes()
    (tmp_path / "short.log").write_bytes(whole[: len(whole) // 2 + 5])
    back = load_flight_record(tmp_path / "short.log", aircraft())
    assert back.duration == pytest.approx(record.duration / 2, rel=0.1)


@pytest.mark.parametrize("text", [False, True])
def test_a_clock_that_was_set_back_is_refused(tmp_path, text):
    dataflash_log(tmp_path / "flight", text=text, jump=-30.0)
    with pytest.raises(InputError, match=r"the stamps of IMU\[1\] go back by 30.0 s after 10.0 s .a clock was set"):
        load_flight_record(tmp_path / "flight", aircraft())


def test_a_clock_that_jumps_ahead_leaves_a_gap(tmp_path):
    record = dataflash_log(tmp_path / "flight.bin", jump=40.0)
    back = load_flight_record(tmp_path / "flight.bin", aircraft())
    assert back.duration == pytest.approx(record.duration + 40.0, abs=0.1)
    assert np.diff(back.time).max() > 39.0


def test_the_part_that_was_flown_as_a_fixed_wing_is_taken(tmp_path):
    """Truth: in the air from 2 s to 17 s, of which QHOVER (18) and QLAND (20) take all but 5 s to 12 s (FBWA is 5)."""
    states = {
        "STAT": [(0.0, 0), (2.0, 1), (17.0, 0)],
        "MODE": [(0.0, 18), (5.0, 5), (12.0, 20)],
    }
    record = dataflash_log(tmp_path / "flight.bin", states=states)
    back = load_flight_record(tmp_path / "flight.bin", aircraft())
    assert back.duration == pytest.approx(7.0, abs=0.05)
    first = np.searchsorted(record.time, record.time[0] + 5.0)
    assert np.abs(record["q"][first : first + 4] - back["q"][0]).min() < 1e-5
    (said,) = (remark for remark in open_log(tmp_path / "flight.bin").remarks if "flown as a fixed wing" in remark)
    assert said == "flown as a fixed wing: 7.0 of 20.0 s (5.0 to 12.0 s); the rest is left out"


def test_truncated_and_damaged_logs(tmp_path):
    record = dataflash_log(tmp_path / "flight.bin")
    whole = (tmp_path / "flight.bin").read_bytes()
    (tmp_path / "short.bin").write_bytes(whole[: len(whole) // 2 + 7])
    assert load_flight_record(tmp_path / "short.bin", aircraft()).duration == pytest.approx(
        record.duration / 2, rel=0.1
    )
    damaged = bytearray(whole)
    damaged[len(whole) // 2 : len(whole) // 2 + 500] = bytes(500)
    (tmp_path / "damaged.bin").write_bytes(damaged)
    assert load_flight_record(tmp_path / "damaged.bin", aircraft()).duration == pytest.approx(record.duration, rel=0.02)
    (tmp_path / "head.bin").write_bytes(whole[:300])
    with pytest.raises(InputError, match=r"head\.bin"):
        load_flight_record(tmp_path / "head.bin", aircraft())


def test_a_type_of_message_without_length_is_refused(tmp_path):
    """Its FMT message has the length after the type, then name and format; pymavlink would read it for ever."""
    dataflash_log(tmp_path / "flight.bin")
    damaged = bytearray((tmp_path / "flight.bin").read_bytes())
    name = damaged.index(b"IMU\x00")
    assert damaged[name - 5 : name - 2] == b"\xa3\x95\x80"
    damaged[name - 1] = 0
    damaged[name + 4 : name + 20] = bytes(16)
    (tmp_path / "loop.bin").write_bytes(damaged)
    with pytest.raises(InputError, match=r"loop\.bin: cannot be read as an ArduPilot log: a message without length"):
        load_flight_record(tmp_path / "loop.bin", aircraft())


def test_outputs_of_the_aircraft_file_replace_the_logs_parameters(tmp_path):
    record = dataflash_log(tmp_path / "flight.bin")
    made = replace(aircraft(), outputs="elevator=out2:1480:0.0008 aileron=out1:1500:-0.000875 rudder=out4:1500:0.0008")
    back = load_flight_record(tmp_path / "flight.bin", made)
    at = np.searchsorted(record.time, record.time[0] + back.time + 1e-4) - 1
    np.testing.assert_allclose(back["da"], record["da"][at], atol=5e-4)
