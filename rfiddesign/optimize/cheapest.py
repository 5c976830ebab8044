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

With a *cost tolerance* e the walk races all designs that cost at most 1 + e times the cheapest one still open, and ends
at the first certified. Its price then is within e of the lower bound, which statement 2 covers as before.

With a *budget* of runs or of time, or with assumptions to make use of, a ladder comes first: certified designs are
looked for at prices that rise fast, then between the dearest rung that fell and the cheapest that held. At most half of
the budget goes there; the walk has the rest. Where it ends early the cheapest certified design is the incumbent, and
the gap between its price and the lower bound tells how much could be left to save. Both statements hold unchanged:
certification was divided by the number of all designs, and no rule says which may be tried first.

The walk is a function of the outcomes it consumes. Runs computed ahead, in other sizes, by more workers or before an
interruption and never consumed change neither the result nor the counts in it.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from rfiddesign.optimize.certify import Decision, TestPlan
from rfiddesign.optimize.conclude import UNTESTED, SearchResult, conclude
from rfiddesign.optimize.walk import Outcomes, Progress, SearchRules, Walk, start_walk

PILOT_RUNS = 16  # consumed by every design of a price level before the best of them is preferred
LADDER_SHARE = 0.5  # of the budget, at most, for finding some certified design


def cheapest_certified(
    cost_cents: ArrayLike,
    outcomes: Outcomes,
    plan: TestPlan,
    *,
    rules: SearchRules | None = None,
    on_progress: Callable[[Progress], None] | None = None,
) -> SearchResult:
    """Walk in rising cost to the first certified design.

    Parameters
    ----------
    cost_cents : integer costs [cent], shape (n,). Designs of equal cost are tried in the order of their index.
    outcomes : scores of the runs of design 0..n-1.
    plan : thresholds, alphas, the cap of runs per design and the declared number of designs, which must be at least n.
    rules : tolerance, budgets and assumptions. Stopping is valid at any time, it only weakens the claim.
    on_progress : called after every look at a design. It cannot change the result.

    Raises
    ------
    ValueError : costs that are not a non-empty row of non-negative integers, more designs than declared, or rules that
        are not for these designs.
    """
    walk = start_walk(cost_cents, outcomes, plan, rules or SearchRules(), on_progress)
    if walk.rules.is_short or walk.rules.weaker is not None:
        _climb(walk)
    winner = _first_certified(walk, above=-1)
    if winner is None:
        certified = [d for d in walk.order if walk.decisions.get(d, UNTESTED).verdict == "certified"]
        winner = certified[0] if certified else None
    return _result(walk, winner)


def next_best(
    result: SearchResult,
    cost_cents: ArrayLike,
    outcomes: Outcomes,
    plan: TestPlan,
    *,
    count: int = 1,
    rules: SearchRules | None = None,
    on_progress: Callable[[Progress], None] | None = None,
) -> SearchResult:
    """Walk on above the winner's price to ``count`` more certified designs, one per price, added to ``runners_up``.

    That all of them and the winner have p > p1 is covered by the one alpha_certify. Outside the claim: whether a
    design priced between them holds. Winner, claim, lower bound and undecided designs stay as they are. Arguments as in
    :func:`cheapest_certified`, equal to those of the first walk; a budget of runs counts those of this call. Fewer
    than ``count`` are added when designs or budget run out.

    Raises
    ------
    ValueError : a result without winner, a count below 1, or as in :func:`cheapest_certified`.
    """
    if result.winner is None:
        raise ValueError(f"result must have a winner to continue from, found claim {result.claim!r}")
    if count < 1:
        raise ValueError(f"count must be at least 1, found {count}")
    rules = replace(rules or SearchRules(), cost_tolerance=0.0)
    walk = start_walk(cost_cents, outcomes, plan, rules, on_progress, dict(result.decisions))
    walk.assumed.update(result.assumed)
    certified = [result.winner, *result.runners_up]
    for _ in range(count):
        following = _first_certified(walk, above=walk.cost[certified[-1]])
        if following is None:
            break
        certified.append(following)
    return replace(result, runners_up=tuple(certified[1:]), decisions=walk.decisions)


def _first_certified(walk: Walk, above: int) -> int | None:
    """Race band after band of prices above a cost; the first design certified, None if designs or budget run out."""
    dearer = [design for design in walk.order if walk.cost[design] > above]
    walk.racing.clear()
    at = 0
    while at < len(dearer) and not walk.is_exhausted:
        design = dearer[at]
        if walk.decisions.get(design, UNTESTED).verdict == "certified":
            return design
        if not walk.is_open(design):
            at += 1
            walk.racing.discard(design)
            continue
        winner = _race_once(walk, dearer[at:], walk.cost[design] * (1 + walk.rules.cost_tolerance))
        if winner is not None:
            return winner
    return None


def _race_once(walk: Walk, dearer: list[int], limit: float) -> int | None:
    """One look within the band of prices up to a limit: the pilot of a newcomer, or a batch for the best so far.

    Which design is preferred steers power only: the error bounds hold for any way of choosing. Returns the design if
    that look, or one before, certified it.
    """
    band = []
    for design in dearer:
        if walk.cost[design] > limit:
            break
        decision = walk.decisions.get(design, UNTESTED)
        if decision.verdict == "certified":
            return design
        if walk.is_open(design):
            band.append(design)
            if decision.n_runs < PILOT_RUNS:
                return design if walk.look(design, PILOT_RUNS).verdict == "certified" else None
    best = max(band, key=lambda design: _posterior_mean(walk.decisions[design]))
    n_runs = walk.decisions[best].n_runs
    return best if walk.look(best, n_runs + max(PILOT_RUNS, n_runs // 2)).verdict == "certified" else None


def _climb(walk: Walk) -> None:
    """Look for some certified design: rungs at ranks of cost that double, then halve what lies below the first held.

    Each rung tries the most promising design at or below its price that was not tried yet. A design that falls takes
    with it those assumed to be weaker.
    """
    rules, start = walk.rules, walk.n_runs
    promise = np.zeros(len(walk.order)) if rules.promise is None else np.asarray(rules.promise, float)

    def is_over() -> bool:
        is_late = rules.time_used is not None and rules.time_used() >= LADDER_SHARE
        is_spent = rules.run_budget is not None and walk.n_runs - start >= LADDER_SHARE * rules.run_budget
        return is_late or is_spent or walk.is_exhausted

    def holds(low: int, high: int) -> bool | None:
        """Try the best of the ranks low..high - 1; None if none of them is open."""
        options = [design for design in walk.order[low:high] if walk.is_open(design)]
        if not options:
            return None
        best = max(options, key=lambda design: (promise[design], walk.place[design]))
        while walk.is_open(best) and not is_over():
            walk.look(best, 2 * walk.decisions.get(best, UNTESTED).n_runs + PILOT_RUNS)
        verdict = walk.decisions.get(best, UNTESTED).verdict
        if verdict == "refuted":
            walk.assume_weaker_refuted(best)
        return verdict == "certified"

    n, low, high = len(walk.order), 0, 1
    while not is_over() and not holds(low, high):
        if high == n:
            return
        low, high = high, min(2 * high, n)
    while high - low > 1 and not is_over():
        middle = (low + high) // 2
        if holds(low, middle):
            high = middle
        else:
            low = middle


def _posterior_mean(decision: Decision) -> float:
    return (decision.n_passed + 1) / (decision.n_runs + 2)


def _result(walk: Walk, winner: int | None) -> SearchResult:
    found = conclude(walk.cost, walk.decisions, walk.assumed, (walk.rules.cost_tolerance, walk.tests.max_runs), winner)
    return replace(found, strictly=walk.strictly)
