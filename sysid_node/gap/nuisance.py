"""What is always allowed for: the derivatives' errors within their tolerances, and biases.

Each is a parameter of the simulator's chain with a Gaussian prior about its neutral value. Derivatives are shared by
all flights; biases are each flight's own. Clocks are none: data that know a delay to a millisecond overrule any prior
that is meant for half a sample, and a lag would pass as one; a delay is a candidate, and must matter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid_node.aircraft.model import Aircraft
from sysid_node.errors import InputError
from sysid_node.flight.record import Array
from sysid_node.gap.view import View

#: Effects whose parameters are all linear nuisances; as a candidate, each is the same with a wider prior.
WIDENED = {"derivative_error": 5.0, "imu_bias": 10.0, "vane_bias": 10.0}

#: Noise of the aircraft file that a bias may be as large as.
_BIASES = {
    **{f"imu_bias.{n}": "accel" for n in ("ax", "ay", "az")},
    **{f"imu_bias.{n}": "gyro" for n in "pqr"},
    "vane_bias.alpha": "alpha",
    "vane_bias.beta": "beta",
}


@dataclass(frozen=True)
class Nuisances:
    """Indices into the parameter vector, 1-sigma of each, and which are shared by the flights."""

    indices: tuple[int, ...]
    sigma: Array
    shared: NDArray[np.bool_]

    def without(self, effects: frozenset[str], names: tuple[str, ...]) -> Nuisances:
        """Those that do not belong to these effects, unless only their prior widens."""
        gone = {e for e in effects if e not in WIDENED}
        keep = np.array([names[i].partition(".")[0] not in gone for i in self.indices], bool)
        wide = np.array([WIDENED.get(e, 1.0) if (e := names[i].partition(".")[0]) in effects else 1.0
                         for i in self.indices])  # fmt: skip
        indices = tuple(i for i, k in zip(self.indices, keep, strict=True) if k)
        return Nuisances(indices, (self.sigma * wide)[keep], self.shared[keep])


def nuisances_of(aircraft: Aircraft, view: View) -> Nuisances:
    """Of an aircraft's flights. Raises InputError where its file has no tolerances."""
    tolerances = {n: d.tolerance for n, d in aircraft.derivatives.items() if d.tolerance}
    if not tolerances:
        raise InputError(
            f"aircraft {aircraft.name!r}: no derivative has a tolerance, so what is a gap cannot be told from an "
            "honest error; give derivatives a tolerance (1 sigma) in the aircraft file"
        )
    lateral = view.flight.lateral
    sigma = {
        f"derivative_error.{n}": t for n, t in tolerances.items() if lateral or n.partition("_")[0] not in _LATERAL
    }
    sigma |= {n: aircraft.noise[s] for n, s in _BIASES.items() if lateral or n.rpartition(".")[2] not in _SIDEWAYS}
    names = view.simulator.names
    shared = np.array([name.startswith("derivative_error") for name in sigma])
    return Nuisances(tuple(names.index(n) for n in sigma), np.array(list(sigma.values())), shared)


_LATERAL = frozenset({"CY", "Cl", "Cn"})
_SIDEWAYS = frozenset({"ay", "p", "r", "beta"})
