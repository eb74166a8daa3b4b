"""Flies an exported model in JSBSim on a planet that does not turn, with the gravity of the flight's altitude."""

import itertools
from pathlib import Path

import jsbsim
import numpy as np

from sysid_node.dynamics.atmosphere import GRAVITY
from sysid_node.dynamics.attitude import euler_angles

FOOT, RADIUS = 0.3048, 6371000.0

PLANET = """<planet name="still"><semimajor_axis unit="M">{radius}</semimajor_axis>
<semiminor_axis unit="M">{radius}</semiminor_axis><rotation_rate unit="RAD/SEC">0</rotation_rate>
<GM unit="FT3/SEC2">{gm}</GM><J2>0</J2></planet>"""

#: JSBSim's properties, in the order of ``states_to_compare``: p q r rad/s, alpha beta rad.
READ = ("velocities/p-rad_sec", "velocities/q-rad_sec", "velocities/r-rad_sec", "aero/alpha-rad", "aero/beta-rad")


def fly(model: str, name: str, folder: Path, rate: float, initial, commands, max_thrust: float, substeps: int):
    """(N, 5) of ``READ``; commands (N, 4) linear between samples, ``substeps`` frames from one to the next.

    JSBSim applies a frame's surfaces one frame late and steps by low-order rules: the more frames the closer.
    """
    fdm = load(model, name, folder, rate * substeps, -initial[2])
    start(fdm, initial, commands[0], max_thrust)
    rows = [[fdm[name] for name in READ]]
    for before, after in itertools.pairwise(commands):
        for part in np.arange(1, substeps + 1) / substeps:
            command(fdm, before + part * (after - before), max_thrust)
            fdm.run()
        rows.append([fdm[name] for name in READ])
    return np.array(rows)


def load(model: str, name: str, folder: Path, rate: float, altitude: float) -> jsbsim.FGFDMExec:
    """JSBSim with the model. The time step comes first: lags and delays freeze when the model is read."""
    place = folder / "aircraft" / name
    place.mkdir(parents=True)
    (place / f"{name}.xml").write_text(model)
    gm = GRAVITY * (RADIUS + altitude) ** 2 / FOOT**3
    (folder / "planet.xml").write_text(PLANET.format(radius=RADIUS, gm=gm))
    fdm = jsbsim.FGFDMExec(str(folder))
    fdm.set_debug_level(0)
    assert fdm.load_planet(str(folder / "planet.xml"), False)
    fdm.set_dt(1.0 / rate)
    assert fdm.load_model(name)
    return fdm


def start(fdm: jsbsim.FGFDMExec, initial, trim, max_thrust: float) -> None:
    """Initial conditions from the body's state (13,) without rotation."""
    angles = euler_angles(tuple(initial[6:10]), np)
    conditions = {
        "ic/h-sl-ft": -initial[2] / FOOT,
        "ic/lat-geod-deg": 0.0,
        "ic/long-gc-deg": 0.0,
        **{f"ic/{axis}-rad": angle for axis, angle in zip(("phi", "theta", "psi-true"), angles, strict=True)},
        **{f"ic/{axis}-fps": speed / FOOT for axis, speed in zip("uvw", initial[3:6], strict=True)},
    }
    for name, value in conditions.items():
        fdm[name] = float(value)
    command(fdm, trim, max_thrust)
    fdm.run_ic()
    frames = round(2.0 / fdm.get_delta_t())
    fdm.suspend_integration()
    # JSBSim's delays and lags begin empty: let them fill for two seconds while the aircraft stands still
    for _ in range(frames):
        fdm.run()
    fdm.resume_integration()


def command(fdm: jsbsim.FGFDMExec, values, max_thrust: float) -> None:
    for name, value in zip(("elevator", "aileron", "rudder"), values[:3], strict=True):
        fdm[f"fcs/{name}-cmd-rad"] = float(value)
    fdm["fcs/throttle-cmd-norm"] = float(values[3] / max_thrust)
