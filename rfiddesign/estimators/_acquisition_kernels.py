"""Where am I at all: the pose from the first two tags and the way between them (rssi_kalman_navifloor, eq. 13)."""

import math

from rfiddesign.numerics._compile_kernels import leaf_kernel
from rfiddesign.numerics._math_kernels import atan2_64, sin_cos_64

# The numbers of a search: its stage (0: no tag yet, 1: one tag, 2: the pose is known); the pose in a local map that
# begins where the robot does; the first tag on the map, the place in the local map of the antenna that read it, and
# that antenna's number.
STAGE, LOCAL_X, LOCAL_Y, LOCAL_HEADING, TAG_X, TAG_Y, PLACE_X, PLACE_Y, ANTENNA = range(9)
N_SEARCH = 9
# Moments of a place on the entry border of a disc, in radii: the chord is driven along, its offset is uniform.
ENTRY_MEAN = math.pi / 4
_ENTRY_ALONG = math.sqrt(2 / 3 - ENTRY_MEAN**2)
_ENTRY_ACROSS = math.sqrt(1 / 3)
# Of a place anywhere in a disc.
_WITHIN = 0.5
# Two tags whose distance differs from the way between them by more than this share, and a diameter, contradict it.
_WAY_ERROR = 0.2
# Two tags tell the heading if that leaves it this uncertain at most [rad].
_MOST_UNCERTAIN = 0.7


@leaf_kernel
def restart(search):
    """Forget all: no tag yet, and the local map begins here."""
    for k in range(N_SEARCH):
        search[k] = 0.0


@leaf_kernel
def advance(search, odometry, row):
    """Move in the local map by an odometry increment in the robot's frame."""
    s, c = sin_cos_64(search[LOCAL_HEADING])
    search[LOCAL_X] += c * odometry[row, 0] - s * odometry[row, 1]
    search[LOCAL_Y] += s * odometry[row, 0] + c * odometry[row, 1]
    search[LOCAL_HEADING] += odometry[row, 2]


@leaf_kernel
def find_pose(search, antenna, x, y, tag_x, tag_y, radius, pose, covariance):
    """Take a read into account; True once it is of a second tag, and then pose (3,) and covariance (3, 3) are written.

    The heading is eq. 13.  If the same antenna read both tags it stands on the entry border of the second, else it is
    anywhere within.  Where it stands across the line of the tags is as unknown at the first tag as at the second: it
    shifts the position and turns the heading, which correlates them.

    Parameters
    ----------
    search : (N_SEARCH,) numbers of the search.
    antenna, x, y : number of the antenna, and its place on the robot when it polled.
    tag_x, tag_y : the tag on the map.
    radius : radius of the antenna's detection area, or of the disc with its spread.
    """
    s, c = sin_cos_64(search[LOCAL_HEADING])
    place_x = search[LOCAL_X] + c * x - s * y
    place_y = search[LOCAL_Y] + s * x + c * y
    is_second = search[STAGE] == 1.0 and (search[TAG_X] != tag_x or search[TAG_Y] != tag_y)
    dx, dy = tag_x - search[TAG_X], tag_y - search[TAG_Y]
    way_x, way_y = place_x - search[PLACE_X], place_y - search[PLACE_Y]
    base, way = math.sqrt(dx * dx + dy * dy), math.sqrt(way_x * way_x + way_y * way_y)
    mean, sigma_along, sigma_across = 0.0, _WITHIN * radius, _WITHIN * radius
    if search[ANTENNA] == antenna:
        mean, sigma_along, sigma_across = ENTRY_MEAN * radius, _ENTRY_ALONG * radius, _ENTRY_ACROSS * radius
    # Tags that one antenna sees together, or soon after each other, tell no direction.
    is_second = is_second and math.sqrt(2.0) * sigma_across <= _MOST_UNCERTAIN * min(base, 2.0 * way)
    is_believed = is_second and abs(base - way) <= 2.0 * radius + _WAY_ERROR * way
    if search[STAGE] == 0.0 or (is_second and not is_believed):
        search[STAGE] = 1.0
        search[TAG_X], search[TAG_Y], search[PLACE_X], search[PLACE_Y] = tag_x, tag_y, place_x, place_y
        search[ANTENNA] = antenna
    if not is_believed:
        return False
    heading = search[LOCAL_HEADING] + atan2_64(dy, dx) - atan2_64(way_y, way_x)
    along_x, along_y = dx / base, dy / base
    across_x, across_y = -along_y, along_x
    s, c = sin_cos_64(heading)
    pose[0] = tag_x - mean * along_x - (c * x - s * y)
    pose[1] = tag_y - mean * along_y - (s * x + c * y)
    pose[2] = heading
    # How the pose moves with the heading alone, then with the offsets: along the line, across it at either tag.
    lever_x, lever_y = s * x + c * y, s * y - c * x
    # Where the way is shorter than the line an offset turns it the more.
    turn = 1.0 / min(base, way)
    columns = (
        (sigma_along * along_x, sigma_along * along_y, 0.0),
        (sigma_across * (across_x + turn * lever_x), sigma_across * (across_y + turn * lever_y), sigma_across * turn),
        (-sigma_across * turn * lever_x, -sigma_across * turn * lever_y, -sigma_across * turn),
    )
    for i in range(3):
        for j in range(3):
            covariance[i, j] = 0.0
    for column in columns:
        for i in range(3):
            for j in range(3):
                covariance[i, j] += column[i] * column[j]
    search[STAGE] = 2.0
    return True
