"""The state of the fault monitor."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.faults.hypotheses.bayes_factors import Shifts
from sysid_node.faults.hypotheses.catalogue import Hypothesis
from sysid_node.faults.model.blocks import Block, BlockAverager
from sysid_node.faults.model.reference_model import ModelPrior, ReferenceModel
from sysid_node.faults.model.residual_whitening import ORDER, WhiteningFilter
from sysid_node.faults.model.terms import Terms
from sysid_node.faults.settings import FaultMonitorSettings
from sysid_node.faults.types import Fault

Array = NDArray[np.float64]

SPANS = (5, 10, 20, 40, 80)  # blocks, lengths of the intervals that are tested for a fault
LAG = SPANS[-1]  # blocks without a fault, after which the block before them is learned from
LONGEST = 200  # blocks since the onset of a fault that are used at most


class WhitenedBlock(NamedTuple):
    """A block compared with the reference model."""

    block: Block
    residual: Array  # (6,) of the reference model, before offsets and whitening
    design: Array  # (6, D) whitened
    begun: tuple[Array, ...]  # (6, D) the same for a change that began with this block, or with the one before
    whitened: Array  # (6,) residual, whitened
    J: Array  # (D, D) information
    v: Array  # (D,) score


@dataclass
class Alarm:
    """An alarm: when it was raised, the earliest onset that is possible, and the estimated onset (s)."""

    found: float
    earliest: float
    since: float
    usual: Array  # (H,) mean of the statistics before it
    prior: ModelPrior  # of the model without a fault
    place: int = 0  # of the fault that is named, among the hypotheses and after them the stuck vanes
    shift: Array | None = None  # (D,) of the terms by the fault that is named; None for a stuck vane


@dataclass(frozen=True)
class FaultHypotheses:
    """The hypotheses that blocks are tested for, renewed with what has been learned."""

    each: list[Hypothesis]
    shifts: Shifts  # of each
    prior: ModelPrior  # of the model without a fault
    covariance: Array  # (D, D) of the prior
    flattened: dict[str, tuple[float, Array]]  # by vane: its noise's variance, and (D,) what that takes from the score


@dataclass
class BlockHistory:
    """The blocks so far, of which the last are kept."""

    count: int = 0
    lost: int = 0  # of these, that gaps took from what the reference model learns at the start
    latest: Block | None = None
    raw: deque[tuple[Array, Array]] = field(default_factory=lambda: deque(maxlen=ORDER))  # design (6, D), residual (6,)
    pieces: deque[WhitenedBlock] = field(default_factory=lambda: deque(maxlen=LONGEST))


@dataclass
class MonitorState:
    """The state of the monitor."""

    aircraft: Aircraft
    settings: FaultMonitorSettings
    terms: Terms
    blocks: BlockAverager
    reference: ReferenceModel
    whitening: WhiteningFilter
    history: BlockHistory = field(default_factory=BlockHistory)
    renewed: FaultHypotheses | None = None  # None: nothing has been tested yet
    explained: NDArray[np.bool_] = field(
        default_factory=lambda: np.empty(0, dtype=bool)
    )  # (D,) terms with a large R^2, which are learned
    noisy: dict[str, float] = field(default_factory=dict)  # share of each vane's noise in what is learned
    usual: deque[Array] = field(default_factory=lambda: deque(maxlen=LAG + 1))  # (S, H) mean statistics by block
    alarm: Alarm | None = None
    fault: Fault | None = None

    @property
    def hypotheses(self) -> FaultHypotheses:
        """The hypotheses that are tested; there are some before the first test."""
        assert self.renewed is not None
        return self.renewed
