"""What a rate limit's tolerance does to the lateness of a control, against the servo's own equations.

Truth: a ramp by hand, and the difference that another limit makes to the deflections of ``flight.servos``.
"""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from plant import made_aircraft

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.model import UncertainValue
from sysid_node.excite.spec import parse_manoeuvre
from sysid_node.flight.servos import Servo, ServoState, give, move
from sysid_node.online.alignment.in_pieces import align_streams
from sysid_node.online.replay import run
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.systematic.rate_limited_moves import RateLimitedMoves
from sysid_node.sim import Simulator
from sysid_node.sim.flying.recording import FlightSampler
from sysid_node.sim.flying.sortie import SortieConditions, fly_sortie

LIMIT, SHARE, STEP = 2.0, 0.2, 0.005  # rad/s, 1 sigma as a share of it, s


def moves_of(limit: float = LIMIT, count: int = 1) -> RateLimitedMoves:
    none = [0.0] * count
    return RateLimitedMoves((limit,) * count, np.full(count, SHARE), list(none), list(none), list(none))


def deflected(limit: float, lag: float, seconds: float = 20.0) -> np.ndarray:
    """(N,) rad, every ``STEP``: what a servo makes of steps between -0.1 and 0.1 rad at random times."""
    rng, servo, found = np.random.default_rng(3), ServoState(Servo(lag, rate_limit=limit)), []
    command = 0.0
    for i in range(round(seconds / STEP)):
        if i % 40 == 0:
            command = float(rng.choice([-0.1, 0.0, 0.1]))
            give(servo, i * 5_000_000, command)
        found.append(move(servo, i * 5_000_000)[0])
    return np.array(found)


def followed(positions: np.ndarray, limit: float = LIMIT) -> float:
    """The error of the lateness (s) as a share of the limit's."""
    moves = moves_of(limit)
    for before, after in itertools.pairwise(positions):
        moves.follow(STEP, (before,), (after,))
    return float(moves.errors()[0]) / SHARE


def test_a_move_at_the_limit_is_late_by_half_the_time_that_it_takes():
    ramp = np.concatenate([np.zeros(3), np.arange(1, 21) * LIMIT * STEP, np.full(5, 20 * LIMIT * STEP)])
    assert followed(ramp) == pytest.approx(0.5 * 20 * STEP + 0.5 * STEP, rel=1e-9)  # half a sample by the sum


def test_moves_below_the_limit_are_not_late_by_it():
    assert followed(np.linspace(0.0, 0.9 * LIMIT * STEP * 50, 51)) == 0.0
    assert followed(np.zeros(10)) == 0.0


@pytest.mark.parametrize("lag", [0.0, 0.02, 0.05])
def test_another_limit_makes_controls_later_by_as_much_as_is_said(lag):
    """Least squares of what a slightly lower limit changes on the rate: how late the lines say that it is."""
    less, at, more = (deflected(LIMIT * (1.0 + by), lag) for by in (-0.05, 0.0, 0.05))
    rate = np.gradient(at, STEP)
    late = float(rate @ (more - less)) / float(rate @ rate)  # s per a tenth of the limit
    assert followed(at) == pytest.approx(late / 0.1, rel=0.25)


def test_only_limits_that_are_stated_and_not_exact_count():
    aircraft = made_aircraft()
    symbols = tuple(aircraft.control_symbols)
    assert RateLimitedMoves.of(aircraft, symbols) is None
    stated = {"actuator_rate_limit": {"elevator": UncertainValue(3.0, 0.6)}}
    found = RateLimitedMoves.of(replace(aircraft, effects=stated), symbols)
    assert found is not None
    assert found.limits == (3.0, math.inf, math.inf)
    np.testing.assert_allclose(found.relative, [0.2, 0.0, 0.0])
    exact = {"actuator_rate_limit": {"elevator": UncertainValue(3.0, 0.0)}}
    assert RateLimitedMoves.of(replace(aircraft, effects=exact), symbols) is None


@pytest.mark.slow
def test_a_limit_that_is_off_within_its_tolerance_leaves_the_servos_and_derivatives_within_their_intervals():
    """Commands act 40 ms late. The file states a limit of 2 rad/s with 30 %, but the servos turn at 3.2."""
    late, aircraft = 0.04, load_aircraft("cdrw")
    simulator = Simulator(aircraft, 400.0)
    plan = parse_manoeuvre(("3211:repeat=2:amplitude=0.09",), aircraft, simulator.rate, None)
    moves = np.column_stack([plan.surfaces(), np.zeros(plan.time.size)])
    effects = [f"command_delay:delay={late}", "actuator_rate_limit:rate=3.2"]
    sortie = fly_sortie(simulator, moves, SortieConditions(effects, seed=5, command_rate=100.0))
    stated = {
        "command_delay": {name: UncertainValue(late, 0.01) for name in aircraft.controls},
        "actuator_rate_limit": {name: UncertainValue(2.0, 0.6) for name in aircraft.controls},
    }
    belief, settings = replace(aircraft, effects=stated), OnlineSettings(actuators="commands")
    aligned = align_streams(belief, FlightSampler().record(sortie), settings.max_gap, "commands")
    found = run(belief, settings, aligned.time, aligned.samples, aligned.time[-1:], commands_from=0)[-1]
    for servo in found.servos.values():
        assert abs(servo.value - late) < 2.0 * servo.standard_error, servo
    for derivative in found.derivatives.values():
        if derivative.valid:
            off = abs(derivative.value - sortie.derivatives[derivative.name])
            assert off < 2.6 * derivative.standard_error, derivative
