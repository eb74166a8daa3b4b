"""The response of the structural mode to the measured motion."""

from __future__ import annotations

import jax
import jax.numpy as jnp

from sysid_node.dynamics.vector import Vector
from sysid_node.sim.model.chain import Chain
from sysid_node.sim.model.layout import Scalar
from sysid_node.sim.stations import structure
from sysid_node.sim.stations.structure import Vibration


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
    rest = structure.start(chain.effects, load[0])
    _, mode = jax.lax.scan(advance, jnp.stack([rest.displacement, rest.speed]), loads)
    return mode


def body_rates(chain: Chain, mode: Scalar, rates: Vector) -> Vector:
    """The body's rates (N,), rad/s, without the pitch rate that the mode (N, 2) adds to the gyroscopes' readings.

    The mode must be the response to the force that follows from the rates as they were read. The vibration's own share
    of that force is small, and a mode that were driven by its own pitch rate could grow without bound.
    """
    _, pitch_rate = structure.felt(chain.effects, mode[:, 1], mode[:, 1])
    return rates._replace(y=rates.y - pitch_rate)


def _advance(chain: Chain, mode: Scalar, load0: Scalar, load1: Scalar) -> Scalar:
    """The mode (2,) one sample later under a force linear from ``load0`` to ``load1``."""
    now = structure.advance(chain.effects, Vibration(mode[0], mode[1], load0), load1, chain.step)
    return jnp.stack([now.displacement, now.speed])
