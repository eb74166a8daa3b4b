"""The online estimator: recursive Fourier transform and sequential least squares (SLS-RFT).

Morelli, J. Guidance 23(5), 2000; Subrahmanyam, Kim & Ghosh (CDFP and CDRW). ``init``, then ``update`` with every sample,
``estimate`` whenever the derivatives are wanted. ``update`` and ``solve_now`` are the work of every sample; what changes slowly
(the residuals' colour, the segments, the watch for changes) is renewed every half second of data in ``renew``.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.online import change, information, noise, regression, signals, transform
from sysid_node.online.change import Reference, Watch
from sysid_node.online.information import Information
from sysid_node.online.regression import Plan, Solution, Uncertainty
from sysid_node.online.settings import Settings
from sysid_node.online.signals import NUISANCES, OUTPUTS, Layout
from sysid_node.online.transform import Transform
from sysid_node.online.types import SAMPLE_COLUMNS

Array = NDArray[np.float64]
RENEWAL = change.PIECE  # s of data between renewals
DRIFT = OUTPUTS + NUISANCES.index("t")
THRUST, INTERVAL = SAMPLE_COLUMNS.index("thrust"), SAMPLE_COLUMNS.index("air_interval")


@dataclass(frozen=True)
class Model:
    """What does not change in flight."""

    aircraft: Aircraft
    settings: Settings
    layout: Layout
    plan: Plan
    momentum: tuple[tuple[float, ...], ...]  # see ``signals.momentum_matrix``
    signals: Callable[[Sequence[float]], tuple[list[float], list[float]]]
    segment_time: float  # s
    memory: float  # s, inf = nothing is forgotten


@dataclass
class Renewed:
    """What ``renew`` last found; per-sample estimates lean on it until the next time."""

    total: Information
    solution: Solution
    uncertainty: Uncertainty
    compensation: Array  # (W, W) noise's part of the Gram matrix
    base: Array  # (W, W) Gram matrix of the finished segments
    factors: Array  # (P, C) squared standard error over (P_jj residual)
    lost: NDArray[np.bool_]  # (C,) coefficients that the model does not explain at present


@dataclass
class State:
    """All that the estimator remembers. Times in s."""

    model: Model
    transform: Transform
    past: deque[tuple[float, Information]] = field(default_factory=deque)  # end and content of finished segments
    segment: Array | None = None  # transform at the segment's start
    segment_start: float = math.nan
    piece: Array | None = None  # transform at the piece's start
    piece_start: float = math.nan
    renew_at: float = math.inf
    previous: tuple[float, Array, tuple[float, ...]] | None = None  # time, signals, (p, q, r, ca, sa)
    begin: float = math.nan  # time from which samples count
    samples: int = 0  # in the present segment
    intervals: float = 0.0  # s: sum of the air data's intervals in the present segment
    incomplete: dict[str, int] = field(default_factory=dict)  # samples left out, by the column that was missing
    thrust_known: bool = True
    present: Information | None = None  # the present segment's, at the last renewal
    renewed: Renewed | None = None
    watch: Watch = field(default_factory=Watch)
    changed_at: float = -math.inf


def init(aircraft: Aircraft, settings: Settings) -> State:
    """An estimator that has seen nothing. Raises InputError where the aircraft's model has nothing to estimate."""
    layout = signals.layout(aircraft)
    unformed = signals.unformed(aircraft)
    structure = {c: rs for c, rs in aircraft.structure.items() if c not in unformed and set(rs) - {"0"}}
    if not structure:
        raise InputError(f"aircraft {aircraft.name!r}: derivatives: expected at least one besides offsets")
    memory = settings.forgetting_time or math.inf
    # lines are independent over one period of their spacing; windows and forgetting want several segments
    segment_time = min(1.0 / settings.frequencies[1], settings.window / 5.0 or math.inf, 2.0 * memory)
    model = Model(
        aircraft=aircraft,
        settings=settings,
        layout=layout,
        plan=regression.plan(structure, layout),
        momentum=tuple(tuple(row) for row in signals.momentum_matrix(aircraft).tolist()),
        signals=signals.scalar_signals(aircraft),
        segment_time=max(segment_time, 4.0 * RENEWAL),
        memory=memory,
    )
    return State(model, transform.start(transform.lines(*settings.frequencies), layout.width, memory))


def update(state: State, time: float, sample: Sequence[float]) -> None:
    """Take in one aligned sample (``SAMPLE_COLUMNS``, then the controls) at ``time`` (s, increasing).

    A sample that lacks a value other than thrust is left out and counted in ``incomplete``.
    """
    if math.isnan(state.begin):
        state.begin = time + state.model.settings.settle_time
    if time < state.begin:
        return
    if not math.isfinite(sum(sample)):
        sample = _completed(state, sample)
        if not sample:
            return
    previous = state.previous
    if previous is not None and time <= previous[0]:
        state.incomplete["time"] = state.incomplete.get("time", 0) + 1
        return
    row, angles = state.model.signals(sample)
    row.insert(DRIFT, time)
    now = state.previous = (time, np.array(row), (*sample[3:6], *angles))
    if previous is None or time - previous[0] > state.model.settings.max_gap:
        interrupt(state, time)
        return
    step = time - previous[0]
    half = (now[1] - previous[1]) * 0.5
    mean = previous[1] + half
    add_momentum(state.model.momentum, step, previous[2], now[2], mean)
    transform.add(state.transform, previous[0], time, mean, half)
    count(state, sample[INTERVAL])
    if time >= state.renew_at:
        renew(state)


def _completed(state: State, sample: Sequence[float]) -> Sequence[float]:
    """The sample with unknown thrust taken as none; empty, and counted, where anything else is missing."""
    filled = list(sample)
    if not math.isfinite(filled[THRUST]):
        filled[THRUST] = 0.0
        state.thrust_known = False
    for column, value in enumerate(filled):
        if not math.isfinite(value):
            leave_out(state, column)
            return ()
    return filled


def leave_out(state: State, column: int) -> None:
    """Count a sample that lacks the value of a column."""
    name = (*SAMPLE_COLUMNS, *state.model.aircraft.control_symbols)[column]
    state.incomplete[name] = state.incomplete.get(name, 0) + 1


def add_momentum(matrix, step, before, after, mean):  # type: ignore[no-untyped-def]
    """Add the rate of change of momentum over the interval to the mean coefficients; scalars or columns."""
    dp, dq, dr = ((after[i] - before[i]) / step for i in range(3))
    ca, sa = (before[3] + after[3]) * 0.5, (before[4] + after[4]) * 0.5
    X, Y, Z, L, M, N = (matrix[0][i] * dp + matrix[1][i] * dq + matrix[2][i] * dr for i in range(6))
    for i, part in enumerate((X * sa - Z * ca, -X * ca - Z * sa, Y, L, M, N)):
        mean[..., i] += part


def count(state: State, interval: float) -> None:
    """Count a sample and the air data's interval (s) into the present segment."""
    state.samples += 1
    state.intervals += interval


def interrupt(state: State, time: float) -> None:
    """Nothing is known of the time since the last sample: finish the segment there and begin one here."""
    if state.segment is not None and state.transform.last > state.piece_start:
        renew(state)
        _finish_segment(state)
    state.watch.pieces.clear()
    state.transform.last = time
    _begin(state, transform.current(state.transform), time)


def _begin(state: State, lines: Array, time: float) -> None:
    """Begin a segment and a piece of the watch at ``time`` (s)."""
    state.segment, state.segment_start, state.samples, state.intervals = lines, time, 0, 0.0
    _begin_piece(state, lines, time)


def _begin_piece(state: State, lines: Array, time: float) -> None:
    state.piece, state.piece_start, state.renew_at = lines, time, time + RENEWAL


def _fading(state: State, since: float) -> float:
    """Share of a transform's amplitude that is left of what was there at ``since`` (s)."""
    return math.exp((since - state.transform.last) / (2.0 * state.model.memory))


def renew(state: State) -> None:
    """Renew all that changes slowly; see ``Renewed``."""
    time = state.transform.last
    lines = transform.current(state.transform)
    _watch_piece(state, lines)
    _measure_segment(state, lines)
    _solve_all(state)
    if state.model.settings.detect_changes:
        _look_for_changes(state, lines)
    if time - state.segment_start >= state.model.segment_time:
        _finish_segment(state)
        _begin(state, lines, time)
    else:
        _begin_piece(state, lines, time)


def _watch_piece(state: State, lines: Array) -> None:
    """Hand the finished piece to the watch."""
    if state.piece is not None and state.transform.last > state.piece_start:
        piece = lines - state.piece * _fading(state, state.piece_start)
        state.watch.pieces.append((state.piece_start, piece))


def _measure_segment(state: State, lines: Array) -> None:
    """What the present segment says up to now."""
    model, omega = state.model, state.transform.grid.omega
    begin, end = state.segment_start, state.transform.last
    info = information.measure(lines - state.segment * _fading(state, begin), omega, begin, end, model.memory)
    step = (end - begin) / max(state.samples, 1)
    mean = info.integrals / information.window_energy(end - begin, 2.0 * model.memory)
    per_line_second = noise.gram_bias(model.aircraft, model.layout, mean, step, state.intervals / max(state.samples, 1))
    info.bias = (omega.size - 1) * info.energy * per_line_second
    info.samples = float(state.samples)
    state.present = info


def _past(state: State) -> Information:
    """Sum of the finished segments, faded to now, without those that the window has left behind."""
    settings, now = state.model.settings, state.transform.last
    while settings.window and state.past and state.past[0][0] <= now - settings.window:
        state.past.popleft()
    total = information.nothing(state.model.layout.width)
    for end, info in state.past:
        total += info.scaled(math.exp((end - now) / state.model.memory)) if settings.forgetting_time else info
    return total


def _solve_all(state: State) -> None:
    """Estimates, their covariance and the noise's part, from all segments."""
    plan = state.model.plan
    past = _past(state)
    total = past + state.present
    gram = total.grams.sum(axis=0)
    plain = regression.solve(plan, gram)
    spread = regression.uncertainty(plan, plain, total)
    line_seconds = max((state.transform.grid.count - 1) * total.energy, 1e-9)
    compensation = noise.capped(plan, plain, spread.density, total.bias, line_seconds)
    solution = regression.solve(plan, gram, compensation)
    if not solution.usable:
        solution, compensation = plain, np.zeros_like(compensation)
    spread = regression.uncertainty(plan, solution, total)
    scale = solution.inverse.diagonal()[:, None] * solution.residual
    variance = spread.covariance.diagonal(axis1=1, axis2=2).T
    factors = variance / np.where(scale > 0.0, scale, np.inf)
    lost = np.zeros(len(plan.coefficients), dtype=bool)
    base = past.grams.sum(axis=0)
    state.renewed = Renewed(total, solution, spread, compensation, base, factors, lost)
    state.watch.references.append(Reference(state.transform.last, solution, spread))


def _look_for_changes(state: State, lines: Array) -> None:
    """Begin anew where the aircraft has changed; note which coefficients the model does not explain."""
    finding = change.examine(state.model.plan, state.watch, state.transform.grid.omega, state.transform.last)
    state.renewed.lost = finding.lost
    if finding.changed_since is None:
        return
    since = finding.changed_since
    kept = [piece for start, piece in state.watch.pieces if start >= since - 1e-6]
    now = state.transform.last
    # what is counted of the present segment is taken as even over its time
    share = (now - since) / (now - state.segment_start)
    state.samples, state.intervals = round(state.samples * share), state.intervals * share
    state.past.clear()
    state.segment, state.segment_start = lines - np.sum(kept, axis=0), since
    state.changed_at = now
    state.watch.references.clear()
    state.watch.pieces.clear()
    _measure_segment(state, lines)
    _solve_all(state)


def _finish_segment(state: State) -> None:
    """Put the present segment to the finished ones."""
    if state.present is not None and state.renewed is not None:
        state.past.append((state.transform.last, state.present))
        state.renewed.base = state.renewed.base + state.present.grams.sum(axis=0)
    state.present = None
