"""What can be had at once: designs that no other beats in every objective, how sure that is, and the knee.

Every objective is minimised; turn the sign of one that is to be large. Exact objectives (price, speed) have one value
per design, sampled ones (an error, a time to converge) one per run. A design is *dominated* if another is at least as
good in every objective and better in one, by the means over the runs: that is a sentence about point estimates. How
far it hangs on the runs that happened to be drawn is what `membership` tells.

References
----------
.. [1] I. Das, On characterizing the "knee" of the Pareto curve based on normal-boundary intersection, Structural
   Optimization 18 (1999) 107-115.
.. [2] B. Efron, R. J. Tibshirani, An Introduction to the Bootstrap, 1993, chapter 6.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rfiddesign import require

#: Rows compared with all others at a time: bounds memory at some 8 MB per objective and ten thousand designs.
_BLOCK = 100
#: Below this determinant, relative to its rows' lengths, optima of single objectives span no hyperplane.
_FLAT = 1e-9

BY_OPTIMA = "farthest below the hyperplane through the members that are best in one objective"
BY_SUM = "least sum of the objectives, each from 0 (best on the front) to 1 (worst on it)"


@dataclass(frozen=True)
class Knee:
    """The member of a front beyond which a little more of one objective costs much of the others.

    Parameters
    ----------
    index : the member, as a row of the values given.
    method : by which definition.
    depth : how far below the reference plane it lies, in objectives normalised over the front; 0 if none lies below.
    """

    index: int
    method: str
    depth: float


def non_dominated(values: ArrayLike) -> NDArray[np.bool_]:
    """Which rows of `values` (n, k) no other row dominates, shape (n,); equal rows do not dominate each other.

    Raises
    ------
    ValueError : unless `values` is two-dimensional and without nan.
    """
    values = _table(values)
    is_on = np.ones(len(values), bool)
    for first in range(0, len(values), _BLOCK):
        rows = values[first : first + _BLOCK, None, :]
        is_no_worse = (values[None] <= rows).all(axis=2)
        is_better = (values[None] < rows).any(axis=2)
        is_on[first : first + _BLOCK] = ~(is_no_worse & is_better).any(axis=1)
    return is_on


def layers(values: ArrayLike) -> NDArray[np.int64]:
    """The front that each row of `values` (n, k) is on once the fronts before it are taken away, from 0, shape (n,)."""
    values = _table(values)
    layer = np.full(len(values), -1)
    remaining = np.arange(len(values))
    number = 0
    while remaining.size:
        is_on = non_dominated(values[remaining])
        layer[remaining[is_on]] = number
        remaining = remaining[~is_on]
        number += 1
    return layer


def knee(values: ArrayLike) -> Knee:
    """The knee of a front, of which `values` (n, k) are the members' objectives.

    Objectives are first normalised over the front, from 0 at its best to 1 at its worst value. The knee is then the
    member farthest below the hyperplane through the k members that are each best in one objective [1]_; of equal ones
    the first. Where those k span no hyperplane, as where one member is best in two objectives, it is the member with
    the least sum of the normalised objectives, which for k = 2 is the same.

    Raises
    ------
    ValueError : without a member, or as `non_dominated`.
    """
    values = _table(values)
    if not len(values):
        raise ValueError("values has no row, a knee needs a front with at least one member")
    low, high = values.min(axis=0), values.max(axis=0)
    is_varied = high > low
    if not is_varied.any():
        return Knee(0, BY_SUM, 0.0)
    scaled = (values - low)[:, is_varied] / (high - low)[is_varied]
    k = scaled.shape[1]
    # Of those best in an objective the one best in the others, too.
    optima = np.array([scaled[np.lexsort((scaled.sum(axis=1), scaled[:, i]))[0]] for i in range(k)])
    normal, method = _normal(optima)
    level = optima[0] @ normal if method == BY_OPTIMA else float((optima @ normal).min())
    below = level - scaled @ normal
    index = int(below.argmax())
    return Knee(index, method, max(float(below[index]), 0.0))


def _normal(optima: NDArray[np.float64]) -> tuple[NDArray[np.float64], str]:
    """The unit normal of the hyperplane through k points (k, k) if all its parts are positive, else that of the sum."""
    k = len(optima)
    by_sum = np.full(k, 1 / np.sqrt(k))
    edges = optima[1:] - optima[0]
    if k == 1:
        return by_sum, BY_SUM
    lengths = np.linalg.norm(edges, axis=1)
    if (lengths == 0).any():
        return by_sum, BY_SUM
    _, sizes, axes = np.linalg.svd(edges / lengths[:, None])
    normal = axes[-1] * np.sign(axes[-1].sum() or 1.0)
    if sizes.min() < _FLAT or (normal <= 0).any():
        return by_sum, BY_SUM
    return normal, BY_OPTIMA


def membership(exact: ArrayLike, sampled: ArrayLike, *, seed: int, n_draws: int = 1000) -> NDArray[np.float64]:
    """Chance of each design to be on the front, by bootstrap over its runs, shape (n,).

    Runs are paired: run i met the same route and noise for every design, so that all designs' runs are redrawn
    together. What it covers is the chance of the runs; that a design was never tried it cannot know.

    Parameters
    ----------
    exact : objectives that are known, shape (n, k_exact), k_exact may be 0.
    sampled : objectives that are means over runs, shape (n, n_runs, k_sampled).
    seed : seed of the draws.
    n_draws : how many times the runs are redrawn.

    Raises
    ------
    ValueError : if the shapes do not fit or there is no run.
    """
    exact, sampled = np.asarray(exact, float), np.asarray(sampled, float)
    if exact.ndim != 2 or sampled.ndim != 3 or len(exact) != len(sampled) or not sampled.shape[1]:
        raise ValueError(
            f"exact and sampled have shapes {exact.shape} and {sampled.shape}: must be (n, k) and (n, n_runs, k) with"
            " at least one run"
        )
    n_draws, n_runs = require.count("n_draws", n_draws, at_most=1_000_000), sampled.shape[1]
    generator = np.random.Generator(np.random.PCG64(seed))
    n_on = np.zeros(len(exact))
    for _ in range(n_draws):
        drawn = generator.integers(0, n_runs, n_runs)
        weights = np.bincount(drawn, minlength=n_runs) / n_runs
        means = np.einsum("nrk,r->nk", sampled, weights)
        n_on += non_dominated(np.concatenate([exact, means], axis=1))
    return n_on / n_draws


def _table(values: ArrayLike) -> NDArray[np.float64]:
    values = np.asarray(values, float)
    if values.ndim != 2 or np.isnan(values).any():
        raise ValueError(f"values of shape {values.shape}: must be two-dimensional and without nan")
    return values
