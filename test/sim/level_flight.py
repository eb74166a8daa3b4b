"""The level flight of an imported aircraft, solved from its file."""

import numpy as np
from aircraft_loads import loads
from scipy.optimize import fsolve


def level_flight(aircraft):
    """The level flight of the tables' centre, from the file's own words and numbers."""
    alpha = float(aircraft.source.rpartition("alpha ")[2].partition(" ")[0])
    V, weight = aircraft.reference.airspeed, aircraft.mass * 9.80665
    throttle = aircraft.throttle

    def left(z):
        level = {"alpha": z[0], "de": z[1], "V": V, "da": z[3], "dr": z[4]}
        x = {
            n: np.array([float(level.get(n, 0.0))])
            for n in ("alpha", "beta", "p", "q", "r", "V", *aircraft.control_symbols)
        } | {"throttle": z[2:3]}
        load = loads(aircraft, x, z[2] * throttle.max_thrust)[0]
        phi = z[5]
        down = np.array([-np.sin(z[0]), np.sin(phi) * np.cos(z[0]), np.cos(phi) * np.cos(z[0])])
        return [*(load[:3] / weight + down), *(load[3:] / weight)]

    alpha, de, share, da, dr, _ = fsolve(left, [alpha, 0.0, 0.5, 0.0, 0.0, 0.0], xtol=1e-13)
    return {"alpha": alpha, "de": de, "da": da, "dr": dr, "V": V, "throttle": share}
