"""Conversion of axes: FLU and FRD body axes, ENU and NED world axes, quaternions and Euler angles.

ROS (REP-103) has body axes forward-left-up and world axes east-north-up. This package has body axes forward-right-down
and world axes north-east-down. Both conversions are half turns: FLU to FRD about x, ENU to NED about the line x = y.
"""

from __future__ import annotations

import math
from typing import Literal, get_args

import numpy as np

from sysid_node.flight.record import Array

BodyFrame = Literal["flu", "frd"]
BODY_FRAMES: tuple[BodyFrame, ...] = get_args(BodyFrame)


def turn_vectors(vectors: Array, frame: BodyFrame) -> Array:
    """Vectors (N, 3) converted between ``frame`` and FRD, in either direction: for FLU, y and z change sign."""
    signs = (1.0, 1.0, 1.0) if frame == "frd" else (1.0, -1.0, -1.0)
    turned: Array = vectors * np.array(signs)
    return turned


def euler_from_quaternion(quaternion: Array, frame: BodyFrame) -> Array:
    """Euler angles phi theta psi (N, 3) rad, 3-2-1, FRD against NED, of unit quaternions x y z w (N, 4).

    The quaternion rotates vectors from ``frame`` axes to world axes: ENU for FLU, NED for FRD. The angles are NaN where
    its length is not 1 (within 1 %), as that marks a missing attitude.
    """
    length = np.sqrt(np.sum(quaternion**2, axis=1))
    with np.errstate(invalid="ignore", divide="ignore"):
        x, y, z, w = np.where(np.abs(length - 1.0) < 0.01, quaternion.T / length, np.nan)
        phi = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
        theta = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
        psi = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    if frame == "flu":
        theta, psi = -theta, np.mod(math.pi / 2.0 - psi + math.pi, 2.0 * math.pi) - math.pi
    return np.column_stack([phi, theta, psi])


def tilt_from_quaternion(quaternion: tuple[float, float, float, float], frame: BodyFrame) -> tuple[float, float]:
    """Roll and pitch (rad) of ``euler_from_quaternion`` for one quaternion, without arrays, for use in flight."""
    length = math.hypot(*quaternion)
    if not abs(length - 1.0) < 0.01:
        return math.nan, math.nan
    x, y, z, w = (part / length for part in quaternion)
    phi = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    theta = math.asin(min(max(2.0 * (w * y - z * x), -1.0), 1.0))
    return phi, -theta if frame == "flu" else theta


def quaternion_from_euler(euler: Array, frame: BodyFrame) -> Array:
    """Quaternions x y z w (N, 4) of Euler angles phi theta psi (N, 3) rad; inverse of ``euler_from_quaternion``."""
    phi, theta, psi = euler.T / 2.0
    if frame == "flu":
        theta, psi = -theta, math.pi / 4.0 - psi
    cx, sx, cy, sy, cz, sz = np.cos(phi), np.sin(phi), np.cos(theta), np.sin(theta), np.cos(psi), np.sin(psi)
    return np.column_stack(
        [
            sx * cy * cz - cx * sy * sz,
            cx * sy * cz + sx * cy * sz,
            cx * cy * sz - sx * sy * cz,
            cx * cy * cz + sx * sy * sz,
        ]
    )
