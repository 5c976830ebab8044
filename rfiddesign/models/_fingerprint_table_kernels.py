"""Rows of a look-up table of read probabilities, compiled; fingerprint_table.py says what is what."""

import numpy as np

from rfiddesign.numerics._compile_kernels import kernel
from rfiddesign.numerics._math_kernels import log_32

# Log odds in steps of 1/256 about level 2048: q from 3.4e-4 to 0.9997, each to 0.2 % of itself and of 1 - q.
N_LEVELS = 4096
PER_LEVEL, MIDDLE = 256.0, 2048.0
# The level of a row that knows nothing; no chance has it.
UNTRAINED = 0
# An entry: the level above, the tag below these bits.
TAG_BITS = 16
_LAST_TAG = (1 << TAG_BITS) - 1


@kernel
def level_of(q):
    """Level of a chance (float32)."""
    if q <= np.float32(0.0):
        return 1
    if q >= np.float32(1.0):
        return N_LEVELS - 1
    odds = np.float64(log_32(np.float32(q)) - log_32(np.float32(np.float32(1.0) - q)))
    return min(max(int(np.floor(odds * PER_LEVEL + MIDDLE + 0.5)), 1), N_LEVELS - 1)


@kernel
def pack(chances, support, least_support, entries, lengths, bases):
    """Entries of some rows: tags likelier than the least likely one, by falling level and then by their numbers.

    Parameters
    ----------
    chances : (n, n_tags) float32.
    support, least_support : rows whose support is less stay empty, their base `UNTRAINED`.
    entries : (n n_tags,) uint32, filled from the begin.
    lengths : (n,) int64 entries of each row.
    bases : (n,) uint16 level of every tag that a row does not list.
    """
    n, n_tags = chances.shape
    done = 0
    levels = np.empty(n_tags, np.int64)
    for i in range(n):
        lengths[i], bases[i] = 0, UNTRAINED
        if support[i] < least_support:
            continue
        least = chances[i, 0]
        for tag in range(1, n_tags):
            least = min(least, chances[i, tag])
        base, begin = level_of(least), done
        for tag in range(n_tags):
            # Most chances are the least one: their logarithms are known.
            levels[tag] = base if chances[i, tag] == least else level_of(chances[i, tag])
            if levels[tag] > base:
                # Numbers are stored from behind, so that equal levels fall into the order of the tags.
                entries[done] = np.uint32((levels[tag] << TAG_BITS) | (_LAST_TAG - tag))
                done += 1
        part = entries[begin:done]
        part.sort()
        for k in range((done - begin) // 2):
            part[k], part[done - begin - 1 - k] = part[done - begin - 1 - k], part[k]
        for k in range(done - begin):
            part[k] = part[k] ^ np.uint32(_LAST_TAG)
        lengths[i], bases[i] = done - begin, base
    return done
