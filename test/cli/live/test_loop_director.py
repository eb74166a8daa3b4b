"""The director of ``sysid loop``, against a watch that replays what nodes would report; no ROS is needed."""

from dataclasses import dataclass, field, replace
from pathlib import Path

import pytest

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import UncertainValue
from sysid_node.cli.live.loop_director import PERIOD, LoopDirector
from sysid_node.cli.live.loop_scenario import LoopScenario, set_points
from sysid_node.errors import InputError

FAIL = "control_effectiveness_loss:elevator=0.6"


@dataclass
class RecordedWatch:
    """Stands for the ROS node that listens: time passes, and requests are kept."""

    commands: bool = True
    refusal: str = ""
    aborted_at: float = 1e9  # s: the excitation is reported as aborted for a moment
    excited_from: float = 0.0  # s: requests for excitation are refused before
    time: float = 0.0
    tracking: list[object] = field(default_factory=list)
    requests: list[tuple[float, str]] = field(default_factory=list)
    reports: dict[str, str] = field(default_factory=dict)

    def listen(self, seconds: float) -> None:
        if self.commands:
            self.time += seconds
            self.tracking.append((self.time, {}))

    def ask_for(self, points: dict[str, float]) -> None:
        self.points = points

    def excite(self) -> str:
        self.requests.append((self.time, "excite"))
        return "roll not measured" if self.time < self.excited_from else ""

    def set_effects(self, effects: str) -> str:
        self.requests.append((self.time, effects))
        return self.refusal

    def value(self, node: str, key: str) -> str:
        aborted = self.aborted_at <= self.time < self.aborted_at + 1.5 * PERIOD
        return "aborted: bank" if (node, key) == ("exciter", "last event") and aborted else ""

    def news(self) -> dict[str, str]:
        return self.reports


def directed(watch: RecordedWatch, seconds: float, fail: str = FAIL) -> LoopDirector:
    scenario = LoopScenario(load_aircraft("cdrw"), "cdrw", fail, seconds, True, "none", "sls_rft", Path("out"))
    director = LoopDirector(scenario, watch)
    for _ in range(round(seconds / PERIOD)):
        director.step()
    return director


def test_the_failure_begins_once_at_its_time() -> None:
    watch = RecordedWatch()
    director = directed(watch, 35.0)
    ((time, effects),) = [request for request in watch.requests if request[1] != "excite"]
    assert time == pytest.approx(30.0, abs=2 * PERIOD)
    assert effects == f"actuator_lag:time_constant=0.05 {FAIL}"
    assert [event.text for event in director.events] == ["excitation asked for", FAIL]


def test_servos_that_the_file_states_are_flown_before_and_after_the_failure() -> None:
    aircraft = load_aircraft("cdrw")
    stated = replace(aircraft, effects={"actuator_lag": {"elevator": UncertainValue(0.12)}})
    for known, servos in ((aircraft, "actuator_lag:time_constant=0.05"), (stated, "")):
        scenario = LoopScenario(known, "cdrw", FAIL, 35.0, True, "none", "sls_rft", Path("out"))
        assert f"effects:='{servos}'" in scenario.arguments("flight_simulator")
        assert scenario.effects_after_failure == f"{servos} {FAIL}".strip()


def test_an_aborted_excitation_is_requested_again_after_a_pause() -> None:
    watch = RecordedWatch(aborted_at=6.0)
    directed(watch, 12.0, fail="")
    assert [time for time, _ in watch.requests] == [
        pytest.approx(3.0, abs=2 * PERIOD),
        pytest.approx(9.0, abs=3 * PERIOD),
    ]


def test_excitation_that_is_refused_is_asked_for_again() -> None:
    watch = RecordedWatch(excited_from=8.0)
    director = directed(watch, 20.0, fail="")
    assert [time for time, _ in watch.requests] == pytest.approx([3.0, 6.0, 9.0], abs=4 * PERIOD)
    said = [event.text for event in director.events]
    assert said == ["excitation refused: roll not measured"] * 2 + ["excitation asked for"]


def test_a_report_is_an_event_when_it_changes() -> None:
    watch = RecordedWatch(reports={"fault_monitor": "learns what sound flight is like", "exciter": ""})
    director = directed(watch, 1.0)
    assert [(event.node, event.text) for event in director.events] == [
        ("fault_monitor", "learns what sound flight is like")
    ]


def test_a_refused_failure_is_bad_input() -> None:
    with pytest.raises(InputError, match=f"--fail {FAIL}: no such effect"):
        directed(RecordedWatch(refusal="no such effect"), 31.0)


def test_nodes_that_never_command_end_the_flight() -> None:
    with pytest.raises(RuntimeError, match="no command came within 60 s; the logs in out may say why"):
        directed(RecordedWatch(commands=False), 61.0)


def test_set_points_step_within_what_is_safe() -> None:
    points = [set_points(0.1 * k) for k in range(200)]
    assert {p["roll"] for p in points} == {0.3, 0.0, -0.3}
    assert max(p["pitch"] for p in points) == 0.16
