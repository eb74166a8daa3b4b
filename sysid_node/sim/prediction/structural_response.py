"""The response of the structural mode to the measured motion."""

from __future__ import annotations

import jax
import jax.numpy as jnp

from sysid_node.dynamics.vector import Vector
from sysid_node.sim.model.chain import Chain
from sysid_node.sim.model.layout import Scalar
from sysid_node.sim.stations import structure


def mode_response(chain: Chain, load: Scalar) -> Scalar:
    """Displacement (m) and speed (m/s) of the mode (N, 2) under a specific force (N,) along z, m/s^2.

    The mode is at rest under the first sample's force. One step is linear in the mode and in the force, so that its
    four columns are computed once and the scan only adds their multiples.
    """

    unit = jnp.eye(4)
    columns = jax.vmap(lambda mode, load0, load1: _advance(chain, mode, load0, load1))(
        unit[:, :2], unit[:, 2], unit[:, 3]
    )

    def advance(mode: Scalar, loads: Scalar) -> tuple[Scalar, Scalar]:
        now = (jnp.concatenate([mode, loads])[:, None] * columns).sum(axis=0)
        return now, now

    loads = jnp.stack([jnp.concatenate([load[:1], load[:-1]]), load], 1)
    _, mode = jax.lax.scan(advance, jnp.stack(structure.start(chain.effects, load[0])), loads)
    return mode


def body_rates(chain: Chain, mode: Scalar, rates: Vector) -> Vector:
    """The body's rates (N,), rad/s, without the pitch rate that the mode (N, 2) adds to the gyroscopes' readings.

    The mode must be the response to the force that follows from the rates as they were read. The vibration's own share
    of that force is small, and a mode that were driven by its own pitch rate could grow without bound.
    """
    _, pitch_rate = structure.felt(chain.effects, mode[:, 1], mode[:, 1])
    return rates._replace(y=rates.y - pitch_rate)


def _advance(chain: Chain, mode: Scalar, load0: Scalar, load1: Scalar) -> Scalar:
    """The mode (2,) one sample later under a force linear from ``load0`` to ``load1``, by Runge-Kutta as in a rollout.

    A sample takes two steps: with one step at the diagnosis' rate the fastest mode within the bounds would be unstable.
    """

    def rate(y: Scalar, load: Scalar) -> Scalar:
        return jnp.stack(structure.rate(chain.effects, y[0], y[1], load))

    h, loads = 0.5 * chain.step, [load0 + share * (load1 - load0) for share in (0.0, 0.25, 0.5, 0.75, 1.0)]
    for before, middle, after in (loads[:3], loads[2:]):
        k1 = rate(mode, before)
        k2 = rate(mode + 0.5 * h * k1, middle)
        k3 = rate(mode + 0.5 * h * k2, middle)
        k4 = rate(mode + h * k3, after)
        mode = mode + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return mode
