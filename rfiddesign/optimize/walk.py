"""The state of a walk through designs: which runs were consumed, what they decided, what may still be spent."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from math import inf
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rfiddesign.optimize.assume import Weaker
from rfiddesign.optimize.certify import Decision, TestPlan
from rfiddesign.optimize.conclude import UNTESTED
from rfiddesign.optimize.judge import Battery, battery, judge

LOOK_AHEAD = 64  # designs named to the workers ahead of their turn, the most urgent first


class Outcomes(Protocol):
    """Where runs come from: a process pool, a saved study, a table in a test."""

    def scores(self, design: int, n_runs: int) -> NDArray:
        """Scores of the first ``n_runs`` runs of a design in order: a pure function of (design, run).

        Shape (n_runs, n_criteria), or (n_runs,) where there is one criterion; True or 1 where a run keeps a share's
        limits, see :mod:`rfiddesign.optimize.criteria`. A run that could not be finished gets the worst score; leaving
        it out would select runs.
        """
        ...

    def prefetch(self, requests: list[tuple[int, int]]) -> None:
        """A hint: these (design, n_runs) are likely asked for next, most urgent first.

        It may be ignored, in whole or from any point of the list on.
        """
        ...


@dataclass(frozen=True)
class Progress:
    """Counts while a walk goes on: designs refuted, given up undecided, being tested, not yet tested; consumed runs."""

    n_refuted: int
    n_undecided: int
    n_racing: int
    n_remaining: int
    n_runs: int


@dataclass(frozen=True)
class SearchRules:
    """How a search spends runs, and when it may stop short of the cheapest design.

    Parameters
    ----------
    cost_tolerance : a certified design is good enough if it costs at most this share more than the cheapest design not
        refuted.
    run_budget : consumed runs at most; None: as many as it takes.
    time_used : tells the share of the time allowed that has passed; the search stops at 1. What a search finds then
        depends on the machine, what it claims is true all the same.
    promise : a number per design, the greater the more likely it seems to hold; it steers where a certified design is
        looked for when runs or time are short, and changes no chance of error.
    weaker : which designs are assumed to hold only if others do, see :mod:`rfiddesign.optimize.assume`.

    Raises
    ------
    ValueError : for a tolerance or a budget below 0.
    """

    cost_tolerance: float = 0.0
    run_budget: int | None = None
    time_used: Callable[[], float] | None = None
    promise: ArrayLike | None = None
    weaker: Weaker | None = None

    def __post_init__(self) -> None:
        if not 0 <= self.cost_tolerance < inf:
            raise ValueError(f"cost_tolerance must be a share of at least 0, found {self.cost_tolerance}")
        if self.run_budget is not None and self.run_budget < 0:
            raise ValueError(f"run_budget must not be negative, found {self.run_budget}")

    @property
    def is_short(self) -> bool:
        """Whether runs or time may end before the search does."""
        return self.run_budget is not None or self.time_used is not None


@dataclass
class Walk:
    """The state of a walk: what was decided so far and what may still be spent.

    `assumed` has the designs that count as refuted because a design assumed to be no weaker was, with that design;
    `strictly` the decisions on those, at the evidence that this takes.
    """

    cost: list[int]
    order: list[int]
    outcomes: Outcomes
    tests: Battery
    rules: SearchRules
    decisions: dict[int, Decision]
    on_progress: Callable[[Progress], None] | None
    assumed: dict[int, int] = field(default_factory=dict)
    strictly: dict[int, Decision] = field(default_factory=dict)

    def __post_init__(self):
        self.place = {design: i for i, design in enumerate(self.order)}
        self.racing: set[int] = set()
        self.runs_left = inf if self.rules.run_budget is None else self.rules.run_budget
        self.n_runs = sum(decision.n_runs for decision in self.decisions.values())
        self.n_verdicts = Counter(decision.verdict for decision in self.decisions.values())

    @property
    def is_exhausted(self) -> bool:
        """Whether no more runs may be consumed."""
        return self.runs_left <= 0 or (self.rules.time_used is not None and self.rules.time_used() >= 1)

    def is_open(self, design: int) -> bool:
        """Without a verdict, an assumed one included, and below the cap."""
        decision = self.decisions.get(design, UNTESTED)
        return decision.verdict == "undecided" and decision.n_runs < self.tests.max_runs and design not in self.assumed

    def is_ruled_out(self, design: int) -> bool:
        """Refuted, or assumed to be."""
        return design in self.assumed or self.decisions.get(design, UNTESTED).verdict == "refuted"

    def look(self, design: int, n_runs: int) -> Decision:
        """Consume runs of a design up to ``n_runs`` in all, or up to its verdict, its cap or the end of the budget.

        Runs are asked for in doubling portions, so that a hopeless design, refuted by its first few, costs only those.
        The portions change what is computed in vain, never what is consumed.
        """
        before = self.decisions.get(design, UNTESTED)
        decision = self._judged(design, n_runs, self.tests, before)
        if decision.n_runs > before.n_runs:
            self._spend(decision.n_runs - before.n_runs)
            self._record(design, before, decision)
        return decision

    def assume_weaker_refuted(self, design: int) -> None:
        """Go on with a refuted design up to the evidence that those assumed to be weaker need, and count them refuted.

        Nothing happens where there are none, or where that evidence is not reached at four times the runs.
        """
        weaker = self.rules.weaker
        if weaker is None or not weaker.than[design] or all(self.is_ruled_out(other) for other in weaker.than[design]):
            return
        before = self.decisions[design]
        start = replace(before, verdict="undecided")
        decision = self._judged(design, 4 * before.n_runs + self.tests.soonest, weaker.tests, start)
        self._spend(max(0, decision.n_runs - before.n_runs))
        if decision.verdict == "refuted":
            self.strictly[design] = decision
            for other in weaker.than[design]:
                if self.decisions.get(other, UNTESTED).verdict == "undecided":
                    self.assumed.setdefault(other, design)

    def _judged(self, design: int, n_runs: int, tests: Battery, decision: Decision) -> Decision:
        target = int(min(n_runs, tests.max_runs, decision.n_runs + self.runs_left))
        while decision.verdict == "undecided" and decision.n_runs < target and not self.is_exhausted:
            portion = min(target, max(tests.soonest, 2 * decision.n_runs))
            self.outcomes.prefetch([(design, portion), *self._upcoming(design)])
            decision = judge(tests, self.outcomes.scores(design, portion)[:portion])
        return decision

    def _spend(self, n_runs: int) -> None:
        self.n_runs += n_runs
        self.runs_left -= n_runs

    def _upcoming(self, design: int) -> list[tuple[int, int]]:
        first = self.place[design] + 1
        ahead = self.order[first : first + LOOK_AHEAD]
        return [(following, self.tests.soonest) for following in ahead if following not in self.decisions]

    def _record(self, design: int, before: Decision, decision: Decision) -> None:
        if before.n_runs:
            self.n_verdicts[before.verdict] -= 1
        self.n_verdicts[decision.verdict] += 1
        self.decisions[design] = decision
        if self.is_open(design):
            self.racing.add(design)
        else:
            self.racing.discard(design)
        if self.on_progress is not None:
            self.on_progress(
                Progress(
                    n_refuted=self.n_verdicts["refuted"] + len(self.assumed),
                    n_undecided=self.n_verdicts["undecided"] - len(self.racing),
                    n_racing=len(self.racing),
                    n_remaining=len(self.order) - len(self.decisions.keys() | self.assumed.keys()),
                    n_runs=self.n_runs,
                )
            )


def start_walk(
    cost_cents: ArrayLike,
    outcomes: Outcomes,
    plan: TestPlan,
    rules: SearchRules,
    on_progress: Callable[[Progress], None] | None,
    decisions: dict[int, Decision] | None = None,
) -> Walk:
    """A checked walk over the designs by rising cost, equal costs by rising index."""
    costs = np.asarray(cost_cents)
    if costs.ndim != 1 or costs.dtype.kind not in "iu" or not len(costs):
        found = f"{costs.dtype} of shape {costs.shape}"
        raise ValueError(f"cost_cents must be a non-empty one-dimensional array of integers, found {found}")
    if costs.min() < 0:
        raise ValueError(f"cost_cents must not be negative, found {costs.min()}")
    if len(costs) > plan.n_designs:
        raise ValueError(f"n_designs must be at least the {len(costs)} designs to be tested, found {plan.n_designs}")
    for name, values in (("promise", rules.promise), ("weaker", rules.weaker and rules.weaker.than)):
        if values is not None and len(values) != len(costs):
            raise ValueError(f"{name} must have one entry for each of the {len(costs)} designs, found {len(values)}")
    order = np.argsort(costs, kind="stable").tolist()
    return Walk(costs.tolist(), order, outcomes, battery(plan), rules, decisions or {}, on_progress)
