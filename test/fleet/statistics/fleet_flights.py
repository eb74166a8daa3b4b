"""Flights of a small fleet with known truth, for the tests of the fleet's statistics."""

import datetime

import numpy as np

from sysid_node.fleet.results import FlightResult

START = datetime.datetime(2026, 1, 1, tzinfo=datetime.UTC)


def flight(tail, day, values, statistical, systematic=0.0, *, names=("Cl_da", "Cl_p"), gap=None, aircraft="cdrw"):
    """A flight on a day with estimates (n,) whose statistical and systematic errors are the same for all."""
    values = np.atleast_1d(np.asarray(values, dtype=float))
    names = names[: values.size]
    S = statistical**2 * np.eye(values.size)
    return FlightResult(
        f"{tail}/{day:g}",
        aircraft,
        tail,
        "",
        START + datetime.timedelta(days=float(day)),
        60.0,
        tuple(names),
        values,
        S + systematic**2 * np.eye(values.size),
        S,
        np.ones(values.size, dtype=bool),
        gap,
        f"flights/{tail}-{day:g}/report.html",
    )


def fleet(seed=0, tails=8, flights=8, *, worn=None, wear=0.0):
    """Tails about 0.2 and -0.5; the ``worn`` tail's first derivative changes by ``wear`` in its second half."""
    generator = np.random.default_rng(seed)
    found = []
    for j in range(tails):
        centre = np.array([0.2, -0.5]) + [0.01, 0.02] * generator.standard_normal(2)
        for i in range(flights):
            value = centre + 0.005 * generator.standard_normal(2)
            if f"t{j}" == worn and i >= flights // 2:
                value[0] += wear
            found.append(flight(f"t{j}", 20 * i, value, 0.004, 0.003))
    return found
