"""How far a robot moves until each of its antennas passes over a tag of a lattice."""

import math

import numpy as np

from rfiddesign.numerics._compile_kernels import inline_kernel, kernel, leaf_kernel

TWO_PI = 2 * math.pi


@kernel
def first_reads(poses, basis, mounts, course, distance, reach, planes):
    """Return what the robot drives straight on until each antenna reads first.

    Parameters
    ----------
    poses : (n, 3) places of the robot against the lattice [mm] and headings [rad].
    basis : (2, 2) vectors of the lattice [mm].
    mounts : (m, 2) antennas in the robot's frame [mm].
    course : direction of travel against the heading [rad].
    distance : looked at [mm].
    reach : of what an antenna sees [mm]: the radius of a disc, if there are no `planes`.
    planes : (p, 3) half-planes of the convex area that antennas see, in the robot's frame [mm].

    Returns
    -------
    distances : (n, m) float32 [mm]; infinite where no read comes.
    """
    distances = np.empty((len(poses), len(mounts)), np.float32)
    for row in range(len(poses)):
        heading = poses[row, 2]
        cos_h, sin_h = math.cos(heading), math.sin(heading)
        way_x, way_y = math.cos(heading + course), math.sin(heading + course)
        for m in range(len(mounts)):
            x = poses[row, 0] + cos_h * mounts[m, 0] - sin_h * mounts[m, 1]
            y = poses[row, 1] + sin_h * mounts[m, 0] + cos_h * mounts[m, 1]
            half = distance / 2
            first_i, last_i, first_j, last_j = index_range(
                basis, x + half * way_x, y + half * way_y, half + reach, reach, way_x, way_y
            )
            nearest = math.inf
            for i in range(first_i, last_i + 1):
                for j in range(first_j, last_j + 1):
                    east = i * basis[0, 0] + j * basis[1, 0] - x
                    north = i * basis[0, 1] + j * basis[1, 1] - y
                    if len(planes) == 0:
                        low, high = _disc_chord(way_x * east + way_y * north, way_x * north - way_y * east, reach)
                    else:
                        ahead, left = cos_h * east + sin_h * north, cos_h * north - sin_h * east
                        low, high = _chord(ahead, left, course, planes)
                    if high >= max(low, 0.0) and low <= distance:
                        nearest = min(nearest, max(low, 0.0))
            distances[row, m] = nearest
    return distances


@kernel
def first_reads_turning(poses, basis, mounts, turn, radius):
    """Return what the robot turns to the left on the spot until each antenna reads first [rad], as `first_reads`."""
    angles = np.empty((len(poses), len(mounts)), np.float32)
    for row in range(len(poses)):
        for m in range(len(mounts)):
            arm, place = math.hypot(mounts[m, 0], mounts[m, 1]), math.atan2(mounts[m, 1], mounts[m, 0])
            wide = arm + radius
            first_i, last_i, first_j, last_j = index_range(basis, poses[row, 0], poses[row, 1], wide, wide, 1.0, 0.0)
            nearest = math.inf
            for i in range(first_i, last_i + 1):
                for j in range(first_j, last_j + 1):
                    east = i * basis[0, 0] + j * basis[1, 0] - poses[row, 0]
                    north = i * basis[0, 1] + j * basis[1, 1] - poses[row, 1]
                    to_left = math.atan2(north, east) - poses[row, 2] - place
                    angle = _turn_to(math.hypot(east, north), to_left % TWO_PI, arm, radius)
                    if angle <= turn:
                        nearest = min(nearest, angle)
            angles[row, m] = nearest
    return angles


@inline_kernel
def index_range(basis, x, y, half_along, half_across, way_x, way_y):
    """Lowest and highest lattice indices i and j in a box about x, y, its first axis along (way_x, way_y)."""
    cell = basis[0, 0] * basis[1, 1] - basis[0, 1] * basis[1, 0]
    i = (x * basis[1, 1] - y * basis[1, 0]) / cell
    j = (y * basis[0, 0] - x * basis[0, 1]) / cell
    half_i = half_along * abs(way_x * basis[1, 1] - way_y * basis[1, 0])
    half_i = (half_i + half_across * abs(way_y * basis[1, 1] + way_x * basis[1, 0])) / abs(cell) + 1e-9
    half_j = half_along * abs(way_y * basis[0, 0] - way_x * basis[0, 1])
    half_j = (half_j + half_across * abs(way_x * basis[0, 0] + way_y * basis[0, 1])) / abs(cell) + 1e-9
    return math.ceil(i - half_i), math.floor(i + half_i), math.ceil(j - half_j), math.floor(j + half_j)


@leaf_kernel
def _disc_chord(ahead, aside, radius):
    """First and last distance at which a disc, driving on, holds a tag that lies so far ahead and aside."""
    squared = radius * radius - aside * aside
    if squared < 0:
        return math.inf, -math.inf
    half = math.sqrt(squared)
    return ahead - half, ahead + half


@leaf_kernel
def _chord(ahead, left, course, planes):
    """First and last distance at which a convex area, driving along `course`, holds the tag at ahead, left."""
    way_x, way_y = math.cos(course), math.sin(course)
    low, high = -math.inf, math.inf
    for p in range(len(planes)):
        room = planes[p, 2] - planes[p, 0] * ahead - planes[p, 1] * left
        # After a distance s there is room + s * opening.
        opening = planes[p, 0] * way_x + planes[p, 1] * way_y
        if opening > 1e-12:
            low = max(low, -room / opening)
        elif opening < -1e-12:
            high = min(high, -room / opening)
        elif room < 0:
            return math.inf, -math.inf
    return low, high


@leaf_kernel
def _turn_to(far, to_left, arm, radius):
    """Angle to turn to the left until a disc on an arm holds a tag so far from the centre and so much to its left."""
    if abs(far - arm) > radius:
        return math.inf
    half = math.pi
    if arm + far > radius:
        half = math.acos(min(max((far * far + arm * arm - radius * radius) / (2 * far * arm), -1.0), 1.0))
    if to_left <= half or to_left >= TWO_PI - half:
        return 0.0
    return to_left - half
