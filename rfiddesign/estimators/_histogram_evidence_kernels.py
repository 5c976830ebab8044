"""What a step's polls say of every cell of a histogram over poses.

`field` is (radius of the disc [mm], 0: the table; table (n, m); 1 / side of its cells; whether it holds the depth
inside the border [mm], else a probability; reach [mm]; radii (m + 1,) of the steps of RSSI, then 0; normal distribution
function in steps of 1 / CDF_PER_UNIT from -CDF_MOST to CDF_MOST).
"""

import math

from rfiddesign.estimators._evidence_kernels import antenna_then
from rfiddesign.estimators._histogram_window_kernels import CELL, HEADING, TURN
from rfiddesign.models.soft_field import LEAST_PROBABILITY
from rfiddesign.numerics._compile_kernels import inline_kernel, leaf_kernel
from rfiddesign.numerics._math_kernels import sin_cos_64

CDF_MOST, CDF_PER_UNIT = 4.5, 64.0
_LEAST = LEAST_PROBABILITY


@inline_kernel
def _cdf(z, table):
    at = (min(max(z, -CDF_MOST), CDF_MOST - 1e-9) + CDF_MOST) * CDF_PER_UNIT
    k = int(at)
    return table[k] + (at - k) * (table[k + 1] - table[k])


@leaf_kernel
def _in_table(u, v, table, per_cell):
    """Table at (u, v) from its middle (bilinear), and whether it reaches so far."""
    p, q = u * per_cell + 0.5 * (table.shape[0] - 1), v * per_cell + 0.5 * (table.shape[1] - 1)
    if p < 0.0 or q < 0.0 or p >= table.shape[0] - 1 or q >= table.shape[1] - 1:
        return 0.0, False
    i, j = int(p), int(q)
    f, g = p - i, q - j
    low = table[i, j] + g * (table[i, j + 1] - table[i, j])
    high = table[i + 1, j] + g * (table[i + 1, j + 1] - table[i + 1, j])
    return low + f * (high - low), True


@inline_kernel
def _columns(cy, h, square, first, end):
    """First column and end of the columns within the root of `square` of cy, among those from `first` to `end`."""
    if square <= 0.0:
        return end, end
    root = math.sqrt(square)
    begin = min(max(math.ceil((cy - root) / h), first), end)
    return begin, min(max(math.floor((cy + root) / h) + 1, begin), end)


@inline_kernel
def _multiply(layer, i, first, end, factor):
    total = 0.0
    for j in range(first, end):
        layer[i, j] *= factor
        total += layer[i, j]
    return total


@inline_kernel
def _multiply_by_ring(layer, i, first, end, dx, cy, h, outer, inner, per_s, least, most, cdf):
    total = 0.0
    for j in range(first, end):
        dy = cy - j * h
        distance = math.sqrt(dx * dx + dy * dy)
        inside = _cdf((outer - distance) * per_s, cdf)
        if inner > 0.0:
            inside -= _cdf((inner - distance) * per_s, cdf)
        layer[i, j] *= max(most * inside, least) if most > 0.0 else 1.0 + most * inside
        total += layer[i, j]
    return total


@leaf_kernel
def _ring_layer(layer, box, cx, cy, h, outer, inner, s, least, most, cdf):
    """Multiply a layer by the chance that a tag lies in a ring, at least `least`; 1 less that if `most` < 0.

    The tag lies at (cx, cy) from the middle of cell (0, 0).  Returns the sum of what is left, but for cells out of
    reach of a tag that was not read, which stay as they are.
    """
    total, per_s = 0.0, 1.0 / s
    reach = outer + CDF_MOST * s
    # Of a disc, all within this is certainly inside.
    flat = outer - CDF_MOST * s if inner == 0.0 else 0.0
    factor = max(most, least) if most > 0.0 else 1.0 + most
    for i in range(box[2], box[3]):
        dx = cx - i * h
        first, end = _columns(cy, h, reach * reach - dx * dx, box[4], box[5])
        flat_first, flat_end = end, end
        if flat > 0.0:
            flat_first, flat_end = _columns(cy, h, flat * flat - dx * dx, first, end)
        if most > 0.0:
            total += _multiply(layer, i, box[4], first, least) + _multiply(layer, i, end, box[5], least)
        total += _multiply_by_ring(layer, i, first, flat_first, dx, cy, h, outer, inner, per_s, least, most, cdf)
        total += _multiply(layer, i, flat_first, flat_end, factor)
        total += _multiply_by_ring(layer, i, flat_end, end, dx, cy, h, outer, inner, per_s, least, most, cdf)
    return total


@leaf_kernel
def _table_layer(layer, box, cx, cy, h, s, c, per_s, least, most, table, per_cell, is_depth, cdf):
    """As `_ring_layer` for a tabulated field of an antenna whose direction has sine and cosine (s, c)."""
    total = 0.0
    for i in range(box[2], box[3]):
        dx = cx - i * h
        for j in range(box[4], box[5]):
            dy = cy - j * h
            inside, is_near = _in_table(c * dx + s * dy, c * dy - s * dx, table, per_cell)
            if is_depth and is_near:
                inside = _cdf(inside * per_s, cdf)
            layer[i, j] *= max(most * inside, least) if most > 0.0 else 1.0 + most * inside
            total += layer[i, j]
    return total


@leaf_kernel
def weigh(mass, origins, box, frame, antenna, tag_x, tag_y, rssi, softness, most, field):
    """Multiply the mass by the chance of what a poll said of a tag; returns the sum of what is left after a read.

    Parameters
    ----------
    antenna : x, y on the robot when it polled, cosine and sine of its direction there.
    rssi : step of the read's strength, -1: any.
    softness : deviation by which borders are blurred [mm]; with it go the cell's own h^2 / 12.
    most : chance that a tag in the field is read; its negative: the tag was not read.
    """
    radius, table, per_cell, is_depth, reach, radii, cdf = field
    x, y, along, across = antenna
    h, n_layers = frame[CELL], mass.shape[0]
    half, middle = (mass.shape[1] - 1) // 2, (n_layers - 1) // 2
    s2 = math.sqrt(softness * softness + h * h / 12.0)
    far = reach + CDF_MOST * s2
    outer, inner = radius, 0.0
    if rssi >= 0 and radii.shape[0] > 1:
        step = min(rssi, radii.shape[0] - 2)
        outer, inner = radii[step], radii[step + 1]
    total = 0.0
    for k in range(box[0], box[1]):
        s, c = sin_cos_64(frame[HEADING] + (k - middle) * frame[TURN])
        cx = tag_x - (origins[k, 0] - half * h) - (c * x - s * y)
        cy = tag_y - (origins[k, 1] - half * h) - (s * x + c * y)
        if outer > 0.0:
            total += _ring_layer(mass[k], box, cx, cy, h, outer, inner, s2, _LEAST, most, cdf)
        else:
            s, c = s * along + c * across, c * along - s * across
            # What lies beyond the window's corners needs no look.
            to_x = max(box[2] * h - cx, cx - (box[3] - 1) * h, 0.0)
            to_y = max(box[4] * h - cy, cy - (box[5] - 1) * h, 0.0)
            if most > 0.0 or to_x * to_x + to_y * to_y < far * far:
                total += _table_layer(
                    mass[k], box, cx, cy, h, s, c, 1.0 / s2, _LEAST, most, table, per_cell, is_depth, cdf
                )  # fmt: skip
    return total


@inline_kernel
def antenna_of(t, odometry, antennas, a, back, is_age_compensated):
    """Antenna a as `weigh` takes it, `back` steps before the end of step t."""
    x, y = antennas[a, 0], antennas[a, 1]
    if is_age_compensated and back > 0.0:
        x, y = antenna_then(x, y, back, odometry[t, 0], odometry[t, 1], odometry[t, 2])
    return x, y, antennas[a, 2], antennas[a, 3]


@leaf_kernel
def bounds_of_antenna(mass, origins, box, frame, x, y):
    """Least and most x, least and most y of where an antenna at (x, y) on the robot may be."""
    half, middle, h = (mass.shape[1] - 1) // 2, (mass.shape[0] - 1) // 2, frame[CELL]
    low_x = low_y = math.inf
    high_x = high_y = -math.inf
    for k in range(box[0], box[1]):
        s, c = sin_cos_64(frame[HEADING] + (k - middle) * frame[TURN])
        at_x, at_y = origins[k, 0] + (c * x - s * y), origins[k, 1] + (s * x + c * y)
        low_x, high_x = min(low_x, at_x), max(high_x, at_x)
        low_y, high_y = min(low_y, at_y), max(high_y, at_y)
    return (
        low_x + (box[2] - half) * h, high_x + (box[3] - 1 - half) * h, low_y + (box[4] - half) * h,
        high_y + (box[5] - 1 - half) * h,
    )  # fmt: skip


@leaf_kernel
def weigh_nothing_seen(step, t, log, model, tags, mass, origins, box, frame):
    """Every antenna that polled in this step speaks against each tag in its reach that it did not read.

    An antenna that answers with one tag says nothing of the others once it has read one.
    """
    antennas, _, field, rules, ages, looks = model
    softness, read_probability = rules[0], rules[1]
    is_inventory, slots, phases, period = looks
    odometry, read_start, read_antenna, read_tags = log[0], log[1], log[2], log[3]
    tag_x, tag_y, cell_start, per_cell, x0, y0, n_x, n_y = tags
    h = frame[CELL]
    far = field[4] + CDF_MOST * math.sqrt(softness * softness + h * h / 12.0)
    for a in range(antennas.shape[0]):
        if period > 1 and step % period != slots[a]:
            continue
        has_read = False
        for row in range(read_start[t], read_start[t + 1]):
            has_read = has_read or read_antenna[row] == a
        if has_read and not is_inventory:
            continue
        antenna = antenna_of(t, odometry, antennas, a, 1.0 - phases[a] + ages[1], ages[0])
        low_x, high_x, low_y, high_y = bounds_of_antenna(mass, origins, box, frame, antenna[0], antenna[1])
        # Cells of the map, clipped before they become integers.
        first_i = math.floor(min(max((low_x - far - x0) * per_cell - 1e-6, 0.0), float(n_x)))
        last_i = math.floor(min(max((high_x + far - x0) * per_cell + 1e-6, -1.0), n_x - 1.0))
        first_j = math.floor(min(max((low_y - far - y0) * per_cell - 1e-6, 0.0), float(n_y)))
        last_j = math.floor(min(max((high_y + far - y0) * per_cell + 1e-6, -1.0), n_y - 1.0))
        for j in range(first_j, last_j + 1):
            if first_i > last_i:
                break
            for tag in range(cell_start[j * n_x + first_i], cell_start[j * n_x + last_i + 1]):
                x, y = float(tag_x[tag]), float(tag_y[tag])
                if x < low_x - far or x > high_x + far or y < low_y - far or y > high_y + far:
                    continue
                is_read = False
                for row in range(read_start[t], read_start[t + 1]):
                    is_same = read_tags[row, 0] == x and read_tags[row, 1] == y
                    is_read = is_read or (read_antenna[row] == a and is_same)
                if not is_read:
                    weigh(
                        mass, origins, box, frame, antenna, x, y, -1, softness, -read_probability, field
                    )  # fmt: skip
