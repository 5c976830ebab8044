"""Is a mean below a limit?  An anytime-valid test of bounded scores by betting.

Scores x of a design's runs lie in [0, 1], with an unknown law and an unknown mean m.  Whoever believes "m >= m1" must
expect no gain from a bettor who stakes a share of his capital on each next score being lower than m1:

    E(n) = mean over stakes s of  prod over runs i of (1 + s (m1 - x_i)),      0 < s < 1 / (1 - m1),

is a nonnegative process that starts at 1 and whose mean never rises while m >= m1 (mirrored for "m <= m0").  Ville's
inequality bounds the chance that it *ever* reaches 1/alpha by alpha, as in :mod:`rfiddesign.optimize.certify`.  A
mixture of fixed stakes keeps that, and comes within a factor of their number of the best, whatever the scores are.

The scores must be bounded, or one rare run could hide any mean: what exceeds the bound is cut off before, and the
statement is about the mean of what was cut off there.

References
----------
.. [1] I. Waudby-Smith, A. Ramdas, Estimating means of bounded random variables by betting, J. R. Stat. Soc. B 86 (2024)
   1-27, section 4.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from rfiddesign.optimize.criteria import ROUNDING_MARGIN, MeanCriterion

# Stakes as shares of the largest that cannot lose everything: a factor of 1.6 between neighbours costs the bettor a few
# per cent of his growth, and the smallest still gains on differences of a hundredth of the limit.
STAKES = tuple(0.98 * 0.62**k for k in range(12))


@dataclass(frozen=True, eq=False)
class MeanTest:
    """Both tests of a mean.

    Parameters
    ----------
    criterion : the mean asked for.
    refute_threshold, certify_threshold : evidence that decides, 1/alpha.
    max_runs : runs spent on one design at most.
    """

    criterion: MeanCriterion
    refute_threshold: float
    certify_threshold: float
    max_runs: int

    def crossed(self, scores: NDArray[np.float64]) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Whether the evidence of the first 1, 2, ... runs refutes and certifies, two arrays (n,)."""
        hold, fail = self.criterion.hold, self.criterion.fail
        return (
            evidence(scores - hold, 1 / hold) >= self.refute_threshold * (1 + ROUNDING_MARGIN),
            evidence(fail - scores, 1 / (1 - fail)) >= self.certify_threshold * (1 + ROUNDING_MARGIN),
        )

    @cached_property
    def soonest(self) -> int:
        """The fewest runs that can decide anything; max_runs if none can."""
        is_refuted, _ = self.crossed(np.ones(self.max_runs))
        _, is_certified = self.crossed(np.zeros(self.max_runs))
        can_decide = is_refuted | is_certified
        return int(can_decide.argmax()) + 1 if can_decide.any() else self.max_runs


def evidence(gains: NDArray[np.float64], largest_stake: float) -> NDArray[np.float64]:
    """The e-process after each run (n,) from what a stake of 1 gains in each (n,).

    Products and sums are taken in a fixed order with the four basic operations alone: every machine finds the same.
    """
    total = np.zeros(len(gains))
    # Far beyond any threshold a product may exceed what a double holds; "enough" is all that is asked of it.
    with np.errstate(over="ignore", under="ignore"):
        for stake in STAKES:
            total = total + np.multiply.accumulate(1.0 + stake * largest_stake * gains)
        return total / len(STAKES)
