"""What the fault monitor remembers."""

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

SPANS = (5, 10, 20, 40, 80)  # blocks looked back over
LAG = SPANS[-1]  # blocks that must have shown nothing before what is older is learned
LONGEST = 200  # blocks of a fault that are weighed


class WhitenedBlock(NamedTuple):
    """A block against the held model."""

    block: Block
    residual: Array  # (6,) without the learned offsets; raw
    design: Array  # (6, D) whitened
    begun: tuple[Array, ...]  # (6, D) the same for what set in with this block, or with the one before
    whitened: Array  # (6,) residual
    J: Array  # (D, D)
    v: Array  # (D,)


@dataclass
class Alarm:
    """A fault under way: when it was found, the earliest it can have begun, and since when it is taken to be (s)."""

    found: float
    earliest: float
    since: float
    usual: Array  # (H,) size of the statistics before it
    belief: ModelPrior  # what is weighed against


@dataclass
class MonitorState:
    """All that the monitor remembers."""

    aircraft: Aircraft
    settings: FaultMonitorSettings
    terms: Terms
    blocks: BlockAverager
    held: ReferenceModel
    colour: WhiteningFilter
    pieces: deque[WhitenedBlock] = field(default_factory=lambda: deque(maxlen=LONGEST))
    raw: deque[tuple[Array, Array]] = field(default_factory=lambda: deque(maxlen=ORDER))  # design (6, D), residual (6,)
    hypotheses: list[Hypothesis] = field(default_factory=list)
    shifts: Shifts | None = None  # the hypotheses'
    belief: ModelPrior | None = None  # what the blocks are weighed against
    flattened: dict[str, tuple[float, Array]] = field(
        default_factory=dict
    )  # by vane: its noise's variance, and (D,) ...
    explained: NDArray[np.bool_] = field(default_factory=lambda: np.empty(0, dtype=bool))  # (D,) terms that are learned
    usual: deque[Array] = field(default_factory=lambda: deque(maxlen=LAG + 1))  # (S, H) by block
    count: int = 0
    alarm: Alarm | None = None
    fault: Fault | None = None
