"""The verdict on a design that must keep several criteria at once: all certified, or any refuted."""

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from rfiddesign.optimize.betting import MeanTest
from rfiddesign.optimize.certify import Decision, TestPlan, decide, first_crossing
from rfiddesign.optimize.criteria import Criterion, ShareCriterion
from rfiddesign.optimize.share_test import Boundaries, share_boundaries


@dataclass(frozen=True, eq=False)
class Battery:
    """The tests of all criteria of a plan, in their order."""

    criteria: tuple[Criterion, ...]
    tests: tuple[Boundaries | MeanTest, ...]
    max_runs: int

    @cached_property
    def soonest(self) -> int:
        """The fewest runs that can decide anything; max_runs if none can."""
        return min(test.soonest for test in self.tests)


@lru_cache(maxsize=64)
def battery(plan: TestPlan) -> Battery:
    """The tests of a plan."""
    return Battery(plan.all_criteria, tuple(_test(plan, criterion) for criterion in plan.all_criteria), plan.max_runs)


def judge(tests: Battery, scores: NDArray) -> Decision:
    """Verdict on one design from the scores of its runs in order, shape (n_runs, n_criteria), or (n_runs,) for one.

    The first run after which any criterion is refuted, or all are certified, decides, and later runs are discarded
    unread.  A criterion once certified stays so, as its chance of error is counted over all sample sizes at once.

    Raises
    ------
    ValueError : scores of another shape, or outside [0, 1].
    """
    scores = np.asarray(scores)
    if scores.dtype == np.bool_ and scores.ndim == 1 and len(tests.criteria) == 1:
        return decide(tests.tests[0], scores)  # the usual case, for which the rest takes three times as long
    columns = scores[:, None] if scores.ndim == 1 else scores
    if columns.ndim != 2 or columns.shape[1] != len(tests.criteria):
        raise ValueError(f"scores have shape {scores.shape}, must be (n_runs, {len(tests.criteria)})")
    # Written so that a nan is found, too.
    if not ((columns >= 0) & (columns <= 1)).all():
        raise ValueError("scores must lie in [0, 1]")
    columns = columns[: tests.max_runs]
    crossed = [test.crossed(column) for test, column in zip(tests.tests, columns.T, strict=True)]
    refuted = np.array([is_refuted for is_refuted, _ in crossed])
    certified = np.array([np.logical_or.accumulate(is_certified) for _, is_certified in crossed])
    is_share = [isinstance(criterion, ShareCriterion) for criterion in tests.criteria]
    is_passed = (columns[:, is_share] == 1).all(axis=1)
    decision = first_crossing(refuted.any(axis=0), certified.all(axis=0), is_passed)
    if decision.verdict == "refuted" and len(tests.criteria) > 1:
        return replace(decision, refuted_by=int(refuted[:, decision.n_runs - 1].argmax()))
    return decision


def _test(plan: TestPlan, criterion: Criterion) -> Boundaries | MeanTest:
    thresholds = (plan.refute_threshold, plan.certify_threshold, plan.max_runs)
    if isinstance(criterion, ShareCriterion):
        return share_boundaries(criterion, *thresholds)
    return MeanTest(criterion, *thresholds)
