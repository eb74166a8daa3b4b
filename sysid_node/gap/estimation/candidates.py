"""Candidates: every effect of the simulator's chain, with the values from which its fit may start.

An effect with a corner, a state or an onset has no slope at its neutral value or at a wrong onset. Its fit is therefore
started from several plausible values, of which the best is iterated to convergence.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from math import log

import numpy as np

from sysid_node.aircraft.names import LATERAL, LATERAL_SIGNALS
from sysid_node.flight.record import Array
from sysid_node.gap.estimation.nuisances import DERIVATIVE_ERROR, derivative_tolerances
from sysid_node.gap.residuals.residual_model import CHANNELS, ResidualModel
from sysid_node.gap.thresholds import THRESHOLDS
from sysid_node.sim import EFFECTS, Simulator

#: Effects that leave no residual of their own: motion of the air is measured by the vanes, and noise is no deficiency.
UNOBSERVABLE = frozenset({"steady_wind", "turbulence", "gust", "sensor_noise"})

#: Effects that a flight without vanes cannot show: those of the air data, and the delay of the IMU, from which all but
#: the airspeed comes then, so that it cannot be told from a delay of the commands (``selection.causes``).
_OF_VANES = frozenset({"vane_bias", "vane_scale", "vane_lever_arm", "air_data_lag", "air_data_delay", "imu_delay"})

#: Effects of the drag alone, which is not compared where gusts turn the lift by angles that no vane measures.
_OF_DRAG = frozenset({"drag_rise"})

#: Effects of propulsion, which a flight without measured thrust cannot show.
_OF_THRUST = frozenset(name for name, effect in EFFECTS.items() if effect.station == "propulsion")

#: Effects of the structure, which a flight that is compared below all structural modes cannot show.
_OF_STRUCTURE = frozenset({"structural_mode"})

#: Effects that need the ground. No reading of a flight says how far it is: at one height its effect is that of other
#: derivatives. They are candidates where the aircraft file states one, and with it the height.
_OF_GROUND = frozenset({"ground_effect"})

#: Parameters that only shape an effect and stay at their defaults: one flight seldom contains information on them.
_FIXED = frozenset({"stall_separation.tau1", "structural_mode.damping", "actuator_lag.damping"})

#: Parameters that motion in the plane of symmetry does not show. Where the lateral readings were not measured, they
#: would stand for the motion that is not known: a bias of the yaw rate for the turn that a banked aircraft flies.
_SIDEWAYS = frozenset({*LATERAL_SIGNALS, "y", "roll", "yaw", "Ixx", "Izz", "Ixz"})

#: Effects with a parameter that all controls share and one for each control. There is a candidate of the shared one,
#: one of each control alone, and one of every control by itself; of the actuators' lag also one of second order.
SHARED = tuple(name for name, effect in EFFECTS.items() if effect.shared)

#: The actuators' lag with a damping, which makes it of second order.
SECOND_ORDER = "actuator_lag of second order"

#: Effects that are one candidate for each control, because each control has an onset of its own.
PER_CONTROL = ("control_effectiveness_loss", "stuck_surface")

#: Effects of one time constant or delay, whose slope changes direction with its size.
TIME_EFFECTS = frozenset(
    {"actuator_lag", "command_delay", "air_data_lag", "air_data_delay", "imu_delay", "actuator_stamp_delay"}
)

#: Of these, the effects that delay the response to commands: each is always compared with the others.
RESPONSE_DELAYS = frozenset({"actuator_lag", "command_delay", "imu_delay", "actuator_stamp_delay"})

#: Widths of a free play from which fits start, as shares of the command's travel. What is left has several minima over
#: the width: a play that is half as wide as the true one turns the surface back at the wrong instants.
_PLAYS = (0.1, 0.25, 0.5)

#: Onsets from which fits start, as shares of the flight's duration.
_ONSETS = (0.15, 0.3, 0.45, 0.6, 0.75)


@dataclass(frozen=True)
class Candidate:
    """An effect that may be to blame: the parameters that are fitted, and the values from which their fit may start."""

    effect: str
    label: str  # the effect, and the control where it is one control's: see ``scope``
    indices: tuple[int, ...]  # none where only priors of nuisances are widened
    starts: tuple[tuple[float, ...], ...]
    widened: tuple[int, ...] = ()  # nuisances whose priors are widened
    choices: int = 1  # from how many of its kind it is, each as probable before the flight
    law: str = ""  # where the effect's equation is another one than its other candidates have: "second order"

    @property
    def entries(self) -> tuple[int, ...]:
        """All entries of the parameter vector that it changes."""
        return (*self.indices, *self.widened)

    @property
    def log_choices(self) -> float:
        """Nats by which it is less probable before the flight than if there were no others of its kind."""
        return log(self.choices)

    @property
    def scope(self) -> str:
        """The control, coefficient or derivative on which it acts alone; empty where it acts on all."""
        return "" if self.law else self.label.partition(" of ")[2]

    @property
    def station(self) -> str:
        """Its station in the simulator's chain."""
        return EFFECTS[self.effect].station


def candidates_of(simulator: Simulator, models: Sequence[ResidualModel]) -> list[Candidate]:
    """All effects on which these flights may contain information."""
    found: list[Candidate] = []
    unseen = UNOBSERVABLE | (_OF_VANES if any(model.flight.inferred for model in models) else frozenset())
    unseen |= frozenset() if all(model.axes[CHANNELS.index("CD")] for model in models) else _OF_DRAG
    unseen |= frozenset() if all(model.flight.metered for model in models) else _OF_THRUST
    unseen |= _OF_GROUND - frozenset(simulator.aircraft.effects)
    band = min(model.windows.highest for model in models)
    unseen |= _OF_STRUCTURE if band < THRESHOLDS.priors.lowest_mode else frozenset()
    for effect in EFFECTS:
        if effect in unseen:
            continue
        if effect == DERIVATIVE_ERROR:
            found += _per_coefficient(simulator, lateral=any(model.flight.lateral for model in models))
        elif effect in PER_CONTROL:
            found += _per_control(simulator, effect, models)
        else:
            found.append(_whole(simulator, models, effect))
        if effect in SHARED:
            found += _variants(simulator, models, effect)
    return [*found, *_second_order(simulator)]


def _whole(simulator: Simulator, models: Sequence[ResidualModel], effect: str) -> Candidate:
    """The candidate of an effect with all its free parameters; those of motion that was not measured are left out."""
    lateral = any(model.flight.lateral for model in models)
    table = [(i, p) for i, (e, p) in enumerate(simulator.parameters)
             if e == effect and f"{e}.{p.name}" not in _FIXED and (lateral or p.name not in _SIDEWAYS)
             and (effect not in SHARED or p.name == EFFECTS[effect].shared)]  # fmt: skip
    shaped, now = dict(_shapes(simulator, models, effect)), simulator.neutral()
    values = [
        shaped.get(p.name, (float(np.clip(now[i] + 0.3 * simulator.scales[i], p.lower, p.upper)),)) for i, p in table
    ]
    return Candidate(effect, effect, tuple(i for i, _ in table), tuple(product(*values)))


def _shapes(
    simulator: Simulator, models: Sequence[ResidualModel], effect: str
) -> Iterator[tuple[str, tuple[float, ...]]]:
    """Start values of those parameters of an effect on which its slopes depend, by the parameters' names."""
    if effect == "stall_separation":
        highest = max(float(model.record["alpha"].max()) for model in models)
        yield "alpha_star", tuple(np.clip([highest - 0.06, highest - 0.01, highest + 0.05], 0.06, 0.9).tolist())
        yield "depth", (0.8,)
        yield from (("a1", (20.0,)), ("CD_X", (0.1,)), ("Cm_X", (-0.05,)))
    if effect == "actuator_rate_limit":
        speed = float(np.max([_fastest(model) for model in models]))
        yield "inverse_rate", tuple(1.0 / (max(speed, 0.1) * share) for share in (0.6, 0.3, 0.15, 0.07))
    if effect == "actuator_backlash":
        moved = travel_of(models)
        least = float(moved[moved > 0.0].min(initial=0.2))
        yield "width", tuple(_believed(simulator, effect) + share * least for share in _PLAYS)
    if effect in TIME_EFFECTS:
        believed = _believed(simulator, effect)
        name = "delay" if effect.endswith("delay") else "time_constant"
        yield name, tuple(believed + more for more in (0.02, 0.07, 0.2))
    if effect == "structural_mode":
        yield "frequency", (3.5, 5.0, 9.0)
    if effect == "ground_effect":
        yield "height", (0.5, 3.0)


def _believed(simulator: Simulator, effect: str) -> float:
    """What the aircraft file states of the parameter that all controls share, or of the effect's only one."""
    values = simulator.neutral()
    return float(next(values[i] for i, (name, p) in enumerate(simulator.parameters) if name == effect and p.switch))


def _fastest(model: ResidualModel) -> Array:
    """The fastest change (controls,) of each command, rad/s."""
    return np.asarray(np.abs(np.diff(model.commands[:, :-1], axis=0)).max(axis=0) * model.simulator.rate)


def travel_of(models: Sequence[ResidualModel]) -> Array:
    """How far each command (controls,) goes to either side of its middle, rad."""
    return np.asarray(np.max([0.5 * np.ptp(model.commands[:, :-1], axis=0) for model in models], axis=0))


def _variants(simulator: Simulator, models: Sequence[ResidualModel], effect: str) -> list[Candidate]:
    """The candidates of one control alone, for each that moves, and of each of them by itself.

    Their parameters are added to what all controls share.
    """
    speeds = np.max([_fastest(model) for model in models], axis=0)
    controls = [c for c, speed in zip(simulator.layout.controls, speeds, strict=True) if speed > 0.0]
    if len(controls) < 2:
        return []
    indices = tuple(simulator.names.index(f"{effect}.{control}") for control in controls)
    by_speed = {c: 1.0 / max(float(s), 0.1) for c, s in zip(simulator.layout.controls, speeds, strict=True)}
    travel = dict(zip(simulator.layout.controls, travel_of(models), strict=True))
    starts = [
        [by_speed[c] / share for share in (0.4, 0.1)] if effect == "actuator_rate_limit"
        else [float(travel[c]) * share for share in _PLAYS] if effect == "actuator_backlash"
        else [0.03, 0.1]
        for c in controls
    ]  # fmt: skip
    alone = [
        Candidate(effect, f"{effect} of {control}", (index,), tuple((start,) for start in own))
        for control, index, own in zip(controls, indices, starts, strict=True)
    ]
    return [*alone, Candidate(effect, f"{effect} of each control", indices, tuple(zip(*starts, strict=True)))]


def _second_order(simulator: Simulator) -> Iterator[Candidate]:
    """The lag of all actuators with a damping; none where the file states a damping, which the lag then has anyway.

    Most servos are of second order: a motor with inertia in a position loop. A lag of first order cannot describe one
    that is slow, because it attenuates the command as soon as it delays it.
    """
    names, neutral = simulator.names, simulator.neutral()
    lag, damping = (names.index(f"actuator_lag.{name}") for name in ("time_constant", "damping"))
    if neutral[damping] == 0.0:
        starts = tuple((float(neutral[lag]) + more, 0.7) for more in (0.01, 0.03, 0.07))
        yield Candidate("actuator_lag", SECOND_ORDER, (lag, damping), starts, law="second order")


def _per_coefficient(simulator: Simulator, *, lateral: bool) -> list[Candidate]:
    """Derivatives beyond their tolerances, one coefficient's at a time: all together would fit almost anything.

    Of a coefficient all may be off, or one alone by a gross error while the others stay within their tolerances (a
    contaminated normal prior: Box & Tiao (1968), Biometrika 55(1)), any of them as probably as another. Without the
    latter a cause that shifts all of them, as another inertia does, would have no rival in which one has moved. Alone
    are those with respect to the motion: a control's are what its effectiveness is, constants what biases are.
    """
    by_coefficient: dict[str, list[int]] = {}
    tolerances = derivative_tolerances(simulator.aircraft)
    for i, (effect, parameter) in enumerate(simulator.parameters):
        coefficient = parameter.name.partition("_")[0]
        if effect == DERIVATIVE_ERROR and parameter.name in tolerances and (lateral or coefficient not in LATERAL):
            by_coefficient.setdefault(coefficient, []).append(i)
    found = []
    other = {"0", *simulator.aircraft.control_symbols}
    for coefficient, entries in by_coefficient.items():
        found.append(Candidate(DERIVATIVE_ERROR, f"{DERIVATIVE_ERROR} of {coefficient}", (), ((),), tuple(entries)))
        names = {i: simulator.parameters[i][1].name for i in entries if len(entries) > 1}
        alone = {i: name for i, name in names.items() if name.partition("_")[2] not in other}
        found += [
            Candidate(DERIVATIVE_ERROR, f"{DERIVATIVE_ERROR} of {name}", (), ((),), (i,), len(alone))
            for i, name in alone.items()
        ]
    return found


def _per_control(simulator: Simulator, effect: str, models: Sequence[ResidualModel]) -> list[Candidate]:
    """Candidates of an effect, one for each control, with an onset before or during the flights."""
    first, last = min(float(model.time[0]) for model in models), max(float(model.time[-1]) for model in models)
    names, candidates = simulator.names, []
    onsets = (-10.0, *(first + share * (last - first) for share in _ONSETS))
    for control in simulator.layout.controls:
        fitted = [f"{effect}.{control}"]
        values: list[tuple[float, ...]] = [(0.2,)]
        if effect == "stuck_surface":
            fitted.append(f"{effect}.{control}_position")
            values = [(1.0,), (0.0,)]
        indices = (*(names.index(n) for n in fitted), names.index(f"{effect}.onset"))
        candidates.append(Candidate(effect, f"{effect} of {control}", indices, tuple(product(*values, onsets))))
    return candidates
