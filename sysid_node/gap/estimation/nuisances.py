"""Nuisance parameters: errors of the derivatives within their tolerances, biases, and clock offsets within one sample.

Each is a parameter of the simulator's chain with a Gaussian prior about the aircraft file's value, truncated at three
standard deviations (a clock offset at one sample). So are the effects that the file states, within their tolerances.
The truncation gives the tolerance its meaning: data that determine a derivative to a thousandth would overrule any
prior, and a shifted centre of gravity would pass as an error of Cm_alpha of ten standard deviations. All flights share
the derivatives, the file's effects and clock offsets; biases are each flight's own.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import DELAY_EFFECTS, Aircraft
from sysid_node.aircraft.names import LATERAL, LATERAL_SIGNALS
from sysid_node.aircraft.reading.body import default_noise_bias
from sysid_node.errors import InputError
from sysid_node.flight.record import Array
from sysid_node.gap.residuals.air_motion import is_gusty
from sysid_node.gap.residuals.residual_model import ResidualModel
from sysid_node.gap.thresholds import THRESHOLDS
from sysid_node.sim import Simulator
from sysid_node.sim.model.parameters import stated_parameters

#: The effect whose parameters are all nuisances; as a candidate, those of one coefficient have a wider prior.
DERIVATIVE_ERROR = "derivative_error"

#: A derivative up to this size is an import's rounding of zero.
_ROUNDING = 1e-9

#: Clock offsets that are known to one sample of their topic, and the effects that replace each. Only relative delays
#: can be observed: a delay of the IMU replaces the offset of the air data, whereas that of the commands stays a
#: nuisance, so that a servo's lag does not pass for a delay of the IMU.
CLOCKS = {
    "actuator_stamp_delay": ("command_delay", "actuator_stamp_delay"),
    "air_data_delay": ("air_data_delay", "imu_delay"),
}

#: Biases, and the sensor of each.
_BIASES = {
    **{f"imu_bias.{n}": "accel" for n in ("ax", "ay", "az")},
    **{f"imu_bias.{n}": "gyro" for n in "pqr"},
    "vane_bias.alpha": "alpha",
    "vane_bias.beta": "beta",
}


@dataclass(frozen=True)
class Nuisances:
    """Nuisance parameters of a flight: entries of the parameter vector, and their truncated Gaussian priors."""

    indices: tuple[int, ...]
    sigma: Array  # standard deviation of each
    limit: Array  # largest deviation of each from the aircraft file's value
    shared: NDArray[np.bool_]  # whether all flights have the same value
    widened: float = 0.0  # sum of the logarithms by which priors are wider than the file's tolerances
    factors: Array = field(default_factory=lambda: np.empty(0))  # by which each prior is widened; empty: the same
    wide: frozenset[int] = frozenset()  # entries whose priors are widened already

    def without(self, effects: frozenset[str], names: tuple[str, ...], widened: tuple[int, ...] = ()) -> Nuisances:
        """The nuisances without those that these effects replace; the priors of ``widened`` entries are widened."""
        gone = {e for e in effects if e != DERIVATIVE_ERROR}
        gone |= {clock for clock, same in CLOCKS.items() if not effects.isdisjoint(same)}
        keep = np.array([names[i].partition(".")[0] not in gone for i in self.indices], bool)
        factors = self.factors if self.factors.size else np.full(len(self.indices), THRESHOLDS.priors.widening)
        new = [i for i in widened if i not in self.wide]
        wide = np.where(np.isin(self.indices, new), factors, 1.0)
        indices = tuple(i for i, k in zip(self.indices, keep, strict=True) if k)
        more = self.widened + float(np.log(wide[keep]).sum())
        sigma, limit = (self.sigma * wide)[keep], (self.limit * wide)[keep]
        return Nuisances(indices, sigma, limit, self.shared[keep], more, factors[keep], self.wide.union(new))

    def places(self, flight: int) -> NDArray[np.intp]:
        """Places of one flight's nuisance parameters among those of all flights, the shared ones first."""
        shared = int(self.shared.sum())
        separate = len(self.indices) - shared
        places = np.empty(len(self.indices), np.intp)
        places[self.shared] = np.arange(shared)
        places[~self.shared] = shared + flight * separate + np.arange(separate)
        return places

    def among_all(self, slopes: Array, flight: int, flights: int) -> Array:
        """Slopes (n, K) of one flight as columns among those of all flights' nuisance parameters; zero elsewhere."""
        shared = int(self.shared.sum())
        wide = np.zeros((slopes.shape[0], shared + flights * (len(self.indices) - shared)))
        wide[:, self.places(flight)] = slopes
        return wide


@dataclass(frozen=True)
class HeldOutFlight:
    """A flight that is predicted and not fitted: its residual model, and the nuisance parameters it may need."""

    model: ResidualModel
    nuisances: Nuisances


def derivative_tolerances(aircraft: Aircraft) -> dict[str, float]:
    """1 sigma of the derivatives that may be off.

    A simulator's file (``ideal``) need not state any: it is then right within a small share of each derivative.
    """
    stated = {name: d.tolerance for name, d in aircraft.derivatives.items() if d.tolerance}
    if stated or not aircraft.ideal:
        return stated
    known = ((name, abs(d.value)) for name, d in aircraft.derivatives.items())
    return {name: THRESHOLDS.priors.ideal * size for name, size in known if size > _ROUNDING}


def _expected_differences(aircraft: Aircraft) -> dict[str, float]:
    """1 sigma by which reality's derivatives may be off a simulator's file that states no tolerance, by name.

    How well a file holds its simulator says nothing of how well the simulator agrees with reality.
    """
    if any(d.tolerance for d in aircraft.derivatives.values()):
        return {}
    return {name: THRESHOLDS.priors.reality * abs(d.value) for name, d in aircraft.derivatives.items()}


def _required_tolerances(aircraft: Aircraft) -> dict[str, float]:
    """The same; raises InputError where there are none."""
    tolerances = derivative_tolerances(aircraft)
    if not tolerances:
        raise InputError(
            f"aircraft {aircraft.name!r}: no derivative has a tolerance, so what is a gap cannot be told from an "
            "honest error; give derivatives a tolerance (1 sigma) in the aircraft file"
        )
    return tolerances


def nuisances_of(
    aircraft: Aircraft,
    model: ResidualModel,
    others: Sequence[ResidualModel] = (),
    room: Mapping[str, float] = MappingProxyType({}),
    fitted_with: Sequence[ResidualModel] = (),
) -> Nuisances:
    """The nuisance parameters of one of an aircraft's flights, with limits by the flight's own rates.

    They are the same parameters for all flights that are diagnosed together, ``others`` included. Flights that are
    ``fitted_with`` it have the same limits: those of the slowest messages, and of flow angles that were not measured
    in one of them. ``room`` is 1 sigma
    of errors of derivatives, by name, from which their priors are widened where they are a cause and where it is more
    than the file's tolerance: a simulator knows its derivatives better than they agree with reality. Raises InputError
    where the aircraft file has no tolerances and is no simulator's.
    """
    models, alike = (model, *others), [one.flight for one in (model, *fitted_with)]
    tolerances = _required_tolerances(aircraft)
    lateral = any(m.flight.lateral for m in models)
    sigma = {f"derivative_error.{n}": t for n, t in tolerances.items() if lateral or n.partition("_")[0] not in LATERAL}
    believed = believed_effects(model.simulator)
    sigma |= believed
    sigma |= {n: s for n, s in _biases(aircraft).items() if lateral or n.rpartition(".")[2] not in LATERAL_SIGNALS}
    sigma |= {f"vane_bias.{angle}": THRESHOLDS.priors.inferred_angle for flight in alike for angle in flight.inferred}
    if any(is_gusty(m) for m in models):
        sigma["turbulence.rotation"] = THRESHOLDS.priors.rotation
    limit = {name: THRESHOLDS.priors.limit * s for name, s in sigma.items()}
    ranged = [*believed, *(name for name in sigma if name.startswith("turbulence"))]
    limit |= {name: min(limit[name], room) for name, room in _room(model.simulator, ranged).items()}
    longest = max(flight.step_interval for flight in alike), max(1.0 / flight.air_rate for flight in alike)
    for clock, interval in zip(CLOCKS, longest, strict=True):
        sigma[f"{clock}.delay"], limit[f"{clock}.delay"] = 0.5 * interval, interval
    names = model.simulator.names
    of_aircraft = ("derivative_error", "turbulence", *CLOCKS, *(f"{name}" for name in believed))
    shared = np.array([name.startswith(of_aircraft) for name in sigma])
    numbers = (np.array(list(sigma.values())), np.array(list(limit.values())))
    given = {f"derivative_error.{name}": size for name, size in (room or _expected_differences(aircraft)).items()}
    wider = [max(given[n] / s, 1.0) if n in given else 1.0 for n, s in sigma.items()]
    factors = THRESHOLDS.priors.widening * np.array(wider)
    return Nuisances(tuple(names.index(n) for n in sigma), *numbers, shared, factors=factors)


def _biases(aircraft: Aircraft) -> dict[str, float]:
    """1 sigma of every bias by name: the file's ``noise.bias``, or the noise of a sample where the file states none."""
    stated = stated_biases(aircraft)
    return {name: stated.get(name) or aircraft.noise[sensor] for name, sensor in _BIASES.items()}


def stated_biases(aircraft: Aircraft) -> dict[str, float]:
    """1 sigma of every bias by name that the file states (``noise.bias``); empty where it states none."""
    if dict(aircraft.noise_bias) == default_noise_bias(ideal=aircraft.ideal):
        return {}
    return {name: aircraft.noise_bias[sensor] for name, sensor in _BIASES.items()}


#: Effects of the file that are no nuisance: what differs from flight to flight, and the beginning of a failure.
_NOT_NUISANCES = frozenset({"steady_wind", "turbulence", "gust", "sensor_noise", "derivative_error", *CLOCKS})


def believed_effects(simulator: Simulator) -> dict[str, float]:
    """1 sigma, in the simulator's units, of the parameters of effects that the aircraft file states, by name.

    What the file states without any tolerance, or at the end of a parameter's range, is not among them.
    """
    aircraft, values = simulator.aircraft, simulator.neutral()
    found: dict[str, float] = {}
    for effect in (*aircraft.effects, *(DELAY_EFFECTS[t] for t, delay in aircraft.delays.items() if delay.value)):
        stated = aircraft.effects.get(effect, {"delay": None})
        for name, parameter in stated_parameters(simulator.layout, effect).items():
            key = f"{effect}.{name}" if effect in aircraft.effects else f"delays.{_TOPIC[effect]}"
            sigma = aircraft.tolerances.get(key, 0.0) if name in stated else 0.0
            if parameter.inverse:  # sigma of 1 / x is sigma / x^2
                sigma *= float(values[list(parameter.entries)].sum()) ** 2
            if sigma and effect not in _NOT_NUISANCES and name != "onset":
                found[simulator.names[parameter.entries[-1]]] = sigma
    return {name: sigma for name, sigma in found.items() if _room(simulator, [name])[name] > 0.0}


_TOPIC = {effect: topic for topic, effect in DELAY_EFFECTS.items()}


def _room(simulator: Simulator, names: Iterable[str]) -> dict[str, float]:
    """How far each of these parameters may move both ways from the aircraft file's value within its range."""
    values, indices = simulator.neutral(), {name: simulator.names.index(name) for name in names}
    table = {name: simulator.parameters[i][1] for name, i in indices.items()}
    return {n: float(min(p.upper - values[indices[n]], values[indices[n]] - p.lower)) for n, p in table.items()}
