"""Greedy choice and weighted local search for multi-cover: row r needs need[r] of its places.

`matrix` is a tuple of sparse matrices' arrays, row_starts, places, place_starts, rows, conflict_starts, conflicts.
Row r's places are places[row_starts[r]:row_starts[r + 1]]; place j's rows are rows[place_starts[j]:place_starts[j + 1]]
and its conflicts, places that may not hold a tag as well, conflicts[conflict_starts[j]:conflict_starts[j + 1]].
"""

import heapq

import numpy as np

from rfiddesign.numerics._compile_kernels import kernel

MULTIPLIER = np.uint64(2685821657736338717)


@kernel
def greedy(matrix, need, is_in):
    """Add the place that serves most rows still in need, until none helps; `is_in` holds what is chosen already.

    Lazy: gains only fall, so that a place whose gain is recounted and still heads the queue is the best (Minoux 1978).
    Returns the number of rows left in need.
    """
    row_starts, _, place_starts, rows, conflict_starts, conflicts = matrix
    n_rows, n_places = len(row_starts) - 1, len(place_starts) - 1
    cover = np.zeros(n_rows, np.int32)
    blocked = np.zeros(n_places, np.int32)
    for j in range(n_places):
        if is_in[j]:
            for at in range(place_starts[j], place_starts[j + 1]):
                cover[rows[at]] += 1
            for at in range(conflict_starts[j], conflict_starts[j + 1]):
                blocked[conflicts[at]] += 1
    queue = [(np.int64(place_starts[j] - place_starts[j + 1]), j) for j in range(n_places)]
    heapq.heapify(queue)
    while len(queue) > 0:
        _, j = heapq.heappop(queue)
        if is_in[j] or blocked[j] > 0:
            continue
        gain = 0
        for at in range(place_starts[j], place_starts[j + 1]):
            gain += cover[rows[at]] < need[rows[at]]
        if gain == 0:
            continue
        if len(queue) > 0 and gain < -queue[0][0]:
            heapq.heappush(queue, (-gain, j))
            continue
        is_in[j] = True
        for at in range(place_starts[j], place_starts[j + 1]):
            cover[rows[at]] += 1
        for at in range(conflict_starts[j], conflict_starts[j + 1]):
            blocked[conflicts[at]] += 1
    return np.count_nonzero(cover < need)


@kernel
def prune(matrix, need, is_in):
    """Take away every place without which all rows are still served, those that serve fewest rows first."""
    row_starts, _, place_starts, rows, _, _ = matrix
    cover = np.zeros(len(row_starts) - 1, np.int32)
    chosen = np.flatnonzero(is_in)
    for j in chosen:
        for at in range(place_starts[j], place_starts[j + 1]):
            cover[rows[at]] += 1
    sizes = np.empty(len(chosen), np.int64)
    for n in range(len(chosen)):
        sizes[n] = place_starts[chosen[n] + 1] - place_starts[chosen[n]]
    for n in np.argsort(sizes, kind="mergesort"):
        j = chosen[n]
        is_spare = True
        for at in range(place_starts[j], place_starts[j + 1]):
            if cover[rows[at]] <= need[rows[at]]:
                is_spare = False
                break
        if is_spare:
            is_in[j] = False
            for at in range(place_starts[j], place_starts[j + 1]):
                cover[rows[at]] -= 1


# The state of a search, a tuple of arrays:
# is_in (n_places,) bool : what is chosen.
# cover (n_rows,), blocked (n_places,) : chosen places of each row; chosen places in conflict with each place.
# weight (n_rows,), score (n_places,) : a chosen place scores the weight of the rows that would be in need, or more in
#     need, without it; any other the weight of the rows in need that it would help.
# chosen, place_in_chosen; lacking, place_in_lacking : lists of the chosen places and of the rows in need, each with
#     where in the list a place or row stands.
# moved (n_places,) : round in which each place was last put or taken.
# counters (5,) : lengths of the two lists, rounds done, the place added last, state of the random numbers.
CHOSEN, LACKING, ROUND, ADDED, RANDOM = 0, 1, 2, 3, 4


@kernel
def start(matrix, need, best, seed):
    """Return the state of a search that starts from the choice `best` (n_places,)."""
    row_starts, _, place_starts, rows, conflict_starts, conflicts = matrix
    n_rows, n_places = len(row_starts) - 1, len(place_starts) - 1
    is_in, cover, blocked = best.copy(), np.zeros(n_rows, np.int32), np.zeros(n_places, np.int32)
    weight, score = np.ones(n_rows, np.int64), np.zeros(n_places, np.int64)
    chosen, place_in_chosen = np.empty(n_places, np.int32), np.full(n_places, -1, np.int32)
    lacking, place_in_lacking = np.empty(n_rows, np.int32), np.full(n_rows, -1, np.int32)
    moved, counters = np.zeros(n_places, np.int64), np.zeros(5, np.int64)
    for j in np.flatnonzero(is_in):
        chosen[counters[CHOSEN]], place_in_chosen[j] = j, counters[CHOSEN]
        counters[CHOSEN] += 1
        for at in range(place_starts[j], place_starts[j + 1]):
            cover[rows[at]] += 1
        for at in range(conflict_starts[j], conflict_starts[j + 1]):
            blocked[conflicts[at]] += 1
    for r in range(n_rows):
        if cover[r] < need[r]:
            lacking[counters[LACKING]], place_in_lacking[r] = r, counters[LACKING]
            counters[LACKING] += 1
    for j in range(n_places):
        for at in range(place_starts[j], place_starts[j + 1]):
            r = rows[at]
            score[j] += cover[r] <= need[r] if is_in[j] else cover[r] < need[r]
    counters[ADDED], counters[RANDOM] = -1, np.int64(seed) ^ 0x1E3779B97F4A7C15
    return (is_in, cover, blocked, weight, score, chosen, place_in_chosen, lacking, place_in_lacking, moved, counters)


@kernel
def search(matrix, need, best, state, until_round):
    """Go on with a search until a round; `best` (n_places,) becomes the smallest choice found that serves all rows.

    Row weighting local search (Gao, Weise and Li 2015, for plain set cover), here for rows that need several places.
    Whenever all rows are served the choice is kept and a place taken away. A round then takes away the place that
    weighs least, adds the one that weighs most of some row in need, and adds 1 to the weight of the rows that stay in
    need. What was added in one round is not taken away in the next, and what was taken away not added in the same one.
    """
    row_starts, places = matrix[0], matrix[1]
    is_in, _, blocked, weight, score, chosen, _, lacking, _, moved, counters = state
    while counters[ROUND] < until_round and counters[CHOSEN] > 0:
        counters[ROUND] += 1
        if counters[LACKING] == 0:
            best[:] = is_in
            _take(_lightest(chosen, counters[CHOSEN], score, moved, -1), matrix, need, state)
            continue
        gone = _lightest(chosen, counters[CHOSEN], score, moved, counters[ADDED])
        if gone >= 0:
            _take(gone, matrix, need, state)
            moved[gone] = counters[ROUND]
        row = lacking[_draw(counters, counters[LACKING])]
        added = -1
        for at in range(row_starts[row], row_starts[row + 1]):
            j = places[at]
            if is_in[j] or blocked[j] > 0 or j == gone:
                continue
            if added < 0 or score[j] > score[added] or (score[j] == score[added] and moved[j] < moved[added]):
                added = j
        if added >= 0:
            _put(added, matrix, need, state)
            moved[added] = counters[ROUND]
        counters[ADDED] = added
        for at in range(counters[LACKING]):
            r = lacking[at]
            weight[r] += 1
            for index in range(row_starts[r], row_starts[r + 1]):
                # A chosen place of a row in need is needed too.
                score[places[index]] += 1
    if counters[LACKING] == 0:
        best[:] = is_in


@kernel
def _draw(counters, n):
    """Return a random whole number from 0 to n - 1: xorshift64*, Vigna 2016."""
    value = np.uint64(counters[RANDOM])
    value ^= value >> np.uint64(12)
    value ^= value << np.uint64(25)
    value ^= value >> np.uint64(27)
    counters[RANDOM] = np.int64(value)
    return np.int64(((value * MULTIPLIER) >> np.uint64(33)) % np.uint64(n))


@kernel
def _lightest(chosen, n_chosen, score, moved, kept):
    best = -1
    for at in range(n_chosen):
        j = chosen[at]
        if j != kept and (best < 0 or score[j] < score[best] or (score[j] == score[best] and moved[j] < moved[best])):
            best = j
    return best


@kernel
def _put(j, matrix, need, state):
    """Add place j; keep covers, scores and lists true."""
    row_starts, places, place_starts, rows, conflict_starts, conflicts = matrix
    is_in, cover, blocked, weight, score, chosen, place_in_chosen, lacking, place_in_lacking, _, counters = state
    is_in[j] = True
    chosen[counters[CHOSEN]], place_in_chosen[j] = j, counters[CHOSEN]
    counters[CHOSEN] += 1
    for at in range(conflict_starts[j], conflict_starts[j + 1]):
        blocked[conflicts[at]] += 1
    own = 0
    for at in range(place_starts[j], place_starts[j + 1]):
        r = rows[at]
        cover[r] += 1
        if cover[r] <= need[r]:
            own += weight[r]
        if cover[r] == need[r]:
            # Served now: no other place helps it any more.
            for index in range(row_starts[r], row_starts[r + 1]):
                if not is_in[places[index]]:
                    score[places[index]] -= weight[r]
            counters[LACKING] -= 1
            last = lacking[counters[LACKING]]
            lacking[place_in_lacking[r]], place_in_lacking[last] = last, place_in_lacking[r]
            place_in_lacking[r] = -1
        elif cover[r] == need[r] + 1:
            # One to spare: none of its places is needed for it.
            for index in range(row_starts[r], row_starts[r + 1]):
                if is_in[places[index]] and places[index] != j:
                    score[places[index]] -= weight[r]
    score[j] = own


@kernel
def _take(j, matrix, need, state):
    """Take place j away; keep covers, scores and lists true."""
    row_starts, places, place_starts, rows, conflict_starts, conflicts = matrix
    is_in, cover, blocked, weight, score, chosen, place_in_chosen, lacking, place_in_lacking, _, counters = state
    is_in[j] = False
    counters[CHOSEN] -= 1
    last = chosen[counters[CHOSEN]]
    chosen[place_in_chosen[j]], place_in_chosen[last] = last, place_in_chosen[j]
    place_in_chosen[j] = -1
    for at in range(conflict_starts[j], conflict_starts[j + 1]):
        blocked[conflicts[at]] -= 1
    own = 0
    for at in range(place_starts[j], place_starts[j + 1]):
        r = rows[at]
        cover[r] -= 1
        if cover[r] < need[r]:
            own += weight[r]
        if cover[r] == need[r] - 1:
            for index in range(row_starts[r], row_starts[r + 1]):
                if not is_in[places[index]] and places[index] != j:
                    score[places[index]] += weight[r]
            lacking[counters[LACKING]], place_in_lacking[r] = r, counters[LACKING]
            counters[LACKING] += 1
        elif cover[r] == need[r]:
            for index in range(row_starts[r], row_starts[r + 1]):
                if is_in[places[index]]:
                    score[places[index]] += weight[r]
    score[j] = own
