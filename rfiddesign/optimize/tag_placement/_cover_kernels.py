"""Rows of a sparse matrix that are alike, without comparing all with all."""

import numpy as np

from rfiddesign.numerics._compile_kernels import kernel


@kernel
def row_hashes(starts, indices, rows):
    """Return a hash (n,) uint64 of the indices in each of the rows: FNV-1a over whole indices, mixed at the end."""
    hashes = np.empty(len(rows), np.uint64)
    for n in range(len(rows)):
        value = np.uint64(14695981039346656037)
        for at in range(starts[rows[n]], starts[rows[n] + 1]):
            value = (value ^ np.uint64(indices[at])) * np.uint64(1099511628211)
            value ^= value >> np.uint64(29)
        hashes[n] = value
    return hashes


@kernel
def first_alike(starts, indices, order, hashes):
    """Tell of rows in the order of their hashes which are the first of their kind.

    A row with the hash of an earlier one is compared with the first of that hash only, so that two kinds that share a
    hash may keep a row too many and never lose one.
    """
    is_first = np.ones(len(order), np.bool_)
    leader = 0
    for n in range(1, len(order)):
        if hashes[n] != hashes[leader]:
            leader = n
            continue
        a, b = starts[order[leader]], starts[order[n]]
        size = starts[order[n] + 1] - b
        if starts[order[leader] + 1] - a != size:
            continue
        is_same = True
        for at in range(size):
            if indices[a + at] != indices[b + at]:
                is_same = False
                break
        is_first[n] = not is_same
    return is_first


@kernel
def undominated(row_starts, places, place_starts, rows, order, n_cover):
    """Tell which places stay, when one goes that has `n_cover` others, kept ones, which serve all of its rows.

    The fewest places stay as few: where one that goes is chosen, one of those others is free to take its turn, or all
    are chosen and it is not needed. `order` lists places by falling number of rows.
    """
    n_places = len(place_starts) - 1
    signature = np.zeros(n_places, np.uint64)
    for j in range(n_places):
        for at in range(place_starts[j], place_starts[j + 1]):
            bit = (np.uint64(rows[at]) * np.uint64(0x9E3779B97F4A7C15)) >> np.uint64(58)
            signature[j] |= np.uint64(1) << bit
    is_kept = np.zeros(n_places, np.bool_)
    for j in order:
        begin, end = place_starts[j], place_starts[j + 1]
        if begin == end:
            continue
        rarest = rows[begin]
        for at in range(begin, end):
            r = rows[at]
            if row_starts[r + 1] - row_starts[r] < row_starts[rarest + 1] - row_starts[rarest]:
                rarest = r
        n_over = 0
        for index in range(row_starts[rarest], row_starts[rarest + 1]):
            i = places[index]
            # What is kept so far comes before j in the order.
            if not is_kept[i] or signature[j] & ~signature[i] != 0:
                continue
            other, stop, is_within = place_starts[i], place_starts[i + 1], True
            for at in range(begin, end):
                while other < stop and rows[other] < rows[at]:
                    other += 1
                if other == stop or rows[other] != rows[at]:
                    is_within = False
                    break
            n_over += is_within
            if n_over == n_cover:
                break
        is_kept[j] = n_over < n_cover
    return is_kept
