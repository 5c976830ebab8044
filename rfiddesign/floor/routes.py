"""Random routes inside a floor: straight legs that the robot's centre can drive."""

import math

import numpy as np

from rfiddesign.floor import _route_kernels as kernels
from rfiddesign.floor.plan import Floor

USUAL_LEGS, MAX_LEGS = 200, 20_000


def random_route(
    floor: Floor,
    key: int,
    length_mm: float,
    *,
    is_aligned: bool,
    lattice_angle: float = 0.0,
    min_leg_mm: float = 1000.0,
    max_leg_mm: float = 8000.0,
) -> np.ndarray:
    """Draw a polyline inside `floor.navigable`, from a start that is uniform over it.

    Each leg takes a random direction in which at least `min_leg_mm` are free and a random length up to what is free or
    `max_leg_mm`. Where no direction has so much room, it takes the one with most. The robot turns back only if there is
    no other way.

    Parameters
    ----------
    floor : the floor to drive on.
    key : 64-bit key of the stream that all is drawn from.
    length_mm : least length of the whole route.
    is_aligned : legs along the tag lattice's axes (multiples of 90 degrees from `lattice_angle`), else in any
        direction.
    lattice_angle : direction of the lattice's first axis [rad].
    min_leg_mm, max_leg_mm : least and greatest length of a leg, room permitting.

    Returns
    -------
    Waypoints [mm], shape (n_legs + 1, 2). The last leg is driven to its end, beyond `length_mm`.

    Raises
    ------
    ValueError
        If a length is not positive, the angle not finite, or the floor so small that the route needs more than 20,000
        legs.
    """
    for argument, value in (("length_mm", length_mm), ("min_leg_mm", min_leg_mm)):
        if not 0.0 < value < math.inf:
            raise ValueError(f"{argument} is {value:g}; allowed is more than 0")
    if not min_leg_mm <= max_leg_mm < math.inf:
        raise ValueError(f"max_leg_mm is {max_leg_mm:g}; allowed is at least min_leg_mm, {min_leg_mm:g}")
    if not math.isfinite(lattice_angle):
        raise ValueError(f"lattice_angle is {lattice_angle:g}; allowed is a finite angle")
    for n_legs in (USUAL_LEGS, MAX_LEGS):
        waypoints = np.empty((n_legs + 1, 2))
        n_waypoints = kernels.random_route(
            np.uint64(key), floor.navigable_edges, floor.navigable_bounds, floor.refuge_mm, float(length_mm),
            is_aligned, (math.cos(lattice_angle), math.sin(lattice_angle)), (float(min_leg_mm), float(max_leg_mm)),
            waypoints,
        )  # fmt: skip
        if n_waypoints > 0:
            return waypoints[:n_waypoints]
    raise ValueError(f"length_mm is {length_mm:g}; the floor is too small for a route of that length")
