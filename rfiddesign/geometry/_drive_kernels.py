"""Gaps between reads along straight lanes."""

import math

import numpy as np

from rfiddesign.numerics._compile_kernels import kernel


@kernel
def lane_gaps(starts, window, look_ahead, antennas, radius, edges, tag_u, tag_v):
    """Return what a robot drives before its next read, for starts spread evenly over the first `window` of each lane.

    Everything is in a frame whose u axis is the direction of travel.

    Parameters
    ----------
    starts : (n_lanes, 2) where the lanes begin, u and v [mm].
    window, look_ahead : lanes are followed for both together [mm].
    antennas : (n, 2) offsets from the robot's centre [mm].
    radius : of the discs that the antennas see [mm]; 0 if `edges` count.
    edges : (n, m, 4) outline of what each antenna sees, as turned as the antenna is [mm].
    tag_u, tag_v : (n_tags,) tags [mm], sorted by v; they must reach as far as any antenna sees from any lane.

    Returns
    -------
    gaps : (n_gaps, 2) shortest and longest distance [mm] of the starts in a gap, which lie evenly between; where no
        read comes within the `look_ahead`, -1 and the length over which such starts lie.
    """
    reach = radius
    for edge in edges.reshape(-1, 4):
        reach = max(reach, math.hypot(edge[0], edge[1]))
    ends = np.empty((2, 256))
    crossings = np.empty(max(edges.shape[1], 2))
    gaps, n_gaps = np.empty((4 * len(starts) + 16, 2)), 0
    stop = window + look_ahead
    for lane in range(len(starts)):
        n = 0
        for i in range(len(antennas)):
            u, v = starts[lane, 0] + antennas[i, 0], starts[lane, 1] + antennas[i, 1]
            for tag in range(np.searchsorted(tag_v, v - reach), np.searchsorted(tag_v, v + reach)):
                ahead = tag_u[tag] - u
                if ahead < -reach or ahead > stop + reach:
                    continue
                n_crossings = _chord(tag_v[tag] - v, radius, edges, i, crossings)
                if n + n_crossings > ends.shape[1]:
                    larger = np.empty((2, 2 * ends.shape[1] + n_crossings))
                    larger[:, :n] = ends[:, :n]
                    ends = larger
                for pair in range(0, n_crossings - 1, 2):
                    ends[0, n], ends[1, n] = ahead - crossings[pair + 1], ahead - crossings[pair]
                    n += 1
        if n_gaps + n + 1 > len(gaps):
            more = np.empty((2 * len(gaps) + n + 1, 2))
            more[:n_gaps] = gaps[:n_gaps]
            gaps = more
        ends[0, :n].sort()
        ends[1, :n].sort()
        # As many reads begin before a gap as end before it: the k-th to begin follows the (k - 1)-th to end.
        for k in range(n + 1):
            begin = max(ends[1, k - 1], 0.0) if k > 0 else 0.0
            end = ends[0, k] if k < n else math.inf
            last = min(end, window)
            if last <= begin:
                continue
            if end >= stop:
                gaps[n_gaps] = -1.0, last - begin
            else:
                gaps[n_gaps] = end - last, end - begin
            n_gaps += 1
    return gaps[:n_gaps]


@kernel
def _chord(v, radius, edges, i, crossings):
    """Write, sorted, where a line along u at height v over the antenna crosses the border of what it sees."""
    if radius > 0:
        half = math.sqrt(max(radius * radius - v * v, 0.0))
        crossings[0], crossings[1] = -half, half
        return 2
    n = 0
    for e in range(edges.shape[1]):
        v0, v1 = edges[i, e, 1], edges[i, e, 3]
        if (v0 <= v) != (v1 <= v):
            u = edges[i, e, 0] + (edges[i, e, 2] - edges[i, e, 0]) * (v - v0) / (v1 - v0)
            place = n
            while place > 0 and crossings[place - 1] > u:
                crossings[place] = crossings[place - 1]
                place -= 1
            crossings[place] = u
            n += 1
    return n
