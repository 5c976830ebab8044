"""What follows from the decisions on some designs: which claim may be made, and what costs less and is still open."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from rfiddesign.optimize.certify import Decision

UNTESTED = Decision("undecided", 0, 0)

Claim = Literal[
    "cheapest",
    "cheapest within tolerance",
    "certified, cheaper undecided",
    "certified, stopped by budget",
    "none certified",
    "none holds",
    "stopped by budget",
]

CLAIMS: dict[Claim, str] = {
    "cheapest": "the winner is certified and every cheaper design was refuted",
    "cheapest within tolerance": "the winner is certified and costs no more than the tolerated share above the lower"
    " bound, below which every design was refuted",
    "certified, cheaper undecided": "the winner is certified, but cheaper designs reached the cap of runs without a"
    " verdict; the cheapest design that holds costs at least as much as the lower bound",
    "certified, stopped by budget": "the winner is certified, but the budget ended before every cheaper design was"
    " decided; the cheapest design that holds costs at least as much as the lower bound",
    "none certified": "every design was tested and none certified, but some stayed without a verdict",
    "none holds": "every design was refuted",
    "stopped by budget": "the budget ended before any design was certified;"
    " the cheapest design that holds costs at least as much as the lower bound",
}


@dataclass(frozen=True)
class SearchResult:
    """Where a walk ended and what it may claim.

    Attributes
    ----------
    winner : the first design certified, the cheapest of them where a budget ended the search, None if none was.
    claim : key of :data:`CLAIMS`.
    lower_bound : the cheapest design not refuted (the winner, if nothing cheaper is open), None if all were refuted.
        No design cheaper than this one has p >= p0, but for a chance of alpha_refute.
    undecided : designs cheaper than the winner (all, without a winner) that were tested and have no verdict, by rising
        cost. Designs of the winner's own price that lost the race are not among them: they cannot be cheaper.
    runners_up : designs that :func:`next_best` certified at higher prices, by rising cost, at most one per price.
    decisions : verdict and consumed runs of every design tested, in the order of their first run.
    n_untested : designs cheaper than the winner (all, without a winner) that were never tested, nor assumed to be
        refuted.
    assumed : designs that count as refuted by assumption alone, with the refuted design that this follows from.
    strictly : decisions on those, at the evidence that it takes to count others out.
    """

    winner: int | None
    claim: Claim
    lower_bound: int | None
    undecided: tuple[int, ...]
    runners_up: tuple[int, ...]
    decisions: dict[int, Decision]
    n_untested: int = 0
    assumed: dict[int, int] = field(default_factory=dict)
    strictly: dict[int, Decision] = field(default_factory=dict)

    @property
    def order(self) -> tuple[int, ...]:
        """Tested designs in the order of their first run."""
        return tuple(self.decisions)

    @property
    def n_runs_used(self) -> int:
        """Runs consumed by all decisions; runs computed and never looked at do not count."""
        further = (max(0, strict.n_runs - self.decisions[design].n_runs) for design, strict in self.strictly.items())
        return sum(decision.n_runs for decision in self.decisions.values()) + sum(further)


def conclude(
    cost: Sequence[int],
    decisions: dict[int, Decision],
    assumed: dict[int, int],
    limits: tuple[float, int],
    winner: int | None,
) -> SearchResult:
    """What follows from the decisions on some designs.

    Parameters
    ----------
    cost : costs of all designs [cent].
    decisions : those that were tested.
    assumed : those counted out by assumption, with the refuted design that this follows from.
    limits : cost tolerance, and the cap of runs per design.
    winner : the certified design that was chosen, None if there is none.
    """
    tolerance, max_runs = limits

    def is_ruled_out(design: int) -> bool:
        return design in assumed or decisions.get(design, UNTESTED).verdict == "refuted"

    order = np.argsort(np.asarray(cost), kind="stable").tolist()
    cheaper = [d for d in order if not is_ruled_out(d) and (winner is None or cost[d] < cost[winner])]
    lower_bound = cheaper[0] if cheaper else winner
    is_stopped = any(decisions.get(d, UNTESTED).n_runs < max_runs for d in cheaper)
    if winner is not None:
        is_close = cost[winner] <= cost[lower_bound] * (1 + tolerance)
        claim: Claim = "certified, stopped by budget" if is_stopped else "certified, cheaper undecided"
        if is_close:
            claim = "cheapest within tolerance" if cheaper else "cheapest"
    elif not cheaper:
        claim = "none holds"
    else:
        claim = "stopped by budget" if is_stopped else "none certified"
    return SearchResult(
        winner=winner,
        claim=claim,
        lower_bound=lower_bound,
        undecided=tuple(d for d in cheaper if d in decisions),
        runners_up=(),
        decisions=decisions,
        n_untested=sum(d not in decisions for d in cheaper),
        assumed=assumed,
    )
