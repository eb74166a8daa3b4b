"""What the fault monitor finds is what was put into the flight (``fault_flights``), and nothing where nothing was."""

import math

import numpy as np
import pytest
from fault_flights import AIRCRAFT, ONSET, Maker, Truth, flown, fly, monitored

from sysid_node.errors import InputError
from sysid_node.faults import monitor
from sysid_node.faults.model import blocks
from sysid_node.faults.model.blocks import PERIOD
from sysid_node.faults.model.reference_model import IdentifierEstimate, IdentifierEstimates
from sysid_node.faults.settings import FaultMonitorSettings
from sysid_node.faults.state import MonitorState
from sysid_node.faults.types import AIRSPEED, DAMAGE, HARD_OVER, LOSS, SLOWER, STUCK, VANE_OFFSET, VANE_STUCK


def lost(symbol: str, share: float) -> Truth:
    """A surface has lost a share of its effect."""
    return lambda d, x: (d, x | {symbol: (1.0 - share) * x[symbol]})


def stuck(symbol: str, angle: float) -> Truth:
    """A surface stands at an angle, and its commands are all that is known of it."""
    return lambda d, x: (d, x | {symbol: angle})


def read_off(angle: str, by: float) -> Truth:
    """A vane reads too much; lift and drag, made of what it reads, are turned by as much."""

    def truth(d: dict[str, float], x: dict[str, float]) -> tuple[dict[str, float], dict[str, float]]:
        true = x | {angle: x[angle] - by}
        if angle == "beta":
            return d, true
        turned = {f"CD_{r}": d[f"CD_{r}"] + by * d[f"CL_{r}"] for r in ("0", "alpha", "q", "de")}
        turned |= {f"CL_{r}": d[f"CL_{r}"] - by * d[f"CD_{r}"] for r in ("0", "alpha", "q", "de")}
        return d | turned, true

    return truth


def slow(error: float) -> Truth:
    """The airspeed reads off by a share: dynamic pressure is another, non-dimensional rates are larger by one power."""
    scale = 1.0 / (1.0 + error)

    def truth(d: dict[str, float], x: dict[str, float]) -> tuple[dict[str, float], dict[str, float]]:
        return d, {name: value * (scale if name in "pqr" else scale**2) for name, value in x.items()}

    return truth


def damaged(d: dict[str, float], x: dict[str, float]) -> tuple[dict[str, float], dict[str, float]]:
    """Half the pitch damping and a third of the pitch stiffness are gone."""
    return d | {"Cm_q": 0.5 * d["Cm_q"], "Cm_alpha": 0.65 * d["Cm_alpha"]}, x


@pytest.mark.slow
@pytest.mark.parametrize(
    ("truth", "kind", "part", "size"),
    [
        (lost("de", 0.5), LOSS, "elevator", 0.5),
        (lost("da", 0.4), LOSS, "aileron", 0.4),
        (lost("dr", 0.6), LOSS, "rudder", 0.6),
        (stuck("de", 0.05), STUCK, "elevator", 0.05),
        (stuck("da", -0.1), STUCK, "aileron", -0.1),
        (stuck("dr", 0.34), HARD_OVER, "rudder", 0.34),
        (slow(-0.2), AIRSPEED, "airspeed", -0.2),
        (read_off("alpha", 0.04), VANE_OFFSET, "alpha", 0.04),
        (read_off("beta", -0.06), VANE_OFFSET, "beta", -0.06),
    ],
)
def test_which_how_much_and_since_when(truth: Truth, kind: str, part: str, size: float) -> None:
    state, maker = flown(seed=3)
    assert state.fault is None
    fault = fly(state, maker, 5.0, truth)
    assert fault is not None
    assert (fault.kind, fault.part) == (kind, part), fault.text
    assert fault.lower <= size <= fault.upper, fault.text
    assert fault.size == pytest.approx(size, rel=0.2)
    assert ONSET - 1.5 <= fault.since <= ONSET + 3.0
    assert fault.since <= fault.found


def test_damage_names_the_derivatives_that_changed() -> None:
    state, maker = flown(seed=4)
    fault = fly(state, maker, 8.0, damaged)
    assert fault is not None
    assert (fault.kind, fault.part) == (DAMAGE, "longitudinal")
    assert "Cm_alpha" in [change.name for change in fault.changes]
    change = next(change for change in fault.changes if change.name == "Cm_alpha")
    assert change.lower <= -0.35 * AIRCRAFT.derivatives["Cm_alpha"].value <= change.upper


@pytest.mark.slow
@pytest.mark.parametrize("truth", [stuck("de", 0.05), stuck("da", -0.1), lost("de", 0.6), lost("dr", 0.6)])
@pytest.mark.parametrize("seed", [15, 16])
def test_a_surface_is_never_called_damage(seed: int, truth: Truth) -> None:
    """Not even in the first moments, in which an axis's dozen derivatives would explain them as well."""
    state, maker = flown(seed)
    for _ in range(80):
        fault = fly(state, maker, PERIOD, truth)
        assert fault is None or fault.kind != DAMAGE, fault.text
    assert fault is not None


def test_a_jammed_vane() -> None:
    """It reads a constant with its noise while lift says that the angle varies."""
    state, maker = flown(seed=5)
    column = maker.names.index("alpha")
    for _ in range(50):
        block = maker.block()
        read = 0.07 + 0.001 * maker.random.standard_normal()
        row, air = block.regressors.copy(), block.air.copy()
        row[column] = air[1] = read
        monitor.take(state, block._replace(regressors=row, air=air))
    assert state.fault is not None
    assert (state.fault.kind, state.fault.part) == (VANE_STUCK, "alpha"), state.fault.text


@pytest.mark.slow
# rad; without any, where what is read no longer comes from the vane
@pytest.mark.parametrize(("seed", "noise"), [(11, 0.001), (13, 0.0)])
def test_a_jammed_vane_while_nothing_else_moves(seed: int, noise: float) -> None:
    """Surfaces and rates rest, gusts alone turn the aircraft into the wind: no derivative seems to change."""
    state, maker = flown(seed)
    column = maker.names.index("beta")
    for _ in range(80):
        for name in ("p", "q", "r", "de", "da", "dr"):
            maker.motion[name] = 0.0
        block = maker.block()
        row, air = block.regressors.copy(), block.air.copy()
        row[column] = air[2] = noise * maker.random.standard_normal()
        monitor.take(state, block._replace(regressors=row, air=air))
    assert state.fault is not None
    assert (state.fault.kind, state.fault.part) == (VANE_STUCK, "beta"), state.fault.text
    assert ONSET - 1.0 <= state.fault.since <= state.fault.found <= ONSET + 6.0


def test_a_vane_that_reads_its_noise_where_the_angle_rests_has_not_failed() -> None:
    """In calm air that noise is all that the yawing moment leaves, and least squares find a Cn_beta of nought."""
    state, maker = monitored(seed=14)
    column = maker.names.index("beta")
    calm = np.array([1.0, 1.0, 1.0, 1.0, 1.0, 0.03])
    noise = AIRCRAFT.noise["beta"] / math.sqrt(20)  # of a block's 20 samples
    for _ in range(600):
        block = maker.block(lambda d, x: (d, x | {"beta": 0.0}), calm)
        row, air = block.regressors.copy(), block.air.copy()
        row[column] = air[2] = noise * maker.random.standard_normal()
        monitor.take(state, block._replace(regressors=row, air=air))
        assert state.fault is None, state.fault.text


@pytest.mark.slow
def test_nothing_is_found_where_nothing_failed() -> None:
    """Two minutes; by chance one in a thousand of such flights may raise an alarm (``false_alarms``)."""
    state, maker = monitored(seed=1)
    for _ in range(12):
        assert fly(state, maker, 10.0) is None


@pytest.mark.slow
def test_rougher_air_is_no_fault() -> None:
    state, maker = monitored(seed=6)
    fly(state, maker, 60.0)
    for _ in range(3):
        assert fly(state, maker, 10.0, rough=3.0) is None


@pytest.mark.slow
def test_the_alarm_ends_with_the_fault() -> None:
    state, maker = flown(seed=7)
    assert fly(state, maker, 4.0, lost("de", 0.6)) is not None
    assert fly(state, maker, 12.0) is None
    assert fly(state, maker, 6.0, lost("de", 0.6)) is not None


@pytest.mark.slow
def test_a_fault_stands_while_nothing_moves_that_would_show_it() -> None:
    """Level flight for 22 s, longer than blocks are remembered; then the elevator has its effect again."""
    state, maker = flown(seed=7)
    found = fly(state, maker, 8.0, lost("de", 0.6))
    maker.moving = 0.0
    later = fly(state, maker, 22.0, lost("de", 0.6))
    assert found is not None and later is not None
    assert (later.kind, later.part, later.found) == (LOSS, "elevator", found.found)
    assert later.size == pytest.approx(found.size, abs=0.05)
    maker.moving = 1.0
    assert fly(state, maker, 12.0) is None


def test_a_gap_is_bridged_without_an_alarm() -> None:
    state, maker = flown(seed=8)
    maker.count += 50
    monitor.take(state, maker.block()._replace(follows=False))
    assert fly(state, maker, 20.0) is None


def test_a_gap_prolongs_the_learning_by_what_it_takes_from_it() -> None:
    """Of each stretch of flight the last 8 s are not learned from, until later flight has shown no fault in them."""
    state, maker = monitored(seed=9)
    fly(state, maker, 10.0)
    assert monitor.learned(state) == pytest.approx(10.0)
    maker.count += 100
    monitor.take(state, maker.block()._replace(follows=False))
    after = monitor.learned(state)
    assert 1.5 < after < 2.5
    fly(state, maker, 20.0)
    assert monitor.learned(state) == pytest.approx(after + 20.0)
    monitor.take(state, maker.block()._replace(follows=False))  # it has ended
    assert monitor.learned(state) == pytest.approx(after + 20.0 + PERIOD)


@pytest.mark.slow
def test_a_gap_while_a_fault_is_followed() -> None:
    state, maker = flown(seed=12)
    assert fly(state, maker, 6.0, lost("de", 0.6)) is not None
    for _ in range(3):
        maker.count += 50
        monitor.take(state, maker.block(lost("de", 0.6))._replace(follows=False))
        fault = fly(state, maker, 2.0, lost("de", 0.6))
    assert fault is not None
    assert (fault.kind, fault.part) == (LOSS, "elevator"), fault.text


@pytest.mark.slow
def test_the_last_good_derivatives_are_held() -> None:
    """What the identifier says is taken up ten seconds later, and nothing that comes after an alarm."""
    state, maker = flown(seed=9)
    place = state.terms.names.index("Cm_de")
    known = {"Cm_de": IdentifierEstimate(-0.47, 0.004, True), "CL_alpha": IdentifierEstimate(9.9, 0.1, False)}
    monitor.receive_estimates(state, ONSET, IdentifierEstimates(known, {}, False))
    fly(state, maker, 12.0)
    assert state.reference.values[place] == -0.47
    assert state.reference.errors[place] == 0.004
    assert state.reference.values[state.terms.names.index("CL_alpha")] == AIRCRAFT.derivatives["CL_alpha"].value
    fly(state, maker, 4.0, lost("de", 0.6))
    known = {"Cm_de": IdentifierEstimate(-0.19, 0.004, True)}
    monitor.receive_estimates(state, 60.0, IdentifierEstimates(known, {}, False))
    fly(state, maker, 12.0, lost("de", 0.6))
    assert state.reference.values[place] == -0.47


def test_estimates_that_are_ripe_as_soon_as_it_judges() -> None:
    """Their values differ from the file's as a sound aircraft's may: nothing is found, early or late."""
    state, maker = monitored(seed=10)
    known = {"Cm_de": IdentifierEstimate(-0.465, 0.01, True), "CL_alpha": IdentifierEstimate(3.02, 0.05, True)}
    monitor.receive_estimates(state, 1.0, IdentifierEstimates(known, {}, False))
    assert fly(state, maker, 60.0) is None
    assert state.reference.values[state.terms.names.index("CL_alpha")] == 3.02


def commanded(seed: int, lateness: float, error: float = 0.006) -> tuple[MonitorState, Maker]:
    """A monitor and a maker of flights whose elevator is commanded, after ``ONSET`` s of flight without a fault.

    The identifier says that its servo is late by 0.03 s with this standard ``error`` (s); it is late by ``lateness`` s.
    """
    state, maker = monitored(seed)
    maker.lateness["elevator"] = lateness
    known = {"elevator": IdentifierEstimate(0.03, error, True)}
    monitor.receive_estimates(state, 1.0, IdentifierEstimates({}, known, False))
    assert fly(state, maker, ONSET) is None
    return state, maker


@pytest.mark.slow
@pytest.mark.parametrize("slower", [0.05, 0.1])
def test_a_servo_that_becomes_slower_is_named_by_how_much(slower: float) -> None:
    state, maker = commanded(21, 0.03)
    maker.lateness["elevator"] += slower
    fault = fly(state, maker, 10.0)
    assert fault is not None
    assert (fault.kind, fault.part, fault.unit) == (SLOWER, "elevator", "s"), fault.text
    assert fault.lower <= slower <= fault.upper
    assert fault.size == pytest.approx(slower, abs=0.02)


def test_a_servo_that_becomes_faster_is_not_slower() -> None:
    state, maker = commanded(22, 0.035)
    maker.lateness["elevator"] = 0.0
    fault = fly(state, maker, 10.0)
    assert fault is None or fault.kind != SLOWER


def test_a_servo_s_error_within_what_is_not_known_of_it_is_no_fault() -> None:
    """Two standard errors; what is learned of it in flight stands from then on."""
    state, maker = commanded(23, 0.11, 0.04)
    assert fly(state, maker, 20.0) is None


def test_half_of_a_commanded_elevator_is_a_loss() -> None:
    state, maker = commanded(24, 0.03)
    maker.values = {name: value * (0.5 if name.endswith("_de") else 1.0) for name, value in maker.values.items()}
    fault = fly(state, maker, 8.0)
    assert fault is not None
    assert (fault.kind, fault.part) == (LOSS, "elevator")
    assert fault.lower <= 0.5 <= fault.upper


def test_samples_of_another_rate_or_with_holes_are_averaged_alike() -> None:
    """A steady turn: the means are the samples' values, whatever the rate; what lacks a value is left out."""
    for rate in (50, 200):
        state = monitor.init(AIRCRAFT, FaultMonitorSettings())
        sample = [0.1, 0.0, -9.8, 0.0, 0.02, 0.1, 18.0, 0.07, 0.0, 1.2, 5.0, 0.01, 0.01, 0.0, 0.0]
        heard = []
        for k in range(rate):
            holed = [math.nan if k % 7 == 3 and i == 6 else x for i, x in enumerate(sample)]
            block = blocks.add(state.blocks, k / rate, holed)
            heard += [] if block is None else [block]
        assert len(heard) >= 8
        for block in heard:
            np.testing.assert_allclose(block.air, [18.0, 0.07, 0.0], rtol=1e-12)
            assert block.outputs[0] == pytest.approx(heard[0].outputs[0], rel=1e-12)


def test_a_record_makes_the_blocks_that_samples_make() -> None:
    """But for rounding, with thrust missing here, a value missing there, and a gap."""
    random = np.random.default_rng(2)
    time = np.cumsum(np.full(400, 0.01))
    time[200:] += 1.0
    middle = [0.1, 0.0, -9.8, 0.0, 0.02, 0.1, 18.0, 0.07, 0.0, 1.2, math.nan, 0.01, 0.01, 0.0, 0.0]
    samples = middle + 0.05 * random.standard_normal((400, len(middle)))
    samples[50:53, 6] = math.nan
    state = blocks.init(AIRCRAFT)
    live = [b for t, s in zip(time.tolist(), samples.tolist(), strict=True) if (b := blocks.add(state, t, s))]
    whole = blocks.of_record(AIRCRAFT, time, samples)
    assert len(live) == len(whole) > 35
    for one, other in zip(live, whole, strict=True):
        assert (one.time, one.samples, one.follows) == (other.time, other.samples, other.follows)
        np.testing.assert_allclose(one.regressors, other.regressors, atol=1e-12)
        np.testing.assert_allclose(one.air, other.air, atol=1e-11)


def test_impossible_settings() -> None:
    with pytest.raises(InputError, match="slack"):
        FaultMonitorSettings(slack=2.0)
