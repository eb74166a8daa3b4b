"""What is added to the screen of a flight that goes on."""

import numpy as np

from sysid_node.aircraft.load import load_aircraft
from sysid_node.flight.live.news import FlightNews
from sysid_node.view.live import LiveScene

SECOND = 1_000_000_000


def news(times: list[float]) -> FlightNews:
    """IMU and air data at these times (s)."""
    level = (0.0, 0.0, -9.8, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    stamps = [SECOND + round(SECOND * t) for t in times]
    return FlightNews([(s, level) for s in stamps], [(s, (20.0, 0.0, 0.0, 1.2)) for s in sorted(stamps)], [])


def test_messages_out_of_order_are_left_out() -> None:
    scene = LiveScene(load_aircraft("cdrw"))
    first = scene.update(SECOND, news([0.0, 0.1, 0.05, 0.08, 0.2]), [], {})
    np.testing.assert_allclose(first.bodies[0].time, [0.0, 0.1, 0.2])
    second = scene.update(SECOND, news([0.15, 0.3, 0.4]), [], {})
    np.testing.assert_allclose(second.bodies[0].time, [0.2, 0.3, 0.4])
    np.testing.assert_allclose(second.bodies[0].position[:, 0], [4.0, 6.0, 8.0])  # north at 20 m/s, carried on


def test_messages_that_come_one_at_a_time_are_shown() -> None:
    """An IMU of 20 Hz gives one message between two looks."""
    scene = LiveScene(load_aircraft("cdrw"))
    shown = [scene.update(SECOND, news([t]), [], {}).bodies for t in (0.0, 0.1, 0.2)]
    assert not shown[0]
    np.testing.assert_allclose(shown[1][0].time, [0.0, 0.1])
    np.testing.assert_allclose(shown[2][0].position[:, 0], [2.0, 4.0])


def test_nothing_new_adds_nothing() -> None:
    scene = LiveScene(load_aircraft("cdrw"))
    nothing = scene.update(0, FlightNews([], [], []), [], {})
    assert not nothing.bodies
    assert not nothing.tabs
    assert "No estimate has come yet" in nothing.about
