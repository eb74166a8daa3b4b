"""JSBSim's c172p and its aircraft file for tests of corrections, and what JSBSim says of a corrected model."""

from dataclasses import replace

import numpy as np

from sysid_node.aircraft.model import Aircraft, Control, Derivative, Geometry, Inertia, ReferenceCondition, Throttle
from sysid_node.aircraft.model import UncertainValue as Value
from sysid_node.sim.importing.jsbsim.files import copy_model
from sysid_node.sim.importing.jsbsim.program import Program

POUND, FOOT = 4.4482216152605, 0.3048


def file_of(survey):
    """A file with the model's masses and sizes and derivatives that only serve as a beginning."""
    names = "CL_0 CL_alpha CL_de CD_0 CY_beta Cl_p Cl_da Cm_0 Cm_alpha Cm_q Cm_de Cn_beta Cn_dr"
    symbols = {"elevator": "de", "aileron": "da", "rudder": "dr"}
    return Aircraft(
        name="c172p",
        source="JSBSim's model",
        mass=survey.mass,
        inertia=Inertia(**survey.inertia),
        geometry=Geometry(*survey.geometry),
        reference=ReferenceCondition(52.0, 1.12),
        controls={name: Control(name, symbol, {name: 1.0}) for name, symbol in symbols.items()},
        derivatives={name: Derivative(0.3) for name in names.split()} | {"Cm_alpha": Derivative(-0.5)},
        throttle=Throttle("throttle", 3000.0),
        ideal=True,
    )


def having(aircraft, **effects):
    """The aircraft with effects beside its own."""
    stated = {name: {key: Value(value) for key, value in values.items()} for name, values in effects.items()}
    return replace(aircraft, effects={**aircraft.effects, **stated})


def running(files, folder, rate=400.0, without=()):
    """JSBSim with a model."""
    return Program(copy_model(files, folder, without), rate)


def moved_by_hand(survey):
    """The properties of all surfaces."""
    return {name for s in survey.surfaces for name in s.properties}


def added_load(program):
    """Force (N) and moment (N m) of external reactions, of which the model itself has none, and the density."""
    fdm = program.fdm
    force = [fdm[f"forces/fb{axis}-external-lbs"] * POUND for axis in "xyz"]
    moment = [fdm[f"moments/{axis}-external-lbsft"] * POUND * FOOT for axis in "lmn"]
    return np.array([*force, *moment]), program.loads().density


def put_twice(program, survey, state, deflections):
    """Into a state; a second time, so that terms in the lift of the frame before have that of the state."""
    driven = {k: v for s in survey.surfaces for k, v in s.at(deflections[s.name]).items()}
    for _ in range(2):
        program.put(state, driven)


def loads_of(coefficients, alpha, pressure, geometry):
    """Force and moment (6,) of coefficients by name; ``pressure`` is qbar S."""
    CL, CD, CY, Cl, Cm, Cn = (coefficients.get(n, 0.0) for n in ("CL", "CD", "CY", "Cl", "Cm", "Cn"))
    sin, cos = np.sin(alpha), np.cos(alpha)
    moments = (Cl * geometry.b, Cm * geometry.cbar, Cn * geometry.b)
    return pressure * np.array([CL * sin - CD * cos, CY, -CL * cos - CD * sin, *moments])
