"""Stop a proposal early: once its runs are significantly worse than another's that asks for no more.

optuna's WilcoxonPruner does this for one objective and refuses several; here the runs are ours, and paired: run i met
the same route and noise for both. The test steers where runs are spent. It is no claim, so that looking after every
stage costs no part of a certificate's chance of error.

References
----------
.. [1] F. Wilcoxon, Individual comparisons by ranking methods, Biometrics Bulletin 1 (1945) 80-83.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import wilcoxon


@dataclass(frozen=True)
class Standing:
    """How a proposal stands.

    Parameters
    ----------
    exact : values that need no run, as its price, shape (k,); lower is better.
    per_run : values of each run in their order, shape (n_runs, m); lower is better.
    """

    exact: NDArray[np.float64]
    per_run: NDArray[np.float64]

    @property
    def n_runs(self) -> int:
        """Runs made."""
        return len(self.per_run)


def is_worse(ours: NDArray[np.float64], theirs: NDArray[np.float64], alpha: float) -> bool:
    """Whether paired values (n,) are significantly larger than others: one-sided Wilcoxon signed-rank test [1]_."""
    difference = ours - theirs
    if not (difference > 0).any() or difference.mean() <= 0:
        return False
    return bool(wilcoxon(difference, alternative="greater").pvalue < alpha)


def rival_of(standing: Standing, others: list[Standing]) -> Standing | None:
    """Whom a proposal is held against, None if there is nobody.

    Of those with at least as many runs that are nowhere worse in what is exact it is the one with the least mean on the
    same runs, and of equal ones the first.
    """
    n = standing.n_runs
    rivals = [other for other in others if other.n_runs >= n and (other.exact <= standing.exact).all()]
    if not rivals or not n:
        return None
    return min(rivals, key=lambda other: tuple(other.per_run[:n].mean(axis=0)))


def is_beaten(standing: Standing, others: list[Standing], alpha: float) -> bool:
    """Whether a proposal's runs may stop.

    They may if its rival, nowhere worse in what is exact, is significantly better in every sampled value at `alpha`.
    """
    rival = rival_of(standing, others)
    if rival is None:
        return False
    n = standing.n_runs
    return all(is_worse(standing.per_run[:, i], rival.per_run[:n, i], alpha) for i in range(standing.per_run.shape[1]))
