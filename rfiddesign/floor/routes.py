"""Random routes inside a floor: straight legs that the robot's centre can drive."""

import math
from threading import Lock

import numpy as np
import shapely

from rfiddesign.floor._ray_kernels import ray_distance
from rfiddesign.floor.plan import Floor

N_STARTS = 64  # drawn at a time
N_OBLIQUE = 4  # directions tried at a time
MAX_LEGS = 20_000
_ASKING = Lock()  # see prepared_copy
WALL_SHARE = 0.99  # of the free way at most: waypoints never touch a wall


def random_route(
    floor: Floor,
    rng: np.random.Generator,
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
    rng : source of all randomness.
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
    axes = _lattice_axes(lattice_angle)
    position = _random_start(floor, rng)
    backward = np.zeros(2)
    waypoints = [position]
    driven = 0.0
    while driven < length_mm:
        directions = axes[rng.permutation(4)] if is_aligned else _random_directions(rng)
        direction, room = _choose_direction(floor, position, directions, backward, min_leg_mm)
        leg = _draw_leg(rng, room, min_leg_mm, max_leg_mm)
        target = position + leg * direction
        if len(waypoints) > MAX_LEGS or np.array_equal(target, position):
            raise ValueError(f"length_mm is {length_mm:g}; the floor is too small for a route of that length")
        waypoints.append(target)
        driven += leg
        position, backward = target, -direction
    return np.array(waypoints)


def free_way(floor: Floor, position: np.ndarray, direction: np.ndarray) -> float:
    """Distance from a position inside `floor.navigable` along a unit vector to its boundary [mm].

    Infinite if the ray meets no edge, which means that the position is outside.
    """
    return ray_distance(floor.navigable_edges, position[0], position[1], direction[0], direction[1])


def _choose_direction(
    floor: Floor, position: np.ndarray, directions: np.ndarray, backward: np.ndarray, min_leg_mm: float
) -> tuple[np.ndarray, float]:
    """Take the first direction with enough room, else the roomiest; back along the last leg only if that beats all."""
    roomiest, most = backward, 0.0
    for direction in directions:
        if np.abs(direction - backward).max() < 1e-6:
            continue
        room = WALL_SHARE * free_way(floor, position, direction)
        if room >= min_leg_mm:
            return direction, room
        if room > most:
            roomiest, most = direction, room
    if backward.any():
        room = WALL_SHARE * free_way(floor, position, backward)
        if room > most:
            return backward, room
    return roomiest, most


def _draw_leg(rng: np.random.Generator, room: float, min_leg_mm: float, max_leg_mm: float) -> float:
    longest = min(room, max_leg_mm)
    return min_leg_mm + (longest - min_leg_mm) * rng.random() if longest > min_leg_mm else longest


def _lattice_axes(lattice_angle: float) -> np.ndarray:
    cos, sin = math.cos(lattice_angle), math.sin(lattice_angle)
    return np.array([[cos, sin], [-sin, cos], [-cos, -sin], [sin, -cos]])


def _random_directions(rng: np.random.Generator) -> np.ndarray:
    """Unit vectors in uniform directions, shape (N_OBLIQUE, 2).

    Drawn in the unit disc and scaled: square roots, unlike sines, come out the same on every machine.
    """
    directions = np.empty((0, 2))
    while len(directions) < N_OBLIQUE:
        points = 2.0 * rng.random((2 * N_OBLIQUE, 2)) - 1.0
        norm = np.sqrt(points[:, 0] ** 2 + points[:, 1] ** 2)
        is_kept = (norm > 0.1) & (norm <= 1.0)
        directions = np.concatenate([directions, points[is_kept] / norm[is_kept, None]])
    return directions[:N_OBLIQUE]


def _random_start(floor: Floor, rng: np.random.Generator) -> np.ndarray:
    """A uniform point inside `floor.navigable`; where it fills next to nothing of its box, some point inside."""
    x_low, y_low, x_high, y_high = floor.navigable.bounds
    low, extent = np.array([x_low, y_low]), np.array([x_high - x_low, y_high - y_low])
    for _ in range(100):
        points = low + extent * rng.random((N_STARTS, 2))
        with _ASKING:
            is_inside = shapely.contains_xy(floor.navigable_index, points)
        if is_inside.any():
            return points[is_inside.argmax()]
    return shapely.get_coordinates(floor.navigable.representative_point())[0]
