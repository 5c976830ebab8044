"""What an estimator is told of the robot's pose before the first step."""

import math
from dataclasses import dataclass

import numpy as np

from rfiddesign import require
from rfiddesign.floor.plan import MAX_EXTENT_MM

_MAX_HEADING = 1e5


@dataclass(frozen=True)
class KnownStart:
    """The robot starts at this pose: x [mm], y [mm], heading [rad]."""

    pose: tuple[float, float, float]

    def __post_init__(self) -> None:
        for name, value, most in zip(
            ("x", "y", "heading"), self.pose, (MAX_EXTENT_MM, MAX_EXTENT_MM, _MAX_HEADING), strict=True
        ):
            require.within(f"start pose, {name}", value, low=-most, high=most)


@dataclass(frozen=True)
class UncertainStart:
    """The robot starts about this pose: x [mm], y [mm], heading [rad], and the covariance (3, 3) of its error."""

    pose: tuple[float, float, float]
    covariance: tuple[tuple[float, float, float], ...]

    def __post_init__(self) -> None:
        KnownStart(self.pose)
        covariance = np.asarray(self.covariance, float)
        if covariance.shape != (3, 3) or not np.isfinite(covariance).all():
            raise ValueError(f"start covariance has shape {covariance.shape}, must be (3, 3) finite numbers")
        if np.abs(covariance - covariance.T).max() > 1e-9 * np.abs(covariance).max():
            raise ValueError("start covariance must be symmetric")
        if np.linalg.eigvalsh(covariance).min() < -1e-9 * np.abs(covariance).max():
            raise ValueError("start covariance has a negative variance")


@dataclass(frozen=True)
class UnknownStart:
    """The robot is somewhere in this box, (low_x, low_y, high_x, high_y) [mm], with any heading."""

    bounds_mm: tuple[float, float, float, float]

    def __post_init__(self) -> None:
        low_x, low_y, high_x, high_y = self.bounds_mm
        for axis, low, high in (("x", low_x, high_x), ("y", low_y, high_y)):
            require.within(f"start bounds, low {axis}", low, low=-MAX_EXTENT_MM, high=MAX_EXTENT_MM)
            require.within(f"start bounds, high {axis}", high, low=low, high=MAX_EXTENT_MM)


Start = KnownStart | UncertainStart | UnknownStart


def moments_of_start(start: Start) -> tuple[np.ndarray, np.ndarray]:
    """Mean pose (3,) and covariance (3, 3) of what a start tells; of uniform distributions over a box and the turn."""
    if isinstance(start, KnownStart):
        return np.array(start.pose, float), np.zeros((3, 3))
    if isinstance(start, UncertainStart):
        return np.array(start.pose, float), np.array(start.covariance, float)
    low_x, low_y, high_x, high_y = (float(bound) for bound in start.bounds_mm)
    variances = ((high_x - low_x) ** 2 / 12, (high_y - low_y) ** 2 / 12, math.pi**2 / 3)
    return np.array([(low_x + high_x) / 2, (low_y + high_y) / 2, 0.0]), np.diag(variances)
