"""Local search for mount points: weighting of unserved rows, and best swaps."""

import numpy as np

from rfiddesign.numerics._compile_kernels import kernel


@kernel
def fewest_unserved(serves, conflicts, n_wanted, n_readers, n_allowed, randoms):
    """Search `n_readers` mount points without conflict that leave the fewest rows unserved.

    Row weighting local search for covers (Gao, Weise and Li 2015): the reader whose loss costs least makes place for
    the mount point that serves the most of what is not served, near a row drawn at random; rows that stay unserved
    weigh more and more.

    Parameters
    ----------
    serves : (m, n) uint8, which mount point serves which row.
    conflicts : (m, m) bool, which of them exclude each other; each itself, too.
    n_wanted : readers that must serve a row.
    n_readers : mount points sought.
    n_allowed : the search ends when no more rows than these are unserved.
    randoms : (n_steps,) uint32; it ends after so many steps.

    Returns
    -------
    best : (k,) mount points; k < n_readers only if no more were ever made to fit.
    n_unserved : rows that they leave unserved.
    """
    n_mounts, n_rows = serves.shape
    weights, n_serving = np.ones(n_rows), np.zeros(n_rows, np.int64)
    chosen, n_chosen = np.empty(n_readers, np.int64), 0
    blocked, last_moved = np.zeros(n_mounts, np.int64), np.full(n_mounts, -2)
    unserved = np.arange(n_rows)
    n_unserved = n_rows
    best, best_unserved = chosen[:0].copy(), n_rows + 1
    for step in range(-n_readers, len(randoms)):
        if step >= 0 and n_chosen == n_readers:
            out, least = 0, np.inf
            for k in range(n_chosen):
                loss = 0.0
                for row in range(n_rows):
                    if serves[chosen[k], row] and n_serving[row] <= n_wanted:
                        loss += weights[row]
                if loss < least and (last_moved[chosen[k]] < step - 1 or n_chosen == 1):
                    out, least = k, loss
            n_chosen = _remove(out, chosen, n_chosen, serves, conflicts, n_serving, blocked)
            last_moved[chosen[n_chosen]] = step
        n_unserved = 0
        for row in range(n_rows):
            if n_serving[row] < n_wanted:
                unserved[n_unserved] = row
                n_unserved += 1
        target = unserved[randoms[max(step, 0)] % n_unserved] if step >= 0 and n_unserved > 0 else -1
        into, most = -1, -1.0
        for mount in range(n_mounts):
            if (
                blocked[mount]
                or (step >= 0 and last_moved[mount] == step)
                or (target >= 0 and not serves[mount, target])
            ):
                continue
            gain = 0.0
            for k in range(n_unserved):
                if serves[mount, unserved[k]]:
                    gain += weights[unserved[k]]
            if gain > most or (gain == most and last_moved[mount] < last_moved[into]):
                into, most = mount, gain
        if into < 0:
            # Nothing fits beside the others: one of them, drawn at random, makes place.
            if n_chosen > 0 and step >= 0:
                out = (randoms[step] // 65536) % n_chosen
                n_chosen = _remove(out, chosen, n_chosen, serves, conflicts, n_serving, blocked)
                last_moved[chosen[n_chosen]] = step
            continue
        chosen[n_chosen] = into
        n_chosen += 1
        last_moved[into] = step
        n_unserved = 0
        for mount in range(n_mounts):
            blocked[mount] += conflicts[into, mount]
        for row in range(n_rows):
            n_serving[row] += serves[into, row]
            if n_serving[row] < n_wanted:
                n_unserved += 1
                weights[row] += 1.0
        if n_chosen > len(best) or (n_chosen == len(best) and n_unserved < best_unserved):
            best, best_unserved = chosen[:n_chosen].copy(), n_unserved
        if n_chosen == n_readers and n_unserved <= n_allowed:
            break
    return best, best_unserved


@kernel
def _remove(out, chosen, n_chosen, serves, conflicts, n_serving, blocked):
    """Take a chosen mount point away; it is left behind the last of those chosen."""
    mount = chosen[out]
    chosen[out] = chosen[n_chosen - 1]
    chosen[n_chosen - 1] = mount
    for row in range(serves.shape[1]):
        n_serving[row] -= serves[mount, row]
    for other in range(len(blocked)):
        blocked[other] -= conflicts[mount, other]
    return n_chosen - 1


@kernel
def best_swaps(distances, conflicts, n_wanted, chosen, max_swaps):
    """Swap one mount point for another, the best swap first, while the mean distance to the wanted read falls.

    Parameters
    ----------
    distances : (n, m) float64, how far each mount point is from its read in each row; finite.
    conflicts : (m, m) bool, which of them exclude each other.
    n_wanted : the distance counts to the read by so many different antennas.
    chosen : (k,) mount points to begin with, k >= n_wanted.
    max_swaps : at most so many.

    Returns
    -------
    chosen : (k,) mount points.
    total : sum of the distances over all rows.
    """
    n_rows, n_mounts = distances.shape
    k = len(chosen)
    chosen = chosen.copy()
    total = np.inf
    costs = np.empty((k, n_mounts))
    rest = np.empty(k)
    for _ in range(max_swaps + 1):
        costs[:] = 0.0
        total = 0.0
        for row in range(n_rows):
            for out in range(k):
                n = 0
                for c in range(k):
                    if c != out:
                        rest[n] = distances[row, chosen[c]]
                        n += 1
                rest[:n].sort()
                # The wanted read lies between those of the readers that stay, wherever the new one is.
                low = rest[n_wanted - 2] if n_wanted >= 2 else -np.inf
                high = rest[n_wanted - 1] if n_wanted <= n else np.inf
                if out == 0:
                    total += min(max(distances[row, chosen[0]], low), high)
                for mount in range(n_mounts):
                    costs[out, mount] += min(max(distances[row, mount], low), high)
        best_out, into, least = -1, -1, total - 1e-9 * abs(total)
        for out in range(k):
            for mount in range(n_mounts):
                if costs[out, mount] >= least:
                    continue
                is_free = True
                for c in range(k):
                    if c != out and conflicts[mount, chosen[c]]:
                        is_free = False
                if is_free:
                    best_out, into, least = out, mount, costs[out, mount]
        if into < 0:
            break
        chosen[best_out] = into
    return chosen, total
