"""The online estimator: recursive Fourier transform and sequential least squares (SLS-RFT).

Morelli, "Real-time parameter estimation in the frequency domain", J. Guidance 23(5), 2000, as flown on the CDFP and
CDRW by Subrahmanyam, Kim & Ghosh. ``init``, then ``update`` with every sample, and ``estimates.estimate`` whenever the
derivatives are wanted. What changes slowly (the residuals' colour, the segments, the watch for changes) is renewed
every half second of data or less often (``segment_update``): with the next sample, or earlier by ``renew_early``, so
that no estimate waits for it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.aircraft.stated_effects import as_estimated
from sysid_node.errors import InputError
from sysid_node.flight.checks import AIRSPEED_LOW, DENSITY_LOW
from sysid_node.online.alignment import flow_angle_filter
from sysid_node.online.changes.detection import PIECE
from sysid_node.online.changes.excited_segments import no_excited_segments
from sysid_node.online.frequency import fourier_transform, regression_signals, sampled_transform
from sysid_node.online.frequency.regression_signals import NUISANCES, OFFSET, OUTPUTS, SignalLayout
from sysid_node.online.frequency.sampled_transform import SampledTransform
from sysid_node.online.regression import information, normal_equations
from sysid_node.online.regression.derivative_index import derivative_index
from sysid_node.online.regression.instruments import INSTRUMENTED, instrument_model
from sysid_node.online.regression.mixed_estimation import believed_derivatives
from sysid_node.online.renewal import pending_renewal
from sysid_node.online.renewal.segment_update import begin_segment, reach, renew
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.state import (
    ChangeWatch,
    ControlLines,
    EstimatorModel,
    EstimatorState,
    FinishedSegments,
    SampleModel,
    SegmentTimes,
)
from sysid_node.online.status import vocabulary
from sysid_node.online.systematic.imperfections import Imperfections, imperfections
from sysid_node.online.systematic.rate_limited_moves import RateLimitedMoves
from sysid_node.online.systematic.servo_states import ServoStates
from sysid_node.online.types import AZ, SAMPLE_COLUMNS

Array = NDArray[np.float64]
DRIFT = OUTPUTS + NUISANCES.index("t")
AIRSPEED, DENSITY = SAMPLE_COLUMNS.index("V"), SAMPLE_COLUMNS.index("rho")
THRUST, INTERVAL = SAMPLE_COLUMNS.index("thrust"), SAMPLE_COLUMNS.index("air_interval")
LIMIT = 1e9  # nothing measured is as large in SI units
JITTER = 1e-3  # s by which a stamp may be early and its sample still be the one that is meant
SERVOS_SETTLE = 0.4  # s after which it no longer matters where a servo was at first
SHORTEST = 1e-4  # s between samples: no sensor is faster, and noise over shorter steps would pass for acceleration


def init(
    aircraft: Aircraft, settings: OnlineSettings, *, commanded: bool = False, command_interval: float = 0.0
) -> EstimatorState:
    """An estimator that has seen nothing. Raises InputError where the aircraft's model has nothing to estimate.

    ``commanded``: whether the samples' deflections follow from commands (``flight.commanded``), which a log holds every
    ``command_interval`` (s; ``JointStream.interval``).
    """
    aircraft = as_estimated(aircraft)
    grid = fourier_transform.lines(*settings.frequencies)
    model = _model(aircraft, settings, grid.omega, commanded, command_interval)
    layout, equations, imperfect = model.layout, model.equations, model.imperfections
    transform = fourier_transform.start(grid, layout.transformed, model.times.memory, len(layout.instrumented))
    return EstimatorState(
        model,
        SampledTransform(layout, transform),
        equations,
        flow_angle_filter.init(aircraft),
        ControlLines(
            servos=imperfect.applied if imperfect else None,
            states=ServoStates([0.0] * len(layout.timed)) if imperfect and imperfect.controls else None,
            line_model=model.instrument_model,
        ),
        FinishedSegments(information.nothing(layout, grid.count if imperfect else 0)),
        ChangeWatch(no_excited_segments(equations, layout)),
        RateLimitedMoves.of(aircraft, layout.timed) if commanded and imperfect else None,
    )


def _model(
    aircraft: Aircraft, settings: OnlineSettings, omega: Array, commanded: bool, command_interval: float
) -> EstimatorModel:
    """What does not change in flight; ``omega`` are the lines (rad/s). Raises InputError, see ``init``."""
    layout = regression_signals.layout(aircraft, INSTRUMENTED)
    unformed = regression_signals.unformed(aircraft)
    structure = {c: rs for c, rs in aircraft.model_structure.items() if c not in unformed and set(rs) - {"0"}}
    if not structure:
        raise InputError(f"aircraft {aircraft.name!r}: derivatives: expected at least one besides offsets")
    memory = settings.forgetting_time or math.inf
    # lines are independent over one period of their spacing; windows and forgetting want several segments
    segment_time = min(1.0 / settings.frequencies[1], settings.window / 5.0 or math.inf, 2.0 * memory)
    instrumented = normal_equations.normal_equations(structure, layout)
    plain = settings.method == "sls_rft"
    equations = normal_equations.least_squares_of(instrumented) if plain else instrumented
    return EstimatorModel(
        aircraft=aircraft,
        settings=settings,
        layout=layout,
        equations=equations,
        instrumented=instrumented,
        table=derivative_index(aircraft, equations.structure, settings.valid_fraction),
        vocabulary=vocabulary(aircraft, equations.structure),
        spectrum=information.spectrum(omega, memory),
        sample=SampleModel(
            lower_limits=_lowest(len(aircraft.controls)),
            signals=regression_signals.scalar_signals(aircraft),
            momentum=regression_signals.momentum_gain(aircraft),
            commanded=commanded,
            command_interval=command_interval,
            timed=tuple(aircraft.control_symbols.index(symbol) for symbol in layout.timed),
        ),
        times=SegmentTimes(max(segment_time, 4.0 * PIECE), memory),
        prior=believed_derivatives(aircraft, equations.structure),
        instrument_model=instrument_model(aircraft, layout, omega),
        imperfections=_imperfections(aircraft, settings, layout, commanded, command_interval),
    )


def _imperfections(
    aircraft: Aircraft,
    settings: OnlineSettings,
    layout: SignalLayout,
    commanded: bool,
    command_interval: float,
    reconstructed: tuple[bool, bool] = (False, False),
) -> Imperfections | None:
    return imperfections(
        aircraft,
        layout,
        commanded=commanded,
        positions=settings.actuators == "positions",
        command_interval=command_interval,
        reconstructed=reconstructed,
    )


def _tell_reconstructed_angles(state: EstimatorState) -> None:
    """Take the imperfections as they are where the first sample has shown that flow angles are reconstructed."""
    model, missing = state.model, state.flow.missing
    if state.flow.model is None or missing is None:
        return  # nothing is reconstructed
    if model.imperfections is None or model.imperfections.reconstructed == missing:
        return
    sample = model.sample
    found = _imperfections(
        model.aircraft, model.settings, model.layout, sample.commanded, sample.command_interval, missing
    )
    state.model = replace(model, imperfections=found or model.imperfections)


def begin_with_commands(state: EstimatorState, time: float) -> EstimatorState:
    """An estimator that has seen nothing before ``time`` (s), when deflections begin to follow from commands.

    What the samples said of the aircraft's instruments remains known.
    """
    model = state.model
    fresh = init(model.aircraft, model.settings, commanded=True, command_interval=model.sample.command_interval)
    fresh.transform.transform.last = time
    fresh.flow, fresh.inputs.begin = state.flow, state.inputs.begin
    if fresh.controls.states is not None:
        fresh.inputs.begin = max(state.inputs.begin, time + SERVOS_SETTLE)
    fresh.inputs.thrust_known, fresh.inputs.incomplete = state.inputs.thrust_known, state.inputs.incomplete
    fresh.inputs.force, fresh.inputs.unchanging = state.inputs.force, state.inputs.unchanging
    fresh.inputs.contradiction = state.inputs.contradiction
    return fresh


def _lowest(controls: int) -> tuple[float, ...]:
    """What each value of a sample must lie above."""
    special = {"V": AIRSPEED_LOW, "rho": DENSITY_LOW}
    return (*(special.get(column, -LIMIT) for column in SAMPLE_COLUMNS), *(-LIMIT,) * controls)


def update(state: EstimatorState, time: float, sample: Sequence[float]) -> None:
    """Take in one aligned sample (``SAMPLE_COLUMNS``, then the controls) at ``time`` (s).

    Where the model is ``commanded``, the deflections' excess over straight lines between samples stands behind.

    A sample that lacks a value, has an impossible one, or does not come after the last one, is left out and counted in
    ``incomplete``. Where the first sample has no thrust it is taken as unknown, and as none, from then on; where it
    lacks a flow angle, that is reconstructed from then on.
    """
    sample, excess = _without_excess(state.model, sample)
    sample = flow_angle_filter.complete(state.flow, time, sample, state.model.settings.max_gap)
    inputs = state.inputs
    if inputs.previous is None:
        _tell_reconstructed_angles(state)
    if math.isnan(inputs.begin) and abs(time) < LIMIT:
        inputs.begin = first_counted(time, state.model.settings)
    if not time >= inputs.begin:
        _follow_uncounted(state, time, sample)
        return
    if not (math.hypot(time, *sample) < LIMIT and sample[AIRSPEED] > AIRSPEED_LOW and sample[DENSITY] > DENSITY_LOW):
        sample = _completed(state, time, sample)
        if not sample:
            return
    elif inputs.thrust_known is None:
        inputs.thrust_known = True
    if inputs.previous is not None and time - inputs.previous[0] < SHORTEST:
        leave_out(state, len(sample))
        return
    _append(state, time, sample, excess)


def _append(state: EstimatorState, time: float, sample: Sequence[float], excess: Sequence[float]) -> None:
    """Append a complete sample to the transform; after a gap, begin a segment with it."""
    model, inputs, previous = state.model, state.inputs, state.inputs.previous
    inputs.force.add(time, sample[AZ])
    inputs.unchanging.add(time, sample)
    row, angles = model.sample.signals(sample)
    row.insert(DRIFT, time)
    motion = (*sample[3:6], *angles)
    renew_early(state)
    inputs.previous = (time, motion)
    if previous is None or time - previous[0] > model.settings.max_gap:
        inputs.interruptions.add(previous[0] if previous else None, time)
        interrupt(state)  # before the servos move on
        _follow(state, time, sample, (), row[OFFSET])
        sampled_transform.begin_at(state.transform, time, row)
        begin_segment(state)
        return
    inputs.step = time - previous[0]
    gain = model.sample.momentum(previous[1], motion)
    extra = [row[OFFSET] * excess[i] for i in model.sample.timed] if excess else ()
    if extra:
        gain += [inputs.step * part for part in extra]
    _follow(state, time, sample, excess, row[OFFSET])
    sampled_transform.append(state.transform, time, row, gain)
    state.segment.samples += 1
    state.segment.intervals += sample[INTERVAL]


def _without_excess(model: EstimatorModel, sample: Sequence[float]) -> tuple[Sequence[float], Sequence[float]]:
    """The sample, and behind it the controls' excess where the model is ``commanded``.

    A recorded flight has a place for the excess in all its samples, in those before commands were told, too.
    """
    count = len(model.sample.lower_limits)
    if len(sample) == count:
        return sample, ()
    return sample[:count], sample[count:] if model.sample.commanded else ()


def _follow_uncounted(state: EstimatorState, time: float, sample: Sequence[float]) -> None:
    """Let the servos follow a sample that does not count, so that they are where they are when samples begin to."""
    V, density = sample[AIRSPEED], sample[DENSITY]
    if math.isfinite(V * density * math.fsum(_controls(state, sample))):
        reference = state.model.aircraft.reference
        _follow(state, time, sample, (), density * V * V / (reference.air_density * reference.airspeed**2))


def _controls(state: EstimatorState, sample: Sequence[float]) -> list[float]:
    """The sample's controls, in the layout's order."""
    return [sample[len(SAMPLE_COLUMNS) + i] for i in state.model.sample.timed]


def _follow(state: EstimatorState, time: float, sample: Sequence[float], excess: Sequence[float], scale: float) -> None:
    """Let the servos follow the sample's controls and their excess; ``scale`` is the dynamic pressure's k."""
    servos = state.controls.states
    if servos is not None:
        extra = [excess[i] for i in state.model.sample.timed] if excess else ()
        controls, step = _controls(state, sample), time - servos.time
        if state.rate_limited is not None and 0.0 < step <= state.model.settings.max_gap:
            state.rate_limited.follow(step, servos.controls, controls)
        servos.follow(time, controls, extra, scale)


def renew_early(state: EstimatorState) -> None:
    """Take over what a renewal found, or begin one, where that is due before the next sample.

    Whoever has time before that sample comes may do it then.
    """
    pending_renewal.take_over_if_due(state)
    if reach(state.transform.last, state.inputs.step) >= state.segment.renew_at:
        renew(state)


def use_pause(state: EstimatorState) -> None:
    """Make a step of the renewal under way, a millisecond or two: a later sample need then not wait for it."""
    pending_renewal.make_step(state)


def complete(state: EstimatorState) -> None:
    """End the renewal that is under way, as no further sample comes."""
    pending_renewal.complete(state)


def first_counted(time: float, settings: OnlineSettings) -> float:
    """Time (s) from which samples count, where the first comes at ``time``."""
    return time + settings.settle_time - JITTER


def _completed(state: EstimatorState, time: float, sample: Sequence[float]) -> Sequence[float]:
    """The sample with unknown thrust taken as none; empty, and counted, where anything else is missing."""
    filled = list(sample)
    powerless = not abs(filled[THRUST]) < LIMIT and not state.inputs.thrust_known
    if powerless:
        filled[THRUST] = 0.0
    for column, value in enumerate(filled):
        if not state.model.sample.lower_limits[column] < value < LIMIT:
            leave_out(state, column)
            return ()
    if not time < LIMIT:
        leave_out(state, len(filled))
        return ()
    if state.inputs.thrust_known is None:
        state.inputs.thrust_known = not powerless
    return filled


def leave_out(state: EstimatorState, column: int) -> None:
    """Count a sample that lacks a possible value of a column; the one behind them all stands for the time."""
    name = (*SAMPLE_COLUMNS, *state.model.aircraft.control_symbols, "time")[column]
    state.inputs.incomplete[name] = state.inputs.incomplete.get(name, 0) + 1


def interrupt(state: EstimatorState) -> None:
    """Finish the segment at the last sample: nothing is known of the time until the next."""
    complete(state)
    if state.transform.last > state.segment.start:
        renew(state, last=True)
        complete(state)
    state.changes.monitor.pieces.clear()
