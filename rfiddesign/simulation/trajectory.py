"""From a route on the floor to the poses of a robot that drives it."""

import math

import numpy as np

from rfiddesign.models._math_kernels import atan2_64

HEADINGS = ("along", "constant")


def drive(
    waypoints: np.ndarray, speed_mm_per_s: float, constant_heading: float | None, turn_rate: float, times_s: np.ndarray
) -> np.ndarray:
    """Poses of a robot that follows a polyline at constant speed and stays at its end.

    Parameters
    ----------
    waypoints : (k, 2) corners of the route [mm].
    speed_mm_per_s : speed between the corners [mm/s].
    constant_heading : heading held all the way [rad]; None: the robot faces where it drives and turns in place at
        corners.
    turn_rate : speed of these turns [rad/s].
    times_s : (n,) instants asked for [s].

    Returns
    -------
    (n, 3) x [mm], y [mm], heading [rad, unwrapped].
    """
    legs = np.diff(waypoints, axis=0)
    lengths = np.hypot(legs[:, 0], legs[:, 1])
    is_leg = lengths > 0
    legs, lengths = legs[is_leg], lengths[is_leg]
    corners = np.concatenate([waypoints[:1], waypoints[:1] + np.cumsum(legs, axis=0)])
    if constant_heading is not None:
        instants = np.concatenate([[0.0], np.cumsum(lengths / speed_mm_per_s)])
        headings = np.full(len(instants), constant_heading)
        knots = np.column_stack([corners, headings])
    else:
        # Unwrapping makes every turn the short way round.
        headings = np.unwrap([atan2_64(float(y), float(x)) for x, y in legs])
        turns = np.concatenate([[0.0], np.abs(np.diff(headings)) / turn_rate])
        durations = np.column_stack([turns, lengths / speed_mm_per_s]).ravel()
        instants = np.concatenate([[0.0], np.cumsum(durations)])
        knots = np.empty((2 * len(legs) + 1, 3))
        knots[0] = (*corners[0], headings[0])
        knots[1::2] = np.column_stack([corners[:-1], headings])
        knots[2::2] = np.column_stack([corners[1:], headings])
    return np.column_stack([np.interp(times_s, instants, knots[:, axis]) for axis in range(3)])


def route_length_mm(speed_mm_per_s: float, duration_s: float) -> float:
    """Length of a route that lasts at least `duration_s` [mm]; turns in place only make it last longer."""
    return math.nextafter(speed_mm_per_s * duration_s, math.inf)
