"""Which effects act at a parameter vector, so that a compiled program can leave the others out."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import jax
import numpy as np

from sysid_node.sim.model.layout import ParameterLayout, Scalar
from sysid_node.sim.model.parameters import table

_Result = TypeVar("_Result")

#: Whether the effect of a name acts, as a traced boolean; None where it is not known.
EffectActs = Callable[[str], Scalar | None]


def effect_acts(layout: ParameterLayout, acting: Scalar | None, effect: str) -> Scalar | None:
    """Whether any switch of an effect is among the acting parameters (P,); None where these are not known."""
    if acting is None:
        return None
    return acting[np.array([i for i, (name, p) in enumerate(table(layout)) if name == effect and p.switch])].any()


def evaluate_if(condition: Scalar | None, function: Callable[[], _Result], otherwise: Callable[[], _Result]) -> _Result:
    """The value of ``function`` where the condition holds or is not known (None), else that of ``otherwise``."""
    result: _Result = function() if condition is None else jax.lax.cond(condition, function, otherwise)
    return result
