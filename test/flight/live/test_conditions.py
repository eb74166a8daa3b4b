"""What a node says in its log: every change once, what lasts every ten seconds, and never a flood."""

from sysid_node.flight.live.conditions import REPEAT, Conditions, ReportedStates


class Clock:
    now = 100.0

    def __call__(self) -> float:
        return self.now


def test_a_condition_is_said_when_it_begins_while_it_lasts_and_when_it_ends() -> None:
    clock = Clock()
    conditions = Conditions(clock)
    said = []
    for second in range(25):
        clock.now = 100.0 + second
        silent = {"/imu/data": f"no message for {second:.1f} s"} if 2 <= second < 23 else {}
        said += [(second, line) for _, line in conditions.update(silent)]
    assert said == [
        (2, "/imu/data: no message for 2.0 s"),
        (12, "/imu/data: no message for 12.0 s"),
        (22, "/imu/data: no message for 22.0 s"),
        (23, "/imu/data: well again"),
    ]


def test_a_condition_that_comes_and_goes_is_no_flood() -> None:
    clock = Clock()
    conditions = Conditions(clock)
    lines = []
    for k in range(100):
        clock.now = 100.0 + 0.5 * k
        lines += conditions.update({"x": "bad"} if k % 2 else {})
    assert lines == [(True, "x: bad"), (False, "x: well again")] * round(50.0 / REPEAT)


def test_a_state_is_said_when_its_words_change() -> None:
    clock = Clock()
    states = ReportedStates(clock)
    lines = []
    waiting = [f"baseline: no estimates for {seconds} s" for seconds in ("0.6", "1.6")]
    for text in ("baseline: no estimates yet", "adapted", *waiting):
        clock.now += 3.0
        lines += states.update({"pitch gains": text})
    assert lines == [
        "pitch gains: baseline: no estimates yet",
        "pitch gains: adapted",
        "pitch gains: baseline: no estimates for 0.6 s",
    ]
    assert states.update({"pitch gains": "adapted"}) == ["pitch gains: adapted"]
    clock.now += 0.5
    assert states.update({"pitch gains": "baseline"}) == [], "too soon after the last line"
    clock.now += 2.0
    assert states.update({"pitch gains": "baseline"}) == ["pitch gains: baseline"]
