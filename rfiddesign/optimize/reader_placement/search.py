"""Local search for mount points that serve the rows of a cover."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rfiddesign import require
from rfiddesign.optimize.reader_placement._swap_kernels import best_swaps, fewest_unserved
from rfiddesign.optimize.reader_placement.demand import Demand
from rfiddesign.optimize.reader_placement.exact import SolverLimits
from rfiddesign.optimize.reader_placement.problem import PlacementProblem


@dataclass(frozen=True)
class PlacementLimits:
    """How hard to search; everything is counted, so that an answer is the same on every machine.

    Parameters
    ----------
    seed : of the local search.
    n_restarts, n_steps : local searches, and steps of each.
    n_swaps : best swaps that then shorten the mean distance.
    max_rounds : times that poses which a layout leaves unserved become rows of the search, before one more reader is
        taken.
    n_added : such poses that one round adds for each motion.
    allowed_share : of sampled poses that may stay unserved.
    solver : limits of the integer solver.
    """

    seed: int = 1
    n_restarts: int = 6
    n_steps: int = 1500
    n_swaps: int = 60
    max_rounds: int = 20
    n_added: int = 150
    allowed_share: float = 0.0
    solver: SolverLimits = field(default_factory=SolverLimits)

    def __post_init__(self) -> None:
        require.seed("seed", self.seed)
        require.within("allowed_share", self.allowed_share, low=0.0, high=0.5)


def conflicts(problem: PlacementProblem) -> NDArray[np.bool_]:
    """Which mount points (m, m) exclude each other; each itself, too."""
    return problem.are_in_conflict(problem.mounts[:, None], problem.mounts[None, :])


def serving_mounts(
    problem: PlacementProblem, rows: Demand, n_readers: int, limits: PlacementLimits
) -> tuple[NDArray[np.int64], int]:
    """Mount points (k,) that leave few rows unserved, and how many: the best of some local searches.

    They are fewer than `n_readers` only if no more fit.
    """
    serves = np.ascontiguousarray(rows.is_served.T.astype(np.uint8))
    excluded = conflicts(problem)
    enough = int(limits.allowed_share * len(rows.poses))
    best, fewest = np.zeros(0, np.int64), len(rows.poses) + 1
    for restart in range(limits.n_restarts):
        generator = np.random.Generator(np.random.PCG64((limits.seed, n_readers, restart)))
        randoms = generator.integers(0, 2**32, limits.n_steps, dtype=np.uint32)
        chosen, n_left = fewest_unserved(serves, excluded, problem.n_wanted, n_readers, enough, randoms)
        if len(chosen) > len(best) or (len(chosen) == len(best) and n_left < fewest):
            best, fewest = chosen, n_left
        if len(best) == n_readers and fewest <= enough:
            break
    return best, fewest


def nearer_reads(
    problem: PlacementProblem, rows: Demand, chosen: NDArray[np.int64], limits: PlacementLimits
) -> NDArray[np.int64]:
    """Mount points (k,) with a shorter mean distance to the wanted read, reached by swaps that serve no fewer rows.

    A row left unserved costs as much as all others together could gain.
    """
    if len(chosen) < problem.n_wanted:
        return chosen
    distances = np.where(rows.is_served, rows.distances, len(rows.poses) + 1.0).astype(np.float64)
    nearer, _ = best_swaps(distances, conflicts(problem), problem.n_wanted, chosen, limits.n_swaps)
    is_worse = n_unserved(problem, rows, nearer) > n_unserved(problem, rows, chosen)
    return chosen if is_worse else nearer


def n_unserved(problem: PlacementProblem, rows: Demand, chosen: NDArray[np.int64]) -> int:
    """How many rows the chosen mount points (k,) leave unserved."""
    return int(np.count_nonzero(rows.n_reading(chosen) < problem.n_wanted))
