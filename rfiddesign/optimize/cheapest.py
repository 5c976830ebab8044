"""The cheapest certified design: a walk in rising cost, because cost is known and error must be sampled.

Each price level is tested until every design on it is refuted (the walk goes on), one is certified (the walk ends: the
winner) or the rest stays undecided at the cap of runs (the walk goes on and the claim is weaker). Designs of equal
price race each other.

What the result promises, with p the unknown share of runs a design passes and p1 < p0 as in
:mod:`rfiddesign.optimize.certify`:

1. *The winner has p > p1*, but for a chance of at most alpha_certify. So have, at once and within the same alpha, all
   designs that :func:`next_best` certifies later, since that alpha was divided by the declared number of designs.
2. *No design cheaper than the lower bound has p >= p0*, but for a chance of at most alpha_refute. ``lower_bound`` is
   the cheapest design not refuted. Everything cheaper was refuted, so the sentence is wrong only if one particular
   design was refuted wrongly: the cheapest one with p >= p0 (the first of them, if several share that price), which
   the truth fixes and not the data. One test can go wrong, hence no division by N. It holds wherever the walk stopped:
   by the cap, by a budget, by an interruption. If all designs are refuted it reads "no design of the
   space has p >= p0".
3. Nothing cheaper undecided: the lower bound is the winner's price, and 1 and 2 together read "certified, and nothing
   cheaper holds", wrong with a chance of at most alpha_certify + alpha_refute (claim "cheapest").
4. With cheaper designs undecided the price of the cheapest design with p >= p0 is at least that of the lower bound,
   and only that is known at alpha_refute. Refuted designs *between* lower bound and winner are refuted one by one:
   that none of them holds has, for a number u declared beforehand, error at most (u + 1) alpha_refute with no more
   than u undecided (one of the u + 1 cheapest holding designs would have to be refuted wrongly). The claim says
   "certified, cheaper undecided" instead.

Chances are over repeated studies with fresh seeds, those that end without a winner included. They are not the
probability that this winner is good given its runs, which would need a prior.

What it does not promise: that the winner has p >= p0 (it may lie in the zone between p1 and p0, cheaper than the
cheapest with p >= p0: valid, and to be said); that a cheaper design between p1 and p0 does not exist; that an untested
design of the winner's price is worse; anything about designs that a screen removed before; anything about limits
chosen after the runs were seen; that no design between winner and next best holds (that statement hangs on a design
which the data pick, so alpha_refute does not cover it).

The walk is a function of the outcomes it consumes. Runs computed ahead, in other sizes, by more workers or before an
interruption and never consumed change neither the result nor the counts in it.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Literal

from numpy.typing import ArrayLike

from rfiddesign.optimize.certify import Decision, TestPlan
from rfiddesign.optimize.walk import UNTESTED, Outcomes, Progress, Walk, start_walk

PILOT_RUNS = 16  # consumed by every design of a price level before the best of them is preferred

Claim = Literal["cheapest", "certified, cheaper undecided", "none certified", "none holds", "stopped by budget"]

CLAIMS: dict[Claim, str] = {
    "cheapest": "the winner is certified and every cheaper design was refuted",
    "certified, cheaper undecided": "the winner is certified, but cheaper designs reached the cap of runs without a"
    " verdict; the cheapest design that holds costs at least as much as the lower bound",
    "none certified": "every design was tested and none certified, but some stayed without a verdict",
    "none holds": "every design was refuted",
    "stopped by budget": "the budget of runs ended before any design was certified;"
    " the cheapest design that holds costs at least as much as the lower bound",
}


@dataclass(frozen=True)
class SearchResult:
    """Where a walk ended and what it may claim.

    Attributes
    ----------
    winner : the first design certified, None if none was.
    claim : key of :data:`CLAIMS`.
    lower_bound : the cheapest design not refuted (the winner, if nothing cheaper is open), None if all were refuted.
        No design cheaper than this one has p >= p0, but for a chance of alpha_refute.
    undecided : designs cheaper than the winner (all, without a winner) that were tested and have no verdict, by rising
        cost. Designs of the winner's own price that lost the race are not among them: they cannot be cheaper.
    runners_up : designs that :func:`next_best` certified at higher prices, by rising cost, at most one per price.
    decisions : verdict and consumed runs of every design tested, in the order of their first run.
    """

    winner: int | None
    claim: Claim
    lower_bound: int | None
    undecided: tuple[int, ...]
    runners_up: tuple[int, ...]
    decisions: dict[int, Decision]

    @property
    def order(self) -> tuple[int, ...]:
        """Tested designs in the order of their first run."""
        return tuple(self.decisions)

    @property
    def n_runs_used(self) -> int:
        """Runs consumed by all decisions; runs computed and never looked at do not count."""
        return sum(decision.n_runs for decision in self.decisions.values())


def cheapest_certified(
    cost_cents: ArrayLike,
    outcomes: Outcomes,
    plan: TestPlan,
    *,
    run_budget: int | None = None,
    on_progress: Callable[[Progress], None] | None = None,
) -> SearchResult:
    """Walk in rising cost to the first certified design.

    Parameters
    ----------
    cost_cents : integer costs [cent], shape (n,). Designs of equal cost are tried in the order of their index.
    outcomes : passed and failed runs of design 0..n-1.
    plan : thresholds, alphas, the cap of runs per design and the declared number of designs, which must be at least n.
    run_budget : consumed runs of the whole walk at most. Stopping is valid at any time, it only weakens the claim.
    on_progress : called after every look at a design. It cannot change the result.

    Raises
    ------
    ValueError : costs that are not a non-empty row of non-negative integers, more designs than declared, or a negative
        budget.
    """
    walk = start_walk(cost_cents, outcomes, plan, run_budget, on_progress)
    return _result(walk, _first_certified(walk, above=-1))


def next_best(
    result: SearchResult,
    cost_cents: ArrayLike,
    outcomes: Outcomes,
    plan: TestPlan,
    *,
    count: int = 1,
    run_budget: int | None = None,
    on_progress: Callable[[Progress], None] | None = None,
) -> SearchResult:
    """Walk on above the winner's price to ``count`` more certified designs, one per price, added to ``runners_up``.

    That all of them and the winner have p > p1 is covered by the one alpha_certify. Outside the claim: whether a
    design priced between them holds. Winner, claim, lower bound and undecided designs stay as they are. Arguments as in
    :func:`cheapest_certified`, equal to those of the first walk; ``run_budget`` counts the runs of this call. Fewer
    than ``count`` are added when designs or budget run out.

    Raises
    ------
    ValueError : a result without winner, a count below 1, or as in :func:`cheapest_certified`.
    """
    if result.winner is None:
        raise ValueError(f"result must have a winner to continue from, found claim {result.claim!r}")
    if count < 1:
        raise ValueError(f"count must be at least 1, found {count}")
    walk = start_walk(cost_cents, outcomes, plan, run_budget, on_progress, dict(result.decisions))
    certified = [result.winner, *result.runners_up]
    for _ in range(count):
        following = _first_certified(walk, above=walk.cost[certified[-1]])
        if following is None:
            break
        certified.append(following)
    return replace(result, runners_up=tuple(certified[1:]), decisions=walk.decisions)


def _first_certified(walk: Walk, above: int) -> int | None:
    """Race price after price above a cost; the first design certified, None if designs or budget run out."""
    dearer = [design for design in walk.order if walk.cost[design] > above]
    for _, price_level in groupby(dearer, key=walk.cost.__getitem__):
        winner = _race(walk, list(price_level))
        walk.racing.clear()
        if winner is not None or walk.is_exhausted:
            return winner
    return None


def _race(walk: Walk, price_level: list[int]) -> int | None:
    """Test designs of one price: a pilot for each, then the one with the best posterior mean gets growing batches.

    Ends at the first certified design, or when all are decided or capped. Which design is preferred steers power only:
    the error bounds hold for any way of choosing.
    """
    for design in price_level:
        if walk.look(design, PILOT_RUNS).verdict == "certified":
            return design
    while racing := [design for design in price_level if walk.is_open(design)]:
        if walk.is_exhausted:
            return None
        best = max(racing, key=lambda design: _posterior_mean(walk.decisions[design]))
        n_runs = walk.decisions[best].n_runs
        if walk.look(best, n_runs + max(PILOT_RUNS, n_runs // 2)).verdict == "certified":
            return best
    return None


def _posterior_mean(decision: Decision) -> float:
    return (decision.n_passed + 1) / (decision.n_runs + 2)


def _result(walk: Walk, winner: int | None) -> SearchResult:
    not_refuted = [d for d in walk.order if walk.decisions.get(d, UNTESTED).verdict != "refuted"]
    cheaper_open = [d for d in not_refuted if winner is None or walk.cost[d] < walk.cost[winner]]
    if winner is not None:
        claim: Claim = "certified, cheaper undecided" if cheaper_open else "cheapest"
    elif not cheaper_open:
        claim = "none holds"
    else:
        claim = "stopped by budget" if any(walk.is_open(d) for d in cheaper_open) else "none certified"
    return SearchResult(
        winner=winner,
        claim=claim,
        lower_bound=cheaper_open[0] if cheaper_open else winner,
        undecided=tuple(d for d in cheaper_open if d in walk.decisions),
        runners_up=(),
        decisions=walk.decisions,
    )
