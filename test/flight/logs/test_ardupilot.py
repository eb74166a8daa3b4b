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
