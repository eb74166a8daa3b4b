"""How well a model stands for a simulator: what it leaves of simulated flight that was not fitted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from sysid_node.gap.residuals.residual_model import ResidualModel
from sysid_node.gap.residuals.simulator_error import SimulatorError
from sysid_node.gap.residuals.windowed_spectra import power_of
from sysid_node.gap.thresholds import THRESHOLDS
from sysid_node.gap.validation.simulation_error import error_shares


def simulator_error(models: Sequence[ResidualModel], noise: Mapping[str, float]) -> SimulatorError:
    """The error of the models' own simulator on flights held out.

    Channels that hardly move in these flights count as exact: they bound nothing. ``noise`` is 1 sigma of the real
    sensors, SI.
    """
    left = sum(power_of(model.residual(model.simulator.neutral())) for model in models)
    motion = sum(model.motion_power for model in models)
    quiet = sum(m.axes * len(m.measured) * (m.noise.sum(axis=0) - 0.5 * m.noise[0]) for m in models)
    moved = motion > THRESHOLDS.validation.motion * quiet
    channels = np.sqrt(np.where(moved, left / np.maximum(motion, 1e-300), 0.0))
    readings = error_shares(models, noise)
    shares = list(readings.values()) or channels[np.any([model.axes for model in models], axis=0)].tolist()
    return SimulatorError(channels, readings, float(np.sqrt(np.mean(np.square(shares)))))
