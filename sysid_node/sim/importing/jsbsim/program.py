"""JSBSim with one model: its masses, and its forces in any state, in SI units and body axes forward-right-down."""

from __future__ import annotations

import ctypes
import math
import os
import weakref
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sysid_node.errors import InputError
from sysid_node.sim.importing.jsbsim.files import ModelFiles, jsbsim_root
from sysid_node.sim.importing.jsbsim.messages import collect_messages

Array = NDArray[np.float64]

FOOT, POUND, SLUG, INCH = 0.3048, 4.4482216152605, 14.5939029372064, 0.0254
_MOMENT, _INERTIA = POUND * FOOT, SLUG * FOOT * FOOT
_FORCES, _MOMENTS = ("x", "y", "z"), ("l", "m", "n")

#: The external force and the lever of a model whose thrust is no engine's (``sim.export.jsbsim`` writes such models).
_THRUST, LEVER = "external_reactions/thrust", "fcs/throttle-cmd-norm"


@dataclass(frozen=True)
class Flight:
    """A state of flight without wind: m/s, rad, rad/s, m; throttle 0..1."""

    airspeed: float
    alpha: float = 0.0
    beta: float = 0.0
    rates: tuple[float, float, float] = (0.0, 0.0, 0.0)
    phi: float = 0.0
    theta: float = 0.0
    altitude: float = 1000.0
    throttle: float = 0.0


@dataclass(frozen=True)
class Loads:
    """Aerodynamic and propulsive force (N) and moment about the centre of gravity (N m), each (6,), and more."""

    air: Array
    engine: Array
    density: float  # kg/m^3
    alpha_rate: float  # rad/s, by which JSBSim computed its terms in the rate of alpha


#: All programs that have not been destroyed.
_ALIVE: weakref.WeakSet[Program] = weakref.WeakSet()


def never_destroy_programs() -> None:
    """Lets the programs that there are live until the process ends.

    A model that reads a property which it lacks makes JSBSim throw when it runs, and again when it is destroyed; the
    second would end the process.
    """
    for program in _ALIVE:
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(program.fdm))


class Program:
    """JSBSim with one model. Surfaces are properties that the caller sets, by name. Raises InputError if none loads."""

    def __init__(self, files: ModelFiles, rate: float = 400.0) -> None:
        jsbsim_root()
        os.environ.setdefault("JSBSIM_DEBUG", "0")  # no banner; it is read when the program starts
        import jsbsim  # noqa: PLC0415  # an optional dependency

        messages = collect_messages()
        self.fdm: Any = jsbsim.FGFDMExec(str(files.folder))
        _ALIVE.add(self)
        self.fdm.set_debug_level(0)
        self._rate = rate
        self.fdm.set_dt(1.0 / rate)  # lags and delays freeze when the model is read
        folders = (str(files.folder.parent), str(files.engines), str(files.systems))
        try:
            loaded = self.fdm.load_model_with_paths(files.name, *folders)
        except Exception as error:
            raise InputError(f"model {files.label}: JSBSim does not load it: {' '.join(str(error).split())}") from error
        if not loaded:
            why = messages[-1] if messages else "run JSBSim on it to see why"
            raise InputError(f"model {files.label}: JSBSim does not load it: {why}")
        self._settled: tuple[float, float] | None = None
        self._set_if_there({"propulsion/fuel_freeze": 1.0, "atmosphere/turb-type": 0.0})

    def has(self, name: str) -> bool:
        """Whether there is a property of this name."""
        return bool(self.fdm.get_property_manager().hasNode(name))

    def _set_if_there(self, values: Mapping[str, float]) -> None:
        for name, value in values.items():
            if self.has(name):
                self.fdm[name] = value

    @property
    def powered(self) -> bool:
        """Whether a throttle gives thrust: of engines, or of an external force called thrust."""
        return self.engines > 0 or (self.has(LEVER) and self.has(f"{_THRUST}/magnitude"))

    @property
    def engines(self) -> int:
        """How many engines the model has."""
        return int(self.fdm.get_propulsion().get_num_engines())

    def put(self, state: Flight, properties: Mapping[str, float]) -> None:
        """Into a state, engines running steadily at its airspeed and throttle; forces are then those of the state."""
        engine = (state.airspeed, state.throttle)
        if self.engines and self._settled != engine:
            # always from the same flow, or an engine would remember the state that it was first asked for
            self._place(replace(state, alpha=0.0, beta=0.0, rates=(0.0, 0.0, 0.0), phi=0.0), properties)
            self._settle(state.throttle)
            self._settled = engine
        self._place(state, properties)

    def _place(self, state: Flight, properties: Mapping[str, float]) -> None:
        fdm = self.fdm
        speed, beta, alpha = state.airspeed, state.beta, state.alpha
        forward = speed * math.cos(beta)
        velocity = (forward * math.cos(alpha), speed * math.sin(beta), forward * math.sin(alpha))
        angles = {"ic/phi-rad": state.phi, "ic/theta-rad": state.theta, "ic/psi-true-rad": 0.0}
        for name, value in {"ic/h-sl-ft": state.altitude / FOOT, **angles}.items():
            fdm[name] = value
        for axis, value in zip("uvw", velocity, strict=True):
            fdm[f"ic/{axis}-fps"] = value / FOOT
        for axis, value in zip("pqr", state.rates, strict=True):
            fdm[f"ic/{axis}-rad_sec"] = value
        self.levers(state.throttle)
        self.drive(properties)
        fdm.run_ic()

    def _settle(self, throttle: float) -> None:
        """Engines into their steady running at this throttle and airspeed."""
        self.suspend()
        self.levers(throttle)
        self.fdm.run()
        self.fdm["propulsion/set-running"] = -1  # at full throttle, whatever the levers say
        self.levers(throttle)
        self.fdm.run()
        self.fdm.get_propulsion().get_steady_state()
        self.fdm.run()
        self.resume()

    def suspend(self) -> None:
        """The aircraft stands still while its systems run on."""
        self.fdm.suspend_integration()

    def resume(self) -> None:
        """Integrate again; an engine that was started within a suspension has made JSBSim forget its step."""
        self.fdm.resume_integration()
        if self.fdm.integration_suspended():
            self.fdm.set_dt(1.0 / self._rate)

    def levers(self, throttle: float) -> None:
        """Throttle of all engines (0..1), mixture and propeller forward."""
        if self.powered and not self.engines:
            self.fdm[LEVER] = throttle
        for i in range(self.engines):
            levers = {"throttle": throttle, "mixture": 1.0, "advance": 1.0}
            for lever, share in levers.items():
                for kind in ("cmd", "pos"):
                    self.fdm[f"fcs/{lever}-{kind}-norm[{i}]"] = share

    def drive(self, properties: Mapping[str, float]) -> None:
        """Set properties, such as positions of surfaces."""
        for name, value in properties.items():
            self.fdm[name] = value

    def loads(self) -> Loads:
        """The loads of the present state."""
        fdm = self.fdm
        air, engine = self._part("aero"), self._part("prop") if self.engines else self._thrust_force()
        if self.has("forces/fbx-external-lbs"):  # forces that the model adds to its aerodynamics
            air = air + self._part("external") - (0.0 if self.engines else engine)
        density = fdm["atmosphere/rho-slugs_ft3"] * SLUG / FOOT**3
        return Loads(air, engine, density, float(fdm["aero/alphadot-rad_sec"]))

    def _part(self, part: str) -> Array:
        """Force (N) and moment (N m) about the centre of gravity (6,) of one part of the forces."""
        force = [self.fdm[f"forces/fb{axis}-{part}-lbs"] * POUND for axis in _FORCES]
        moment = [self.fdm[f"moments/{axis}-{part}-lbsft"] * _MOMENT for axis in _MOMENTS]
        return np.array([*force, *moment])

    def _thrust_force(self) -> Array:
        """Force (N) and moment (N m) (6,) of an external force called thrust, in place of an engine."""
        if not self.has(f"{_THRUST}/magnitude"):
            return np.zeros(6)
        force = np.array([self.fdm[f"{_THRUST}/{axis}"] for axis in "xyz"]) * self.fdm[f"{_THRUST}/magnitude"] * POUND
        place = self.place(*(float(self.fdm[f"{_THRUST}/location-{axis}-in"]) for axis in "xyz"))
        return np.concatenate([force, np.cross(place, force)])

    def accelerations(self) -> Array:
        """Rates of u, v, w (m/s^2) and p, q, r (rad/s^2), (6,), of the present state."""
        fdm = self.fdm
        moving = [fdm[f"accelerations/{axis}dot-ft_sec2"] * FOOT for axis in "uvw"]
        return np.array([*moving, *(fdm[f"accelerations/{axis}dot-rad_sec2"] for axis in "pqr")])

    @property
    def climb(self) -> float:
        """Rate of climb, m/s."""
        return float(self.fdm["velocities/h-dot-fps"]) * FOOT

    @property
    def mach(self) -> float:
        """Mach number of the present state."""
        return float(self.fdm["velocities/mach"])

    @property
    def mass(self) -> float:
        """With fuel and loads as the model has them, kg."""
        return float(self.fdm["inertia/mass-slugs"]) * SLUG

    @property
    def inertia(self) -> dict[str, float]:
        """Moments and products about the centre of gravity, kg m^2, in the usual signs (JSBSim's Ixz is minus it)."""
        signs = {"xx": 1.0, "yy": 1.0, "zz": 1.0, "xz": -1.0}
        return {f"I{a}": s * float(self.fdm[f"inertia/i{a}-slugs_ft2"]) * _INERTIA for a, s in signs.items()}

    @property
    def cross_products(self) -> float:
        """The largest of |Ixy| and |Iyz| over the largest moment: 0 for a symmetric aircraft."""
        fdm = self.fdm
        cross = [abs(float(fdm[f"inertia/i{axes}-slugs_ft2"])) for axes in ("xy", "yz")]
        return max(cross) / max(float(fdm[f"inertia/i{axes}-slugs_ft2"]) for axes in ("xx", "yy", "zz"))

    @property
    def geometry(self) -> tuple[float, float, float]:
        """Reference area (m^2), span (m), chord (m)."""
        fdm = self.fdm
        return (fdm["metrics/Sw-sqft"] * FOOT**2, fdm["metrics/bw-ft"] * FOOT, fdm["metrics/cbarw-ft"] * FOOT)

    def place(self, x_in: float, y_in: float, z_in: float) -> tuple[float, float, float]:
        """A point of the structure (in, aft, right, up) from the centre of gravity (m, forward, right, down)."""
        cg = [float(self.fdm[f"inertia/cg-{axis}-in"]) for axis in "xyz"]
        return -(x_in - cg[0]) * INCH, (y_in - cg[1]) * INCH, -(z_in - cg[2]) * INCH

    def named_place(self, metric: str) -> tuple[float, float, float]:
        """A point of the model's metrics, such as ``eyepoint``, from the centre of gravity, m."""
        x, y, z = (float(self.fdm[f"metrics/{metric}-{axis}-in"]) for axis in "xyz")
        return self.place(x, y, z)

    def step(self, frames: int) -> None:
        """Let systems run on for so many frames while the aircraft stands still."""
        self.suspend()
        for _ in range(frames):
            self.fdm.run()
        self.resume()

    def run_for(self, seconds: float) -> None:
        """Fly on; the next steady flight settles its engines anew."""
        self._settled = None
        for _ in range(round(seconds * self._rate)):
            self.fdm.run()

    def read(self, names: Sequence[str]) -> Array:
        """Values of properties."""
        return np.array([float(self.fdm[name]) for name in names])
