"""Forces and moments from coefficients, and coefficients from forces and moments.

Lift and drag act in stability axes: the body's, turned by the angle of attack about y. Klein & Morelli (2006),
"Aircraft System Identification", eqs. 5.96 to 5.101; Stevens, Lewis & Johnson (2016), "Aircraft Control and
Simulation", ch. 2.
"""

from __future__ import annotations

from sysid_node.aircraft.model import Throttle
from sysid_node.dynamics.coefficients import Coefficients
from sysid_node.dynamics.vector import Namespace, Real, Vector


def lift_and_drag(forward: Real, down: Real, cos: Real, sin: Real) -> tuple[Real, Real]:
    """Lift and drag of a force's components along body x and z; cosine and sine of the angle of attack."""
    return forward * sin - down * cos, -(forward * cos + down * sin)


def along_body(lift: Real, drag: Real, cos: Real, sin: Real) -> tuple[Real, Real]:
    """Components along body x and z of lift and drag; cosine and sine of the angle of attack."""
    return lift * sin - drag * cos, -(lift * cos + drag * sin)


def force_and_moment(
    c: Coefficients, axes: tuple[Real, Real], pressure_area: Real, span: Real, chord: Real
) -> tuple[Vector, Vector]:
    """Force (N) and moment (N m), body axes.

    ``axes``: cosine and sine of the angle of attack; ``pressure_area`` is qbar S (N), ``span`` and ``chord`` in m.
    """
    X, Z = along_body(c.CL, c.CD, *axes)
    force = Vector(pressure_area * X, pressure_area * c.CY, pressure_area * Z)
    moment = Vector(pressure_area * span * c.Cl, pressure_area * chord * c.Cm, pressure_area * span * c.Cn)
    return force, moment


def coefficients_of(
    force: Vector, moment: Vector, axes: tuple[Real, Real], pressure_area: Real, span: Real, chord: Real
) -> Coefficients:
    """The inverse of ``force_and_moment``."""
    scale = 1.0 / pressure_area
    lift, drag = lift_and_drag(force.x, force.z, *axes)
    return Coefficients(
        scale * lift,
        scale * drag,
        scale * force.y,
        scale / span * moment.x,
        scale / chord * moment.y,
        scale / span * moment.z,
    )


def thrust_axes(inclination: Real, xp: Namespace) -> tuple[Real, Real]:
    """Share of the thrust along body x, and along body z; ``inclination`` (rad) of its line above body x."""
    return xp.cos(inclination), -xp.sin(inclination)


def thrust_line(throttle: Throttle | None) -> tuple[float, float]:
    """Inclination (rad) and lever arm (m) of the aircraft file's thrust line; zeros without an engine."""
    return (throttle.inclination, throttle.arm) if throttle else (0.0, 0.0)
