"""The imperfections of one aircraft as the estimator takes them: sources, servos, and where their columns stand."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.servos import Servo, servos_of
from sysid_node.online.frequency.regression_signals import SignalLayout
from sysid_node.online.regression.information import Information, Spectrum, with_grams
from sysid_node.online.regression.instruments import InstrumentModel, with_servos
from sysid_node.online.systematic import servo_model
from sysid_node.online.systematic.column_changes import ColumnChanges, flight_means
from sysid_node.online.systematic.cross_spectra import ServoColumns, band_grams
from sysid_node.online.systematic.cross_spectra import with_servos as spectra_with_servos
from sysid_node.online.systematic.servo_model import SHORTEST, ServoModel
from sysid_node.online.systematic.sources import ErrorSource, describe, not_negative, sources

Array = NDArray[np.float64]
Index = NDArray[np.intp]

#: Share of L^2 that the curvature B of a servo of which nothing is known has: first order has 0, a delay 0.5.
CURVATURE = 0.25
#: Share of L^3 by which the third coefficient of a servo lies beside what L and B say of it: lags of first and second
#: order with delays of up to all of L.
THIRD = 0.05
#: Correlation of the lateness of two servos of which nothing is known: an aircraft has servos of one type, and what
#: their linkages, loads and makes add to one of 50 ms is under half of it. Where messages may be positions as well as
#: commands, either all controls have servos after them or none has.
OF_ONE_TYPE = 0.8
#: The longest interval (s) between a log's commands of which nothing more is unknown: 50 Hz, whose stamps scatter.
COMPLETE = 0.02 / 0.93
#: The largest root of a correlation by a shared damping: that of one would have no inverse.
ALIKE = 0.99
#: Where messages may be positions or commands: 1 sigma of the lateness (s) that this leaves open. Held commands are
#: half an interval later than the lines between them, at most 0.01 s at 50 Hz: a rectangular distribution (GUM, sec.
#: 4.3.7).
HELD_OR_NOT = 0.01 / math.sqrt(3.0)
SMALLEST = 1e-4  # s: 1 sigma of a servo of which only the rate limit is not exactly known
KNOWN = 0.03  # s: the largest 1 sigma of a servo of which something is known


@dataclass(frozen=True)
class Imperfections:
    """K = S + 3 m imperfections: S sources, and lateness, curvature and third coefficient of m servos."""

    sources: tuple[ErrorSource, ...]
    controls: tuple[str, ...]  # names of the controls whose servos are not exactly known
    timed: Index  # (m,) places of these controls among those of the layout
    applied: ServoModel  # of all controls: what the alignment has made of commands already, by the aircraft file
    expected: Array  # (m,) s: the lateness that is expected beyond the aircraft file's
    sigmas: Array  # (m,) s: 1 sigma of the lateness about that
    unknown: Index  # places among the m of the servos of which nothing is known, see ``_UncertainServo``
    precision: Array  # (K, K) inverse of the correlations before the flight, but for what ``prior`` adds
    columns: ServoColumns
    stamps: float  # s: 1 sigma of the lateness of the stamps of controls and motion, against each other
    step_time: float  # s: 1 sigma of the time of steps in a log's commands
    held_or_not: float  # s: 1 sigma of a servo's lateness that stems from not knowing whether commands are held
    limits: Array  # (m,) s: 1 sigma of how late the rate limits have made the controls in the flight
    places: Index  # (W,) where the columns of the signal vector stand among them
    reconstructed: tuple[bool, bool] = (False, False)  # whether alpha, beta are, as no vanes measure them

    @cached_property
    def keys(self) -> tuple[str, ...]:
        """Of each imperfection the key of its tolerance: all of a servo share theirs."""
        servos = tuple(f"actuator_lag.{name}" for name in self.controls)
        return (*(source.key for source in self.sources), *servos, *servos, *servos)

    def limited(self, limits: Array) -> Imperfections:
        """With another error of the lateness (m,) s that rate limits have caused."""
        return replace(self, limits=limits, sigmas=np.sqrt(self.sigmas**2 - self.limits**2 + limits**2))

    @property
    def servos(self) -> slice:
        """Places of the servos' lateness."""
        return slice(len(self.sources), len(self.sources) + len(self.controls))


def imperfections(
    aircraft: Aircraft,
    layout: SignalLayout,
    *,
    commanded: bool,
    positions: bool,
    command_interval: float = 0.0,
    reconstructed: tuple[bool, bool] = (False, False),
) -> Imperfections | None:
    """Those of an aircraft file; None where it states that all is exact.

    ``commanded``: the deflections follow from commands by the file's servos. ``positions``: they are known to be
    measured, so that no servo comes after them. Where neither is known, they may be either. ``command_interval`` (s) is
    that between a log's commands where lines stand between them (``JointStream``). ``reconstructed``: whether alpha,
    beta are, as no vanes measure them.
    """
    found = sources(aircraft, reconstructed)
    unseen = _time_of_steps(command_interval) if commanded else 0.0
    servos = dict(zip(aircraft.control_symbols, servos_of(aircraft)[1:], strict=True))
    of_controls = [servos[symbol] for symbol in layout.timed]
    stated = [servo_model.of_servo(servo) for servo in of_controls]
    rows = [] if positions else _uncertain_servos(aircraft, layout, of_controls, unseen, commanded=commanded)
    if not found and not rows:
        return None
    columns = ServoColumns.of(layout, integrals=any(reconstructed))
    controls, timed, expected, sigmas, damped, of_unknown = zip(*rows, strict=True) if rows else ((),) * 6
    unknown = np.flatnonzero(of_unknown)
    applied = np.array(stated).reshape(-1, 3) if commanded else np.zeros((len(layout.timed), 3))
    return Imperfections(
        found,
        controls,
        np.array(timed, np.intp),
        ServoModel(*applied.T.copy()),
        np.array(expected),
        np.array(sigmas),
        unknown,
        _precision(len(found), unknown, np.array(damped)),
        columns,
        math.hypot(unseen, *(aircraft.tolerances.get(f"delays.{topic}", 0.0) for topic in ("actuators", "imu"))),
        unseen,
        0.0 if commanded or positions else HELD_OR_NOT,
        np.zeros(len(controls)),
        np.array([columns.place(i) for i in range(layout.width)], np.intp),
        reconstructed,
    )


class _UncertainServo(NamedTuple):
    """A servo that is not exactly known."""

    control: str
    place: int
    expected: float  # s: lateness beyond the file's
    sigma: float  # s: its 1 sigma about that
    damped: float  # share of the 1 sigma that it has by the damping, which all controls share
    unknown: bool  # whether the file says nothing of it, or what it says may not concern what is recorded


def _uncertain_servos(
    aircraft: Aircraft, layout: SignalLayout, servos: Sequence[Servo], unseen: float, *, commanded: bool
) -> list[_UncertainServo]:
    """Those of the controls' ``servos`` (m,) that are not exactly known.

    ``unseen`` (s): 1 sigma of the time of steps.
    """
    names = {control.symbol: name for name, control in aircraft.controls.items()}
    rows = []
    for place, (symbol, servo) in enumerate(zip(layout.timed, servos, strict=True)):
        name, stated = names[symbol], servo_model.of_servo(servo)[0]
        sigma, damped = _lag_sigma(aircraft, name, servo)
        sigma = math.hypot(sigma, aircraft.tolerances.get(f"command_delay.{name}", 0.0))
        if not commanded:
            sigma = math.hypot(sigma, stated)
        if f"actuator_rate_limit.{name}" in aircraft.tolerances and commanded:
            sigma = max(sigma, SMALLEST)  # the flight may make it later by a limit that is not exactly known
        whole = math.hypot(sigma, unseen)
        if whole > 0.0:
            unknown = (stated == 0.0 or not commanded) and sigma > KNOWN
            mean, spread = _later(stated, sigma) if commanded else (0.0, sigma)
            rows.append(_UncertainServo(name, place, mean, math.hypot(spread, unseen), damped / whole, unknown))
    return rows


def _lag_sigma(aircraft: Aircraft, name: str, servo: Servo) -> tuple[float, float]:
    """1 sigma (s) of a lag's lateness by the file's tolerances, and the part of it that is the damping's.

    The lateness is T of first order and 2 d T of second order (``servo_model``), to first order in both tolerances.
    """
    of_time = aircraft.tolerances.get(f"actuator_lag.{name}", 0.0)
    if not servo.damping:
        return of_time, 0.0
    damped = 2.0 * servo.time_constant * aircraft.tolerances.get("actuator_lag.damping", 0.0)
    return math.hypot(2.0 * servo.damping * of_time, damped), damped


def _later(stated: float, sigma: float) -> tuple[float, float]:
    """What is expected of a servo's lateness beyond the ``stated`` one, and its 1 sigma: no servo is early."""
    if sigma == 0.0:
        return 0.0, 0.0
    mean, spread = not_negative(stated, sigma)
    return mean - stated, spread


def _time_of_steps(interval: float) -> float:
    """1 sigma (s) of the time of a step in a log's commands: uniform over the ``interval`` (s) between them.

    Manoeuvres are often made of steps at whole multiples of it, which are then all off by the same time.
    """
    return interval / math.sqrt(12.0) if interval > COMPLETE else 0.0


def _precision(sources: int, unknown: Index, damped: Array) -> Array:
    """(K, K) where the ``unknown`` of the m servos have a part in common: of lateness, curvature and third coefficient.

    So has the lateness of servos of second order by their damping, which is the share ``damped`` (m,) of their 1 sigma.
    """
    correlation = np.eye(sources + 3 * damped.size)
    for order in range(3):
        places = sources + order * damped.size + unknown
        correlation[np.ix_(places, places)] += OF_ONE_TYPE * (1.0 - np.eye(places.size))
    alike = np.minimum(damped, ALIKE)
    servos = slice(sources, sources + damped.size)
    correlation[servos, servos] += np.outer(alike, alike) - np.diag(alike**2)
    return np.asarray(np.linalg.inv(correlation))


def line_model(
    exact: InstrumentModel | None, layout: SignalLayout, omega: Array, model: ServoModel, applied: ServoModel
) -> InstrumentModel | None:
    """The ``exact`` model of the lines with the controls where the servos have them."""
    if np.array_equal(model.lateness, applied.lateness) and np.array_equal(model.curvature, applied.curvature):
        return exact
    return with_servos(exact, layout, omega, servo_model.lateness(model, applied, omega))


def column_changes(
    imperfect: Imperfections, aircraft: Aircraft, layout: SignalLayout, integrals: Array
) -> ColumnChanges:
    """What one unit of each imperfection changes, by the signals' ``integrals`` (W,)."""
    means = flight_means(layout, integrals)
    count = len(imperfect.sources) + 3 * len(imperfect.controls)
    changes = ColumnChanges(aircraft, layout, imperfect.columns, means, count, imperfect.reconstructed)
    for i, source in enumerate(imperfect.sources):
        changes.at = i
        describe(changes, source)
    for i, place in enumerate(imperfect.timed.tolist()):
        for order in range(3):
            changes.at = imperfect.servos.start + i + order * len(imperfect.controls)
            changes.servo(place, order)
    changes.finish()
    return changes


def prior(imperfect: Imperfections, model: ServoModel) -> tuple[Array, Array, Array]:
    """(K,) 1 sigma of each and (K,) its mean, both from where the servos are at present taken to be, and (K, K).

    The last is the inverse of the correlations: what is expected of a servo's curvature goes with its lateness, and of
    its third coefficient with both.
    """
    late, curved = model.lateness[imperfect.timed], model.curvature[imperfect.timed]
    size = np.maximum(late, max(SHORTEST, math.sqrt(3.0) * imperfect.step_time))  # a step is off by half an interval
    of_curvature, of_third = CURVATURE * size**2, THIRD * size**3
    of_sources = [source.sigma for source in imperfect.sources]
    sigmas = np.concatenate([of_sources, imperfect.sigmas, of_curvature, of_third])
    more = late - imperfect.applied.lateness[imperfect.timed]  # beyond the file's servo; it may be a lag or a delay
    coupling = _coupling(imperfect, 2.0 * CURVATURE * more, *servo_model.third_slopes(late, curved))
    of_sources = [source.expected for source in imperfect.sources]
    about = imperfect.applied.curvature[imperfect.timed] + CURVATURE * more**2 - curved
    means = np.concatenate([of_sources, imperfect.expected - more, about, np.zeros(late.size)])
    scaled = coupling * sigmas / sigmas[:, None]
    return sigmas, np.linalg.solve(coupling, means), scaled.T @ imperfect.precision @ scaled


def _coupling(imperfect: Imperfections, curvature: Array, third: Array, third_of_curvature: Array) -> Array:
    """(K, K) of all imperfections those parts that do not follow from others.

    A servo's curvature is expected to change with its lateness by the slope ``curvature`` (m,) s, its third coefficient
    by ``third`` (m,) s^2, and with the curvature by ``third_of_curvature`` (m,) s.
    """
    m, first = len(imperfect.controls), imperfect.servos.start
    coupling, servo = np.eye(first + 3 * m), np.arange(first, first + m)
    coupling[servo + m, servo] = -curvature
    coupling[servo + 2 * m, servo] = -third
    coupling[servo + 2 * m, servo + m] = -third_of_curvature
    return coupling


def remapped(
    info: Information,
    imperfect: Imperfections,
    exact: InstrumentModel | None,
    layout: SignalLayout,
    lines: Spectrum,
    servos: tuple[ServoModel, ServoModel],
) -> Information:
    """The information with the controls where the second of the ``servos`` have them, not the first.

    The Gram matrices follow from the cross-spectra.
    """
    if not info.spectra.size or not info.samples:
        return info
    before, after = servos
    model = with_servos(exact, layout, lines.omega, servo_model.lateness(after, before, lines.omega))
    full = spectra_with_servos(info.spectra, imperfect.columns, model, lines.omega, None)
    grams = band_grams(full, lines.bands, imperfect.places)
    T = imperfect.columns.transformed
    return replace(with_grams(info, grams), spectra=full[:, :T, :T].copy())
