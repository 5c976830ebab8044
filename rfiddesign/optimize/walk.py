"""The state of a walk through designs: which runs were consumed, what they decided, what may still be spent."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rfiddesign.optimize.certify import Boundaries, Decision, TestPlan, boundaries, decide

LOOK_AHEAD = 64  # designs named to the workers ahead of their turn, the most urgent first
UNTESTED = Decision("undecided", 0, 0)


class Outcomes(Protocol):
    """Where passed and failed runs come from: a process pool, a saved study, a table in a test."""

    def passed(self, design: int, n_runs: int) -> NDArray[np.bool_]:
        """The first ``n_runs`` runs of a design in order, True where passed: a pure function of (design, run).

        A run that could not be finished counts as failed; leaving it out would select runs.
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


@dataclass
class Walk:
    """The state of a walk: what was decided so far and what may still be spent."""

    cost: list[int]
    order: list[int]
    outcomes: Outcomes
    table: Boundaries
    decisions: dict[int, Decision]
    runs_left: float
    on_progress: Callable[[Progress], None] | None

    def __post_init__(self):
        self.place = {design: i for i, design in enumerate(self.order)}
        self.racing: set[int] = set()
        self.n_runs = sum(decision.n_runs for decision in self.decisions.values())
        self.n_verdicts = Counter(decision.verdict for decision in self.decisions.values())

    @property
    def is_exhausted(self) -> bool:
        return self.runs_left <= 0

    def is_open(self, design: int) -> bool:
        """Without a verdict and below the cap."""
        decision = self.decisions.get(design, UNTESTED)
        return decision.verdict == "undecided" and decision.n_runs < self.table.max_runs

    def look(self, design: int, n_runs: int) -> Decision:
        """Consume runs of a design up to ``n_runs`` in all, or up to its verdict, its cap or the end of the budget.

        Runs are asked for in doubling portions, so that a hopeless design, refuted by its first few, costs only those.
        The portions change what is computed in vain, never what is consumed.
        """
        decision = before = self.decisions.get(design, UNTESTED)
        target = int(min(n_runs, self.table.max_runs, before.n_runs + self.runs_left))
        while decision.verdict == "undecided" and decision.n_runs < target:
            portion = min(target, max(self.table.soonest, 2 * decision.n_runs))
            self.outcomes.prefetch([(design, portion), *self._upcoming(design)])
            decision = decide(self.table, self.outcomes.passed(design, portion)[:portion])
        if decision.n_runs > before.n_runs:
            self._record(design, before, decision)
        return decision

    def _upcoming(self, design: int) -> list[tuple[int, int]]:
        first = self.place[design] + 1
        ahead = self.order[first : first + LOOK_AHEAD]
        return [(following, self.table.soonest) for following in ahead if following not in self.decisions]

    def _record(self, design: int, before: Decision, decision: Decision) -> None:
        if before.n_runs:
            self.n_verdicts[before.verdict] -= 1
        self.n_verdicts[decision.verdict] += 1
        self.decisions[design] = decision
        self.n_runs += decision.n_runs - before.n_runs
        self.runs_left -= decision.n_runs - before.n_runs
        if self.is_open(design):
            self.racing.add(design)
        else:
            self.racing.discard(design)
        if self.on_progress is not None:
            self.on_progress(
                Progress(
                    n_refuted=self.n_verdicts["refuted"],
                    n_undecided=self.n_verdicts["undecided"] - len(self.racing),
                    n_racing=len(self.racing),
                    n_remaining=len(self.order) - len(self.decisions),
                    n_runs=self.n_runs,
                )
            )


def start_walk(
    cost_cents: ArrayLike,
    outcomes: Outcomes,
    plan: TestPlan,
    run_budget: int | None,
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
    if run_budget is not None and run_budget < 0:
        raise ValueError(f"run_budget must not be negative, found {run_budget}")
    order = np.argsort(costs, kind="stable").tolist()
    runs_left = np.inf if run_budget is None else run_budget
    return Walk(costs.tolist(), order, outcomes, boundaries(plan), decisions or {}, runs_left, on_progress)
