"""Likelihoods of a read by where the tag lies, in ellipses ahead of the antenna (tag_mapping_adaptive_likelihood).

An ellipse has one end of its long axis at the antenna.
"""

import math
from dataclasses import dataclass

from rfiddesign import require
from rfiddesign.estimators.tag_mapping.window import EXACT_STEP, Ellipses

#: Short axis over long one, from the paper's experiments (section III-A).
AXES_RATIO = 7 / 20
# Logarithms are exact up to 1,000 in all.
_LEAST_LIKELIHOOD = 1e-6


@dataclass(frozen=True)
class FixedLikelihood:
    """One likelihood within an ellipse, another outside, whatever the signal (section II, figure 1).

    Parameters
    ----------
    length_mm : long axis of the ellipse [mm]; the paper does not tell it.
    inside, outside : likelihoods, 0.9 and 0.5 in the paper.
    ratio : short axis over long one.
    """

    length_mm: float = 1900.0
    inside: float = 0.9
    outside: float = 0.5
    ratio: float = AXES_RATIO

    def __post_init__(self) -> None:
        require.within("length_mm", self.length_mm, low=1.0, high=1e5)
        require.within("ratio", self.ratio, low=0.01, high=100.0)
        require.within("outside", self.outside, low=_LEAST_LIKELIHOOD, high=1.0)
        require.within("inside", self.inside, low=self.outside, high=1.0)

    def ellipses(self, distance_mm: float) -> Ellipses:
        """What a read says; the communication distance plays no role."""
        return Ellipses(
            self.length_mm, exact_log(self.inside / self.outside), 0.0, 0.0, self.ratio, math.log(self.outside)
        )


@dataclass(frozen=True)
class AdaptiveLikelihood:
    """Likelihoods in a core that grows as the signal falls, in an ellipse of fixed size around, and outside.

    The core's long axis is the communication distance at which the tag was just read (eq. 2: the fourth root of the
    signal's inverse), and as much again as `redundancy` says (eq. 3).

    Parameters
    ----------
    expanded_mm : long axis of the expanded range [mm]; the paper gives it the shape of the fixed model's.
    core, expanded, outside : likelihoods; 0.7 and 0.5 in the paper, and the core's "the highest".
    redundancy : RD / CD of eq. 3.
    ratio : short axis over long one, of core and expanded range.
    """

    expanded_mm: float = 1900.0
    core: float = 0.9
    expanded: float = 0.7
    outside: float = 0.5
    redundancy: float = 0.2
    ratio: float = AXES_RATIO

    def __post_init__(self) -> None:
        require.within("expanded_mm", self.expanded_mm, low=1.0, high=1e5)
        require.within("ratio", self.ratio, low=0.01, high=100.0)
        require.within("redundancy", self.redundancy, low=0.0, high=10.0)
        require.within("outside", self.outside, low=_LEAST_LIKELIHOOD, high=1.0)
        require.within("expanded", self.expanded, low=self.outside, high=1.0)
        require.within("core", self.core, low=self.expanded, high=1.0)

    def ellipses(self, distance_mm: float) -> Ellipses:
        """What a read at a communication distance says."""
        return Ellipses(
            (1.0 + self.redundancy) * require.positive("distance_mm", distance_mm), exact_log(self.core / self.outside),
            self.expanded_mm, exact_log(self.expanded / self.outside), self.ratio, math.log(self.outside),
        )  # fmt: skip


Likelihood = FixedLikelihood | AdaptiveLikelihood


def exact_log(ratio: float) -> float:
    """Logarithm to the nearest multiple of 2^-14, so that equal products of likelihoods have equal sums."""
    return round(math.log(ratio) / EXACT_STEP) * EXACT_STEP
