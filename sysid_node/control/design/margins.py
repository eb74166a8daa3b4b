"""Stability, gain margin and phase margin of closed loops with delay, for many aircraft at once.

Margins are the classical ones, of one loop at a time at its actuator while the others are closed (Stevens, Lewis &
Johnson (2016), sect. 4.2). Transfer functions follow from the resolvent by the algorithm of Faddeev and Leverrier
(Gantmacher, "The Theory of Matrices", vol. 1 (1959), ch. IV sect. 5), which also holds for defective matrices.
Stability follows from the eigenvalues, with the delay by Pade's second-order approximation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sysid_node.dynamics.linear_model import LinearModel

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

#: Frequencies, rad/s; crossings are interpolated between them.
OMEGA = np.geomspace(0.05, 150.0, 120)

_LEAST_DELAY = 1e-3  # s, in Pade's approximation


@dataclass(frozen=True)
class Margins:
    """(...,) for each aircraft: the least gain margin (a factor, up or down) and phase margin (rad) of all loops."""

    gain: Array
    phase: Array
    stable: NDArray[np.bool_]

    def enough(self, gain: float, phase: float) -> NDArray[np.bool_]:
        """(...,) whether the loops are stable with at least these margins."""
        good: NDArray[np.bool_] = self.stable & (self.gain >= gain) & (self.phase >= phase)
        return good


def margins(plant: LinearModel, K: Array, delay: float) -> Margins:
    """Margins of u = -K x (m, n) with plants A (..., n, n), B (..., n, m) and a ``delay`` (s) of every input."""
    loops = one_at_a_time(transfer(plant, K, OMEGA) * np.exp(-1j * OMEGA * delay)[:, None, None])
    gain, phase = crossings(loops)
    return Margins(gain.min(axis=-1), phase.min(axis=-1), stable(plant, K, delay))


def transfer(plant: LinearModel, K: Array, omega: Array) -> Complex:
    """(..., F, m, m) K (jw - A)^-1 B at frequencies (F,) rad/s."""
    terms, polynomial = _resolvent(plant.A)
    numerators = np.stack([K @ term @ plant.B for term in terms], axis=-3)  # (..., n, m, m) of s^(n-1) ... s^0
    powers = (1j * omega[:, None]) ** np.arange(len(terms), -1, -1)  # (F, n + 1)
    flat = numerators.reshape(*numerators.shape[:-2], -1)
    top = (powers[:, 1:] @ flat).reshape(*flat.shape[:-2], omega.size, *numerators.shape[-2:])
    bottom = np.stack(polynomial, axis=-1) @ powers.T
    return np.asarray(top / bottom[..., None, None])


def one_at_a_time(L: Complex) -> Complex:
    """(..., F, m) each loop of (..., F, m, m) at its input while the others are closed, m = 1 or 2."""
    diagonal = np.diagonal(L, axis1=-2, axis2=-1).copy()
    if L.shape[-1] == 2:
        coupling = L[..., 0, 1] * L[..., 1, 0]
        diagonal = diagonal - coupling[..., None] / (1.0 + diagonal[..., ::-1])
    return diagonal


def crossings(L: Complex) -> tuple[Array, Array]:
    """(..., m) gain margin (factor) and phase margin (rad) of loops (..., F, m) by frequency; inf where none cross."""
    a, b = L[..., :-1, :], L[..., 1:, :]
    gain, phase = np.full(a.shape, np.inf), np.full(a.shape, np.inf)
    # the negative real axis: gain margin, up or down
    here = (a.imag * b.imag <= 0.0) & ((a.real < 0.0) | (b.real < 0.0))
    gain[here] = _gain(a[here], b[here])
    # the unit circle: phase margin, lag or lead
    beyond = L.real**2 + L.imag**2 >= 1.0
    here = beyond[..., :-1, :] != beyond[..., 1:, :]
    phase[here] = _phase(a[here], b[here])
    return gain.min(axis=-2), phase.min(axis=-2)


def _gain(a: Complex, b: Complex) -> Array:
    """(N,) gain margins where loops cross the negative real axis on the way from a to b (N,); inf: the positive one."""
    share = np.clip(a.imag / np.where(a.imag == b.imag, 1.0, a.imag - b.imag), 0.0, 1.0)
    real = a.real + share * (b.real - a.real)
    return np.where(real < 0.0, np.exp(np.abs(np.log(np.maximum(-real, 1e-12)))), np.inf)


def _phase(a: Complex, b: Complex) -> Array:
    """(N,) phase margins where loops cross the unit circle on the way from a to b (N,), in the logarithm of size."""
    size_a, size_b = np.log(np.abs(a) + 1e-300), np.log(np.abs(b) + 1e-300)
    share = size_a / (size_a - size_b)
    turn = np.angle(b * np.conj(a))
    return np.asarray(np.abs(np.angle(-a * np.exp(1j * share * turn))))


def stable(plant: LinearModel, K: Array, delay: float) -> NDArray[np.bool_]:
    """(...,) whether the closed loop is stable."""
    closed = closed_loop(plant, K, delay)
    found: NDArray[np.bool_] = np.linalg.eigvals(closed).real.max(axis=-1) < 0.0
    return found


def closed_loop(plant: LinearModel, K: Array, delay: float) -> Array:
    """(..., n + 2m, n + 2m) of the states, and Pade's two of each delayed command c = -K x.

    exp(-s T) = 1 - 12 T s / (T^2 s^2 + 6 T s + 12): delayed = c - 12 z2 / T, with dz1/dt = z2 and
    dz2/dt = c - 6 z2 / T - 12 z1 / T^2.
    """
    *batch, n, m = plant.B.shape
    T, eye = max(delay, _LEAST_DELAY), np.eye(m)
    A = np.zeros((*batch, n + 2 * m, n + 2 * m))
    x, z1, z2 = slice(0, n), slice(n, n + m), slice(n + m, n + 2 * m)
    A[..., x, x], A[..., x, z2] = plant.A - plant.B @ K, -12.0 / T * plant.B
    A[..., z1, z2] = eye
    A[..., z2, x], A[..., z2, z1], A[..., z2, z2] = -K, -12.0 / T**2 * eye, -6.0 / T * eye
    return A


def _resolvent(A: Array) -> tuple[list[Array], list[Array]]:
    """(s - A)^-1 = (sum M_k s^(n-1-k)) / (sum c_k s^(n-k)): the M_k (..., n, n) and c_k (...,)."""
    n = A.shape[-1]
    eye = np.eye(n)
    terms, polynomial = [np.broadcast_to(eye, A.shape)], [np.ones(A.shape[:-2])]
    for k in range(1, n + 1):
        product = A @ terms[-1]
        c = -np.trace(product, axis1=-2, axis2=-1) / k
        polynomial.append(c)
        if k < n:
            terms.append(product + c[..., None, None] * eye)
    return terms, polynomial
