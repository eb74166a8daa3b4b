"""What the online estimator remembers."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Generator
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.live.interruptions import Interruptions
from sysid_node.flight.live.mean_force import RecentMeanForce
from sysid_node.flight.live.unchanging import UnchangingReadings
from sysid_node.online.alignment.flow_angle_filter import FlowAngleFilter
from sysid_node.online.changes.detection import ChangeMonitor
from sysid_node.online.changes.excited_segments import ExcitedSegments
from sysid_node.online.frequency import fourier_transform, sampled_transform
from sysid_node.online.frequency.regression_signals import MomentumGain, ScalarSignals, SignalLayout
from sysid_node.online.frequency.sampled_transform import SampledTransform
from sysid_node.online.regression.actuator_lag_test import LagTest
from sysid_node.online.regression.derivative_index import DerivativeIndex
from sysid_node.online.regression.heteroskedasticity import NoiseMoments
from sysid_node.online.regression.information import Information, Spectrum
from sysid_node.online.regression.instruments import InstrumentModel
from sysid_node.online.regression.least_squares import InstrumentStrength, Solution, Uncertainty
from sysid_node.online.regression.normal_equations import NormalEquations
from sysid_node.online.regression.weak_instruments import AndersonRubinBounds
from sysid_node.online.settings import OnlineSettings
from sysid_node.online.status import Codes, Vocabulary
from sysid_node.online.systematic.budget import Budget
from sysid_node.online.systematic.estimation import AlternativeSolution, SystematicErrors
from sysid_node.online.systematic.imperfections import Imperfections
from sysid_node.online.systematic.rate_limited_moves import RateLimitedMoves
from sysid_node.online.systematic.servo_model import ServoModel
from sysid_node.online.systematic.servo_states import ServoStates
from sysid_node.online.types import DerivativeEstimate

Array = NDArray[np.float64]
T = TypeVar("T")
#: Work in steps of a millisecond or two, between which it waits; its result is the generator's.
Steps = Generator[None, None, T]


@dataclass(frozen=True)
class SampleModel:
    """How a sample is taken in: what it must lie within, and what signals it becomes."""

    lower_limits: tuple[float, ...]  # of each value of a sample, exclusive
    signals: ScalarSignals
    momentum: MomentumGain
    commanded: bool = False  # whether deflections follow from commands by the aircraft file's servos
    command_interval: float = 0.0  # s between a log's commands where lines stand between them
    timed: tuple[int, ...] = ()  # places among the aircraft's controls of those in the layout's order


@dataclass(frozen=True)
class SegmentTimes:
    """How long data are taken together, and how long they count (s)."""

    length: float  # of a segment
    memory: float  # inf = nothing is forgotten


@dataclass(frozen=True)
class EstimatorModel:
    """What does not change in flight."""

    aircraft: Aircraft
    settings: OnlineSettings
    layout: SignalLayout
    equations: NormalEquations
    instrumented: NormalEquations  # with instruments, whatever the method
    table: DerivativeIndex
    vocabulary: Vocabulary
    spectrum: Spectrum
    sample: SampleModel
    times: SegmentTimes
    prior: tuple[Array, Array]  # (P, C) the aircraft file's derivatives, and 1 / tolerance^2
    instrument_model: InstrumentModel | None  # None where no regressor has an instrument
    imperfections: Imperfections | None  # None where the aircraft file states that all is exact


@dataclass(frozen=True)
class ValidityBasis:
    """Criteria of validity of the D estimates that do not change between renewals."""

    without_objection: NDArray[np.bool_]  # (D,) whether all criteria evaluated at the renewal are met
    objections: Codes  # (D,) status by the criteria evaluated at the renewal, 0 = ok
    reasons: Codes  # (D,) what is said of those that are not valid, unless a sample says more
    open: NDArray[np.bool_]  # (D,) whether a sample may say more: where nothing is objected
    squares: Array  # (D,) of half of Student's interval over a standard error
    longest: Array  # (D,) the largest squared standard error of an interval that has an end
    allowed: Array  # (D,) the largest squared standard error of a valid estimate
    relative: Array | None  # (D,) ... as a share of the estimate's square, where that may be larger
    systematic: Array  # (D,) squared systematic errors
    systematic_errors: Array  # (D,) their roots
    systematic_arms: Array  # (D,) squares of what they alone make of an interval's half
    floor: Array  # (P,) energy under which a regressor is buried in noise
    fits: Array  # (C, 4) what ``FitQuality`` says, behind room for R squared
    servos: Codes  # (m,) what is said against every derivative of a control whose servo is estimated, 0 = not of every


@dataclass(frozen=True)
class PublishedImperfections:
    """What is published of imperfections, which does not change between renewals."""

    servos: dict[str, DerivativeEstimate]  # how late each control follows what is recorded of it, s
    budget: Budget  # but for the derivatives' statistical variances


@dataclass
class FinishedSums:
    """Sums over the finished segments at a renewal, to which the transform of the present one is added."""

    gram: Array  # (W, W)
    integrals: Array  # (W,) of the signals


@dataclass(frozen=True)
class InstrumentChecks:
    """How far estimates by the instruments can be trusted."""

    strength: InstrumentStrength  # of the instruments on the regressors
    selection_bias_factors: Array  # (P, C) see ``selection_bias``
    anderson_rubin: AndersonRubinBounds  # of the intervals
    only_answered: NDArray[np.bool_]  # (C,) coefficients of an axis whose surfaces do nothing but answer gusts


@dataclass(frozen=True)
class ModelTests:
    """Tests of the model by the data."""

    lag: LagTest  # whether measured deflections are late
    lag_tested: int  # number of pieces finished when ``lag`` was found
    outside_model: NDArray[np.bool_]  # (C,) coefficients that the model does not explain at present
    contradicted: NDArray[np.bool_]  # (C,) coefficients whose estimates the last seconds contradict


@dataclass(frozen=True)
class LaterEstimates:
    """What estimates until the next renewal take from this one."""

    compensation: Array | None  # noise's part of the normal equations, see ``least_squares.bias_of``
    trim_noise: Array  # (C,) squared error of the coefficients' integrals
    factors: Array  # (C, P) squared standard error over (P_jj residual)


@dataclass
class SegmentSolution:
    """What ``renew`` last found; the estimates use it until the next renewal."""

    time: float  # s, when it was found
    pieces: int  # number of pieces finished by then
    total: Information
    solution: Solution
    uncertainty: Uncertainty
    finished: FinishedSums
    later: LaterEstimates
    instruments: InstrumentChecks
    tests: ModelTests
    gusts: Array  # (C,) share of the residuals that is not the sensors' noise
    systematic: SystematicErrors | None = None  # None where all is exact
    basis: ValidityBasis | None = None  # made when first wanted
    published: PublishedImperfections | None = None  # made when first wanted

    def corrected(self, errors: SystematicErrors) -> tuple[Array, Array]:
        """The slopes, each corrected for the systematic ``errors``, and their whole variances, (P, C)."""
        statistical = self.uncertainty.covariance.diagonal(axis1=1, axis2=2)
        theta = self.solution.theta + errors.correction[:, :-1].T
        return np.asarray(theta), np.asarray((statistical + errors.variance[:, :-1]).T)


@dataclass
class PresentSegment:
    """The segment that is under way, of which alone the transform is. Times in s."""

    start: float = math.nan  # NaN = none is under way
    start_impulse: Array = field(default_factory=lambda: np.empty(0))  # (2F + 1,) a unit one at the start
    samples: int = 0
    intervals: float = 0.0  # s: sum of the air data's intervals
    piece_start: float = math.nan  # of the piece under way, half a second of data
    piece_lines: Array = field(default_factory=lambda: np.empty((0, 0)))  # transform at the piece's start
    renew_at: float = math.inf
    noise_moments: NoiseMoments = field(default_factory=NoiseMoments)
    noise_measured_until: float = math.nan  # time up to which ``noise_moments`` are measured
    first_impulses: Array = field(default_factory=lambda: np.empty((0, 0)))  # of the servos, at the segment's start
    first_servos: ServoStates | None = None  # then; None where they are not to be looked at again
    information: Information | None = None  # at the last renewal; None = none since the segment's start

    def start_at(self, time: float, omega: Array) -> None:
        """Let the segment start at ``time`` (s), with lines ``omega`` (F,) rad/s."""
        self.start, self.start_impulse = time, fourier_transform.impulse(omega, time)


@dataclass
class FinishedSegments:
    """What the finished segments say of the derivatives."""

    information: Information  # their sum, faded to ``time``
    time: float = math.nan  # s
    in_window: deque[tuple[float, Information]] = field(default_factory=deque)  # end (s) and content of each
    pieces: int = 0  # number of pieces finished


@dataclass
class ChangeWatch:
    """What the tests for changes of the aircraft use."""

    excited: list[ExcitedSegments]  # by block of the normal equations
    monitor: ChangeMonitor = field(default_factory=ChangeMonitor)
    changed_at: float = -math.inf  # s, of the last change


@dataclass
class ServoSearch:
    """Other solutions for servos of which the aircraft file is silent (``servo_search``)."""

    energy: float = 0.0  # s of data when the last one was tried
    tried: int = 0  # how many have been
    #: By the control's place among those that are not exactly known.
    alternatives: dict[int, AlternativeSolution] = field(default_factory=dict)


@dataclass
class EstimatorInputs:
    """What the samples so far say of the instruments. Times in s."""

    begin: float = math.nan  # time from which samples count
    previous: tuple[float, tuple[float, ...]] | None = None  # the last sample: time, (p, q, r, ca, sa)
    step: float = 0.0  # between the last two samples
    incomplete: dict[str, int] = field(default_factory=dict)  # samples left out, by the column that was missing
    thrust_known: bool | None = None  # whether the first sample had one; None = none has come yet
    force: RecentMeanForce = field(default_factory=RecentMeanForce)  # specific force along z
    contradiction: str = ""  # which readings contradict the others by their signs, in words
    unchanging: UnchangingReadings = field(default_factory=UnchangingReadings)
    interruptions: Interruptions = field(default_factory=Interruptions)


@dataclass(frozen=True)
class ControlLines:
    """Where the transform's lines have the controls."""

    servos: ServoModel | None  # of the controls; None where all is exact
    states: ServoStates | None  # where those servos are now; None where no control is late
    line_model: InstrumentModel | None  # what is computed from the lines: the controls' servos, instruments


@dataclass
class EstimatorState:
    """All that the estimator remembers."""

    model: EstimatorModel
    transform: SampledTransform  # of the present segment
    equations: NormalEquations  # the model's, with least squares where instruments are weak
    flow: FlowAngleFilter  # of the flow angles that are not measured
    controls: ControlLines
    finished: FinishedSegments
    changes: ChangeWatch
    rate_limited: RateLimitedMoves | None = None  # None where no rate limit is stated with a tolerance
    inputs: EstimatorInputs = field(default_factory=EstimatorInputs)
    segment: PresentSegment = field(default_factory=PresentSegment)
    search: ServoSearch = field(default_factory=ServoSearch)
    latest: SegmentSolution | None = None
    pending: PendingRenewal | None = None


@dataclass
class PendingRenewal:
    """A renewal that is under way, on a copy of the estimator (``pending_renewal``). Times in s."""

    copy: EstimatorState  # as it stood at ``time``, but for what the steps so far have renewed
    steps: Steps[None]  # what is left of the work
    time: float
    lines: Array  # (2F + 1, W) the transform then, without the servos' impulses
    whole: bool  # whether its segment ended with it
    begin: float  # of its segment
    samples: int  # in its segment
    intervals: float  # s: sum of the air data's intervals in its segment


def completed(steps: Steps[T]) -> T:
    """The result of work in steps, all of which are made at once."""
    while True:
        try:
            next(steps)
        except StopIteration as end:
            result: T = end.value
            return result


def current_lines(state: EstimatorState, impulse: Array | None = None) -> Array:
    """(2F + 1, W) the transform of the present segment up to the last sample, with the servos' impulses.

    ``impulse`` (2F + 1,): a unit one at the last sample, from a caller that has it already.
    """
    lines = sampled_transform.current(state.transform)
    servos = state.controls.states
    if servos is not None and state.segment.first_impulses.size:
        model, time = state.model, state.transform.last
        first = state.segment.first_impulses
        unit = fourier_transform.impulse(model.spectrum.omega, time) if impulse is None else impulse
        if model.spectrum.rate:
            first = first * math.exp(0.5 * model.spectrum.rate * (state.segment.start - time))
        rates = lines[:, model.layout.rates]
        rates += servos.impulses(unit) - first
    return lines
