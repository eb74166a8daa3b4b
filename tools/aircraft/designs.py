"""The three aircraft that come with the package: planform, masses, sensors; x aft, y right, z up, from the nose.

Cropped deltas: Subrahmanyam, Kim & Ghosh identify a cropped-delta flat-plate (CDFP) and a reflex-wing (CDRW) aircraft
in flight; their wind-tunnel tables and drawings are not public. Root chord 0.90 m, tip chord 0.15 m and span 1.5 m are
those of a public trim study of a wing-alone cropped delta of that class (github.com/joshi-simran,
"Cropped-Delta-UAV-Trim-Analysis"); everything else here is assumed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from vortex_lattice import Array, Flap, Point, Section, flat, mirrored

from sysid_node.aircraft.model import Control, Throttle, Vector3


@dataclass(frozen=True)
class Body:
    """A slender fuselage: volume m^3, reference point m; it destabilises in pitch and yaw (Munk)."""

    volume: float
    slenderness_factor: float = 0.9  # apparent mass k2 - k1 of a body of fineness about 8


@dataclass(frozen=True)
class Design:
    """All from which an aircraft file is computed."""

    name: str
    source: str
    sections: tuple[Section, ...]
    S: float
    b: float
    cbar: float
    airspeed: float
    points: tuple[tuple[float, Point], ...]  # mass kg, place m
    plates: tuple[tuple[float, tuple[Section, ...]], ...]  # mass kg, spread evenly over sections
    controls: Mapping[str, Control]
    throttle: Throttle
    profile_drag: float  # CD at zero lift
    suction: float  # share of the leading-edge suction that is realised
    imu: Vector3  # forward, right, down of the CG, m
    air_data: Vector3
    body: Body | None = None
    density: float = 1.20
    noise: Mapping[str, float] = field(
        default_factory=lambda: {
            "accel": 0.05,
            "gyro": 0.002,
            "airspeed": 0.2,
            "alpha": 0.004,
            "beta": 0.004,
            "attitude": 0.005,
        }
    )


def reflex_slope(x: Array) -> Array:
    """Camber slope of z/c = k x (1 - x)(0.75 - x), 2 % at its highest: nose camber, trailing edge turned up."""
    k = 0.02 / 0.0949  # the cubic's maximum over 0 < x < 0.75 is 0.0949 k
    return np.asarray(k * (3 * x**2 - 3.5 * x + 0.75))


ROOT, TIP, SPAN = 0.90, 0.15, 1.50
_SWEEP = (ROOT - TIP) / (SPAN / 2)  # leading edge, per metre of span; the trailing edge is straight


def _delta_wing(camber: Callable[[Array], Array]) -> tuple[Section, ...]:
    """Elevons of 20 % chord from 25 % to 95 % of the half span, elevator and aileron in one."""
    sections: list[Section] = []
    for inner, outer, flapped, panels in ((0.0, 0.25, False, 6), (0.25, 0.95, True, 14), (0.95, 1.0, False, 2)):
        y0, y1 = inner * SPAN / 2, outer * SPAN / 2
        flaps = (Flap("elevator", 0.8), Flap("aileron", 0.8)) if flapped else ()
        section = Section(
            start=(_SWEEP * y0, y0, 0.0),
            stop=(_SWEEP * y1, y1, 0.0),
            start_chord=ROOT - _SWEEP * y0,
            stop_chord=ROOT - _SWEEP * y1,
            span_panels=panels,
            flaps=flaps,
            camber_slope=camber,
        )
        sections += mirrored(section, antisymmetric=("aileron",))
    return tuple(sections)


#: Drawn from tip to root, so that its normal points right; trailing edge left is then positive, as for the rudder.
_DELTA_FIN = (Section((0.78, 0.0, 0.32), (0.58, 0.0, 0.02), 0.17, 0.32, 8, (Flap("rudder", 0.6),)),)
_DELTA_MEAN_CHORD = 2 / 3 * (ROOT + TIP - ROOT * TIP / (ROOT + TIP))
_DELTA_AREA = SPAN / 2 * (ROOT + TIP)
_ASSUMED = (
    "Planform: root chord 0.90 m, tip chord 0.15 m, span 1.5 m of a public trim study of a wing-alone cropped delta "
    "(github.com/joshi-simran/Cropped-Delta-UAV-Trim-Analysis). The aircraft of Subrahmanyam, Kim and Ghosh are of "
    "this class, but their drawings and wind-tunnel tables are not public: fin, elevons, masses, CG, inertia, thrust, "
    "sensor noise and drag are assumed. Derivatives computed by a vortex lattice about level flight at the reference "
    "condition, by tools/aircraft/make.py; not measured. Tolerances are plausible errors of such a computation."
)


def _surface(name: str, symbol: str, limit: float, joints: Mapping[str, float] | None = None) -> Control:
    return Control(name, symbol, joints or {name: 1.0}, 0.0, limit)


def cdfp() -> Design:
    """Flat plate, elevons as two joints."""
    wing = _delta_wing(flat)
    elevons = {"elevon_left": 0.5, "elevon_right": 0.5}, {"elevon_left": -0.5, "elevon_right": 0.5}
    return Design(
        name="cdfp",
        source=f"Cropped-delta flat-plate UAV. {_ASSUMED}",
        sections=(*wing, *_DELTA_FIN),
        S=_DELTA_AREA,
        b=SPAN,
        cbar=_DELTA_MEAN_CHORD,
        airspeed=18.0,
        points=(
            (0.55, (-0.02, 0.0, 0.0)),
            (1.00, (0.38, 0.0, -0.01)),
            (0.45, (0.34, 0.0, 0.02)),
            (0.12, (0.78, 0.0, 0.0)),
        ),
        plates=((1.30, wing), (0.08, _DELTA_FIN)),
        controls={
            "elevator": _surface("elevator", "de", 0.40, elevons[0]),
            "aileron": _surface("aileron", "da", 0.35, elevons[1]),
            "rudder": _surface("rudder", "dr", 0.40),
        },
        throttle=Throttle("throttle", 26.0),
        profile_drag=0.024,
        suction=0.3,
        imu=(0.03, 0.0, -0.01),
        air_data=(0.55, 0.0, 0.0),
    )


def cdrw() -> Design:
    """Reflex wing, elevator and aileron mixed by the autopilot and reported as such."""
    wing = _delta_wing(reflex_slope)
    return Design(
        name="cdrw",
        source=f"Cropped-delta reflex-wing UAV. {_ASSUMED}",
        sections=(*wing, *_DELTA_FIN),
        S=_DELTA_AREA,
        b=SPAN,
        cbar=_DELTA_MEAN_CHORD,
        airspeed=18.0,
        points=(
            (0.60, (-0.02, 0.0, 0.0)),
            (1.10, (0.39, 0.0, -0.01)),
            (0.50, (0.34, 0.0, 0.02)),
            (0.15, (0.78, 0.0, 0.0)),
        ),
        plates=((1.55, wing), (0.10, _DELTA_FIN)),
        controls={
            "elevator": _surface("elevator", "de", 0.35),
            "aileron": _surface("aileron", "da", 0.35),
            "rudder": _surface("rudder", "dr", 0.35),
        },
        throttle=Throttle("throttle", 30.0),
        profile_drag=0.019,
        suction=0.85,
        imu=(0.05, 0.0, -0.01),
        air_data=(0.55, 0.0, 0.0),
    )


def kestrel() -> Design:
    """A conventional tractor aircraft of the 2 kg class: straight wing, tail behind, one fin."""
    b, chord = 1.60, 0.22
    inner = Section((0.28, 0.0, 0.06), (0.28, 0.45, 0.073), chord, chord, 10, camber_slope=_camber_4, incidence=0.02)
    outer = Section(
        (0.28, 0.45, 0.073),
        (0.32, 0.80, 0.092),
        chord,
        0.15,
        10,
        flaps=(Flap("aileron", 0.75),),
        camber_slope=_camber_4,
        incidence=0.01,
    )
    wing = (*mirrored(inner), *mirrored(outer, antisymmetric=("aileron",)))
    tail = mirrored(Section((1.00, 0.0, 0.02), (1.03, 0.26, 0.02), 0.16, 0.12, 8, flaps=(Flap("elevator", 0.6),)))
    fin = (Section((1.08, 0.0, 0.26), (1.00, 0.0, 0.03), 0.10, 0.18, 8, (Flap("rudder", 0.6),)),)
    ailerons = {"aileron_left": -0.5, "aileron_right": 0.5}
    return Design(
        name="kestrel",
        source=(
            "A drawn, not built, conventional UAV of the 2 kg class (1.6 m span, tractor propeller, tail behind). "
            "Geometry, masses, inertia, thrust, sensor noise and drag are assumed. Derivatives computed by a vortex "
            "lattice plus a slender-body fuselage about level flight at the reference condition, by "
            "tools/aircraft/make.py; not measured. Tolerances are plausible errors of such a computation."
        ),
        sections=(*wing, *tail, *fin),
        S=2 * (0.45 * chord + 0.35 * (chord + 0.15) / 2),
        b=b,
        cbar=0.205,
        airspeed=16.0,
        points=(
            (0.22, (0.02, 0.0, 0.0)),
            (0.55, (0.295, 0.0, -0.01)),
            (0.25, (0.38, 0.0, 0.0)),
            (0.18, (0.25, 0.0, 0.0)),
            (0.12, (0.75, 0.0, 0.0)),
        ),
        plates=((0.55, wing), (0.07, tail), (0.06, fin)),
        controls={
            "elevator": _surface("elevator", "de", 0.35),
            "aileron": _surface("aileron", "da", 0.35, ailerons),
            "rudder": _surface("rudder", "dr", 0.40),
        },
        throttle=Throttle("throttle", 16.0, arm=0.0),
        profile_drag=0.028,
        suction=0.9,
        imu=(0.02, 0.0, 0.01),
        air_data=(0.05, -0.45, -0.06),
        body=Body(volume=0.0042),
    )


def _camber_4(x: Array) -> Array:
    """Slope of the NACA 24xx camber line."""
    m, p = 0.02, 0.4
    return np.where(x < p, 2 * m / p**2 * (p - x), 2 * m / (1 - p) ** 2 * (p - x))


DESIGNS = {design.__name__: design for design in (cdfp, cdrw, kestrel)}
