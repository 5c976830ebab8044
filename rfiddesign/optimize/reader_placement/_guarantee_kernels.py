"""Whether antennas read in time from all phases of a lattice and all headings: boxes of poses, halved until sure."""

import math

import numpy as np

from rfiddesign.numerics._compile_kernels import kernel, leaf_kernel
from rfiddesign.optimize.reader_placement._first_read_kernels import TWO_PI, index_range

#: More boxes than halvings of one box ever leave waiting.
MAX_WAITING = 512


@kernel
def unserved_poses(basis, mounts, numbers, swept, n_wanted, sector, finest, max_boxes, max_found):
    """Halve the box of all phases and headings until each part is surely served, surely not, or too small.

    A pose that moves by `place` [mm] and turns by `turn` [rad] moves a tag at distance D from the robot, in the robot's
    frame, by at most place + turn D.  So an antenna whose swept area holds the tag with that much to spare from the
    middle of a box reads it from all of the box.

    Parameters
    ----------
    basis : (2, 2) vectors of the lattice [mm].
    mounts : (m, 2) antennas in the robot's frame [mm].
    numbers : (4,) course [rad], distance [mm], turn on the spot [rad] and reach [mm].
    swept : (q, 3) half-planes of what an antenna sweeps [mm]; none if it sees a disc.
    n_wanted : how many different antennas must read.
    sector : headings from 0 to this one are looked at [rad].
    finest : boxes over which a tag moves no more than this [mm] are not halved.
    max_boxes : boxes looked at.
    max_found : the search ends when it has found so many unserved poses.

    Returns
    -------
    found : (n, 3) poses from which reads do not come in time.
    shares : (2,) of all phases and headings: surely unserved; undecided.
    n_boxes : looked at.
    """
    waiting = np.empty((MAX_WAITING, 6))
    waiting[0] = 0.5, 0.5, sector / 2, 0.5, 0.5, sector / 2
    n_waiting, n_boxes = 1, 0
    found, n_found = np.empty((max_found, 3)), 0
    unserved, undecided = 0.0, 0.0
    lengths = math.hypot(basis[0, 0], basis[0, 1]), math.hypot(basis[1, 0], basis[1, 1])
    arm = 0.0
    for m in range(len(mounts)):
        arm = max(arm, math.hypot(mounts[m, 0], mounts[m, 1]))
    span = arm + numbers[1] + numbers[3]
    pose = np.empty(3)
    while n_waiting > 0:
        n_waiting -= 1
        box = waiting[n_waiting].copy()
        share = 8 * box[3] * box[4] * box[5] / sector
        if n_boxes >= max_boxes or n_found >= max_found:
            undecided += share
            continue
        n_boxes += 1
        pose[0] = box[0] * basis[0, 0] + box[1] * basis[1, 0]
        pose[1] = box[0] * basis[0, 1] + box[1] * basis[1, 1]
        pose[2] = box[2]
        slack = box[3] * lengths[0] + box[4] * lengths[1]
        n_surely, n_perhaps, n_reading = 0, 0, 0
        for m in range(len(mounts)):
            surely, perhaps, is_read = _clearance(pose, basis, mounts[m], numbers, swept, slack, box[5])
            n_surely += surely <= 0
            n_perhaps += perhaps <= 0
            n_reading += is_read
            if n_surely >= n_wanted:
                break
        if n_surely >= n_wanted:
            continue
        is_hopeless = n_perhaps < n_wanted
        is_smallest = slack + box[5] * span <= finest or n_waiting + 2 > MAX_WAITING
        if is_hopeless or (is_smallest and n_reading < n_wanted):
            found[n_found] = pose
            n_found += 1
        if is_hopeless:
            unserved += share
        elif is_smallest:
            undecided += share
        else:
            axis = 3
            if box[4] * lengths[1] > box[3] * lengths[0]:
                axis = 4
            if box[5] * span > box[axis] * lengths[axis - 3]:
                axis = 5
            half = box[axis] / 2
            for side in range(2):
                waiting[n_waiting] = box
                waiting[n_waiting, axis] = half
                waiting[n_waiting, axis - 3] += half if side == 0 else -half
                n_waiting += 1
    return found[:n_found], np.array([unserved, undecided]), n_boxes


@kernel
def _clearance(pose, basis, mount, numbers, swept, slack_place, slack_turn):
    """How surely an antenna reads from a box of poses about `pose`.

    Returns the distance [mm] by which tags lie outside of what it sweeps: from every pose at most the first one, from
    any pose at least the second; and whether it reads from the middle.
    """
    course, distance, turn, reach = numbers
    cos_h, sin_h = math.cos(pose[2]), math.sin(pose[2])
    arm, place = math.hypot(mount[0], mount[1]), math.atan2(mount[1], mount[0])
    if turn > 0:
        wide = arm + reach + slack_place
        first_i, last_i, first_j, last_j = index_range(basis, pose[0], pose[1], wide, wide, 1.0, 0.0)
    else:
        # A tag that comes into view from some pose is no farther from the middle than all that is swept, and the slack.
        wide = reach + slack_place + slack_turn * (arm + distance + reach + slack_place)
        way_x, way_y = math.cos(pose[2] + course), math.sin(pose[2] + course)
        x = pose[0] + cos_h * mount[0] - sin_h * mount[1] + way_x * distance / 2
        y = pose[1] + sin_h * mount[0] + cos_h * mount[1] + way_y * distance / 2
        first_i, last_i, first_j, last_j = index_range(basis, x, y, distance / 2 + wide, wide, way_x, way_y)
    surely, perhaps, is_read = math.inf, math.inf, False
    for i in range(first_i, last_i + 1):
        for j in range(first_j, last_j + 1):
            east = i * basis[0, 0] + j * basis[1, 0] - pose[0]
            north = i * basis[0, 1] + j * basis[1, 1] - pose[1]
            ahead, left = cos_h * east + sin_h * north, cos_h * north - sin_h * east
            if turn > 0:
                outside = _from_arc(ahead, left, arm, place, turn) - reach
            elif len(swept) == 0:
                outside = _from_way(ahead - mount[0], left - mount[1], course, distance) - reach
            else:
                outside = _from_planes(ahead - mount[0], left - mount[1], swept)
            slack = slack_place + slack_turn * math.hypot(ahead, left)
            surely, perhaps = min(surely, outside + slack), min(perhaps, outside - slack)
            is_read |= outside <= 0
    return surely, perhaps, is_read


@leaf_kernel
def _from_way(x, y, course, distance):
    """Distance of a point from the way of an antenna that drives straight on from the origin."""
    ahead, aside = math.cos(course) * x + math.sin(course) * y, math.cos(course) * y - math.sin(course) * x
    return math.hypot(ahead - min(max(ahead, 0.0), distance), aside)


@leaf_kernel
def _from_planes(x, y, planes):
    """How far a point lies outside of a convex shape: inside, negative and exact; outside, no more than the truth."""
    outside = -math.inf
    for p in range(len(planes)):
        outside = max(outside, planes[p, 0] * x + planes[p, 1] * y - planes[p, 2])
    return outside


@leaf_kernel
def _from_arc(x, y, arm, place, turn):
    """Distance of a point from the way of an antenna that turns to the left about the origin."""
    if (math.atan2(y, x) - place) % TWO_PI <= turn:
        return abs(math.hypot(x, y) - arm)
    start = math.hypot(x - arm * math.cos(place), y - arm * math.sin(place))
    return min(start, math.hypot(x - arm * math.cos(place + turn), y - arm * math.sin(place + turn)))
