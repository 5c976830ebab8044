"""Which tag places are seen along which windows of travel."""

import math

import numpy as np

from rfiddesign.numerics._compile_kernels import kernel


@kernel
def sightings(
    pieces, first, count, begins, length, near_start, near, places, offsets, radius, edges, reach, stamp, rows, seen
):
    """Write every (row, place) with a place that is seen along a window; return how many there are.

    Row w * n_deviations + d is window w driven with deviation d. A place that is seen from several pieces of a window
    is written several times. With arrays `rows` and `seen` of no length it only counts.

    Parameters
    ----------
    pieces, first, count, begins, length : as in `windows.Windows`.
    near_start, near : places about piece p are near[near_start[p]:near_start[p + 1]].
    offsets : (n_deviations, n_antennas, 2) antennas' places along and to the left of the road.
    radius, edges : of the areas: a disc's radius; or, if that is 0, the sides (n_deviations, n_antennas, m, 4) of each
        area's outline about the antenna, in the road's frame.
    reach : largest distance of a place that is seen from the road.
    stamp : (most windows of a stretch,) int64, zeros.
    """
    n_deviations, n_antennas = offsets.shape[0], offsets.shape[1]
    is_counting = len(rows) == 0
    n, mark = 0, 0
    crossings = np.empty(max(edges.shape[2], 2))
    for p in range(len(pieces)):
        x, y, cosine, sine, at, size = pieces[p]
        n_windows, begin = count[p], begins[first[p]]
        step = (begins[first[p] + n_windows - 1] - begin) / (n_windows - 1) if n_windows > 1 else 1.0
        for place in near[near_start[p] : near_start[p + 1]]:
            east, north = places[place, 0] - x, places[place, 1] - y
            u, v = cosine * east + sine * north, cosine * north - sine * east
            if abs(v) > reach or u < -reach or u > size + reach:
                continue
            for d in range(n_deviations):
                mark += 1
                for a in range(n_antennas):
                    across = v - offsets[d, a, 1]
                    if radius > 0:
                        if abs(across) >= radius:
                            continue
                        crossings[0] = -math.sqrt(radius * radius - across * across)
                        crossings[1] = -crossings[0]
                        n_crossings = 2
                    else:
                        n_crossings = _cut(edges[d, a], across, crossings)
                    for pair in range(0, n_crossings - 1, 2):
                        # The antenna sees the place while it is between these distances behind it.
                        low = max(u - offsets[d, a, 0] - crossings[pair + 1], 0.0)
                        high = min(u - offsets[d, a, 0] - crossings[pair], size)
                        if high < low:
                            continue
                        w0 = max(math.ceil((at + low - length - begin) / step), 0)
                        w1 = min(math.floor((at + high - begin) / step), n_windows - 1)
                        for w in range(w0, w1 + 1):
                            if stamp[w] != mark:
                                stamp[w] = mark
                                if not is_counting:
                                    rows[n] = (first[p] + w) * n_deviations + d
                                    seen[n] = place
                                n += 1
    return n


@kernel
def _cut(edges, v, crossings):
    """Write where the line at height v crosses an outline, sorted; return how many crossings there are."""
    n = 0
    for k in range(len(edges)):
        u0, v0, u1, v1 = edges[k]
        if (v0 <= v) != (v1 <= v):
            at = u0 + (v - v0) / (v1 - v0) * (u1 - u0)
            place = n
            while place > 0 and crossings[place - 1] > at:
                crossings[place] = crossings[place - 1]
                place -= 1
            crossings[place] = at
            n += 1
    return n
