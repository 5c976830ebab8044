"""From a route on the floor to the poses of a robot that drives it."""

import math

import numpy as np

from rfiddesign import require
from rfiddesign.simulation import _trajectory_kernels as kernels

HEADINGS = ("along", "constant")


def check_manner(speeds_mm_per_s: tuple[float, ...], headings: tuple[str, ...], turn_rate_rad_per_s: float) -> None:
    """Raise ValueError unless there are speeds and manners of heading to draw from, and turns in place end."""
    if not speeds_mm_per_s:
        raise ValueError("speeds_mm_per_s is empty, must hold at least one speed")
    for speed in speeds_mm_per_s:
        require.within("speeds_mm_per_s", speed, low=0.0, high=10_000.0, is_low_open=True)
    if not headings or any(heading not in HEADINGS for heading in headings):
        raise ValueError(f"headings are {list(headings)}, must be one or more of {', '.join(HEADINGS)}")
    require.within("turn_rate_rad_per_s", turn_rate_rad_per_s, low=1e-3, high=100.0)


def drive(
    waypoints: np.ndarray, speed_mm_per_s: float, constant_heading: float | None, turn_rate: float, dt_s: float,
    n_steps: int,
) -> np.ndarray:  # fmt: skip
    """Poses of a robot that follows a polyline at constant speed and stays at its end.

    Parameters
    ----------
    waypoints : (k, 2) corners of the route [mm].
    speed_mm_per_s : speed between the corners [mm/s].
    constant_heading : heading held all the way [rad]; None: the robot faces where it drives and turns in place at
        corners, the short way round.
    turn_rate : speed of these turns [rad/s].
    dt_s, n_steps : duration [s] and number of the steps between the poses.

    Returns
    -------
    (n_steps + 1, 3) x [mm], y [mm], heading [rad, unwrapped].
    """
    poses = np.empty((n_steps + 1, 3))
    held = math.nan if constant_heading is None else float(constant_heading)
    kernels.drive(np.asarray(waypoints, float), float(speed_mm_per_s), held, float(turn_rate), float(dt_s), poses)
    return poses


def route_length_mm(speed_mm_per_s: float, duration_s: float) -> float:
    """Length of a route that lasts at least `duration_s` [mm]; turns in place only make it last longer."""
    return math.nextafter(speed_mm_per_s * duration_s, math.inf)
