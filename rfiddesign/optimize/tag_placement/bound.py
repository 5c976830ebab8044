"""How few tags any placement needs: a lower bound that linear programming finds and integer arithmetic proves.

For any weights y >= 0 of the rows, every choice of places that gives each row as many of them as it needs has at least

    sum of need y - sum over places of max(0, load - 1),   load = sum of y over the place's rows,

tags: the sums of need y count each tag by its load, and a load above 1 can count once only (linear programming
duality, with x <= 1). So it does not matter how exactly the weights were found: they are rounded to whole multiples of
2^-20 and the sum is done in integers.

The weights come tile by tile from the linear relaxation, in which a place costs 1 less its load from other tiles. A
second pass over tiles with other borders makes good what was lost at the borders of the first.
"""

from collections.abc import Callable
from dataclasses import dataclass

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


@dataclass(eq=False)
class Proof:
    """The sum so far, over parts of a cover problem: `needed` and the load of every place, in whole units."""

    needed: int
    loads: NDArray[np.int64]

    def add(self, cover: Cover, weights: NDArray) -> None:
        """Add the rows of `cover`, of which all places that serve them must be listed, with weights (n_rows,)."""
        whole = np.floor(np.maximum(weights, 0.0) * WEIGHT_UNIT).astype(np.int64)
        self.needed += int((cover.need * whole).sum())
        self.loads[cover.number] += cover.columns.astype(np.int64) @ whole

    @property
    def bound(self) -> int:
        """Number of tags below which the rows added cannot all be served, rounded up."""
        return max(-(-(self.needed - int(np.maximum(self.loads - WEIGHT_UNIT, 0).sum())) // WEIGHT_UNIT), 0)


def row_weights(
    cover: Cover, places: NDArray, loads: NDArray, on_progress: Callable[[str, int, int], None] | None = None
) -> NDArray[np.float64]:
    """Return weights (n_rows,) that prove a good bound.

    Parameters
    ----------
    places : (n_places, 2) [mm].
    loads : (n_places,) what other parts' rows load the places with already.
    on_progress : called with "bound", the tiles done and all tiles.
    """
    load, weights = loads.astype(np.float64), np.zeros(cover.rows.shape[0])
    groups = [group for share in BORDER_SHARES for group in tiles(cover.rows, places, TILE_ROWS, share)]
    for number, group in enumerate(groups):
        part = cover.rows[group]
        used = np.unique(part.indices)
        part = part[:, used].astype(np.float64)
        load[used] -= part.T @ weights[group]
        weights[group] = relaxed_weights(part, np.maximum(1.0 - load[used], 0.0), cover.need[group])
        load[used] += part.T @ weights[group]
        if on_progress is not None:
            on_progress("bound", number + 1, len(groups))
    return weights


def relaxed_weights(rows: csr_array, cost: NDArray, need: NDArray) -> NDArray[np.float64]:
    """Return the rows' dual prices (n,) in the linear relaxation: cheapest 0 <= x <= 1 that serves all rows.

    All 0 if the solver finds none, which is a valid choice of weights too.
    """
    solver = quiet_highs(solver="ipm", run_crossover="off")
    solver.passModel(cover_model(rows, cost, need))
    solver.run()
    prices = np.array(solver.getSolution().row_dual)
    is_usable = len(prices) == rows.shape[0] and np.isfinite(prices).all()
    return np.maximum(prices, 0.0) if is_usable else np.zeros(rows.shape[0])


def cover_model(rows: csr_array, cost: NDArray, need: NDArray) -> highspy.HighsLp:
    """Return the model: the least cost of 0 <= x <= 1 with rows x >= need."""
    n_rows, n_places = rows.shape
    model = highspy.HighsLp()
    model.num_row_, model.num_col_ = n_rows, n_places
    model.col_cost_ = np.asarray(cost, np.float64)
    model.col_lower_, model.col_upper_ = np.zeros(n_places), np.ones(n_places)
    model.row_lower_ = need.astype(np.float64)
    model.row_upper_ = np.full(n_rows, highspy.kHighsInf)
    model.a_matrix_.format_ = highspy.MatrixFormat.kRowwise
    model.a_matrix_.start_, model.a_matrix_.index_ = rows.indptr, rows.indices
    model.a_matrix_.value_ = rows.data.astype(np.float64)
    return model
