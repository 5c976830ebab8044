"""The likelihood of snapshots at rows of chances, compiled; likelihood.py says what is what."""

import math

import numpy as np

from rfiddesign.numerics._compile_kernels import kernel

_LEAST = 1e-12


@kernel
def truncated_logs(chances, counts, n_cycles, most, log_ways, out):
    """Logarithm (n,) of eq. 8 for each row of chances (n, n_tags) and one snapshot's counts (n_tags,).

    `log_ways` (n_cycles + 1,): logarithm of the binomial coefficient of each count.
    """
    n, n_tags = chances.shape
    n_read = np.count_nonzero(counts)
    # Of more tags than count, those read most often; of equally many reads the first ones.
    by_count = np.bincount(counts, minlength=n_cycles + 1)
    left, least = most, n_cycles + 1
    while least > 1 and by_count[least - 1] <= left:
        least -= 1
        left -= by_count[least]
    n_others = max(most - n_read, 0)
    others = np.empty(n_tags - n_read)
    for i in range(n):
        total, k, room = 0.0, 0, left
        for tag in range(n_tags):
            q, f = min(max(np.float64(chances[i, tag]), _LEAST), 1.0 - _LEAST), counts[tag]
            if f == 0:
                others[k] = q
                k += 1
                continue
            if f < least:
                if f < least - 1 or room == 0:
                    continue
                room -= 1
            total += log_ways[f] + f * math.log(q) + (n_cycles - f) * math.log1p(-q)
        if 0 < n_others < others.shape[0]:
            likeliest = np.partition(others, others.shape[0] - n_others)[others.shape[0] - n_others :]
        else:
            likeliest = others[:n_others]
        for q in likeliest:
            total += n_cycles * math.log1p(-q)
        out[i] = total
