"""How imperfections change the transformed signals: a linear map of the columns for each of K imperfections.

A signal about its mean changes by sums of other signals and of their rates. All signals carry the factor k = qbar /
qbar0, so a column stands for its quantity times the mean k. The means change apart, which matters to the offsets alone:
C_0 = mean of the coefficient - sum of C_j times the mean of x_j.

A flow angle that no vane measures is the integral of what the IMU reads (``flow_angle_filter``): d alpha/dt = q + az /
V, d beta/dt = -r + (ay + g phi) / V and d phi/dt = p, at small angles (Klein & Morelli 2006, eqs. 3.33 and 3.34). Both
terms are much larger than their sum, so that an error of one of them shows in it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.dynamics.atmosphere import GRAVITY, dynamic_pressure
from sysid_node.online.frequency.regression_signals import OFFSET, SignalLayout, momentum_matrix
from sysid_node.online.systematic.cross_spectra import ServoColumns

Array = NDArray[np.float64]
Index = NDArray[np.intp]
Terms = Mapping[str, tuple[float, float]]  # by signal: factors of it, and of its rate (s)
Turn = Callable[[Terms, float], None]  # of a flow angle (rad): the terms that change it, and the change of its mean

AXES = "xyz"
RATES = "pqr"
MOMENTS = ("Cl", "Cm", "Cn")
FORCES = ("X", "Y", "Z")


@dataclass(frozen=True)
class FlightMeans:
    """What the maps need of the flight: means over time, weighted with k."""

    k: float  # mean of qbar over the reference's
    values: Mapping[str, float]  # of the coefficients, regressors, and the thrust as a force coefficient

    def of(self, name: str) -> float:
        """Mean of a signal; zero of one that is not in the model."""
        return self.values.get(name, 0.0)


def flight_means(layout: SignalLayout, integrals: Array) -> FlightMeans:
    """Means by the signals' ``integrals`` (W,)."""
    weight, time = float(integrals[OFFSET]), float(integrals[layout.column("1")])
    names = layout.names[: layout.transformed]
    shares = integrals[: layout.transformed] / max(weight, 1e-12)
    return FlightMeans(max(weight / max(time, 1e-12), 1e-3), dict(zip(names, shares.tolist(), strict=True)))


class ProbeFlow(NamedTuple):
    """What the probe's arm brings to the flow at the CG."""

    of: str  # alpha, beta or V
    rate: str  # that turns the arm
    share: float  # rad, or share of the airspeed times the mean k, per m of the arm and unit of the rate's column


@dataclass
class ColumnChanges:
    """Changes of N signals (``ServoColumns``) with K imperfections, per unit of each."""

    aircraft: Aircraft
    layout: SignalLayout
    columns: ServoColumns
    means: FlightMeans
    count: int
    reconstructed: tuple[bool, bool] = (False, False)  # whether alpha, beta are, as no vanes measure them
    signals: Array = field(init=False)  # (K, N, 2N) of each signal: factors of all signals, then j omega times them
    rates: Index = field(init=False)  # (N,) where the rate of each signal stands among these
    shifts: Array = field(init=False)  # (K, N) of the means
    at: int = 0  # the imperfection that is being described

    def __post_init__(self) -> None:
        N = self.columns.width
        self.signals, self.shifts = np.zeros((self.count, N, 2 * N)), np.zeros((self.count, N))
        self._place = {name: self.columns.place(i) for i, name in enumerate(self.layout.names)}
        self._place["0"] = OFFSET
        for (name, order), place in self.columns.integrals.items():
            self._place[_integral(name, order)] = place
        self.rates = self.columns.rates_of(self.layout)
        ratio = momentum_matrix(self.aircraft)
        self._momentum = {axis: dict(zip((*FORCES, *MOMENTS), ratio[i].tolist(), strict=True))
                          for i, axis in enumerate(RATES)}  # fmt: skip
        alpha = self.means.of("alpha")
        self._cos, self._sin = math.cos(alpha), math.sin(alpha)

    @property
    def airspeed(self) -> float:
        """Mean airspeed, m/s."""
        return self.aircraft.reference.airspeed * math.sqrt(self.means.k)

    def per_column(self, rate: str) -> float:
        """Angular rate (rad/s) per unit of its column."""
        g = self.aircraft.geometry
        return 2.0 * self.airspeed / ((g.cbar if rate == "q" else g.b) * self.means.k)

    def add(self, target: str, terms: Terms) -> None:
        """Change a signal by others and their rates; what is not in the model is left out."""
        row = self._place.get(target)
        if row is None:
            return
        for name, (plain, rate) in terms.items():
            column = self._place.get(name)
            if column is not None:
                self.signals[self.at, row, column] += plain
                self.signals[self.at, row, self.rates[column]] += rate

    def servo(self, control: int, order: int) -> None:
        """Change a control by its servo's column (0), by the column's rate (1), or by the rate's rate (2)."""
        N, m, place = self.columns.width, len(self.layout.timed), self.columns.servos.start + control
        row = self._place[self.layout.timed[control]]
        self.signals[self.at, row, (place, N + place, place + m)[order]] += 1.0

    def shift(self, target: str, by: float) -> None:
        """Change a signal's mean."""
        row = self._place.get(target)
        if row is not None:
            self.shifts[self.at, row] += by

    def scale(self, target: str, share: float) -> None:
        """Change a signal, its mean included, by a share of it."""
        self.add(target, {target: (share, 0.0)})
        self.shift(target, share * self.means.of(target))

    def rescale(self, target: str, share: float) -> None:
        """Change a signal about its mean by a share of it, and keep the mean: both k and the signal change."""
        self.add(target, {target: (share, 0.0)})

    def turn_flow(self, terms: Terms, mean: float) -> None:
        """Change the angle of attack (rad): its regressor, and by turning the force both lift and drag."""
        self.add("alpha", terms)
        self.shift("alpha", mean)
        lift, drag = self.means.of("CL"), self.means.of("CD")
        self.add("CL", {"CD": (-mean, 0.0)} | _times(terms, -drag))
        self.add("CD", {"CL": (mean, 0.0)} | _times(terms, lift))
        self.shift("CL", -mean * drag)
        self.shift("CD", mean * lift)

    def turn_sideslip(self, terms: Terms, mean: float) -> None:
        """Change the sideslip (rad)."""
        self.add("beta", terms)
        self.shift("beta", mean)

    def by_vane(self, angle: str) -> Turn:
        """``turn_flow`` or ``turn_sideslip`` of an angle that a vane measures; else nothing is changed."""
        return self._turn(angle, reconstructed=False)

    def by_integration(self, angle: str) -> Turn:
        """The same of an angle that is reconstructed."""
        return self._turn(angle, reconstructed=True)

    def _turn(self, angle: str, *, reconstructed: bool) -> Turn:
        flow = angle == "alpha"
        if self.reconstructed[0 if flow else 1] != reconstructed:
            return _unchanged
        return self.turn_flow if flow else self.turn_sideslip

    def angles_by_rate(self, target: str, source: str, share: float) -> None:
        """Change reconstructed angles, as the rate ``target`` is another by a ``share`` of ``source`` (rad/s)."""
        factor = share * self.means.k * self.per_column(source)
        if target == "q":
            self.by_integration("alpha")({_integral(source, 1): (factor, 0.0)}, 0.0)
        elif target == "r":
            self.by_integration("beta")({_integral(source, 1): (-factor, 0.0)}, 0.0)
        else:
            self.by_integration("beta")({_integral(source, 2): (factor * GRAVITY / self.airspeed, 0.0)}, 0.0)

    def angles_by_force(self, axis: str, terms: Terms) -> None:
        """Change reconstructed angles, as the specific force along a body axis is another by ``terms`` of force."""
        reference, g = self.aircraft.reference, self.aircraft.geometry
        per_force = dynamic_pressure(reference.air_density, reference.airspeed) * g.S / self.aircraft.mass  # m/s^2
        factor = self.means.k * per_force / self.airspeed
        if axis != "X":
            changed = {_integral(name, 1): (factor * plain, 0.0) for name, (plain, _) in terms.items()}
            self.by_integration("alpha" if axis == "Z" else "beta")(changed, 0.0)

    def mean_alpha(self, off: float) -> None:
        """Change a reconstructed sideslip, as the mean angle of attack is ``off`` (rad): v' = ... + p w."""
        factor = off * self.means.k * self.per_column("p")
        self.by_integration("beta")({_integral("p", 1): (factor, 0.0)}, 0.0)

    def mean_sideslip(self, side_force: float) -> None:
        """Change a reconstructed sideslip, whose mean is that at which the file has the ``side_force`` coefficient.

        An error of it is turned into the angle of attack by the roll rate: w' = ... - p v.
        """
        slope = self.aircraft.derivatives.get("CY_beta")
        if slope is not None and slope.value:
            off = side_force / slope.value
            self.by_integration("beta")({}, off)
            factor = -off * self.means.k * self.per_column("p")
            self.by_integration("alpha")({_integral("p", 1): (factor, 0.0)}, 0.0)

    def airspeed_varies(self, terms: Terms) -> None:
        """Change the airspeed's variation; ``terms`` make its share of the mean airspeed, times the mean k."""
        for name in ("CL", "CD", "CY", "Cl", "Cm", "Cn"):
            self.add(name, _times(terms, -2.0 * self.means.of(name)))
        self.add("V", _times(terms, self.airspeed / self.aircraft.reference.airspeed))

    def forces(self) -> dict[str, tuple[dict[str, tuple[float, float]], float]]:
        """The measured force (specific force times mass, thrust included) as coefficients, by body axis.

        Each is the terms that make it about its mean, and its mean.
        """
        c, s, lift, drag = self._cos, self._sin, self.means.of("CL"), self.means.of("CD")
        inclination = self.aircraft.throttle.inclination if self.aircraft.throttle else 0.0
        tx, tz = math.cos(inclination), -math.sin(inclination)
        thrust = self.means.of("thrust")
        X = {"CL": (s, 0.0), "CD": (-c, 0.0), "thrust": (tx, 0.0), "alpha": (c * lift + s * drag, 0.0)}
        Z = {"CL": (-c, 0.0), "CD": (-s, 0.0), "thrust": (tz, 0.0), "alpha": (s * lift - c * drag, 0.0)}
        side = self.means.of("CY")
        return {
            "X": (X, s * lift - c * drag + tx * thrust),
            "Y": ({"CY": (1.0, 0.0)}, side),
            "Z": (Z, -c * lift - s * drag + tz * thrust),
        }

    def force(self, axis: str, terms: Terms, mean: float = 0.0) -> None:
        """Change the aerodynamic force along a body axis, as a coefficient; ``mean`` is that of the terms."""
        c, s = self._cos, self._sin
        if axis == "Y":
            self.add("CY", terms)
            self.shift("CY", mean)
            return
        # lift = X sin - Z cos, drag = -X cos - Z sin; a constant force turns in stability axes as alpha varies
        lift, drag, turned_lift, turned_drag = (s, -c, c, s) if axis == "X" else (-c, -s, s, -c)
        self.add("CL", _times(terms, lift))
        self.add("CD", _times(terms, drag))
        self.add("CL", {"alpha": (turned_lift * mean, 0.0)})
        self.add("CD", {"alpha": (turned_drag * mean, 0.0)})
        self.shift("CL", lift * mean)
        self.shift("CD", drag * mean)

    def probe_flow(self, along: int) -> Iterator[ProbeFlow]:
        """What each m of the probe's arm ``along`` an axis (0 to 2) brings to the flow at the CG, by rates."""
        one, other = (along + 1) % 3, (along + 2) % 3
        for target, turning, sign in ((one, other, -1.0), (other, one, 1.0)):
            rate = RATES[turning]
            share = sign * self.per_column(rate) * self.means.k / self.airspeed
            if target == 1:
                yield ProbeFlow("beta", rate, share)
                continue
            across, forward = (self._cos, self._sin) if target == 2 else (-self._sin, self._cos)
            yield ProbeFlow("alpha", rate, across * share)
            yield ProbeFlow("V", rate, forward * share)

    def flow_at_cg(self, flow: ProbeFlow, factor: float, source: str = "", rate: float = 0.0) -> None:
        """Change the flow at the CG by ``factor`` times a part of it that the probe's arm brings.

        It is made of the rate of the ``flow``, or of another ``source``; ``rate`` is the same of its rate (s).
        """
        name = source or flow.rate
        ratio = self.per_column(name) / self.per_column(flow.rate)
        terms = {name: (factor * flow.share * ratio, rate * flow.share * ratio)}
        if flow.of == "V":
            self.airspeed_varies(terms)
        else:
            self.by_vane(flow.of)(terms, factor * flow.share * ratio * self.means.of(name))

    def rate(self, target: str, source: str, share: float) -> None:
        """Change an angular rate by a ``share`` of another, or of its own.

        It changes its regressor, the flow at the CG by the probe's arms, and all coefficients by its angular
        acceleration.
        """
        ratio = self.per_column(source) / self.per_column(target)
        self.add(target, {source: (share * ratio, 0.0)})
        self.shift(target, share * ratio * self.means.of(source))
        for along, arm in enumerate(self.aircraft.sensors.air_data):
            for flow in self.probe_flow(along):
                if flow.rate == target:
                    self.flow_at_cg(flow, arm * share, source)
        for name, momentum in self._momentum[target].items():
            self.acceleration(name, source, share * momentum)

    def acceleration(self, coefficient: str, rate: str, factor: float) -> None:
        """Change a coefficient by ``factor`` times an angular acceleration (rad/s^2)."""
        terms = {rate: (0.0, factor * self.per_column(rate))}
        if coefficient in FORCES:
            self.force(coefficient, terms)
        else:
            self.add(coefficient, terms)

    def angular_accelerations(self) -> tuple[Index, Index, Array]:
        """Places of the rates' columns and of the moments', and what moments (columns) make of the rates' rates (rows).

        Of those axes whose rate and moment are both there, and whose moment of inertia is known.
        """
        axes = [
            (rate, moment)
            for rate, moment in zip(RATES, MOMENTS, strict=True)
            if rate in self._place and 0.0 < self._momentum[rate][moment] < math.inf
        ]
        needed = [[self._momentum[rate][moment] * self.per_column(rate) for rate, _ in axes] for _, moment in axes]
        rates, moments = (np.array([self._place[pair[i]] for pair in axes], np.intp) for i in range(2))
        return rates, moments, np.linalg.inv(np.array(needed).reshape(len(axes), len(axes)))

    def finish(self) -> None:
        """Derive the changes of the lift's square, which goes with the lift."""
        square, lift, mean = self._place.get("k"), self._place["CL"], self.means.of("CL")
        if square is not None:
            self.signals[:, square] += 2.0 * mean * self.signals[:, lift]
            self.shifts[:, square] += 2.0 * mean * self.shifts[:, lift]


def _integral(name: str, order: int) -> str:
    return f"{name} integrated" if order == 1 else f"{name} integrated twice"


def _unchanged(terms: Terms, mean: float) -> None:
    """Nothing changes."""


def _times(terms: Terms, factor: float) -> dict[str, tuple[float, float]]:
    return {name: (factor * plain, factor * rate) for name, (plain, rate) in terms.items()}
