"""Name the candidates of a certification, after exploring and before its first run.

The certified walk tests candidates in rising cost and ends at the first that holds, so that what matters is to name
designs around and below the apparent optimum: those that the exploration liked, and cheaper neighbours of them, some of
which it never tried. A hopeless candidate costs the walk a few runs, one that was not named cannot be found.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from heapq import heappop, heappush
from itertools import islice

import numpy as np

from rfiddesign import require
from rfiddesign.optimize.explore.explorer import Bench, Trial
from rfiddesign.optimize.explore.proposal import Fixed, Proposal, propose
from rfiddesign.optimize.explore.variables import Value, Variables
from rfiddesign.optimize.pareto import layers

MAX_CANDIDATES = 10_000
#: Neighbours built and priced for each candidate that may be named.
LOOKS_PER_CANDIDATE = 8


@dataclass(frozen=True)
class NamingPlan:
    """How many candidates are named, and from what.

    Parameters
    ----------
    n_candidates : how many at most; fewer only where there are no more.
    tried_share : share of them that the exploration tried; the others are untried neighbours.
    slack : margins that a tried one may have at most, see `score.score`: one further off does not hold.
    """

    n_candidates: int = 300
    tried_share: float = 0.5
    slack: float = 1.5

    def __post_init__(self):
        require.count("n_candidates", self.n_candidates, at_most=MAX_CANDIDATES)
        require.within("tried_share", self.tried_share, low=0.0, high=1.0, is_low_open=True)
        require.within("slack", self.slack, low=1.0, high=100.0)


@dataclass(frozen=True)
class Named:
    """A candidate: a proposal with its price, and the trial it was or is a neighbour of."""

    proposal: Proposal
    cost_cents: int
    trial: int
    is_tried: bool


def apparent_optimum(trials: Sequence[Trial]) -> Trial | None:
    """The cheapest trial whose runs seem to keep the limits, of equal ones the one with the least margin."""
    holding = [trial for trial in trials if trial.is_built and trial.score <= 1.0]
    return min(holding, key=lambda trial: (trial.cost_cents, trial.score), default=None)


def name_candidates(
    trials: Sequence[Trial], variables: Variables, fixed: Fixed, bench: Bench, plan: NamingPlan
) -> list[Named]:
    """Candidates in the order named: tried ones near the front of cost against margin, then neighbours.

    Neighbours change one variable of a candidate a little. They are taken first from the candidates nearest to the
    front, and only if they cost no more than the apparent optimum; with places left, dearer ones follow, for the
    apparent optimum may not hold.
    """
    promising = _promising(trials, plan.slack)
    n_tried = max(1, round(plan.tried_share * plan.n_candidates))
    named = {
        trial.proposal.key: Named(trial.proposal, trial.cost_cents, trial.number, True) for trial in promising[:n_tried]
    }
    best = apparent_optimum(trials)
    dearer: list[_Neighbour] = []
    looked_at = islice(_neighbours(list(named.values()), variables, fixed), LOOKS_PER_CANDIDATE * plan.n_candidates)
    for found in looked_at:
        if len(named) >= plan.n_candidates:
            break
        if found.proposal.key in named or bench.fault(found.proposal) is not None:
            continue
        # Tags are laid, for exact prices, only of what is named.
        if best is None or bench.about_cents(found.proposal) <= best.cost_cents:
            named[found.proposal.key] = _named(found, bench)
        else:
            dearer.append(found)
    for trial in promising[n_tried:]:
        if len(named) < plan.n_candidates:
            named.setdefault(trial.proposal.key, Named(trial.proposal, trial.cost_cents, trial.number, True))
    for found in dearer:
        if len(named) < plan.n_candidates and found.proposal.key not in named:
            named[found.proposal.key] = _named(found, bench)
    return list(named.values())


def _named(found: "_Neighbour", bench: Bench) -> Named:
    return Named(found.proposal, bench.cost_cents(found.proposal), found.trial, False)


def _promising(trials: Sequence[Trial], slack: float) -> list[Trial]:
    """Distinct trials that can be built, those nearest to the front of cost against margin first.

    Those dearer than the apparent optimum come after all cheaper ones, and those beyond the slack last.
    """
    distinct = {trial.proposal.key: trial for trial in reversed(trials) if trial.is_built}
    built = sorted(distinct.values(), key=lambda trial: trial.number)
    if not built:
        return []
    layer = layers(np.array([[float(trial.cost_cents), trial.score] for trial in built]))
    best = apparent_optimum(built)
    most = best.cost_cents if best is not None else max(trial.cost_cents for trial in built)

    def rank(place: int) -> tuple:
        trial = built[place]
        return (trial.score > slack, trial.cost_cents > most, layer[place], trial.score, trial.number)

    return [built[place] for place in sorted(range(len(built)), key=rank)]


@dataclass(frozen=True)
class _Neighbour:
    proposal: Proposal
    trial: int


def _neighbours(parents: list[Named], variables: Variables, fixed: Fixed) -> Iterator[_Neighbour]:
    """Proposals that change one variable of a parent, then, with places left, those that change one of these."""
    queue: list[tuple[int, int, int, Proposal, int]] = []
    seen = {parent.proposal.key for parent in parents}
    for place, parent in enumerate(parents):
        heappush(queue, (0, place, len(queue), parent.proposal, parent.trial))
    n_pushed = len(queue)
    while queue:
        distance, place, _, proposal, trial = heappop(queue)
        for values in _changed(proposal, variables):
            neighbour = propose(values, fixed)
            if neighbour.key in seen:
                continue
            seen.add(neighbour.key)
            yield _Neighbour(neighbour, trial)
            if distance == 0:
                heappush(queue, (1, place, n_pushed, neighbour, trial))
                n_pushed += 1


def _changed(proposal: Proposal, variables: Variables) -> Iterator[tuple[tuple[str, Value], ...]]:
    """Values with one variable changed; the kind stays, for another kind has other variables."""
    for name, value in proposal.values:
        if name in ("kind", "estimator"):
            continue
        for other in variables.by_name[name].beside(value):
            yield tuple((key, other if key == name else held) for key, held in proposal.values)
