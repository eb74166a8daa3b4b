"""JSBSim's ``c172p`` as a plant: tables over alpha, stall hysteresis, propeller wash, alpha-dot, a piston engine.

The aircraft file that goes with it holds local derivatives by finite differences at the trim, and no more. Surfaces are
driven in radians; effects on the air and the masses are made by JSBSim's own masses and external forces and moments.
"""

from __future__ import annotations

import math
import shutil
import tempfile
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import jsbsim
import numpy as np
from scipy.optimize import least_squares

from bench.withheld.plants.aerodynamics import additions
from bench.withheld.plants.motion import DivergedError, Effects, Flow, Instant, Triple, flow_angles
from sysid_node.aircraft.model import (
    Aircraft,
    Control,
    Derivative,
    Geometry,
    Inertia,
    ReferenceCondition,
    Sensors,
    Throttle,
)

_FT, _LBF, _SLUG, _INCH = 0.3048, 4.4482216, 14.593903, 0.0254
_INERTIA = _SLUG * _FT * _FT
_SPEED, _ALTITUDE = 52.0, 900.0  # m/s, m
_FORCES, _MOMENTS = ("x", "y", "z"), ("l", "m", "n")
_DRIVEN = {
    "elevator": ("fcs/elevator-pos-rad",),
    "aileron": ("fcs/left-aileron-pos-rad",),
    "rudder": ("fcs/rudder-pos-rad",),
}
_SURFACES = ("elevator", "aileron", "rudder")

#: Tolerance of a derivative: a share of its size, and at least so much.
_SHARE, _LEAST = 0.12, {"CL": 0.02, "CD": 0.005, "CY": 0.01, "Cl": 0.004, "Cm": 0.015, "Cn": 0.004}


class Machine:
    """JSBSim with this aircraft, in SI units: one evaluation at a time, or flying on step by step."""

    def __init__(self, effects: Effects, rate: float) -> None:
        self._root = Path(tempfile.mkdtemp(prefix="plant"))
        try:
            self._write(effects)
            self.fdm = jsbsim.FGFDMExec(str(self._root))
            self.fdm.set_debug_level(0)
            self.fdm.set_dt(1.0 / rate)
            self.fdm.load_model("c172p")
        finally:
            shutil.rmtree(self._root)
        self.fdm["propulsion/fuel_freeze"] = 1

    def _write(self, effects: Effects) -> None:
        """The stock model with free surfaces, its masses as the effects have them, and room for external loads."""
        stock = Path(jsbsim.__file__).parent
        shutil.copytree(stock / "engine", self._root / "engine")
        (self._root / "systems").mkdir()
        tree = ElementTree.parse(stock / "aircraft" / "c172p" / "c172p.xml")
        root = tree.getroot()
        control = root.find("flight_control")
        assert control is not None
        for channel in control.findall("channel"):
            control.remove(channel)
        _masses(root, effects)
        external = ElementTree.SubElement(root, "external_reactions")
        for axis, direction in zip(_FORCES, np.eye(3), strict=True):
            _load(external, "force", f"add-{axis}", direction)
        for axis, direction in zip(_MOMENTS, np.eye(3), strict=True):
            _load(external, "moment", f"add-{axis}", direction)
        for output in root.findall("output"):
            root.remove(output)
        place = self._root / "aircraft" / "c172p"
        place.mkdir(parents=True)
        tree.write(place / "c172p.xml")

    def settle(self, alpha: float, beta: float, euler: Triple, rates: Triple, given: Mapping[str, float]) -> None:
        """Begins at a state with the engine running steadily; ``given`` surfaces (rad) and ``throttle`` (0..1)."""
        fdm = self.fdm
        for name, value in {
            "h-sl-ft": _ALTITUDE / _FT, "vt-fps": _SPEED / _FT, "alpha-rad": alpha, "beta-rad": beta,
            "phi-rad": euler[0], "theta-rad": euler[1], "psi-true-rad": euler[2],
            "p-rad_sec": rates[0], "q-rad_sec": rates[1], "r-rad_sec": rates[2],
        }.items():  # fmt: skip
            fdm[f"ic/{name}"] = value
        fdm["propulsion/set-running"] = -1
        self.drive(given)
        self.throttle(given["throttle"])
        fdm.run_ic()
        fdm["propulsion/set-running"] = -1
        self.throttle(given["throttle"])
        self.drive(given)
        fdm.suspend_integration()
        fdm.run()  # the levers reach the engine
        fdm.get_propulsion().get_steady_state()
        fdm.run()  # forces and accelerations of this state with this engine
        fdm.resume_integration()

    def throttle(self, share: float) -> None:
        """The engine's levers."""
        for lever in ("throttle", "mixture"):
            for kind in ("cmd", "pos"):
                self.fdm[f"fcs/{lever}-{kind}-norm"] = share if lever == "throttle" else 0.87

    def drive(self, surfaces: Mapping[str, float]) -> None:
        """Deflections, rad; the right aileron goes against the left."""
        for name in _SURFACES:
            for place in _DRIVEN[name]:
                self.fdm[place] = surfaces[name]
        self.fdm["fcs/right-aileron-pos-rad"] = -surfaces["aileron"]
        self.fdm["fcs/mag-elevator-pos-rad"] = abs(surfaces["elevator"])

    def push(self, force: Triple, moment: Triple) -> None:
        """External load at the centre of gravity, N and N m."""
        for axis, value in zip(_FORCES, force, strict=True):
            self.fdm[f"external_reactions/add-{axis}/magnitude"] = value / _LBF
        for axis, value in zip(_MOMENTS, moment, strict=True):
            self.fdm[f"external_reactions/add-{axis}/magnitude-lbsft"] = value / (_LBF * _FT)

    def instant(self) -> Instant:
        """The motion now."""
        fdm = self.fdm
        mass = fdm["inertia/mass-slugs"]
        force = tuple(fdm[f"forces/fb{a}-total-lbs"] / mass * _FT for a in _FORCES)
        turning = tuple(fdm[f"accelerations/{a}dot-rad_sec2"] for a in "pqr")
        rates = tuple(fdm[f"velocities/{a}-rad_sec"] for a in "pqr")
        euler = tuple(fdm[f"attitude/{a}-rad"] for a in ("phi", "theta", "psi"))
        flow = tuple(fdm[f"velocities/{a}-aero-fps"] * _FT for a in "uvw")
        turned = tuple(fdm[f"velocities/{a}-aero-rad_sec"] for a in "pqr")
        density = fdm["atmosphere/rho-slugs_ft3"] * _SLUG / _FT**3
        return Instant(force, turning, rates, euler, flow, turned, density)  # type: ignore[arg-type]

    @property
    def thrust(self) -> float:
        """Of the propeller, N."""
        return float(self.fdm["propulsion/engine/thrust-lbs"]) * _LBF

    @property
    def cg(self) -> Triple:
        """Place of the centre of gravity, m, forward-right-down of the structural origin."""
        x, y, z = (float(self.fdm[f"inertia/cg-{a}-in"]) * _INCH for a in "xyz")
        return -x, y, -z

    def load(self) -> np.ndarray:
        """Aerodynamic force and moment about the CG (6,), N and N m, without what the rate of alpha adds."""
        fdm = self.fdm
        force = np.array([fdm[f"forces/fb{a}-aero-lbs"] for a in _FORCES]) * _LBF
        moment = np.array([fdm[f"moments/{a}-aero-lbsft"] for a in _MOMENTS]) * _LBF * _FT
        alpha, lift = fdm["aero/alpha-rad"], fdm["aero/coefficient/CLadot"] * _LBF
        moment[1] -= fdm["aero/coefficient/Cmadot"] * _LBF * _FT
        arm = self._reference_point()
        unsteady = np.array([lift * math.sin(alpha), 0.0, -lift * math.cos(alpha)])
        return np.concatenate([force - unsteady, moment - np.cross(arm, unsteady)])

    def _reference_point(self) -> np.ndarray:
        """From the CG to the point about which the aerodynamics are stated, m."""
        fdm = self.fdm
        place = -fdm["metrics/aero-rp-x-in"], fdm["metrics/aero-rp-y-in"], -fdm["metrics/aero-rp-z-in"]
        return np.array(place) * _INCH - np.array(self.cg)


def _masses(root: ElementTree.Element, effects: Effects) -> None:
    """Mass, inertia and centre of gravity of the airframe, so that the whole has those of the effects."""
    balance = root.find("mass_balance")
    assert balance is not None
    whole = _STOCK_LBS
    more, shift = whole * effects.get("mass_error", {}).get("error", 0.0), effects.get("cg_shift", {})
    empty = _child(balance, "emptywt")
    own = float(empty.text or 0.0)
    empty.text = repr(own + more)
    place = balance.find("location")
    assert place is not None
    signs = {"x": -1.0, "y": 1.0, "z": -1.0}
    centre = dict(zip("xyz", _STOCK_CG_IN, strict=True))
    for axis, sign in signs.items():
        at = _child(place, axis)
        # what is added sits at the whole's centre of gravity; the shift is made by the airframe's own mass
        moment = own * float(at.text or 0.0) + more * centre[axis]
        moment += sign * shift.get(axis, 0.0) / _INCH * (whole + more)
        at.text = repr(moment / (own + more))
    for axis, error in effects.get("inertia_error", {}).items():
        entry = _child(balance, axis.lower())
        entry.text = repr(float(entry.text or 0.0) + error * _STOCK_INERTIA[axis])


def _child(parent: ElementTree.Element, tag: str) -> ElementTree.Element:
    child = parent.find(tag)
    assert child is not None
    return child


def _load(external: ElementTree.Element, kind: str, name: str, direction: np.ndarray) -> None:
    """A force at the stock aircraft's centre of gravity, or a moment, along one body axis."""
    load = ElementTree.SubElement(external, kind, name=name, frame="BODY")
    if kind == "force":
        place = ElementTree.SubElement(load, "location", unit="IN")
        for axis, value in zip("xyz", _STOCK_CG_IN, strict=True):
            ElementTree.SubElement(place, axis).text = repr(value)
    along = ElementTree.SubElement(load, "direction")
    for axis, value in zip("xyz", direction.tolist(), strict=True):
        ElementTree.SubElement(along, axis).text = repr(value)


#: Of the stock model with pilot and fuel: weight, centre of gravity (inches aft, right, up), inertia (slug ft^2).
_STOCK_LBS = 1880.0
_STOCK_CG_IN = (42.11702127659574, -1.3404255319148937, 37.73936170212766)
_STOCK_INERTIA = {"Ixx": 1524.47, "Iyy": 1384.26, "Izz": 2525.56}


@cache
def _trimmed() -> dict[str, float]:
    """Straight, level flight without sideslip: alpha, phi, theta, surfaces and throttle."""
    return _trim(Machine({}, 400.0))


def _trim(machine: Machine) -> dict[str, float]:
    names = ("alpha", "phi", "theta", *_SURFACES, "throttle")

    def left(z: np.ndarray) -> list[float]:
        at = dict(zip(names, z.tolist(), strict=True))
        machine.settle(at["alpha"], 0.0, (at["phi"], at["theta"], 0.0), (0.0,) * 3, at)
        fdm = machine.fdm
        linear = [fdm[f"accelerations/{a}dot-ft_sec2"] for a in "uvw"]
        return [*linear, *(10.0 * fdm[f"accelerations/{a}dot-rad_sec2"] for a in "pqr"), fdm["velocities/h-dot-fps"]]

    left(np.array([0.03, 0.0, 0.03, 0.0, 0.0, 0.0, 0.7]))
    found = least_squares(left, [0.02, 0.0, 0.02, -0.02, 0.0, 0.0, 0.7], diff_step=1e-4, x_scale=0.1)
    if np.abs(found.fun).max() > 1e-2:
        raise DivergedError("no trim")
    return dict(zip(names, found.x.tolist(), strict=True))


@cache
def aircraft() -> Aircraft:
    """The truth that the aircraft file tells of: masses, geometry and local derivatives at the trim."""
    machine, at = Machine({}, 400.0), _trimmed()
    fdm = machine.fdm
    machine.settle(at["alpha"], 0.0, (at["phi"], at["theta"], 0.0), (0.0,) * 3, at)
    geometry = Geometry(fdm["metrics/Sw-sqft"] * _FT**2, fdm["metrics/bw-ft"] * _FT, fdm["metrics/cbarw-ft"] * _FT)
    inertia = Inertia(*(fdm[f"inertia/i{a}-slugs_ft2"] * _INERTIA for a in ("xx", "yy", "zz")),
                      -fdm["inertia/ixz-slugs_ft2"] * _INERTIA)  # fmt: skip
    density = machine.instant().density
    arm = fdm["moments/m-prop-lbsft"] * _LBF * _FT / machine.thrust
    values = _derivatives(machine, at, geometry, density)
    limits = {"elevator": 0.4, "aileron": 0.3, "rudder": 0.28}
    symbols = {"elevator": "de", "aileron": "da", "rudder": "dr"}
    return Aircraft(
        name="c172p",
        source="local derivatives by finite differences at the trim",
        mass=fdm["inertia/mass-slugs"] * _SLUG,
        inertia=inertia,
        geometry=geometry,
        reference=ReferenceCondition(_SPEED, density),
        controls={n: Control(n, symbols[n], {n: 1.0}, limit=limits[n]) for n in _SURFACES},
        derivatives={n: Derivative(v, max(_SHARE * abs(v), _LEAST[n[:2]])) for n, v in values.items()},
        throttle=Throttle("throttle", None, 0.0, arm),
        sensors=Sensors((0.2, 0.0, 0.1), (1.5, -4.0, 0.2)),
        noise={"accel": 0.05, "gyro": 0.002, "airspeed": 0.3, "alpha": 0.004, "beta": 0.004, "attitude": 0.005},
    )


def _derivatives(machine: Machine, at: Mapping[str, float], geometry: Geometry, density: float) -> dict[str, float]:
    """Central differences of the coefficients; offsets make the trim's balance, the propeller's moments included."""
    b, c, half = geometry.b, geometry.cbar, 0.5 / _SPEED
    steps = {"alpha": (0.01, 1.0), "beta": (0.02, 1.0), "p": (0.05, b * half), "q": (0.05, c * half),
             "r": (0.05, b * half), "de": (0.02, 1.0), "da": (0.02, 1.0), "dr": (0.02, 1.0)}  # fmt: skip
    surface = {"de": "elevator", "da": "aileron", "dr": "rudder"}
    scale = 0.5 * density * _SPEED**2 * geometry.S

    def coefficients(name: str = "", step: float = 0.0) -> np.ndarray:
        alpha = at["alpha"] + (step if name == "alpha" else 0.0)
        rates = tuple(step if name == rate else 0.0 for rate in "pqr")
        given = {**at, **({surface[name]: at[surface[name]] + step} if name in surface else {})}
        beta = step if name == "beta" else 0.0
        machine.settle(alpha, beta, (at["phi"], at["theta"], 0.0), rates, given)  # type: ignore[arg-type]
        return _reduced(machine.load(), alpha, scale, geometry)

    middle, values = coefficients(), {}
    fdm = machine.fdm
    engine = [fdm[f"moments/{a}-prop-lbsft"] * _LBF * _FT / scale for a in "ln"]
    middle[3] += engine[0] / b
    middle[5] += engine[1] / b
    trim = {"alpha": at["alpha"], "beta": 0.0, "p": 0.0, "q": 0.0, "r": 0.0, **{s: at[n] for s, n in surface.items()}}
    longitudinal, lateral = ("alpha", "q", "de"), ("beta", "p", "r", "da", "dr")
    for place, name in enumerate(("CL", "CD", "CY", "Cl", "Cm", "Cn")):
        own = {}
        for x in longitudinal if name in ("CL", "CD", "Cm") else lateral:
            step, unit = steps[x]
            own[x] = float((coefficients(x, step) - coefficients(x, -step))[place] / (2.0 * step * unit))
        values[f"{name}_0"] = float(middle[place]) - sum(own[x] * trim[x] for x in own)
        values |= {f"{name}_{x}": value for x, value in own.items()}
    return values


def _reduced(load: np.ndarray, alpha: float, scale: float, geometry: Geometry) -> np.ndarray:
    """CL, CD, CY, Cl, Cm, Cn of a force and moment in body axes."""
    X, Y, Z, L, M, N = load / scale
    cos, sin = math.cos(alpha), math.sin(alpha)
    return np.array([X * sin - Z * cos, -X * cos - Z * sin, Y, L / geometry.b, M / geometry.cbar, N / geometry.b])


class Cessna:
    """The plant in flight."""

    controls = _SURFACES

    def __init__(self, known: Aircraft, effects: Effects, rate: float) -> None:
        self._machine, self._effects, self._known = Machine(effects, rate), effects, known
        self._rate, self._additions = rate, additions(effects, known)
        self._at = _trim(self._machine)
        stock = tuple(s * i * _INCH for s, i in zip((-1.0, 1.0, -1.0), _STOCK_CG_IN, strict=True))
        self.cg = tuple(a - b for a, b in zip(self._machine.cg, stock, strict=True))
        self.trim = {n: self._at[n] for n in _SURFACES}
        self.start()
        self.trim["thrust"] = self._machine.thrust

    @property
    def mass(self) -> float:
        """All of it, kg."""
        return float(self._machine.fdm["inertia/mass-slugs"]) * _SLUG

    def start(self) -> Instant:
        """Back to the trim."""
        at = self._at
        self._machine.push((0.0,) * 3, (0.0,) * 3)
        for way in ("north", "east", "down"):
            self._machine.fdm[f"atmosphere/gust-{way}-fps"] = 0.0
        self._machine.settle(at["alpha"], 0.0, (at["phi"], at["theta"], 0.0), (0.0,) * 3, at)
        return self._machine.instant()

    def meter(self, commanded: float) -> float:
        """The propeller's thrust as it is, but for ``thrust_scale``, of which the meter knows nothing."""
        return self._machine.thrust

    def step(self, surfaces: Mapping[str, float], thrust: float, gusts: tuple[float, ...], time: float) -> Instant:
        """One step on; the thrust wanted moves the lever."""
        machine, before = self._machine, self._machine.instant()
        machine.drive(surfaces)
        wanted = (thrust - self.trim["thrust"]) / _THRUST_PER_LEVER
        machine.throttle(min(max(self._at["throttle"] + wanted, 0.05), 1.0))
        self._blow(before, gusts, min(time, 1.0))
        self._add(before, time)
        machine.fdm.run()
        now = machine.instant()
        if not (abs(now.euler[1]) < 1.4 and math.isfinite(now.force[2]) and abs(now.force[2]) < 200.0):
            raise DivergedError(f"at {time:.1f} s")
        return now

    def _blow(self, at: Instant, gusts: tuple[float, ...], share: float) -> None:
        """The gusts, turned to earth axes; they grow over the first second, since none is in the trim."""
        for way, value in zip(("north", "east", "down"), _to_earth(at.euler, gusts[:3]), strict=True):  # type: ignore[arg-type]
            self._machine.fdm[f"atmosphere/gust-{way}-fps"] = share * value / _FT

    def _add(self, at: Instant, time: float) -> None:
        """What the effects add to air loads and thrust, as external force and moment."""
        geometry = self._known.geometry
        speed, alpha, beta = flow_angles(at.flow)
        lengths = geometry.b, geometry.cbar, geometry.b
        p, q, r = (rate * length * 0.5 / speed for rate, length in zip(at.turned, lengths, strict=True))
        scale = 0.5 * at.density * speed * speed * geometry.S
        known = self._known.derivatives
        lift = known["CL_0"].value + known["CL_alpha"].value * alpha
        seen = Flow(alpha, beta, p, q, r, 0.0, lift, time)
        parts = [addition(seen) for addition in self._additions]
        CL, CD, CY, Cl, Cm, Cn = (scale * sum(part[i] for part in parts) for i in range(6))
        sin, cos = math.sin(alpha), math.cos(alpha)
        pull = self._machine.thrust * self._effects.get("thrust_scale", {}).get("error", 0.0)
        force = (CL * sin - CD * cos + pull, CY, -CL * cos - CD * sin)
        moment = (Cl * geometry.b, Cm * geometry.cbar + pull * self._throttle_arm(), Cn * geometry.b)
        self._machine.push(force, moment)

    def _throttle_arm(self) -> float:
        return self._known.throttle.arm if self._known.throttle else 0.0


#: Thrust gained from closed to open throttle near the trim, N: what the autopilot's lever is graded in.
_THRUST_PER_LEVER = 3000.0


def _to_earth(euler: Triple, v: Triple) -> Triple:
    """A body-axes vector as north, east, down."""
    sp, cp = math.sin(euler[0]), math.cos(euler[0])
    st, ct = math.sin(euler[1]), math.cos(euler[1])
    ss, cs = math.sin(euler[2]), math.cos(euler[2])
    x, y, z = v
    side, deep = y * cp - z * sp, y * sp + z * cp
    along = x * ct + deep * st
    return along * cs - side * ss, along * ss + side * cs, -x * st + deep * ct
