"""Telemetry logs: the flight comes back from MAVLink messages that pymavlink packed."""

import struct
from pathlib import Path

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega
from simulated_logs import SERVOS, aircraft, flight, fractions, pulses_of

from sysid_node.errors import InputError
from sysid_node.flight.logs.opening import load_flight_record, open_log

G = 9.80665
START_US = 1_700_000_000_000_000  # when the ground station's clock shows the autopilot's start


def telemetry_log(
    path: Path, *, kind: int = 1, rate: int = 100, parameters: bool = True, pressure: bool = True
) -> None:
    """A .tlog of the simulated flight: each message after the time of its arrival, 20 ms after it was sent."""
    link = ardupilotmega.MAVLink(None, srcSystem=1, srcComponent=1)
    record = flight().between(2.0, 9.0)
    pulses = pulses_of(fractions(record))
    body = bytearray()

    def send(message: ardupilotmega.MAVLink_message, boot_s: float) -> None:
        body.extend(struct.pack(">Q", START_US + round((boot_s + 0.02) * 1e6)) + message.pack(link))

    send(ardupilotmega.MAVLink_heartbeat_message(kind, 3, 0, 0, 4, 3), 1.0)
    for number, row in SERVOS.items() if parameters else ():
        for key, value in zip(("FUNCTION", "MIN", "MAX", "TRIM", "REVERSED"), row, strict=True):
            send(ardupilotmega.MAVLink_param_value_message(f"SERVO{number}_{key}".encode(), value, 9, 99, 0), 1.0)
    for i in range(0, len(record), 200 // rate):
        at = float(record.time[i]) + 50.0
        ms, us = round(at * 1e3), round(at * 1e6)
        force = [round(record[name][i] * 1000.0 / G) for name in ("ax", "ay", "az")]
        rates = [round(record[name][i] * 1000.0) for name in ("p", "q", "r")]
        send(ardupilotmega.MAVLink_raw_imu_message(us, *force, *rates, 0, 0, 0), at)
        angles = [float(record[name][i]) for name in ("phi", "theta", "psi")]
        send(ardupilotmega.MAVLink_attitude_message(ms, *angles, 0.0, 0.0, 0.0), at)
        equivalent = float(record["V"][i] * np.sqrt(record["rho"][i] / 1.225))
        send(ardupilotmega.MAVLink_vfr_hud_message(equivalent, 0.0, 0, 0, 0.0, 0.0), at)
        static = float(record["rho"][i] * 287.05287 * 288.15 / 100.0)
        if pressure:
            send(ardupilotmega.MAVLink_scaled_pressure_message(ms, static, 0.0, 4500), at)
        send(ardupilotmega.MAVLink_servo_output_raw_message(us, 0, *pulses[i].tolist(), 0, 0, 0, 0), at)
    path.write_bytes(body)


def test_the_flight_comes_back(tmp_path):
    """Truth: the record. RAW_IMU has 1/1000 g and 1 mrad/s; a pulse is known to 0.5 us, a time to 1 ms."""
    telemetry_log(tmp_path / "flight.tlog")
    back, record = load_flight_record(tmp_path / "flight.tlog", aircraft()), flight().between(2.0, 9.0)
    at = np.searchsorted(record.time, record.time[0] + back.time + 1e-3) - 1
    tolerances = {"ax": 0.006, "az": 0.006, "q": 6e-4, "de": 0.01, "da": 0.01, "V": 0.7, "rho": 1e-3, "theta": 0.01}
    for name, tolerance in tolerances.items():
        np.testing.assert_allclose(back[name], record[name][at], atol=tolerance, err_msg=name)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"kind": 2}, "never flew as a fixed wing"),
        ({"pressure": False}, "no SCALED_PRESSURE in it, by whose density VFR_HUD's airspeed becomes the true one"),
        ({"parameters": False}, "which output moves which surface is not known"),
        ({"rate": 10}, "RAW_IMU comes at 10 Hz; 20 Hz are needed; SERVO_OUTPUT_RAW comes at 10 Hz; 20 Hz"),
    ],
)
def test_what_a_log_lacks_is_one_line(tmp_path, options, said):
    telemetry_log(tmp_path / "flight.tlog", **options)
    with pytest.raises(InputError, match=said):
        load_flight_record(tmp_path / "flight.tlog", aircraft())


def test_a_log_that_was_cut_short_is_used_as_far_as_it_goes(tmp_path):
    """A ground station that was switched off: the file ends in the midst of a message, or within the first."""
    telemetry_log(tmp_path / "flight.tlog")
    whole = (tmp_path / "flight.tlog").read_bytes()
    (tmp_path / "short.tlog").write_bytes(whole[: len(whole) // 2 + 3])
    complete, short = (load_flight_record(tmp_path / f"{name}.tlog", aircraft()) for name in ("flight", "short"))
    assert short.duration == pytest.approx(complete.duration / 2, rel=0.1)
    (tmp_path / "head.tlog").write_bytes(whole[:30])
    with pytest.raises(InputError, match=r"head\.tlog: no HIGHRES_IMU in it"):
        load_flight_record(tmp_path / "head.tlog", aircraft())


def test_a_damaged_part_is_left_out(tmp_path):
    telemetry_log(tmp_path / "flight.tlog")
    damaged = bytearray((tmp_path / "flight.tlog").read_bytes())
    middle = len(damaged) // 2
    damaged[middle : middle + 400] = bytes(400)
    (tmp_path / "damaged.tlog").write_bytes(damaged)
    complete, left = (load_flight_record(tmp_path / f"{name}.tlog", aircraft()) for name in ("flight", "damaged"))
    assert left.duration == pytest.approx(complete.duration, rel=0.02)
    assert 0.95 * len(complete) < len(left) < len(complete)


def test_the_temperature_that_was_assumed_is_said(tmp_path):
    telemetry_log(tmp_path / "flight.tlog")
    assert any("at 15 degC" in remark for remark in open_log(tmp_path / "flight.tlog").remarks)
