"""The fewest readers by integer programming: HiGHS, by way of cvxpy, on the rows that matter."""

import itertools
import math
from dataclasses import dataclass

import cvxpy as cp
import numpy as np
import scipy.sparse
from numpy.typing import NDArray

from rfiddesign.optimize.quiet_highs import solve_with_highs
from rfiddesign.optimize.reader_placement.problem import PlacementProblem

#: The solver's tolerance on whole numbers.
_ROUNDING = 1e-6


@dataclass(frozen=True)
class SolverLimits:
    """When the solver gives up; all but the last are the same on every machine.

    Parameters
    ----------
    n_first_rows, n_added_rows : rows of the first program, those that fewest mount points serve; and rows that each
        solution leaves unserved, added to the next one.
    max_programs : programs solved at most.
    max_nodes : nodes of the search tree of each.
    time_limit_s : seconds for each, if any; an answer then depends on the machine.
    """

    n_first_rows: int = 150
    n_added_rows: int = 40
    max_programs: int = 12
    max_nodes: int = 100
    time_limit_s: float | None = None


@dataclass(frozen=True, eq=False)
class ExactAnswer:
    """What integer programs tell of a cover.

    Parameters
    ----------
    chosen : (k,) mount points that serve all rows, or None if none were found.
    lower_bound : no cover has fewer readers.
    n_rows : of the last program.
    """

    chosen: NDArray[np.int64] | None
    lower_bound: int
    n_rows: int


def cover_exactly(
    problem: PlacementProblem, is_served: NDArray[np.bool_], n_readers: tuple[int, int], limits: SolverLimits
) -> ExactAnswer:
    """Look for a cover by few mount points without conflict, or prove that there is none.

    Programs with some of the rows only are solved; what a solution leaves unserved is added.  A bound on some rows is
    one on all.

    Parameters
    ----------
    is_served : (n, m) which mount point serves which row.
    n_readers : a bound known already, and the most that are of interest.
    """
    lower, at_most = n_readers
    order = np.argsort(np.count_nonzero(is_served, axis=1), kind="stable")
    rows = order[: limits.n_first_rows]
    for _ in range(limits.max_programs):
        chosen, bound = _solve(problem, is_served[rows], (lower, at_most), limits)
        lower = max(lower, bound)
        if chosen is None:
            break
        left = np.flatnonzero(np.count_nonzero(is_served[:, chosen], axis=1) < problem.n_wanted)
        if not len(left):
            return ExactAnswer(chosen, lower, len(rows))
        rows = np.concatenate([rows, left[np.linspace(0, len(left) - 1, limits.n_added_rows).astype(int)]])
        rows = np.unique(rows)
    return ExactAnswer(None, lower, len(rows))


def exclusions(problem: PlacementProblem) -> scipy.sparse.csr_matrix:
    """Sets of mount points (k, m) of which at most one can be taken: those within a window as large as a housing.

    Any two housings that overlap have their mount points in such a window, and any two in a window overlap.
    """
    mounts = problem.mounts
    # Corners at all places of the grid: a window whose corner is no mount point may still hold two that conflict.
    corners = itertools.product(np.unique(mounts[:, 0]), np.unique(mounts[:, 1]))
    windows = np.array(
        [problem.are_in_conflict(mounts, np.array(corner)) & (mounts >= corner).all(axis=1) for corner in corners]
    )
    windows = np.unique(windows[np.count_nonzero(windows, axis=1) > 1], axis=0)
    sparse = scipy.sparse.csr_matrix(windows.astype(np.int32))
    shared = (sparse @ sparse.T).toarray()
    np.fill_diagonal(shared, 0)
    is_within_another = (shared == np.count_nonzero(windows, axis=1)[:, None]).any(axis=1)
    return scipy.sparse.csr_matrix(windows[~is_within_another].astype(np.float64))


def _solve(
    problem: PlacementProblem, is_served: NDArray[np.bool_], n_readers: tuple[int, int], limits: SolverLimits
) -> tuple[NDArray[np.int64] | None, int]:
    """Mount points that serve these rows, or None; and a lower bound, one above `n_readers` if there are none."""
    at_least, at_most = n_readers
    x = cp.Variable(is_served.shape[1], boolean=True)
    serves = scipy.sparse.csr_matrix(is_served.astype(np.float64))
    constraints = [cp.sum(x) >= at_least, cp.sum(x) <= at_most, serves @ x >= problem.n_wanted]
    excluded = exclusions(problem)
    if excluded.shape[0]:
        constraints.append(excluded @ x <= 1)
    model = cp.Problem(cp.Minimize(cp.sum(x)), constraints)
    options = {"mip_max_nodes": limits.max_nodes}
    if limits.time_limit_s is not None:
        options["time_limit"] = limits.time_limit_s
    try:
        solve_with_highs(model, **options)
    except cp.SolverError:
        return None, 0
    if model.status in (cp.INFEASIBLE, cp.INFEASIBLE_INACCURATE):
        return None, at_most + 1
    bound = model.solver_stats.extra_stats.mip_dual_bound
    lower = math.ceil(bound - _ROUNDING) if math.isfinite(bound) else 0
    if x.value is None or not np.isfinite(x.value).all():
        return None, lower
    return np.flatnonzero(x.value > 0.5), lower
