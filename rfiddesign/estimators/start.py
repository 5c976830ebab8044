"""What an estimator is told of the robot's pose before the first step."""

from dataclasses import dataclass


@dataclass(frozen=True)
class KnownStart:
    """The robot starts at this pose: x [mm], y [mm], heading [rad]."""

    pose: tuple[float, float, float]


@dataclass(frozen=True)
class UnknownStart:
    """The robot is somewhere in this box, (low_x, low_y, high_x, high_y) [mm], with any heading."""

    bounds_mm: tuple[float, float, float, float]


Start = KnownStart | UnknownStart
