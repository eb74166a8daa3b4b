"""A renewal in steps, so that no sample waits for all of it.

A renewal takes 3 to 80 times as long as there is between two samples. It is therefore made on a copy of the estimator,
which stays at the time at which the renewal fell due, while the estimator goes on with new samples and the estimates
before. ``AFTER`` s of data later the estimator takes over what was found. Until then the live node makes the steps
whenever it has time; a replay makes them all at once. Neither changes what is found, or when it is used.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from sysid_node.online.frequency import sampled_transform
from sysid_node.online.frequency.fourier_transform import impulse
from sysid_node.online.renewal.segment_information import fading
from sysid_node.online.state import EstimatorState, PendingRenewal, Steps, completed, current_lines

AFTER = 0.2  # s of data after which a renewal counts


def begin(state: EstimatorState, whole: bool, work: Callable[[EstimatorState], Steps[None]]) -> None:
    """Begin ``work`` on a copy of the estimator; ``whole``: whether the segment ends here."""
    time, segment, at_rest = state.transform.last, state.segment, sampled_transform.at_rest(state.transform)
    controls, servos = state.controls, state.controls.states
    # What only renewals use is not copied. Nothing else changes or reads it before the end of this one.
    copy = replace(
        state,
        transform=at_rest,
        segment=replace(segment),
        controls=controls if servos is None else replace(controls, states=servos.copy()),
        rate_limited=state.rate_limited.copy() if state.rate_limited else None,
    )
    lines = sampled_transform.current(at_rest)
    counts = segment.samples, segment.intervals
    state.pending = PendingRenewal(copy, work(copy), time, lines, whole, segment.start, *counts)


def make_step(state: EstimatorState) -> None:
    """Make the next step of the renewal under way, if there is one left."""
    if state.pending is not None:
        next(state.pending.steps, None)


def take_over_if_due(state: EstimatorState) -> None:
    """Take over what a renewal found, if that is due before the next sample."""
    pending = state.pending
    if pending is not None and state.transform.last + 0.5 * state.inputs.step >= pending.time + AFTER:
        complete(state)


def complete(state: EstimatorState) -> None:
    """Make all steps that are left of a renewal, and take over what it found."""
    if state.pending is not None:
        completed(state.pending.steps)
        _take_over(state, state.pending)


def _take_over(state: EstimatorState, pending: PendingRenewal) -> None:
    """Take over what the renewal found."""
    copy, states, found = pending.copy, state.controls.states, pending.copy.controls.states
    moved = copy.controls.servos is not state.controls.servos
    if not pending.whole:
        _take_over_segment(state, pending, moved)
    elif moved and found is not None:
        state.segment.first_servos = found.copy()
        state.segment.first_impulses = found.impulses(impulse(state.model.spectrum.omega, pending.time))
    if moved and states is not None and found is not None:
        for sample in states.recent:
            if sample[0] > pending.time:
                found.follow(*sample)
        states = found
    state.equations, state.latest = copy.equations, copy.latest
    state.controls = replace(copy.controls, states=states)
    state.pending = None


def _take_over_segment(state: EstimatorState, pending: PendingRenewal, moved: bool) -> None:
    """Take over what was found of the segment, to which samples were added since.

    It begins later where the aircraft was found to have changed in it; what came before is then taken out.
    """
    segment, renewed = state.segment, pending.copy.segment
    began_anew = renewed.start != pending.begin
    if began_anew:
        before = pending.lines - sampled_transform.current(pending.copy.transform)
        sampled_transform.take_out(state.transform, before * fading(state, pending.time))
        segment.start, segment.start_impulse = renewed.start, renewed.start_impulse
        segment.noise_moments = renewed.noise_moments
        segment.samples += renewed.samples - pending.samples
        segment.intervals += renewed.intervals - pending.intervals
    segment.information = renewed.information
    segment.first_servos, segment.first_impulses = renewed.first_servos, renewed.first_impulses
    if moved or began_anew:
        segment.piece_lines = current_lines(pending.copy)
