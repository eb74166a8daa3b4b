"""What is said of the servos' times, beside what the file says of them."""

from dataclasses import replace

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import UncertainValue
from sysid_node.online.types import DerivativeEstimate, Estimates
from sysid_node.report.results.servo_remarks import servo_remarks

CDRW = load_aircraft("cdrw")


def found(**late: tuple[float, float, bool]) -> Estimates:
    """Times and half widths of their intervals (s) by control, and whether they are valid."""
    servos = {
        name: DerivativeEstimate(
            name, time, 0.5 * half, time - half, time + half, valid, "ok" if valid else "converging"
        )
        for name, (time, half, valid) in late.items()
    }
    return Estimates(10.0, {}, {}, servos)


def test_known_times_stand_beside_those_of_the_file() -> None:
    """A servo of second order is late by 2 damping T, here 2 0.7 30 ms, and by its delay."""
    lags = {"elevator": UncertainValue(0.03), "damping": UncertainValue(0.7)}
    file = replace(CDRW, effects={"actuator_lag": lags, "command_delay": {"elevator": UncertainValue(0.01)}})
    estimates = found(elevator=(0.0561, 0.0082, True), aileron=(0.0349, 0.0041, True), rudder=(0.2, 0.3, False))
    assert servo_remarks(file, estimates) == [
        "Surfaces lag what is recorded of them by: elevator 56 ± 8 ms (the file says 52 ms), "
        "aileron 35 ± 4 ms (the file says nothing).",
        "Not known well enough: the lag of rudder 200 ± 300 ms.",
    ]


def test_times_that_are_not_known_are_named_as_such() -> None:
    assert servo_remarks(CDRW, found(elevator=(0.05, 0.2, False))) == [
        "Not known well enough: the lag of elevator 50 ± 200 ms."
    ]
    assert servo_remarks(CDRW, found()) == []
