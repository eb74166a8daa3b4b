"""What the online estimator remembers."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.online.alignment.flow_angle_filter import Reconstruction
from sysid_node.online.changes.detection import Watch
from sysid_node.online.changes.excited_segments import Experience
from sysid_node.online.frequency.regression_signals import Layout, MomentumGain, ScalarSignals
from sysid_node.online.frequency.sampled_transform import SampledTransform
from sysid_node.online.regression.actuator_lag_test import Timing
from sysid_node.online.regression.derivative_index import Table
from sysid_node.online.regression.heteroskedasticity import Unevenness
from sysid_node.online.regression.information import Information, Spectrum
from sysid_node.online.regression.instruments import Auxiliary
from sysid_node.online.regression.least_squares import Hold, Solution, Uncertainty
from sysid_node.online.regression.normal_equations import Plan
from sysid_node.online.regression.weak_instruments import Bend
from sysid_node.online.settings import Settings
from sysid_node.online.status import Codes, Vocabulary

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Model:
    """What does not change in flight."""

    aircraft: Aircraft
    settings: Settings
    layout: Layout
    plan: Plan
    table: Table
    vocabulary: Vocabulary
    spectrum: Spectrum
    lowest: tuple[float, ...]  # what each value of a sample must lie above
    signals: ScalarSignals
    momentum: MomentumGain
    believed: tuple[Array, Array]  # (P, C) the aircraft file's derivatives, and 1 / tolerance^2
    auxiliary: Auxiliary | None  # what makes instruments, where the method wants them
    segment_time: float  # s
    memory: float  # s, inf = nothing is forgotten


@dataclass(frozen=True)
class Grounds:
    """What the judgement of the D estimates rests on between renewals."""

    sound: NDArray[np.bool_]  # (D,) nothing speaks against it but what the present says
    against: Codes  # (D,) status of those against which something else speaks, 0 where nothing does
    squares: Array  # (D,) of half of Student's interval over a standard error
    longest: Array  # (D,) the largest squared standard error of an interval that has an end
    allowed: Array  # (D,) the largest squared standard error of a valid estimate
    relative: Array | None  # (D,) ... as a share of the estimate's square, where that may be larger
    floor: Array  # (P,) energy under which a regressor is buried in noise
    fits: Array  # (C, 3) what ``FitQuality`` says besides R squared


@dataclass
class Renewed:
    """What ``renew`` last found; per-sample estimates lean on it until the next time."""

    time: float  # s, when it was found
    pieces: int  # of the watch, finished by then
    timed: int  # ... when ``timing`` was looked at
    total: Information
    solution: Solution
    uncertainty: Uncertainty
    compensation: Array | None  # noise's part of the normal equations, see ``regression.bias_of``
    base: Array  # (W, W) Gram matrix of the finished segments
    integrals: Array  # (W,) of the finished segments' signals
    trim_noise: Array  # (C,) squared error of the coefficients' integrals
    factors: Array  # (C, P) squared standard error over (P_jj residual)
    timing: Timing  # whether the controls are felt when they are measured
    hold: Hold  # of the instruments on the regressors
    prudence: Array  # (P, C) see ``prudence``
    bend: Bend  # of the intervals
    lost: NDArray[np.bool_]  # (C,) coefficients that the model does not explain at present
    doubted: NDArray[np.bool_]  # (C,) coefficients whose estimates the last seconds contradict
    grounds: Grounds | None = None  # made when first wanted


@dataclass
class State:
    """All that the estimator remembers. Times in s."""

    model: Model
    transform: SampledTransform  # of the present segment
    plan: Plan  # the model's, with least squares where instruments are weak
    past: Information  # finished segments, faded to ``past_time``
    flow: Reconstruction  # of the flow angles that are not measured
    past_time: float = math.nan
    inside: deque[tuple[float, Information]] = field(
        default_factory=deque
    )  # end and content of those inside the window
    segment_start: float = math.nan  # NaN = none is under way
    piece: Array = field(default_factory=lambda: np.empty((0, 0)))  # transform at the piece's start
    piece_start: float = math.nan
    weighed_until: float = math.nan  # time up to which ``uneven`` counts
    uneven: Unevenness = field(default_factory=Unevenness)  # of the present segment
    renew_at: float = math.inf
    step: float = 0.0  # s between the last two samples
    previous: tuple[float, tuple[float, ...]] | None = None  # the last sample: time, (p, q, r, ca, sa)
    begin: float = math.nan  # time from which samples count
    samples: int = 0  # in the present segment
    intervals: float = 0.0  # s: sum of the air data's intervals in the present segment
    incomplete: dict[str, int] = field(default_factory=dict)  # samples left out, by the column that was missing
    thrust_known: bool | None = None  # whether the first sample had one; None = none has come yet
    present: Information | None = None  # the present segment's, at the last renewal
    renewed: Renewed | None = None
    watch: Watch = field(default_factory=Watch)
    experiences: list[Experience] = field(default_factory=list)  # by block of the plan
    pieces: int = 0  # of the watch, finished
    changed_at: float = -math.inf
