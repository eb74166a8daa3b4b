"""Evidence adds up over flights, and goes to the type, to a tail, or to one flight."""

import datetime

import pytest
from fleet_flights import START, flight

from sysid_node.fleet.statistics.causes import pooled_causes
from sysid_node.fleet.statistics.series import DAY


def gap(*causes, verdict="explained"):
    """Causes as (label, probability, size, alternatives)."""
    named = [
        {
            "effect": label.partition(" of ")[0],
            "label": label,
            "parameters": {"size": [size, 0.01]},
            "probability": probability,
            "indistinguishable_from": [other.partition(" of ")[0] for other in others],
        }
        for label, probability, size, others in causes
    ]
    listed = [{"effect": o, "probability": 0.2, "share": 0.2} for *_, others in causes for o in others]
    return {"verdict": verdict if causes else "no_gap", "causes": named, "doubted": [], "candidates": listed}


def flights_of(diagnosis, tails=6, flights=8):
    """A fleet whose flights have ``diagnosis(tail, flight)`` as their gap.json."""
    return [flight(f"t{j}", i, [0.2], 0.01, gap=diagnosis(j, i)) for j in range(tails) for i in range(flights)]


def test_what_all_tails_show_is_the_simulators():
    causes = pooled_causes(flights_of(lambda j, i: gap(("motor_lag", 0.9, 0.2 + 0.01 * j, [])) if i % 4 else gap()))
    (cause,) = causes
    assert cause.account == "simulator"
    assert cause.shared > 0.99
    size = cause.sizes["size"]
    assert size.lower < 0.225 < size.upper
    last = cause.tails[5]
    assert last.own_sizes["size"].value == pytest.approx(0.025, abs=0.01)
    assert last.sizes["size"].value == pytest.approx(last.shared_sizes["size"].value + last.own_sizes["size"].value)


def test_what_one_tail_shows_is_its_own_and_has_a_date():
    there = gap(("vane_bias", 0.95, 0.02, []))
    (cause,) = pooled_causes(flights_of(lambda j, i: there if j == 2 and i >= 4 else gap()))
    assert cause.account == "tail"
    assert cause.shared < 0.01
    assert [t.tail for t in cause.tails if t.own > 0.5] == ["t2"]
    assert cause.tails[2].since == pytest.approx((START + datetime.timedelta(days=4)).timestamp() / DAY)
    assert cause.tails[2].sizes["size"].value == pytest.approx(0.02)


def test_two_findings_after_maintenance_are_the_tails_own():
    """Without a date at which something was done to the tail, two that are not sure are too few."""
    there = gap(("vane_bias", 0.55, 0.02, []))
    flights = flights_of(lambda j, i: there if j == 2 and i >= 6 else gap(), flights=8)
    day = (START + datetime.timedelta(days=5, hours=12)).timestamp() / DAY
    (unknown,), (known,) = pooled_causes(flights), pooled_causes(flights, {("cdrw", "t2"): [day]})
    assert unknown.tails[2].own < 0.5 < known.tails[2].own
    assert known.account == "tail"
    assert max(t.own for t in known.tails if t.tail != "t2") < 0.01


def test_two_sure_findings_of_four_flights_are_the_tails_own():
    """Of thirty causes, chance would hardly name the same one twice in one tail, and in no other."""
    there = gap(("actuator_lag of elevator", 0.99, 0.09, []))
    (cause,) = pooled_causes(flights_of(lambda j, i: there if j == 2 and i in (0, 2) else gap(), tails=3, flights=4))
    assert cause.account == "tail"
    assert cause.tails[2].own > 0.5
    assert cause.shared < 0.01


def test_one_flights_finding_is_neither():
    (cause,) = pooled_causes(flights_of(lambda j, i: gap(("cg_shift", 0.95, 0.02, [])) if (j, i) == (1, 3) else gap()))
    assert cause.account == "flight"
    assert cause.shared < 0.01 and max(t.own for t in cause.tails) < 0.5


def test_weak_evidence_adds_up():
    """Every flight alone says that the cause is hardly likelier than not."""
    (cause,) = pooled_causes(flights_of(lambda j, i: gap(("thrust_scale", 0.55, 0.1, []))))
    assert cause.shared > 0.99


def test_confused_causes_share_one_probability():
    """Half of the flights name one, half the other: together they are certain, alone neither more than the other."""
    pair = ("actuator_lag", "command_delay")
    causes = pooled_causes(flights_of(lambda j, i: gap((pair[i % 2], 0.7, 0.05, [pair[1 - i % 2]]))))
    assert {c.label for c in causes} == set(pair)
    assert sum(c.shared for c in causes) == pytest.approx(1.0, abs=1e-6)


def test_flights_that_support_no_diagnosis_say_nothing():
    there = gap(("vane_bias", 0.95, 0.02, []))
    some = pooled_causes(
        flights_of(lambda j, i: there if i < 3 else gap(verdict="unsupported") | {"verdict": "unsupported"})
    )
    assert some[0].shared > 0.9


def test_flights_without_diagnosis_give_no_cause():
    assert pooled_causes([flight("t0", 1, [0.2], 0.01)]) == []
