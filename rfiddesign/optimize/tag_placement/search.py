"""Choose the fewest places that serve every row: greedy and pruned first, then searched, then proved if small."""

from collections.abc import Callable

import highspy
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from rfiddesign.optimize.quiet_highs import quiet_highs
from rfiddesign.optimize.tag_placement import _search_kernels as kernels
from rfiddesign.optimize.tag_placement.bound import cover_model
from rfiddesign.optimize.tag_placement.cover import Cover

#: Rounds of the search between two reports of its progress.
ROUNDS_AT_ONCE = 50_000
#: Problems up to this many entries are given to HiGHS to be proved, for at most so many nodes.
PROVABLE_ENTRIES, PROVE_NODES = 30_000, 500

Progress = Callable[[str, int, int], None]


def conflicts_of(places: NDArray, min_distance: float) -> csr_array:
    """Return which places are closer than `min_distance` [mm] to which, (n_places, n_places) without diagonal."""
    n = len(places)
    if min_distance <= 0:
        return csr_array((n, n), dtype=np.int8)
    pairs = cKDTree(places).query_pairs(min_distance * (1 - 1e-9), output_type="ndarray")
    both = np.concatenate([pairs, pairs[:, ::-1]])
    return csr_array((np.ones(len(both), np.int8), (both[:, 0], both[:, 1])), shape=(n, n))


def greedy_choice(cover: Cover, conflicts: csr_array) -> tuple[NDArray[np.bool_], int]:
    """Return chosen places (n_places,), none of them without need, and the number of rows left in need.

    Rows are left in need only where places in conflict block each other.
    """
    chosen = np.zeros(cover.rows.shape[1], dtype=bool)
    n_lacking = kernels.greedy(_arrays(cover, conflicts), cover.need, chosen)
    kernels.prune(_arrays(cover, conflicts), cover.need, chosen)
    return chosen, int(n_lacking)


def searched(
    cover: Cover, conflicts: csr_array, chosen: NDArray, n_rounds: int, seed: int,
    on_progress: Progress | None = None,
) -> NDArray[np.bool_]:  # fmt: skip
    """Return a choice that serves all rows with at most as many places as `chosen`, which does."""
    best = chosen.copy()
    state = kernels.start(_arrays(cover, conflicts), cover.need, best, seed)
    done = 0
    while done < n_rounds:
        done = min(done + ROUNDS_AT_ONCE, n_rounds)
        kernels.search(_arrays(cover, conflicts), cover.need, best, state, done)
        if on_progress is not None:
            on_progress("search", done, n_rounds)
    return best


def proved(cover: Cover, conflicts: csr_array) -> NDArray[np.bool_] | None:
    """Return the fewest places, or None if the problem is too large or HiGHS does not close it within its nodes."""
    if cover.rows.nnz + conflicts.nnz > PROVABLE_ENTRIES or cover.rows.shape[0] == 0:
        return None
    solver = quiet_highs(mip_max_nodes=PROVE_NODES, mip_rel_gap=0.0, mip_abs_gap=0.99)
    n_places = cover.rows.shape[1]
    model = cover_model(cover.rows, np.ones(n_places), cover.need)
    model.integrality_ = [highspy.HighsVarType.kInteger] * n_places
    solver.passModel(model)
    for first, second in np.argwhere(np.triu(conflicts.toarray())) if conflicts.nnz else ():
        solver.addRow(-highspy.kHighsInf, 1.0, 2, np.array([first, second]), np.ones(2))
    solver.run()
    if solver.getModelStatus() != highspy.HighsModelStatus.kOptimal:
        return None
    return np.array(solver.getSolution().col_value) > 0.5


def counts_of(cover: Cover, chosen: NDArray) -> NDArray[np.int64]:
    """Return how many chosen places each row (n_rows,) has, counted anew in integers."""
    return cover.rows.astype(np.int64) @ chosen.astype(np.int64)


def _arrays(cover: Cover, conflicts: csr_array) -> tuple[NDArray, ...]:
    return (
        cover.rows.indptr.astype(np.int64), cover.rows.indices, cover.columns.indptr.astype(np.int64),
        cover.columns.indices, conflicts.indptr.astype(np.int64), conflicts.indices,
    )  # fmt: skip
