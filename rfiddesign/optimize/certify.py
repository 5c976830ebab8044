"""Does a design hold its limits? An anytime-valid test on passed and failed runs, one design at a time.

A run of a design passes or fails its requirement. Runs are independent and pass with an unknown probability p. Two
thresholds p1 < p0 leave an indifference zone between them:

- *refute*: evidence against "the design holds", H: p >= p0;
- *certify*: evidence against "the design is bad", H: p <= p1.

Each side has an e-process, a nonnegative process that starts at 1 and whose mean never exceeds 1 while its H is true:
the likelihood ratio of a mixture over the alternative against the border of H. With S passed and F failed runs,

    E_refute(S, F)  = sum_k w_k q_k^S (1-q_k)^F / (p0^S (1-p0)^F)
    E_certify(S, F) = int_p1^1 q^S (1-q)^F dq / ((1-p1) * p1^S (1-p1)^F)

Refutation mixes over shortfalls g_k = p0 - q_k = (p0 - p1) 2^((k-1)/2), k = 0, 1, ... as far as they lie below p0, with
weights w_k in proportion to g_k^(-1/4). A walk spends most of its runs on designs that fall, the more the nearer they
come to p0. With p0 = 0.95 and p1 = 0.90 this refutes a design at p1 with 220 runs in the mean, where a uniform mixture
takes 299, and one at 0.6 with 9 as that does. Certification mixes uniformly: few designs are certified.

At the border of H this is a martingale (Robbins' method of mixtures). Inside H it is a supermartingale: for one q < p0
the next run multiplies the ratio by p q/p0 + (1-p)(1-q)/(1-p0) in the mean, which falls in p and is 1 at p = p0;
likewise mirrored. Ville's inequality then bounds the chance that E *ever* reaches 1/alpha by alpha: at every sample
size at once, so looking after every run, stopping when one likes, and raising ``max_runs`` later and going on with the
same runs all cost nothing.

Where multiplicity is paid. Over N declared designs, the chance that any design with p <= p1 is ever certified is at
most the sum of N chances; the threshold N/alpha_certify makes that sum alpha_certify (union bound). This needs no
independence between designs, so common random numbers (run i drawn alike for all designs) are allowed, and the bound
holds however a search picks what to run next: "ever reaches the threshold" depends on that design's own run sequence
only. Refutation pays nothing here, for the reason given in :mod:`rfiddesign.optimize.cheapest`.

What it rests on: run i is fresh randomness, the same in law for every i (a quasi-random or balanced set of routes
would break it); N, p0, p1, both alphas and the requirement are declared before the runs are seen; the probability is
over the study's seed, so trying seeds until one pleases is not covered. It speaks of the simulated scenario, not of
the building.

References
----------
.. [1] J. Ville, Etude critique de la notion de collectif, 1939 (the inequality).
.. [2] H. Robbins, Statistical methods related to the law of the iterated logarithm, Ann. Math. Statist. 41 (1970)
   1397-1409 (mixtures).
.. [3] T. L. Lai, On confidence sequences, Ann. Statist. 4 (1976) 265-280 (mixtures for one-parameter exponential
   families).
.. [4] A. Ramdas, P. Grunwald, V. Vovk, G. Shafer, Game-theoretic statistics and safe anytime-valid inference, Statist.
   Sci. 38 (2023) 576-601 (e-processes, composite hypotheses, optional continuation).
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import nan, sqrt
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rfiddesign.optimize.criteria import ROUNDING_MARGIN, Criterion, ShareCriterion

Verdict = Literal["certified", "refuted", "undecided"]

MAX_RUNS_ALLOWED = 100_000


@dataclass(frozen=True)
class TestPlan:
    """What is declared before the first run is seen.

    Parameters
    ----------
    n_designs : the number N of designs that may be tested; certification divides its alpha by it. Declaring more than
        are tested is valid and costs a little; testing more than declared is not valid.
    hold_probability : p0, a design that passes at least this share of runs holds.
    fail_probability : p1 < p0, a design that passes at most this share must not be sold.
    alpha_refute : bound on the chance that a given design with p >= p0 is ever refuted.
    alpha_certify : bound on the chance that any of the N designs with p <= p1 is ever certified.
    max_runs : runs spent on one design at most; a design open at that point is undecided. The cap costs power, never
        validity. With 1000 designs and the defaults, up to 60 % of designs between p1 and p0 end undecided at 1000 runs
        and up to 2.4 % at 2000, for some third more runs on such a design.
    is_alpha_split : False certifies each design at the whole ``alpha_certify``. That is wrong for more than one design
        and exists to show how wrong.
    criteria : what a design must keep, all of it; without any, the share ``hold_probability`` of its runs.  A design is
        certified once every criterion is: were one of them not kept, that one would have to be certified wrongly, so
        that ``alpha_certify`` is not divided among them.  It is refuted once any of them is, each at its part of
        ``alpha_refute``.

    Raises
    ------
    ValueError : unless 0 < p1 < p0 < 1, both alphas in (0, 0.5], n_designs >= 1 and 1 <= max_runs <= 100,000.
    """

    __test__ = False  # the name begins with "Test", and pytest would collect it wherever a test imports it

    n_designs: int
    hold_probability: float = 0.95
    fail_probability: float = 0.90
    alpha_refute: float = 0.025
    alpha_certify: float = 0.025
    max_runs: int = 1000
    is_alpha_split: bool = True
    criteria: tuple[Criterion, ...] = ()

    def __post_init__(self):
        if not 0 < self.hold_probability < 1:
            raise ValueError(f"hold_probability must lie in (0, 1), found {self.hold_probability}")
        if not 0 < self.fail_probability < self.hold_probability:
            bound = f"(0, hold_probability = {self.hold_probability})"
            raise ValueError(f"fail_probability must lie in {bound}, found {self.fail_probability}")
        for name in ("alpha_refute", "alpha_certify"):
            if not 0 < getattr(self, name) <= 0.5:
                raise ValueError(f"{name} must lie in (0, 0.5], found {getattr(self, name)}")
        if self.n_designs < 1:
            raise ValueError(f"n_designs must be at least 1, found {self.n_designs}")
        if not 1 <= self.max_runs <= MAX_RUNS_ALLOWED:
            raise ValueError(f"max_runs must lie in [1, {MAX_RUNS_ALLOWED}], found {self.max_runs}")

    @property
    def all_criteria(self) -> tuple[Criterion, ...]:
        """What a design must keep."""
        return self.criteria or (ShareCriterion("runs pass", self.hold_probability, self.fail_probability),)

    @property
    def refute_threshold(self) -> float:
        """Evidence that refutes one criterion."""
        return len(self.all_criteria) / self.alpha_refute

    @property
    def certify_threshold(self) -> float:
        """Evidence that certifies one criterion of one design."""
        return (self.n_designs if self.is_alpha_split else 1) / self.alpha_certify


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


@dataclass(frozen=True)
class Decision:
    """The verdict on one design after ``n_runs`` consumed runs, of which ``n_passed`` passed.

    Where a design is held against several criteria a run passes if it scores 1 in every share, and ``refuted_by`` is
    the place of the criterion that refuted it.
    """

    verdict: Verdict
    n_runs: int
    n_passed: int
    refuted_by: int | None = None

    @property
    def pass_share(self) -> float:
        """Share of consumed runs that passed, nan without runs.

        Stopping at a boundary biases it (upwards when certified, downwards when refuted): it describes, it certifies
        nothing.
        """
        return self.n_passed / self.n_runs if self.n_runs else nan


def boundaries(plan: TestPlan) -> Boundaries:
    """The tables of both tests of a plan with one criterion, a share (arrays are read-only).

    Raises
    ------
    ValueError : if it has others; see :func:`rfiddesign.optimize.judge.battery`.
    """
    if len(plan.all_criteria) > 1 or not isinstance(plan.all_criteria[0], ShareCriterion):
        raise ValueError("criteria must be one share")
    return share_boundaries(plan.all_criteria[0], plan.refute_threshold, plan.certify_threshold, plan.max_runs)


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


def decide(table: Boundaries, outcomes: NDArray[np.bool_]) -> Decision:
    """Verdict on one design from its runs in order, True where passed, shape (n,).

    The first boundary crossing decides, and runs after it are discarded unread: the verdict is a function of the run
    sequence alone and cannot depend on how many runs were computed at a time. One run cannot cross both boundaries, as
    only a failed run adds evidence for refuting and only a passed one for certifying. Without a crossing up to
    max_runs: "undecided".

    Raises
    ------
    ValueError : outcomes that are not a one-dimensional array of bool.
    """
    outcomes = np.asarray(outcomes)
    if outcomes.ndim != 1 or outcomes.dtype != np.bool_:
        found = f"{outcomes.ndim}-dimensional {outcomes.dtype}"
        raise ValueError(f"outcomes must be a one-dimensional array of bool, found {found}")
    n = min(len(outcomes), table.max_runs)
    is_refuted, is_certified = table.crossed(outcomes[:n])
    return first_crossing(is_refuted, is_certified, outcomes[:n])


def first_crossing(
    is_refuted: NDArray[np.bool_], is_certified: NDArray[np.bool_], is_passed: NDArray[np.bool_]
) -> Decision:
    """The decision of the first run (n,) that refutes or certifies; of one that did both it would be "refuted"."""
    n = len(is_passed)
    is_crossed = is_refuted | is_certified
    first = int(is_crossed.argmax()) if n else 0
    if not n or not is_crossed[first]:
        return Decision("undecided", n, int(is_passed.sum()))
    n_passed = int(is_passed[: first + 1].sum())
    return Decision("refuted" if is_refuted[first] else "certified", first + 1, n_passed)
