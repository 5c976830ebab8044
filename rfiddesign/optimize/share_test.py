"""The test of one share of runs: evidence as likelihood ratios, and the integer tables that follow from it.

With p0, p1 and H as in :mod:`rfiddesign.optimize.certify` the e-process of each side is the likelihood ratio of a
mixture over the alternative against the border of H. With S passed and F failed runs,

    E_refute(S, F)  = sum_k w_k q_k^S (1-q_k)^F / (p0^S (1-p0)^F)
    E_certify(S, F) = int_p1^1 q^S (1-q)^F dq / ((1-p1) * p1^S (1-p1)^F)

Refutation mixes over shortfalls g_k = p0 - q_k = (p0 - p1) 2^((k-1)/2), k = 0, 1, ... as far as they lie below p0, with
weights w_k in proportion to g_k^(-1/4). A walk spends most of its runs on designs that fall, the more the nearer they
come to p0. With p0 = 0.95 and p1 = 0.90 this refutes a design at p1 with 220 runs in the mean, where a uniform mixture
takes 299, and one at 0.6 with 9 as that does. Certification mixes uniformly: few designs are certified.

At the border of H this is a martingale (Robbins' method of mixtures). Inside H it is a supermartingale: for one q < p0
the next run multiplies the ratio by p q/p0 + (1-p)(1-q)/(1-p0) in the mean, which falls in p and is 1 at p = p0;
likewise mirrored.

References
----------
.. [1] H. Robbins, Statistical methods related to the law of the iterated logarithm, Ann. Math. Statist. 41 (1970)
   1397-1409 (mixtures).
.. [2] T. L. Lai, On confidence sequences, Ann. Statist. 4 (1976) 265-280 (mixtures for one-parameter exponential
   families).
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from rfiddesign.optimize.criteria import ROUNDING_MARGIN, ShareCriterion


@dataclass(frozen=True, eq=False)
class Boundaries:
    """Both tests as integer tables over the number of runs n = 0..max_runs, shape (max_runs + 1,).

    Attributes
    ----------
    refute_at : refuted when the number of passes <= refute_at[n]; -1 where n runs cannot refute.
    certify_at : certified when the number of passes >= certify_at[n]; n + 1 where n runs cannot certify.
    """

    refute_at: NDArray[np.int64]
    certify_at: NDArray[np.int64]

    @property
    def max_runs(self) -> int:
        return len(self.refute_at) - 1

    def crossed(self, scores: NDArray) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Whether the first 1, 2, ... runs refute and certify, two arrays (n,), by scores (n,): 1 if passed, else 0."""
        n = len(scores)
        passes = np.cumsum(np.asarray(scores, np.int64))
        return passes <= self.refute_at[1 : n + 1], passes >= self.certify_at[1 : n + 1]

    @cached_property
    def soonest(self) -> int:
        """The fewest runs that can decide anything; max_runs if none can."""
        n = np.arange(self.max_runs + 1)
        can_decide = (self.refute_at >= 0) | (self.certify_at <= n)
        return int(can_decide.argmax()) if can_decide.any() else self.max_runs


@lru_cache(maxsize=256)
def share_boundaries(
    criterion: ShareCriterion, refute_threshold: float, certify_threshold: float, max_runs: int
) -> Boundaries:
    """The tables of both tests of a share (arrays are read-only).

    The entry for n runs depends on neither max_runs nor on later entries: a larger cap lengthens the tables and
    changes nothing. Only the four basic operations and square roots of doubles are used, so every
    IEEE machine computes the same tables.
    """
    p0, p1 = criterion.hold, criterion.fail
    n = np.arange(max_runs + 1)
    refuting = _passes_refuted(p0, p1, refute_threshold, max_runs)
    certifying = _fails_certified(p1, certify_threshold, max_runs)
    # totals rise strictly: how many of them are <= n says how many adverse outcomes n runs can carry, counted from 0
    refute_at = np.searchsorted(refuting, n, side="right") - 1
    certify_at = n - (np.searchsorted(certifying, n, side="right") - 1)
    refute_at.setflags(write=False)
    certify_at.setflags(write=False)
    return Boundaries(refute_at, certify_at)


def refuting_mixture(hold: float, fail: float) -> tuple[list[float], list[float]]:
    """The pass probabilities q_k below p0 that refutation bets on, from near p0 down, and their weights w_k."""
    step = sqrt(2.0)
    shortfalls = [(hold - fail) / step]
    while shortfalls[-1] * step < hold:
        shortfalls.append(shortfalls[-1] * step)
    stakes = [1.0 / sqrt(sqrt(shortfall)) for shortfall in shortfalls]
    return [hold - shortfall for shortfall in shortfalls], [stake / sum(stakes) for stake in stakes]


def _passes_refuted(p0: float, p1: float, threshold: float, max_runs: int) -> list[int]:
    """Runs at which E_refute with 0, 1, ... passes first reaches the threshold, as far as max_runs.

    E falls with each pass and rises with each fail, so one path along the boundary visits every crossing.
    """
    threshold *= 1 + ROUNDING_MARGIN
    alternatives, terms = refuting_mixture(p0, p1)
    by_pass = [q / p0 for q in alternatives]
    by_fail = [(1 - q) / (1 - p0) for q in alternatives]
    totals = []
    for n in range(max_runs + 1):
        if sum(terms) < threshold:
            ratios = by_fail
        else:
            totals.append(n)
            ratios = by_pass
        terms = [term * ratio for term, ratio in zip(terms, ratios, strict=True)]
    return totals


def _fails_certified(p1: float, threshold: float, max_runs: int) -> list[int]:
    """Runs at which E_certify with 0, 1, ... fails first reaches the threshold, as far as max_runs.

    With a fails and b passes E(a, b) = B(1-p1; a+1, b+1) / ((1-p1)^(a+1) p1^b), an incomplete beta function whose
    neighbours follow from each other by integration by parts:

        E(a, b+1) = (1 + (b+1) E / p1) / (a+b+2)
        E(a+1, b) = ((a+1) E - p1) / ((a+b+2) (1-p1))

    E rises with b and falls with a, so one path along the boundary visits every crossing. The second step is taken at
    E >= threshold > 1 only, where its subtraction loses nothing.
    """
    threshold *= 1 + ROUNDING_MARGIN
    totals = []
    fails = passes = 0
    e_value = 1.0
    while fails + passes <= max_runs:
        n = fails + passes
        if e_value < threshold:
            passes += 1
            e_value = (1 + passes * e_value / p1) / (n + 2)
        else:
            totals.append(n)
            fails += 1
            e_value = (fails * e_value - p1) / ((n + 2) * (1 - p1))
    return totals
