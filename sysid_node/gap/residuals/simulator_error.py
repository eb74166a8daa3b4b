"""How far a model stands off the simulator that it was identified from, as shares of the motion.

A diagnosis against such a model cannot say more of the simulator than the model does. What the model leaves of
simulated flight therefore counts like noise: in the weights of the residual, in the noise floor, and in the least size
of an effect that matters.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from sysid_node.flight.record import Array
from sysid_node.gap.residuals.residual_model import CHANNELS, ResidualModel


@dataclass(frozen=True)
class SimulatorError:
    """Root-mean-square errors of a model of a simulator on simulated flight not fitted, as shares of the motion."""

    channels: Array  # (12,) of forces, moments and kinematics (``CHANNELS``)
    readings: Mapping[str, float]  # of short simulated flights, by reading; empty where none can be simulated
    total: float  # of all readings; of all channels where no short flight can be simulated

    @property
    def per_channel(self) -> dict[str, float]:
        """By reading, or by channel where no short flight can be simulated: the channels of the reported gap."""
        return dict(self.readings) or dict(zip(CHANNELS, self.channels.tolist(), strict=True))


def with_simulator_error(model: ResidualModel, error: SimulatorError) -> ResidualModel:
    """The residual model of a flight, in whose noise is what the simulator's model leaves of such a motion."""
    motion = model.windows.smoothed((np.abs(model.measured) ** 2).mean(axis=0))
    motion[0] = motion[1:].max(axis=0)  # the mean is no motion
    noise = model.noise + error.channels**2 * motion
    return replace(model, noise=noise, simulator_error=error.channels, reading_errors=dict(error.readings))
