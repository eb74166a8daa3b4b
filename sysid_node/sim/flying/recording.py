"""A simulated flight as the messages that a real aircraft would record, each instrument at its own rate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from sysid_node.aircraft.model import Aircraft
from sysid_node.dynamics.atmosphere import GRAVITY, air_density
from sysid_node.errors import InputError
from sysid_node.flight.streams import AirDataStream, Arrival, ImuStream, JointStream, Streams
from sysid_node.sim.flying.sortie import Sortie

Array = NDArray[np.float64]

#: Stamp of the first instant: a fixed date (2026-01-01), so that the same flight gives the same bag.
START_NS = 1_767_225_600_000_000_000

#: Quantisation steps: accelerometers of 16 bits over +-16 g, gyroscopes over +-2000 deg/s, airspeed 1 cm/s,
#: vanes of 14 bits over a turn; attitude is a filter's output and has none.
_STEPS = np.array(
    [32 * GRAVITY / 2**16] * 3 + [np.deg2rad(4000.0) / 2**16] * 3 + [0.0] * 3 + [0.01] + [2 * np.pi / 2**14] * 2
)
#: Resolution of recorded commands, rad: far below that of a servo, and bags are smaller than with all digits.
_COMMAND_STEP = 2.0**-15


@dataclass(frozen=True)
class FlightSampler:
    """Rates (Hz), jitter (s rms) of the sampling times, latency (s) from stamp to log, and what is recorded.

    Where an autopilot holds its commands (``SortieConditions.command_rate``), the commanded surfaces are its commands,
    one message each; otherwise they are sampled at ``actuator_rate``. Raises InputError for a rate outside 1 to 5000 Hz
    or an unknown choice of ``surfaces``.
    """

    imu_rate: float = 200.0
    air_data_rate: float = 100.0
    actuator_rate: float = 100.0
    jitter: float = 0.0002
    latency: float = 0.002
    quantise: bool = True
    surfaces: Literal["commanded", "measured"] = "commanded"

    def __post_init__(self) -> None:
        for name in ("imu_rate", "air_data_rate", "actuator_rate"):
            if not 1.0 <= getattr(self, name) <= 5000.0:
                raise InputError(f"{name} {getattr(self, name):g} Hz: expected 1 to 5000 Hz")
        if self.surfaces not in ("commanded", "measured"):
            raise InputError(f"surfaces {self.surfaces!r}: expected commanded or measured")

    def record(self, sortie: Sortie) -> Streams:
        """The messages of a flight; each stamp is the sampling time, unless an effect of the clock changes it."""
        random = np.random.default_rng(sortie.conditions.seed).spawn(3)[2]
        span = (len(sortie.flight.outputs) - 1) * sortie.simulator.step
        rates = (self.imu_rate, self.air_data_rate, self.actuator_rate)
        times = [_instants(rate, span, self.jitter, random) for rate in rates]
        if self.surfaces == "commanded" and sortie.conditions.command_rate is not None:
            times[2], controls = self._commands(sortie)
        else:
            controls = self._controls(sortie, times[2])
        imu, air, actuators = self._arrivals(times, random)
        inertial, flow = self._readings(sortie, times[0], range(9)), self._readings(sortie, times[1], range(9, 12))
        altitude = np.interp(times[1], _grid(sortie), -np.asarray(sortie.flight.states[:, 2]))
        density = np.round(np.asarray(air_density(altitude, jnp)), 5)
        return Streams(
            ImuStream(imu, inertial[:, :6], inertial[:, 6:9], "imu"),
            AirDataStream(air, np.column_stack([flow, density])),
            JointStream(actuators, *_joints(sortie.simulator.aircraft, controls)),
            f"simulated {sortie.simulator.aircraft.name}",
        )

    def _readings(self, sortie: Sortie, times: Array, columns: range) -> Array:
        """Readings (N, columns) at times (N,), s: the motion by cubic interpolation, the noise of the nearest sample.

        One column after the other: the coefficients of all would take more memory than the flight itself.
        """
        grid, scale = _grid(sortie), sortie.effects.get("sensor_noise", {}).get("scale", 0.0)
        nearest = np.clip(np.round(times * sortie.simulator.rate).astype(int), 0, len(grid) - 1)
        outputs, inputs = np.asarray(sortie.flight.outputs), np.asarray(sortie.inputs.noise)
        readings = np.empty((times.size, len(columns)))
        for k, column in enumerate(columns):
            noise = np.asarray(scale * sortie.simulator.model.noise[column]) * inputs[:, column]
            values = CubicSpline(grid, outputs[:, column] - noise)(times) + noise[nearest]
            step = _STEPS[column]
            readings[:, k] = np.round(values / step) * step if self.quantise and step > 0.0 else values
        return readings

    def _controls(self, sortie: Sortie, times: Array) -> Array:
        """Controls and thrust (N, controls + 1), rad and N, as the actuators' messages contain them."""
        known = sortie.flight.commands if self.surfaces == "commanded" else sortie.flight.surfaces
        late = sortie.effects.get("actuator_stamp_delay", {}).get("delay", 0.0)
        return np.column_stack([np.interp(times - late, _grid(sortie), column) for column in np.asarray(known).T])

    def commands(self, sortie: Sortie) -> JointStream:
        """The messages of the autopilot's commands, each logged ``latency`` after its stamp."""
        times, controls = self._commands(sortie)
        stamps = START_NS + np.round(times * 1e9).astype(np.int64)
        logged = stamps + round(self.latency * 1e9)
        arrival = Arrival(stamps, logged, np.arange(stamps.size))
        joints, positions = _joints(sortie.simulator.aircraft, controls)
        return JointStream(arrival, joints, np.round(positions / _COMMAND_STEP) * _COMMAND_STEP)

    def _commands(self, sortie: Sortie) -> tuple[Array, Array]:
        """Times (K,), s, at which commands are given, and the commands (K, controls + 1), rad and N.

        The simulator's commands are linear between samples. One that is reached at a sample is, but for terms in the
        square of the step, one that is given half a step before and held.
        """
        places, late = sortie.command_places, sortie.effects.get("actuator_stamp_delay", {}).get("delay", 0.0)
        times = np.maximum(places - 0.5, 0.0) * sortie.simulator.step + late
        kept = times >= 0.0
        return times[kept], np.asarray(sortie.flight.commands)[places[kept]]

    def _arrivals(self, times: list[Array], random: np.random.Generator) -> list[Arrival]:
        """For each stream, its stamps, logging times and positions among all messages."""
        stamps = [START_NS + np.round(t * 1e9).astype(np.int64) for t in times]
        delays = [self.latency * (0.5 + random.random(t.size)) for t in times]
        logged = [s + np.round(1e9 * d).astype(np.int64) for s, d in zip(stamps, delays, strict=True)]
        logged = [np.maximum.accumulate(x) for x in logged]  # a topic's messages do not overtake one another
        all_times = np.concatenate(logged)
        place = np.empty(all_times.size, np.int64)
        place[np.argsort(all_times, kind="stable")] = np.arange(all_times.size)
        places = np.split(place, np.cumsum([x.size for x in logged])[:-1])
        return [Arrival(s, x, p) for s, x, p in zip(stamps, logged, places, strict=True)]


def _grid(sortie: Sortie) -> Array:
    """Times (N,) of the simulator's samples, s."""
    return np.arange(len(sortie.flight.outputs), dtype=float) * np.float64(sortie.simulator.step)


def _instants(rate: float, span: float, jitter: float, random: np.random.Generator) -> Array:
    """Sampling times (N,) of an instrument, s: regular, plus a jitter of at most a fifth of the period."""
    regular = np.arange(int(span * rate + 1e-9) + 1) / rate
    off = np.clip(jitter * random.standard_normal(regular.size), -0.2 / rate, 0.2 / rate)
    instants: Array = np.clip(regular + off, 0.0, span)
    return instants


def _joints(aircraft: Aircraft, controls: Array) -> tuple[tuple[str, ...], Array]:
    """Joint names and positions (N, J) from controls and thrust (N, controls + 1): the file's mixing inverted."""
    surfaces = list(aircraft.controls.values())
    names = tuple(dict.fromkeys(joint for control in surfaces for joint in control.joints))
    scales = np.array([[control.joints.get(name, 0.0) for name in names] for control in surfaces])
    offsets = np.array([control.offset for control in surfaces])
    positions: Array = np.asarray((controls[:, :-1] - offsets) @ np.linalg.pinv(scales).T, dtype=float)
    if aircraft.throttle is None:
        return names, positions
    lever = controls[:, -1] / (aircraft.throttle.max_thrust or 1.0)
    return (*names, aircraft.throttle.joint), np.column_stack([positions, lever])
