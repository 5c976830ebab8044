"""How few tags any placement needs: a lower bound that linear programming finds and integer arithmetic proves.

For any weights y >= 0 of the rows, every choice of places that gives each row n of them has at least

    n sum(y) - sum over places max(0, load - 1),   load = sum of y over the place's rows,

tags: the n sum(y) count each tag by its load, and a load above 1 can count once only (linear programming duality, with
x <= 1). So it does not matter how exactly the weights were found: they are rounded to whole multiples of 2^-20 and the
sum is done in integers.

The weights come tile by tile from the linear relaxation, in which a place costs 1 less its load from other tiles. A
second pass over tiles with other borders makes good what was lost at the borders of the first.
"""

from collections.abc import Callable

import highspy
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from rfiddesign.optimize.quiet_highs import quiet_highs
from rfiddesign.optimize.tag_placement.cover import Cover
from rfiddesign.optimize.tag_placement.tiles import tiles

#: Rows of a tile at most: HiGHS takes about half a second for one.
TILE_ROWS = 1500
#: How each pass splits, see `tiles`.
BORDER_SHARES = (0.5, 0.35)
WEIGHT_UNIT = 2**20


def lower_bound(
    cover: Cover, places: NDArray, n_cover: int, on_progress: Callable[[str, int, int], None] | None = None
) -> int:
    """Return a number of tags below which no choice of the places serves every row `n_cover` times."""
    load, weights = np.zeros(len(places)), np.zeros(cover.rows.shape[0])
    groups = [group for share in BORDER_SHARES for group in tiles(cover.rows, places, TILE_ROWS, share)]
    for number, group in enumerate(groups):
        part = cover.rows[group]
        used = np.unique(part.indices)
        part = part[:, used].astype(np.float64)
        load[used] -= part.T @ weights[group]
        weights[group] = relaxed_weights(part, np.maximum(1.0 - load[used], 0.0), n_cover)
        load[used] += part.T @ weights[group]
        if on_progress is not None:
            on_progress("bound", number + 1, len(groups))
    return proved_bound(cover, weights, n_cover)


def proved_bound(cover: Cover, weights: NDArray, n_cover: int) -> int:
    """Return the bound that weights (n_rows,) of the rows prove, rounded up to whole tags; in integers."""
    whole = np.floor(np.maximum(weights, 0.0) * WEIGHT_UNIT).astype(np.int64)
    loads = cover.columns.astype(np.int64) @ whole
    bound = n_cover * int(whole.sum()) - int(np.maximum(loads - WEIGHT_UNIT, 0).sum())
    return max(-(-bound // WEIGHT_UNIT), 0)


def relaxed_weights(rows: csr_array, cost: NDArray, n_cover: int) -> NDArray[np.float64]:
    """Return the rows' dual prices (n,) in the linear relaxation: cheapest 0 <= x <= 1 that serves all rows.

    All 0 if the solver finds none, which is a valid choice of weights too.
    """
    solver = quiet_highs(solver="ipm", run_crossover="off")
    solver.passModel(cover_model(rows, cost, n_cover))
    solver.run()
    prices = np.array(solver.getSolution().row_dual)
    is_usable = len(prices) == rows.shape[0] and np.isfinite(prices).all()
    return np.maximum(prices, 0.0) if is_usable else np.zeros(rows.shape[0])


def cover_model(rows: csr_array, cost: NDArray, n_cover: int) -> highspy.HighsLp:
    """Return the model: the least cost of 0 <= x <= 1 with rows x >= n_cover."""
    n_rows, n_places = rows.shape
    model = highspy.HighsLp()
    model.num_row_, model.num_col_ = n_rows, n_places
    model.col_cost_ = np.asarray(cost, np.float64)
    model.col_lower_, model.col_upper_ = np.zeros(n_places), np.ones(n_places)
    model.row_lower_ = np.full(n_rows, float(n_cover))
    model.row_upper_ = np.full(n_rows, highspy.kHighsInf)
    model.a_matrix_.format_ = highspy.MatrixFormat.kRowwise
    model.a_matrix_.start_, model.a_matrix_.index_ = rows.indptr, rows.indices
    model.a_matrix_.value_ = rows.data.astype(np.float64)
    return model
