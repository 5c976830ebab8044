"""Windows grouped by where they are, so that each group's problem is small."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array


def tiles(rows: csr_array, places: NDArray, n_at_most: int, share: float = 0.5) -> list[NDArray[np.int64]]:
    """Split the rows of a cover matrix into groups of neighbours of at most `n_at_most`, across their longer side.

    `share` of the rows go to one side; other shares give groups with other borders.
    """
    n_places = np.diff(rows.indptr)[:, None]
    centres = (rows.astype(np.float64) @ places) / n_places
    groups, pending = [], [np.arange(len(centres))]
    while pending:
        group = pending.pop()
        if len(group) <= n_at_most:
            groups.append(group)
            continue
        axis = int(np.argmax(np.ptp(centres[group], axis=0)))
        ordered = group[np.argsort(centres[group, axis], kind="stable")]
        cut = max(int(share * len(ordered)), 1)
        pending += [ordered[cut:], ordered[:cut]]
    return groups
