"""The imperfections of one aircraft as the estimator takes them: sources, servos, and where their columns stand."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.flight.servos import servos_of
from sysid_node.online.frequency.regression_signals import SignalLayout
from sysid_node.online.regression.information import Information, Spectrum
from sysid_node.online.regression.instruments import InstrumentModel, with_servos
from sysid_node.online.systematic import servo_model
from sysid_node.online.systematic.column_changes import ColumnChanges, flight_means
from sysid_node.online.systematic.cross_spectra import ServoColumns, band_grams
from sysid_node.online.systematic.cross_spectra import with_servos as spectra_with_servos
from sysid_node.online.systematic.servo_model import ServoModel
from sysid_node.online.systematic.sources import ErrorSource, describe, sources

Array = NDArray[np.float64]
Index = NDArray[np.intp]

#: Share of L^2 that the curvature B of a servo of which nothing is known has: first order has 0, a delay 0.5.
CURVATURE = 0.25
SHORTEST = 0.02  # s: the lateness from which on the curvature's tolerance goes with its square


@dataclass(frozen=True)
class Imperfections:
    """K = S + 2 m imperfections: S sources, and the lateness and the curvature of m servos."""

    sources: tuple[ErrorSource, ...]
    controls: tuple[str, ...]  # names of the controls whose servos are not exactly known
    timed: Index  # (m,) places of these controls among those of the layout
    applied: ServoModel  # of all controls: what the alignment has made of commands already, by the aircraft file
    sigmas: Array  # (m,) s: 1 sigma of the lateness about the aircraft file's
    columns: ServoColumns
    stamps: float  # s: 1 sigma of the lateness of the stamps of controls and motion, against each other
    places: Index  # (W,) where the columns of the signal vector stand among them

    @property
    def keys(self) -> tuple[str, ...]:
        """Of each imperfection the key of its tolerance: lateness and curvature of a servo share theirs."""
        servos = tuple(f"actuator_lag.{name}" for name in self.controls)
        return (*(source.key for source in self.sources), *servos, *servos)

    @property
    def servos(self) -> slice:
        """Places of the servos' lateness."""
        return slice(len(self.sources), len(self.sources) + len(self.controls))


def imperfections(
    aircraft: Aircraft, layout: SignalLayout, *, commanded: bool, positions: bool
) -> Imperfections | None:
    """Those of an aircraft file; None where it states that all is exact.

    ``commanded``: the deflections follow from commands by the file's servos. ``positions``: they are known to be
    measured, so that no servo comes after them. Where neither is known, they may be either.
    """
    found = sources(aircraft)
    servos = dict(zip(aircraft.control_symbols, servos_of(aircraft)[1:], strict=True))
    names = {control.symbol: name for name, control in aircraft.controls.items()}
    stated = [servo_model.of_servo(servos[symbol]) for symbol in layout.timed]
    rows = []
    for place, symbol in enumerate(layout.timed):
        name = names[symbol]
        sigma = math.hypot(*(aircraft.tolerances.get(f"{effect}.{name}", 0.0) for effect in _SERVO_EFFECTS))
        if not commanded:
            sigma = math.hypot(sigma, stated[place][0])
        if sigma > 0.0 and not positions:
            rows.append((name, place, sigma))
    if not found and not rows:
        return None
    columns = ServoColumns.of(layout)
    controls, timed, sigmas = zip(*rows, strict=True) if rows else ((), (), ())
    applied = np.array(stated).reshape(-1, 2) if commanded else np.zeros((len(layout.timed), 2))
    return Imperfections(
        found,
        controls,
        np.array(timed, np.intp),
        ServoModel(applied[:, 0].copy(), applied[:, 1].copy()),
        np.array(sigmas),
        columns,
        math.hypot(*(aircraft.tolerances.get(f"delays.{topic}", 0.0) for topic in ("actuators", "imu"))),
        np.array([columns.place(i) for i in range(layout.width)], np.intp),
    )


_SERVO_EFFECTS = ("actuator_lag", "command_delay")


def line_model(
    exact: InstrumentModel | None, layout: SignalLayout, omega: Array, model: ServoModel, applied: ServoModel
) -> InstrumentModel | None:
    """The ``exact`` model of the lines with the controls where the servos have them."""
    if np.array_equal(model.lateness, applied.lateness) and np.array_equal(model.curvature, applied.curvature):
        return exact
    return with_servos(exact, layout, omega, servo_model.lateness(model, applied, omega))


def column_changes(
    imperfect: Imperfections, aircraft: Aircraft, layout: SignalLayout, integrals: Array
) -> tuple[ColumnChanges, Array]:
    """What one unit of each imperfection changes, and the means (W,) of the signals."""
    means = flight_means(layout, integrals)
    count = len(imperfect.sources) + 2 * len(imperfect.controls)
    changes = ColumnChanges(aircraft, layout, imperfect.columns, means, count)
    for i, source in enumerate(imperfect.sources):
        changes.at = i
        describe(changes, source)
    for i, place in enumerate(imperfect.timed.tolist()):
        changes.at = imperfect.servos.start + i
        changes.servo(place, 1.0, 0.0)
        changes.at = imperfect.servos.stop + i
        changes.servo(place, 0.0, 1.0)
    changes.finish()
    return changes, np.array([means.of(name) for name in layout.names])


def prior(imperfect: Imperfections, model: ServoModel) -> tuple[Array, Array]:
    """(K,) 1 sigma of each, and (K,) its mean, both from where the servos are at present taken to be."""
    late, curved = model.lateness[imperfect.timed], model.curvature[imperfect.timed]
    of_curvature = CURVATURE * np.maximum(late, SHORTEST) ** 2
    sigmas = np.concatenate([[source.sigma for source in imperfect.sources], imperfect.sigmas, of_curvature])
    stated, expected = imperfect.applied.lateness[imperfect.timed], imperfect.applied.curvature[imperfect.timed]
    # what is late beyond the file's servo may be a lag or a delay
    expected = expected + CURVATURE * (late - stated) ** 2
    means = np.concatenate([np.zeros(len(imperfect.sources)), stated - late, expected - curved])
    return sigmas, means


def remapped(
    info: Information,
    imperfect: Imperfections,
    exact: InstrumentModel | None,
    layout: SignalLayout,
    lines: Spectrum,
    servos: tuple[ServoModel, ServoModel],
) -> Information:
    """The information with the controls where the second of the ``servos`` have them, not the first.

    The Gram matrices follow from the cross-spectra. The scores, whose noise is correlated between lines, change as the
    Gram matrices do: column by column, they are as many times as large.
    """
    if not info.spectra.size or not info.samples:
        return info
    before, after = servos
    model = with_servos(exact, layout, lines.omega, servo_model.lateness(after, before, lines.omega))
    full = spectra_with_servos(info.spectra, imperfect.columns, model, lines.omega, None)
    grams = band_grams(full, lines.bands, imperfect.places)
    energies = info.grams.diagonal(axis1=1, axis2=2)
    scores = info.scores.diagonal(axis1=1, axis2=2)
    per_energy = np.divide(np.maximum(scores, 0.0), energies, out=np.zeros_like(energies), where=energies > 0.0)
    root = np.sqrt(per_energy)
    more = (grams - info.grams) * root[:, :, None] * root[:, None, :]
    T = imperfect.columns.transformed
    return _replaced(info, grams=grams, scores=info.scores + more, spectra=full[:, :T, :T].copy())


def _replaced(info: Information, **changes: NDArray[Any]) -> Information:
    values = {name: getattr(info, name) for name in info.__dataclass_fields__}
    return Information(**(values | changes))
