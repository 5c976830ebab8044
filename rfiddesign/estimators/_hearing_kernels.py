"""What an antenna that polled does to a mixture of Gaussians: it read a tag, or none of those about it.

`tuned` is (blur of the field's border [mm], chance to read, split_sigma, gate, size of the field [mm], components kept,
patience); `scratch` (that of `_plane_kernels`, product (N_GRID, N_GRID), found (rows, N_FOUND), near (MOST_NEAR, 2)).
"""

import math

from rfiddesign.estimators._border_kernels import look_across
from rfiddesign.estimators._hypotheses_kernels import hypothesize
from rfiddesign.estimators._mixture_kernels import COSINE, HH, SINE, WEIGHT, XH, XX, YH, YY, X, Y, merge, split
from rfiddesign.estimators._plane_kernels import HALF_BORDER, HALF_GRID, look_at_none, look_at_read
from rfiddesign.estimators._projection_kernels import EVIDENCE, N_TOLD, learn, seen_from, spread, spread_of
from rfiddesign.models.soft_field import LEAST_PROBABILITY
from rfiddesign.numerics._compile_kernels import inline_kernel

# Components there are (0: nothing was read yet), how many may be kept, and reads in a row that contradict them all.
N, CAP, DOUBTS = range(3)
N_NUMBERS = 3
# Tags about an antenna that are looked at; where there are more, its place is too vague to learn from them.
MOST_NEAR = 16
# Beyond so many times the reach of the field an uncertain antenna learns nothing of tags it does not read.
_VAGUE = 3.0
# Components kept of a belief that is in doubt, and what they weigh in all.
_KEPT_IN_DOUBT, _SHARE_IN_DOUBT = 3, 0.5
_LEAST_TOTAL = 1e-3


@inline_kernel
def hear(antenna, tag_x, tag_y, shape, field, tuned, mix, numbers, scratch):
    """An antenna read a tag."""
    soft, chance_to_read, split_sigma, gate, size, n_most, patience = tuned
    grid, _, found, _ = scratch
    is_table = field[0].shape[0] > 0
    if numbers[N] == 0:
        numbers[N] = hypothesize(mix, 0, 1.0, antenna, tag_x, tag_y, shape, field)
        numbers[CAP] = numbers[N]
        return
    total, does_matter = 0.0, False
    n, k = numbers[N], 0
    base, gain = LEAST_PROBABILITY, chance_to_read - LEAST_PROBABILITY
    while k < n:
        seen = seen_from(mix, k, antenna, tag_x, tag_y)
        if is_table or not look_across(mix, k, seen, shape, soft, base, gain, found[k]):
            look_at_read(mix, k, seen, shape, soft, chance_to_read, field, grid, found[k])
            if n <= n_most and found[k, N_TOLD] > 1.0:
                sigma, dx, dy, dh = spread_of(found[k])
                if sigma > split_sigma * size:
                    n = split(mix, n, k, dx, dy, dh)
                    continue
        does_matter = does_matter or found[k, N_TOLD] > 0.0 or found[k, EVIDENCE] < gate
        total += mix[k, WEIGHT] * found[k, EVIDENCE]
        k += 1
    numbers[N] = n
    if not does_matter:
        numbers[DOUBTS] = 0
        return
    numbers[DOUBTS] = numbers[DOUBTS] + 1 if total < gate else 0
    for k in range(n):
        mix[k, WEIGHT] *= found[k, EVIDENCE] / total
        learn(mix, k, found[k])
    if numbers[DOUBTS] >= patience:
        n = merge(mix, n, _KEPT_IN_DOUBT)
        for k in range(n):
            mix[k, WEIGHT] *= _SHARE_IN_DOUBT
        numbers[N] = hypothesize(mix, n, 1.0 - _SHARE_IN_DOUBT, antenna, tag_x, tag_y, shape, field)
        numbers[CAP] = numbers[N]
        numbers[DOUBTS] = 0


@inline_kernel
def _tags_about(at_x, at_y, far, a, first, last, read_antenna, read_tags, tags, near):
    """Tags within `far` of a place that antenna a did not read in rows first..last-1.

    The first of them go to `near`; returns how many there are, or enough to know that there are too many.
    """
    tag_x, tag_y, cell_start, per_cell, x0, y0, n_x, n_y = tags
    column, line, span = (at_x - x0) * per_cell, (at_y - y0) * per_cell, far * per_cell + 1e-6
    first_i, last_i = max(math.floor(column - span), 0), min(math.floor(column + span), n_x - 1)
    first_j, last_j = max(math.floor(line - span), 0), min(math.floor(line + span), n_y - 1)
    n_near = 0
    for j in range(first_j, last_j + 1):
        if first_i > last_i or n_near > MOST_NEAR:
            break
        for tag in range(cell_start[j * n_x + first_i], cell_start[j * n_x + last_i + 1]):
            dx, dy = tag_x[tag] - at_x, tag_y[tag] - at_y
            if dx * dx + dy * dy > far * far:
                continue
            is_read = False
            for row in range(first, last):
                is_same = read_tags[row, 0] == tag_x[tag] and read_tags[row, 1] == tag_y[tag]
                is_read = is_read or (read_antenna[row] == a and is_same)
            if is_read:
                continue
            if n_near < MOST_NEAR:
                near[n_near, 0], near[n_near, 1] = tag_x[tag], tag_y[tag]
            n_near += 1
    return n_near


@inline_kernel
def hear_nothing(
    a, antenna, first, last, read_antenna, read_tags, shape, field, reach, tuned, tags, mix, numbers, scratch
):
    """An antenna read none of the tags about it but those in rows first..last-1."""
    soft, chance_to_read, split_sigma, _, size, n_most, _ = tuned
    grid, product, found, near = scratch
    is_table = field[0].shape[0] > 0
    x, y, _, _ = antenna
    n, k = numbers[N], 0
    total = 0.0
    while k < n:
        s, c = mix[k, SINE], mix[k, COSINE]
        lever_x, lever_y = c * x - s * y, s * x + c * y
        at_x, at_y = mix[k, X] + lever_x, mix[k, Y] + lever_y
        variance = mix[k, XX] + mix[k, YY] + 2.0 * (lever_x * mix[k, YH] - lever_y * mix[k, XH])
        variance += (x * x + y * y) * mix[k, HH]
        sigma = math.sqrt(max(variance, 0.0))
        n_near = 0
        if sigma < _VAGUE * reach:
            far = reach + HALF_BORDER * soft + HALF_GRID * sigma
            n_near = _tags_about(at_x, at_y, far, a, first, last, read_antenna, read_tags, tags, near)
        if n_near == 0 or n_near > MOST_NEAR:
            total += mix[k, WEIGHT]
            k += 1
            continue
        if variance > split_sigma * split_sigma * size * size and n <= n_most:
            seen = seen_from(mix, k, antenna, near[0, 0], near[0, 1])
            spread(mix, k, seen, found[k])
            sigma, dx, dy, dh = spread_of(found[k])
            if sigma > split_sigma * size:
                n = split(mix, n, k, dx, dy, dh)
                continue
        evidence, n_bent = 1.0, 0
        for i in range(n_near):
            seen = seen_from(mix, k, antenna, near[i, 0], near[i, 1])
            if not is_table and look_across(mix, k, seen, shape, soft, 1.0, -chance_to_read, found[k]):
                evidence *= found[k, EVIDENCE]
                learn(mix, k, found[k])
            else:
                near[n_bent, 0], near[n_bent, 1] = near[i, 0], near[i, 1]
                n_bent += 1
        if n_bent > 0:
            seen = seen_from(mix, k, antenna, near[0, 0], near[0, 1])
            look_at_none(mix, k, seen, near, n_bent, shape, soft, chance_to_read, field, grid, product, found[k])
            evidence *= found[k, EVIDENCE]
            learn(mix, k, found[k])
        mix[k, WEIGHT] *= evidence
        total += mix[k, WEIGHT]
        k += 1
    numbers[N] = n
    # The step ends with weights that sum to 1; until then they must not vanish.
    if total < _LEAST_TOTAL:
        for k in range(n):
            mix[k, WEIGHT] /= max(total, 1e-300)
