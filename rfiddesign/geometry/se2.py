"""Poses and transforms of the plane, SE(2).

A pose is the last axis (x [mm], y [mm], theta [rad]) of an array (..., 3); a point is the last axis (x, y) of an
array (..., 2). Leading axes broadcast.
"""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray


def compose(a: ArrayLike, b: ArrayLike) -> NDArray[np.float64]:
    """Return pose `b`, given in the frame of pose `a`, in the frame of `a` itself: a b; theta in [-pi, pi)."""
    a, b = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    return _pose(transform_points(a, b[..., :2]), a[..., 2] + b[..., 2])


def inverse(a: ArrayLike) -> NDArray[np.float64]:
    """Return the pose that undoes `a`: compose(a, inverse(a)) = 0."""
    a = np.asarray(a, dtype=np.float64)
    return _pose(to_local(a, np.zeros(2)), -a[..., 2])


def between(a: ArrayLike, b: ArrayLike) -> NDArray[np.float64]:
    """Return pose `b` as seen from pose `a`, a^-1 b: the increment that leads from `a` to `b`."""
    a, b = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    return _pose(to_local(a, b[..., :2]), b[..., 2] - a[..., 2])


def transform_points(pose: ArrayLike, points: ArrayLike) -> NDArray[np.float64]:
    """Return `points` (..., 2) of the frame at `pose` (..., 3) (say, the robot's) in the world's frame."""
    pose, points = np.asarray(pose, dtype=np.float64), np.asarray(points, dtype=np.float64)
    return _rotate(points, pose[..., 2]) + pose[..., :2]


def to_local(pose: ArrayLike, points: ArrayLike) -> NDArray[np.float64]:
    """Return `points` (..., 2) of the world's frame in the frame at `pose` (..., 3): undoes `transform_points`."""
    pose, points = np.asarray(pose, dtype=np.float64), np.asarray(points, dtype=np.float64)
    return _rotate(points - pose[..., :2], -pose[..., 2])


def wrap_angle(theta: ArrayLike) -> NDArray[np.float64]:
    """Return angles [rad] of any size in [-pi, pi); those already there stay as they are, to the last bit."""
    theta = np.asarray(theta, dtype=np.float64)
    wrapped = theta - 2 * math.pi * np.floor((theta + math.pi) / (2 * math.pi))
    # Rounding may leave an angle on the far side of either end.
    wrapped = np.where((wrapped >= math.pi) | (wrapped < -math.pi), -math.pi, wrapped)
    return np.where((theta >= -math.pi) & (theta < math.pi), theta, wrapped)


def _rotate(points: NDArray, angle: NDArray) -> NDArray[np.float64]:
    x, y = points[..., 0], points[..., 1]
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=-1)


def _pose(position: NDArray, theta: NDArray) -> NDArray[np.float64]:
    wrapped = np.broadcast_to(wrap_angle(theta), position.shape[:-1])
    return np.concatenate([position, wrapped[..., None]], axis=-1)
