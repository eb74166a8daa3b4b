"""Tells whether a servo reaches its rate limit in flight, from commands and motion alone.

A servo turns at most so fast. Below the limit it answers to every command alike: late, but in proportion. At the limit
it is late by the command's size over twice the limit, so that large steps are later than small ones, which no linear
servo is. Two models of the control's main moment are compared by least squares on blocks of 0.1 s. Both have the
aircraft's derivatives free:

    M0: C = sum c_j x_j + (other terms),        x_j = the command through lags of first order, one or more, or none
    M1: C = M0 + g D(R),                        D(R) = a servo's position with the rate limit R, less that without

A sum of lags stands for any servo without a limit. Lags in series are among them, as a servo of second order begins to
move more softly than a lag, and would otherwise look limited. With residual sums of squares S, twice the log likelihood
ratio is n log(S0 / S1), for blocks whose residuals are whitened (see ``residual_whitening``). A limited surface has the
effect g = sum c_j: what is merely correlated with D(R), such as a stall in a hard manoeuvre, has another.
(Nested comparison: Seber & Lee, "Linear Regression Analysis", 2nd ed., 2003, ch. 4; rate limits as a cause of handling
problems: Klyde & Mitchell, J. Guidance 27(5), 2004.)
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.aircraft.names import COEFFICIENTS
from sysid_node.faults.model.blocks import PERIOD, Block
from sysid_node.faults.model.terms import Terms
from sysid_node.faults.types import ESTIMATES, RATE_LIMITED, Fault
from sysid_node.flight.servos import servos_of
from sysid_node.online.frequency.regression_signals import OFFSET
from sysid_node.online.types import SAMPLE_COLUMNS

Array = NDArray[np.float64]

LIMITS = 1.25 ** np.arange(0, 13)  # rad/s, from 1 to 14.6
#: Time constant (s), and which of the lags before it each one follows; none: the command. A sum of them is a servo
#: without a limit.
UNLIMITED = ((0.0, None), (0.02, None), (0.06, None), (0.02, 1), (0.02, 2))
SERVO = 1  # of these, before the limit
MEMORY = 120.0  # s, time constant with which blocks are forgotten
SURE = 15.0  # log likelihood ratio above which a limit is reported, and
MATTERS = 0.2  # ... per block: misfits of servos and instruments in still air reach 0.14 in flights without a limit
NEAR = 0.5  # largest difference of the free factor from the surface's effect, as a share
LEAST_BLOCKS = 100
LEAST_MOVES = 7.0  # blocks in which the surface is behind: in fewer, several shapes of a response fit
EVERY = 50  # blocks between comparisons
KNOWN_SHARE = 0.7  # of a limit that the file states: only a lower one is reported
PROFILE = 1.92  # log likelihood under its maximum at the ends of a 95 % interval
LEAST_WIDTH = (
    1.5  # factor by which the limit of an 8 Hz servo of second order was found too small: no lag with a limit behind
)
_FIRST = len(SAMPLE_COLUMNS)
_RIDGE = 1e-9
HARDLY = 1e-5  # share of the commands' energy under which a limit is hardly ever reached


class _Control(NamedTuple):
    """The equation of a control's main moment."""

    name: str
    place: int  # among the controls
    output: int  # of the coefficient among the outputs
    others: NDArray[np.intp]  # columns of the other terms
    known: float  # rad/s: the limit that the file states; infinite = none


@dataclass
class _Servos:
    """Servos that follow the commands of m controls: by J lags without a limit, and with each of K limits."""

    count: int  # m
    beyond: Array  # (m, K) rad: limited less ``SERVO``'s output
    area_beyond: Array  # (m, K) rad s, since the block began
    limiting: bool = False  # whether anything is beyond
    time: float = math.nan  # s, of the last sample
    commands: list[float] = field(default_factory=list)  # (m,) rad; empty before the first
    lagged: list[list[float]] = field(default_factory=list)  # (m, J) rad
    areas: list[list[float]] = field(default_factory=list)  # (m, J) rad s, since the block began


@dataclass
class RateLimits:
    """The state of the comparison."""

    controls: tuple[_Control, ...]
    servos: _Servos
    rows: list[deque[Array]]  # by control, the last blocks before whitening
    grams: list[Array]
    behind: Array  # (m, 2) sums of squares, and of their squares, of how far each surface is behind its command
    weight: float = 0.0  # blocks that count
    blocks: int = 0
    found: dict[str, Fault] = field(default_factory=dict)

    @property
    def faults(self) -> list[Fault]:
        """The servos that reach their limits."""
        return list(self.found.values())


def init(aircraft: Aircraft, terms: Terms) -> RateLimits:
    """The state before the first sample."""
    stated = servos_of(aircraft)[1:]
    controls = []
    for place, ((name, control), servo) in enumerate(zip(aircraft.controls.items(), stated, strict=True)):
        mine = [
            d for d in np.flatnonzero(terms.of(control.symbol)) if COEFFICIENTS[terms.output[d]] in ("Cl", "Cm", "Cn")
        ]
        main = max(mine, key=lambda d: abs(terms.values[d]), default=None)
        if main is None:
            continue
        output = int(terms.output[main])
        others = terms.column[(terms.output == output) & (np.arange(terms.output.size) != main)]
        controls.append(_Control(name, place, output, others, servo.rate_limit))
    m, J, K = len(aircraft.controls), len(UNLIMITED), LIMITS.size
    rows: list[deque[Array]] = [deque(maxlen=2) for _ in controls]
    grams = [np.zeros((n, n)) for n in (1 + c.others.size + J + K for c in controls)]
    servos = _Servos(m, np.zeros((m, K)), np.zeros((m, K)))
    return RateLimits(tuple(controls), servos, rows, grams, np.zeros((len(controls), 2)))


def move(state: RateLimits, time: float, sample: Sequence[float]) -> None:
    """Let servos with each limit follow the commands of an aligned sample at ``time`` (s)."""
    servos = state.servos
    commands = list(sample[_FIRST : _FIRST + servos.count])
    if not math.isfinite(math.fsum(commands)):
        return
    step, servos.time = time - servos.time, time
    if not servos.commands or not 0.0 < step < PERIOD:
        servos.commands, servos.lagged = commands, [[u] * len(UNLIMITED) for u in commands]
        servos.areas = [[0.0] * len(UNLIMITED) for _ in commands]
        servos.beyond[:], servos.area_beyond[:], servos.limiting = 0.0, 0.0, False
        return
    decays = [math.exp(-step / lag) if lag else 0.0 for lag, _ in UNLIMITED]
    before = [lagged[SERVO] for lagged in servos.lagged]
    for i, (earlier, now) in enumerate(zip(servos.commands, commands, strict=True)):
        lagged, areas = servos.lagged[i], servos.areas[i]
        means: list[float] = []
        for j, ((_, source), decay) in enumerate(zip(UNLIMITED, decays, strict=True)):
            aim = 0.5 * (earlier + now) if source is None else means[source]  # straight lines between samples
            after = aim + (lagged[j] - aim) * decay if decay else now
            means.append(0.5 * (lagged[j] + after))
            areas[j] += step * means[j]
            lagged[j] = after
    servos.commands = commands
    moved = [lagged[SERVO] - old for lagged, old in zip(servos.lagged, before, strict=True)]
    if servos.limiting or max(map(abs, moved), default=0.0) > LIMITS[0] * step:
        _limit(servos, moved, step)


def _limit(servos: _Servos, moved: Sequence[float], step: float) -> None:
    """Advance the limited positions, less the output of the lag, which ``moved`` (m,) rad in the ``step`` (s)."""
    off, reach = np.array(moved)[:, None] - servos.beyond, LIMITS * step
    after = np.minimum(np.maximum(off, -reach), reach) - off
    servos.area_beyond += 0.5 * step * (servos.beyond + after)
    servos.beyond = after
    servos.limiting = bool(np.abs(after).max() > 1e-9)


def take(state: RateLimits, block: Block, whitening: Array) -> None:
    """Take the block that ends with the last sample; ``whitening`` (2, 6) are the residuals' autoregressions."""
    k, servos = block.regressors[OFFSET], state.servos
    if servos.commands:
        means, beyond = np.array(servos.areas) / PERIOD, servos.area_beyond / PERIOD
        servos.areas, servos.area_beyond = (
            [[0.0] * len(UNLIMITED) for _ in servos.commands],
            np.zeros_like(servos.beyond),
        )
    if not servos.commands or not block.follows:
        for earlier in state.rows:
            earlier.clear()
        return
    keep = math.exp(-PERIOD / MEMORY)
    state.weight = keep * state.weight + 1.0
    state.blocks += 1
    for i, control in enumerate(state.controls):
        motion = block.outputs[[control.output]], block.regressors[control.others]
        row = np.concatenate([*motion, k * means[control.place], k * beyond[control.place]])
        earlier = state.rows[i]
        if len(earlier) == 2:
            white = row - whitening[0, control.output] * earlier[1] - whitening[1, control.output] * earlier[0]
            state.grams[i] *= keep
            state.grams[i] += white[:, None] * white
            behind = float(white[1 + control.others.size] - white[1 + control.others.size + SERVO]) ** 2
            state.behind[i] = keep * state.behind[i] + np.array([behind, behind**2])
        earlier.append(row)
        if state.blocks % EVERY == 0 and state.weight > LEAST_BLOCKS:
            _compare(state, i, block.time)


def _compare(state: RateLimits, i: int, now: float) -> None:
    control = state.controls[i]
    ratios, factors = _ratios(state.grams[i], control.others.size, state.weight)
    best = int(np.argmax(ratios))
    lowest = KNOWN_SHARE * control.known if math.isfinite(control.known) else LIMITS[-1]
    needed = max(SURE, MATTERS * state.weight)
    squares, fourth = state.behind[i].tolist()
    told = (
        squares**2 > LEAST_MOVES * fourth
        and ratios[best] > needed
        and abs(factors[best] - 1.0) < NEAR
        and best > 0
        and LIMITS[best] < lowest
    )
    if not told:
        if ratios[best] < 0.5 * needed:
            state.found.pop(control.name, None)
        return
    size, lower, upper = _profile(ratios, best)
    known = state.found.get(control.name)
    found = known.found if known else now
    sure = 1.0 / (1.0 + math.exp(-min(float(ratios[best]), 500.0)))
    state.found[control.name] = Fault(
        RATE_LIMITED, control.name, size, lower, upper, "rad/s", found, found, sure, source=ESTIMATES
    )


def _ratios(gram: Array, others: int, weight: float) -> tuple[Array, Array]:
    """(K,) log likelihood ratios of the limits, and (K,) the free factor over the surface's effect."""
    P = others + len(UNLIMITED)
    scale = np.sqrt(np.maximum(gram.diagonal(), 1e-300))
    unit = gram / (scale[:, None] * scale)
    ratios, factors = np.zeros(LIMITS.size), np.zeros(LIMITS.size)
    known, lags = list(range(1, 1 + P)), slice(others, P)
    unlimited, free = _left(unit, known), max(weight - P, 1.0)
    for j in range(LIMITS.size):
        at = 1 + P + j
        if gram[at, at] < HARDLY * gram[1 + others, 1 + others]:
            continue
        ratios[j] = 0.5 * free * math.log(unlimited / _left(unit, [*known, at]))
        theta = _solved(unit, [*known, at]) / scale[[*known, at]]
        effect = float(theta[lags].sum())
        factors[j] = theta[-1] / effect if effect else 0.0
    return ratios, factors


def _solved(gram: Array, columns: list[int]) -> Array:
    within = gram[np.ix_(columns, columns)] + _RIDGE * np.eye(len(columns))
    return np.asarray(np.linalg.solve(within, gram[columns, 0]))


def _left(gram: Array, columns: list[int]) -> float:
    """The residual's share of the output's energy."""
    return max(1.0 - float(_solved(gram, columns) @ gram[columns, 0]), 1e-12)


def _profile(ratios: Array, best: int) -> tuple[float, float, float]:
    """The limit (rad/s) by a parabola through the three best ratios, and the ends of its interval."""
    inner = min(max(best, 1), ratios.size - 2)
    low, mid, high = ratios[inner - 1 : inner + 2]
    bend = max(2.0 * mid - low - high, 1e-9)
    grid = math.log(float(LIMITS[1] / LIMITS[0]))
    at = math.log(float(LIMITS[inner])) + grid * float(np.clip(0.5 * (high - low) / bend, -1.0, 1.0))
    half = max(grid * math.sqrt(2.0 * PROFILE / bend), math.log(LEAST_WIDTH))
    return math.exp(at), math.exp(at - half), math.exp(at + half)
