"""Logs of public projects (``../shared/logs``): each is read, and what it lacks is said."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from simulated_logs import aircraft

from sysid_node.errors import InputError
from sysid_node.flight.logs.checks.survey import survey
from sysid_node.flight.logs.opening import load_flight_record, open_log, read_autopilot_log

LOGS = Path(__file__).resolve().parents[4] / "shared" / "logs"
OUTPUTS = "aileron=out1:1500:0.001 elevator=out2:1500:0.001 throttle=out3:1000:0.001 rudder=out4:1500:0.001"


@pytest.fixture
def log():
    def found(name: str) -> Path:
        if not (LOGS / name).exists():
            pytest.skip(f"{LOGS.parent.name}/logs/{name} is not beside this repository")
        return LOGS / name

    return found


def test_a_mavros_1_flight_is_read(log):
    """Truth: the README's rates (IMU 10 Hz, rc/out 3 Hz, nav_info 19 Hz) and the last messages' own numbers."""
    flight = open_log(log("alfa_2018-07-18_no_failure.bag"), outputs=OUTPUTS)
    streams = flight.streams
    assert (streams.imu.source, streams.actuators.source) == ("imu/data_raw", "rc/out")
    assert streams.imu.values[-1, 2] == pytest.approx(-10.434, abs=1e-3)
    density = 97163.0 / (287.05287 * 288.15)
    assert streams.air_data.values[-1, 0] == pytest.approx(14.634 * np.sqrt(1.225 / density), abs=0.6)
    assert len(streams.actuators.arrival) == 90


def test_its_low_rates_are_refused(log):
    with pytest.raises(InputError, match=r"rc/out comes at 3 Hz; 20 Hz are needed"):
        load_flight_record(log("alfa_2018-07-18_no_failure.bag"), replace(aircraft(), outputs=OUTPUTS))


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("alfa_2018-10-05_no_failure.bag", "nav_info/airspeed is 0.0 m/s at most: the airspeed sensor did not work"),
        ("px4_vtol_on_the_ground.ulg", "never flew as a fixed wing"),
        ("ardupilot_sitl_plane.BIN", "never flew as a fixed wing"),
    ],
)
def test_what_cannot_be_used_is_refused(log, name, said):
    with pytest.raises(InputError, match=said):
        open_log(log(name))
    assert said in survey(log(name)).refusal.text


def test_parameters_of_real_logs_name_the_controls(log):
    """Truth: the log's SERVOn_FUNCTION 4, 19, 21, 70; PX4 before 1.14 has the commands before the mixer."""
    ardupilot = read_autopilot_log(log("ardupilot_sitl_plane.BIN"))
    assert ardupilot.controls.names == ("aileron", "elevator", "rudder", "throttle")
    px4 = read_autopilot_log(log("px4_vtol_on_the_ground.ulg"))
    assert px4.controls.signal.source == "actuator_controls_1"
    assert px4.autopilot == "PX4 1.11.2"
