"""The unknowns of an estimation as one vector: parameters, then initial states and biases of each manoeuvre."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid_node.batch.models.manoeuvre import ManoeuvreData
from sysid_node.batch.models.model import StateSpaceModel
from sysid_node.errors import InputError
from sysid_node.flight.record import Array

#: Indices of unknowns with a prior, its mean, its 1-sigma uncertainty.
Priors = tuple[NDArray[np.intp], Array, Array]


@dataclass(frozen=True)
class Unknowns:
    """Which quantities of a model are estimated, and where each stands in the vector of unknowns (n,).

    Layout: free parameters (in the model's order), then for each manoeuvre its free initial states and its output
    biases. A bias is added to the modelled output.
    """

    model: StateSpaceModel
    manoeuvres: tuple[ManoeuvreData, ...]
    free: tuple[int, ...]  # indices of the free parameters
    states: tuple[int, ...]  # indices of the free initial states
    biases: tuple[int, ...]  # indices of the biased outputs

    @classmethod
    def of(
        cls,
        model: StateSpaceModel,
        manoeuvres: Sequence[ManoeuvreData],
        initial_states: Sequence[str],
        biases: Sequence[str],
    ) -> Unknowns:
        """From names. Raises InputError on names that the model does not have, or with nothing to estimate."""
        free = tuple(i for i, parameter in enumerate(model.parameters) if not parameter.fixed)
        if not free:
            raise InputError(f"model {model.name}: every parameter is fixed; leave at least one to estimate")
        states = _indices(initial_states, model.states, f"model {model.name} has no state")
        return cls(model, tuple(manoeuvres), free, states, _indices(biases, model.outputs, "no output"))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the free parameters."""
        return tuple(self.model.names[i] for i in self.free)

    @property
    def size(self) -> int:
        """Length n of the vector."""
        return len(self.free) + len(self.manoeuvres) * self.nuisances_per_manoeuvre

    @property
    def nuisances_per_manoeuvre(self) -> int:
        """Number of unknowns that belong to one manoeuvre."""
        return len(self.states) + len(self.biases)

    def nuisances_of(self, index: int) -> slice:
        """The slice of the vector that holds the unknowns of manoeuvre ``index``."""
        first = len(self.free) + index * self.nuisances_per_manoeuvre
        return slice(first, first + self.nuisances_per_manoeuvre)

    def start(self) -> Array:
        """Start values (n,); biases start at zero."""
        nuisances = [np.r_[m.initial_state[list(self.states)], np.zeros(len(self.biases))] for m in self.manoeuvres]
        return np.concatenate([self.model.start[list(self.free)], *nuisances])

    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds (n,); initial states and biases have none."""
        lower, upper = np.full(self.size, -np.inf), np.full(self.size, np.inf)
        lower[: len(self.free)] = [self.model.parameters[i].lower for i in self.free]
        upper[: len(self.free)] = [self.model.parameters[i].upper for i in self.free]
        return lower, upper

    def priors(self) -> Priors:
        """Indices of the unknowns with a prior, their means and 1-sigma uncertainties."""
        priors = {k: self.model.parameters[i].prior for k, i in enumerate(self.free)}
        known = [(k, *prior) for k, prior in priors.items() if prior is not None]
        index, mean, sigma = np.array(known, dtype=float).reshape(-1, 3).T
        return index.astype(np.intp), mean, sigma

    def theta(self, z: Array) -> Array:
        """All parameters (P,) at the unknowns ``z``."""
        theta = self.model.start.copy()
        theta[list(self.free)] = z[: len(self.free)]
        return theta

    def initial_state(self, z: Array, index: int) -> Array:
        """Initial state (nx,) of a manoeuvre at the unknowns ``z``."""
        state = self.manoeuvres[index].initial_state.copy()
        state[list(self.states)] = z[self.nuisances_of(index)][: len(self.states)]
        return state

    def bias(self, z: Array, index: int) -> Array:
        """Output biases (ny,) of a manoeuvre at the unknowns ``z``."""
        bias = np.zeros(len(self.model.outputs))
        bias[list(self.biases)] = z[self.nuisances_of(index)][len(self.states) :]
        return bias

    def nuisance(self, z: Array) -> list[dict[str, float]]:
        """The unknowns of each manoeuvre by name: ``alpha(0)``, ``bias_az``."""
        names = [f"{self.model.states[i]}(0)" for i in self.states]
        names += [f"bias_{self.model.outputs[i]}" for i in self.biases]
        return [
            dict(zip(names, (float(v) for v in z[self.nuisances_of(i)]), strict=True))
            for i in range(len(self.manoeuvres))
        ]


def _indices(wanted: Sequence[str], known: Sequence[str], complaint: str) -> tuple[int, ...]:
    for name in wanted:
        if name not in known:
            raise InputError(f"{complaint} {name!r}; known: {', '.join(known)}")
    return tuple(known.index(name) for name in wanted)
