"""Made-up flights of a known aircraft: blocks whose residuals are coloured noise, and faults put into them.

The truth is the aircraft file: k C = k (C_0 + C_alpha alpha + ...) holds exactly but for the noise, so that what a
monitor finds can be compared with what was put in.
"""

from collections.abc import Callable
from copy import deepcopy
from functools import cache

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.load import load_aircraft
from sysid_node.aircraft.names import COEFFICIENTS
from sysid_node.faults import monitor
from sysid_node.faults.model.blocks import PERIOD, Block
from sysid_node.faults.model.lagged_controls import LAGS, LaggedControls
from sysid_node.faults.settings import FaultMonitorSettings
from sysid_node.faults.state import MonitorState
from sysid_node.faults.types import Fault
from sysid_node.online.frequency.regression_signals import OFFSET, OUTPUTS
from sysid_node.online.systematic.servo_states import ServoStates

Array = NDArray[np.float64]

AIRCRAFT = load_aircraft("cdrw")
NOISE = np.array([0.008, 0.002, 0.002, 0.0015, 0.0015, 0.0008])  # of the coefficients, in a block
MEMORY = 0.6  # share of the noise that the next block keeps
SIZES = {"alpha": 0.03, "beta": 0.03, "p": 0.03, "q": 0.004, "r": 0.01, "de": 0.03, "da": 0.03, "dr": 0.05}
TRIM = {"alpha": 0.07, "de": 0.01}
ONSET = 32.0  # s of sound flight before a fault
Truth = Callable[[dict[str, float], dict[str, float]], tuple[dict[str, float], dict[str, float]]]


def sound(values: dict[str, float], signals: dict[str, float]) -> tuple[dict[str, float], dict[str, float]]:
    """Derivatives and regressors that make the forces, of the file's and the measured ones: the same."""
    return values, signals


class Maker:
    """Makes blocks, one after the other; noise and motion are first-order autoregressions."""

    def __init__(self, seed: int, names: tuple[str, ...]) -> None:
        self.random = np.random.default_rng(seed)
        self.names = names
        self.commands = [0.0] * len(AIRCRAFT.controls)
        self.lateness: dict[str, float] = {}  # s, of the servos of controls that are commanded, of first order
        self.lagged = LaggedControls(len(AIRCRAFT.controls))
        self.servos = ServoStates([0.0] * len(AIRCRAFT.controls))
        self.count = 0
        self.moving = 1.0
        self.noise = np.zeros(6)
        self.motion = dict.fromkeys(SIZES, 0.0)
        self.values = {name: derivative.value for name, derivative in AIRCRAFT.derivatives.items()}

    def block(self, truth: Truth = sound, rough: float | Array = 1.0) -> Block:
        """The next one; ``rough`` times the noise, of each coefficient (6,) or of all."""
        self.count += 1
        fresh = self.random.standard_normal(6) * NOISE * rough * np.sqrt(1.0 - MEMORY**2)
        self.noise = MEMORY * self.noise + fresh
        for name, size in SIZES.items():
            self.motion[name] = 0.85 * self.motion[name] + self.moving * size * 0.53 * self.random.standard_normal()
        measured = {name: self.motion[name] + TRIM.get(name, 0.0) for name in SIZES} | {"0": 1.0}
        values, signals = truth(self.values, dict(measured))
        outputs = self.noise.copy()
        for name, value in values.items():
            c, _, r = name.partition("_")
            outputs[COEFFICIENTS.index(c)] += value * signals[r]
        row = np.zeros(len(self.names))
        for name, value in measured.items():
            row[OFFSET if name == "0" else self.names.index(name)] = value
        behind, moved = self._servos()
        for name, late in moved.items():
            for c in COEFFICIENTS:
                value = self.values.get(f"{c}_{AIRCRAFT.controls[name].symbol}", 0.0)
                outputs[COEFFICIENTS.index(c)] += value * late
        row[:OUTPUTS] = outputs
        air = np.array([18.0, measured["alpha"], measured["beta"]])
        return Block(PERIOD * self.count, outputs, row, behind, air, 20, self.count > 1)

    def _servos(self) -> tuple[Array, dict[str, float]]:
        """What a block's controls are behind by through each lag, and through the servos of those that are commanded.

        Commands step at random every half a second.
        """
        late = [self.lateness.get(name, 0.0) for name in AIRCRAFT.controls]
        if not self.lateness:
            return np.zeros(len(late) * len(LAGS)), {}
        if late != self.servos.lateness:
            self.servos = self.servos.moved(late)
        rows = []
        for k in range(10 * self.count, 10 * self.count + 10):
            if k % 50 == 0:
                self.commands = (0.05 * self.random.choice([-1.0, 0.0, 1.0], len(late))).tolist()
            now = 0.01 * k
            behind = self.lagged.follow(now, self.commands)
            self.servos.follow(now, self.commands)
            rows.append([*behind, *(np.array(self.servos.positions) - self.commands)])
        behind, moved = np.split(np.mean(rows, axis=0), [-len(late)])
        return behind, {name: moved[i] for i, name in enumerate(AIRCRAFT.controls) if name in self.lateness}


def monitored(seed: int, **settings: float) -> tuple[MonitorState, Maker]:
    """A monitor that knows the derivatives to 2 %, and a maker of flights."""
    state = monitor.init(AIRCRAFT, FaultMonitorSettings(**settings))
    state.reference.errors = 0.02 * np.abs(state.reference.values) + 1e-5
    return state, Maker(seed, state.blocks.layout.names)


def fly(state: MonitorState, maker: Maker, seconds: float, truth: Truth = sound, rough: float = 1.0) -> Fault | None:
    """Fly on for so long; what is wrong at the end."""
    for _ in range(round(seconds / PERIOD)):
        monitor.take(state, maker.block(truth, rough))
    return state.fault


@cache
def _flown(seed: int) -> tuple[MonitorState, Maker]:
    state, maker = monitored(seed)
    fly(state, maker, ONSET)
    return state, maker


def flown(seed: int) -> tuple[MonitorState, Maker]:
    """``monitored`` after ``ONSET`` seconds of sound flight, which are flown once for each seed."""
    return deepcopy(_flown(seed), {id(AIRCRAFT): AIRCRAFT})  # the aircraft is not copied: it never changes
