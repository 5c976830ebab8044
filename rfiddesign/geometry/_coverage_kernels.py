"""Coverage of a torus: what the antennas of a robot see, over all phases of a tag lattice, at one heading.

The robot's position modulo the lattice is a point of a torus. Antenna i sees a tag where that point lies in S_i, the
union of all lattice copies of its detection area. The lattice is given as (a, b, h): basis vectors (a, 0) and (b, h).

A row of `levels` holds fractions of the torus: [k] of the points in at least k + 1 of the S_i (k < k_max),
[k_max] the sum of the fractions of all S_i, [k_max + 1] of the points at which some antenna has two tags in view.
"""

import math

import numpy as np

from rfiddesign.numerics._compile_kernels import kernel

# Two circles nearer than this are one and the same [mm]: far above rounding, far below what matters.
SAME_CIRCLE_MM = 1e-9
INSERTION_LIMIT = 32
POSITION_STEPS, INDEX_BITS = 2.0**40, 22
LOWEST_POINT, FULL_TURN = -math.pi / 2, 2 * math.pi


@kernel
def disc_levels(antennas, radius, headings, lattice, k_max):
    """Return `levels` (n_headings, k_max + 2), exact, for discs of one radius about `antennas` (n, 2).

    The border of {at least k} is made of those arcs of the circles that lie in k - 1 other discs; Green's theorem turns
    the arcs, -v ds along each, into an area. The torus is cut open along the line v = 0 for that: v runs from 0 to
    h, and the covered length of the cut, as its upper border, adds h times that length.
    """
    a, b, h = lattice
    n = len(antennas)
    copies = (int(4 * radius / h) + 2) * (int(4 * radius / a) + 2)
    capacity = 2 * n * copies + 2 * (int(2 * radius / h) + 2)
    angle, cosine, product = np.empty(capacity), np.empty(capacity), np.empty(capacity)
    label, order, bins = np.empty(capacity, np.int32), np.empty(capacity, np.int64), np.empty(capacity + 1, np.int32)
    seen = np.zeros(n, np.int32)
    centre_s, centre_v = np.empty(n), np.empty(n)
    levels = np.zeros((len(headings), k_max + 2))
    for row in range(len(headings)):
        turn_cosine, turn_sine = math.cos(headings[row]), math.sin(headings[row])
        for i in range(n):
            centre_s[i] = turn_cosine * antennas[i, 0] - turn_sine * antennas[i, 1]
            centre_v[i] = turn_sine * antennas[i, 0] + turn_cosine * antennas[i, 1]
        for i in range(n):
            seen[:] = 0
            n_events = _circle_crossings(i, centre_s, centre_v, radius, lattice, angle, cosine, product, label, seen)
            lap, n_events = _cut_crossings(n, centre_v[i], radius, h, angle, cosine, product, label, n_events)
            _sort_events(angle, n_events, LOWEST_POINT, FULL_TURN, order, bins)
            _add_arcs(i, centre_v[i], radius, h, lap, n_events, angle, cosine, product, label, order, seen, levels[row])
        seen[:] = 0
        n_events = 0
        for i in range(n):
            for m in range(math.ceil((-radius - centre_v[i]) / h), math.floor((radius - centre_v[i]) / h) + 1):
                v = centre_v[i] + m * h
                half = math.sqrt(max(radius * radius - v * v, 0.0))
                n_events = _add_interval(centre_s[i] + m * b - half, 2 * half, a, i, angle, label, n_events, seen)
        _sort_events(angle, n_events, 0.0, a, order, bins)
        _add_line(n_events, angle, label, order, seen, a, h, levels[row])
        levels[row] /= a * h
    return levels


@kernel
def scanline_levels(antennas, edges, headings, line_phases, lattice, n_lines, k_max):
    """Return `levels` (n_headings, k_max + 2) for areas of any outline, by `n_lines` lines along the lattice's rows.

    Exact along each line; between lines a midpoint rule. `antennas` (n, 3) are x, y, yaw; `edges` (m, 4) are the sides
    x0, y0, x1, y1 of the area's outline, in any order; `line_phases` (n_headings,) shift the lines by that share
    of their distance, so that their error averages out over headings.
    """
    a, b, h = lattice
    n, step = len(antennas), h / n_lines
    reach, per_antenna = 0.0, 2 * len(edges)
    for x0, y0, x1, y1 in edges:
        reach = max(reach, math.hypot(x0, y0))
        per_antenna += int(math.hypot(x1 - x0, y1 - y0) / step) + 1
    span = int(2 * reach / step) + 4
    crossings, first = np.empty((n, per_antenna)), np.empty((n, span + 1), np.int32)
    lowest = np.empty(n, np.int64)
    turned, cursor = np.empty_like(edges), np.empty(span + 1, np.int32)
    position, label = np.empty(n * per_antenna + 2), np.empty(n * per_antenna + 2, np.int32)
    order, bins = np.empty(n * per_antenna + 2, np.int64), np.empty(n * per_antenna + 3, np.int32)
    seen = np.zeros(n, np.int32)
    levels = np.zeros((len(headings), k_max + 2))
    for row in range(len(headings)):
        turn_cosine, turn_sine = math.cos(headings[row]), math.sin(headings[row])
        for i in range(n):
            centre_s = turn_cosine * antennas[i, 0] - turn_sine * antennas[i, 1]
            centre_v = turn_sine * antennas[i, 0] + turn_cosine * antennas[i, 1]
            _turn_edges(edges, headings[row] + antennas[i, 2], centre_s, centre_v, turned)
            lowest[i] = math.ceil((centre_v - reach) / step - line_phases[row]) - 1
            _cut_outline(turned, step, line_phases[row], lowest[i], crossings[i], first[i], cursor)
        for line in range(n_lines):
            seen[:] = 0
            n_events = 0
            for i in range(n):
                lap = math.ceil((lowest[i] - line) / n_lines)
                while lap * n_lines + line < lowest[i] + span:
                    at = lap * n_lines + line - lowest[i]
                    for pair in range(first[i, at], first[i, at + 1] - 1, 2):
                        start, length = crossings[i, pair] - lap * b, crossings[i, pair + 1] - crossings[i, pair]
                        n_events = _add_interval(start, length, a, i, position, label, n_events, seen)
                    lap += 1
            _sort_events(position, n_events, 0.0, a, order, bins)
            _add_line(n_events, position, label, order, seen, a, 1 / (n_lines * a), levels[row])
    return levels


@kernel
def _circle_crossings(i, centre_s, centre_v, radius, lattice, angle, cosine, product, label, seen):
    """Write where circle i enters and leaves every other disc; `seen` gets the discs in which its lowest point lies."""
    a, b, h = lattice
    width, per_a, per_h, per_width = 2 * radius, 1 / a, 1 / h, 0.5 / radius
    n_events = 0
    for j in range(len(centre_s)):
        apart_s, apart_v = centre_s[j] - centre_s[i], centre_v[j] - centre_v[i]
        for m in range(math.ceil((-width - apart_v) * per_h), math.floor((width - apart_v) * per_h) + 1):
            v = apart_v + m * h
            chord = math.sqrt(max(width * width - v * v, 0.0))
            row_s = apart_s + m * b
            for k in range(math.ceil((-chord - row_s) * per_a), math.floor((chord - row_s) * per_a) + 1):
                s = row_s + k * a
                distance = math.sqrt(s * s + v * v)
                if distance < SAME_CIRCLE_MM:
                    # Of two discs that coincide the one with the higher number counts as the larger.
                    seen[j] += j > i
                    continue
                half_cosine = min(distance * per_width, 1.0)
                half_sine = math.sqrt(1 - half_cosine * half_cosine)
                towards, half = math.atan2(v, s), math.acos(half_cosine)
                inverse = 1 / distance
                c, d = s * inverse, v * inverse
                cos_in, sin_in = c * half_cosine + d * half_sine, d * half_cosine - c * half_sine
                cos_out, sin_out = c * half_cosine - d * half_sine, d * half_cosine + c * half_sine
                enters, leaves = _from_lowest(towards - half), _from_lowest(towards + half)
                angle[n_events], cosine[n_events], product[n_events] = enters, cos_in, cos_in * sin_in
                angle[n_events + 1], cosine[n_events + 1], product[n_events + 1] = leaves, cos_out, cos_out * sin_out
                label[n_events], label[n_events + 1] = j + 1, -j - 1
                seen[j] += enters > leaves
                n_events += 2
    return n_events


@kernel
def _cut_crossings(n, v, radius, h, angle, cosine, product, label, n_events):
    """Add, as antenna n, where a circle crosses copies of the cut; return the lap of its lowest point as well."""
    lowest = math.floor((v - radius) / h)
    lap = lowest + 1
    while lap * h < v + radius:
        sine = max((lap * h - v) / radius, -1.0)
        c, up = math.sqrt(1 - sine * sine), math.asin(sine)
        angle[n_events], cosine[n_events], product[n_events] = up, c, c * sine
        angle[n_events + 1], cosine[n_events + 1], product[n_events + 1] = math.pi - up, -c, -c * sine
        label[n_events], label[n_events + 1] = n + 1, -n - 1
        n_events += 2
        lap += 1
    return lowest, n_events


@kernel
def _add_arcs(i, centre_v, radius, h, lap, n_events, angle, cosine, product, label, order, seen, levels):
    """Walk once around circle i and add the arcs that border {at least k}, S_i, or {two tags in view}."""
    k_max = len(levels) - 2
    others = twice = 0
    for j in range(len(seen)):
        others += seen[j] >= 1 and j != i
        twice += seen[j] >= 2 and j != i
    last_angle, last_cosine, last_product = LOWEST_POINT, 0.0, 0.0
    for place in range(n_events + 1):
        if place < n_events:
            event = order[place]
            at_angle, at_cosine, at_product, who = angle[event], cosine[event], product[event], label[event]
        else:
            at_angle, at_cosine, at_product, who = LOWEST_POINT + FULL_TURN, 0.0, 0.0, i + 1
        if seen[i] <= 1:
            area = radius * (centre_v - lap * h) * (last_cosine - at_cosine)
            area += 0.5 * radius * radius * (at_angle - last_angle - at_product + last_product)
            if seen[i] <= 0:
                levels[k_max] += area
                if others < k_max:
                    levels[others] += area
            elif twice == 0:
                levels[k_max + 1] += area
        last_angle, last_cosine, last_product = at_angle, at_cosine, at_product
        step = 1 if who > 0 else -1
        j = abs(who) - 1
        if j == len(seen):
            lap += step
        else:
            before, seen[j] = seen[j], seen[j] + step
            if j != i:
                others += step * (max(before, seen[j]) == 1)
                twice += step * (max(before, seen[j]) == 2)


@kernel
def _add_line(n_events, position, label, order, seen, period, weight, levels):
    """Walk once along a line of the torus and add to `levels` the lengths seen by so many antennas, times `weight`."""
    k_max = len(levels) - 2
    readers = twice = 0
    for j in range(len(seen)):
        readers += seen[j] >= 1
        twice += seen[j] >= 2
    last = 0.0
    for place in range(n_events + 1):
        here = position[order[place]] if place < n_events else period
        length = (here - last) * weight
        for k in range(min(readers, k_max)):
            levels[k] += length
        levels[k_max] += readers * length
        if twice > 0:
            levels[k_max + 1] += length
        last = here
        if place < n_events:
            who = label[order[place]]
            step = 1 if who > 0 else -1
            j = abs(who) - 1
            before, seen[j] = seen[j], seen[j] + step
            readers += step * (max(before, seen[j]) == 1)
            twice += step * (max(before, seen[j]) == 2)


@kernel
def _add_interval(start, length, period, j, position, label, n_events, seen):
    """Lay an interval around a circle of length `period`: two events, and in `seen` how often it covers position 0."""
    laps = math.floor(length / period)
    start -= math.floor(start / period) * period
    if start >= period:
        start = 0.0
    end = start + (length - laps * period)
    if end >= period:
        end -= period
        laps += 1
    seen[j] += laps
    position[n_events], label[n_events] = start, j + 1
    position[n_events + 1], label[n_events + 1] = end, -j - 1
    return n_events + 2


@kernel
def _turn_edges(edges, angle, centre_s, centre_v, turned):
    c, d = math.cos(angle), math.sin(angle)
    for e in range(len(edges)):
        for end in (0, 2):
            x, y = edges[e, end], edges[e, end + 1]
            turned[e, end], turned[e, end + 1] = centre_s + c * x - d * y, centre_v + d * x + c * y


@kernel
def _cut_outline(turned, step, phase, lowest, crossings, first, cursor):
    """Write where lines v = (line + phase) step cross the outline: of line lowest + l, sorted, from first[l] on."""
    first[:] = 0
    for e in range(len(turned)):
        begin, stop = _lines_across(turned[e], step, phase)
        for line in range(begin, stop):
            first[line - lowest + 1] += 1
    for at in range(1, len(first)):
        first[at] += first[at - 1]
    cursor[:] = first
    for e in range(len(turned)):
        x0, y0, x1, y1 = turned[e]
        begin, stop = _lines_across(turned[e], step, phase)
        for line in range(begin, stop):
            x = x0 + (x1 - x0) * ((line + phase) * step - y0) / (y1 - y0)
            place = cursor[line - lowest]
            cursor[line - lowest] += 1
            while place > first[line - lowest] and crossings[place - 1] > x:
                crossings[place] = crossings[place - 1]
                place -= 1
            crossings[place] = x


@kernel
def _lines_across(edge, step, phase):
    """Return the lines that cross an edge, half open, so that two edges share no line at their common corner."""
    low, high = min(edge[1], edge[3]), max(edge[1], edge[3])
    return math.ceil(low / step - phase), math.ceil(high / step - phase)


@kernel
def _from_lowest(angle):
    """Wrap an angle of [-2 pi, 2 pi] to [-pi / 2, 3 pi / 2), which starts at a circle's lowest point."""
    if angle < LOWEST_POINT:
        angle += FULL_TURN
    elif angle >= LOWEST_POINT + FULL_TURN:
        angle -= FULL_TURN
    return angle


@kernel
def _sort_events(position, n, low, span, keys, bins):
    """Write into keys[:n] the indices of position[:n], all within [low, low + span], in rising order of position.

    Sorted are whole numbers that hold a position, to 2^-40 of the span, and its index. Insertion is fastest for few;
    many are spread over as many bins first, so that insertion has little to do.
    """
    scale = POSITION_STEPS / span
    if n > INSERTION_LIMIT:
        bins[: n + 1] = 0
        to_bin = n / span
        for e in range(n):
            bins[min(max(int((position[e] - low) * to_bin), 0), n - 1) + 1] += 1
        for at in range(1, n + 1):
            bins[at] += bins[at - 1]
        for e in range(n):
            at = min(max(int((position[e] - low) * to_bin), 0), n - 1)
            keys[bins[at]] = (int((position[e] - low) * scale) << INDEX_BITS) | e
            bins[at] += 1
    else:
        for e in range(n):
            keys[e] = (int((position[e] - low) * scale) << INDEX_BITS) | e
    for e in range(1, n):
        moving, place = keys[e], e
        while place > 0 and keys[place - 1] > moving:
            keys[place] = keys[place - 1]
            place -= 1
        keys[place] = moving
    for e in range(n):
        keys[e] &= (1 << INDEX_BITS) - 1
