"""Does a design hold its limits? An anytime-valid test on passed and failed runs, one design at a time.

A run of a design passes or fails its requirement. Runs are independent and pass with an unknown probability p. Two
thresholds p1 < p0 leave an indifference zone between them:

- *refute*: evidence against "the design holds", H: p >= p0;
- *certify*: evidence against "the design is bad", H: p <= p1.

Each side has an e-process, a nonnegative process that starts at 1 and whose mean never exceeds 1 while its H is true:
:mod:`rfiddesign.optimize.share_test` for a share of runs, :mod:`rfiddesign.optimize.betting` for a mean. Ville's
inequality then bounds the chance that it *ever* reaches 1/alpha by alpha: at every sample size at once, so looking
after every run, stopping when one likes, and raising ``max_runs`` later and going on with the same runs all cost
nothing.

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
.. [2] A. Ramdas, P. Grunwald, V. Vovk, G. Shafer, Game-theoretic statistics and safe anytime-valid inference, Statist.
   Sci. 38 (2023) 576-601 (e-processes, composite hypotheses, optional continuation).
"""

from dataclasses import dataclass
from math import nan
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rfiddesign.optimize.criteria import Criterion, ShareCriterion
from rfiddesign.optimize.share_test import Boundaries, share_boundaries

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
