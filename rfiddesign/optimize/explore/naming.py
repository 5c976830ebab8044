"""Name the candidates of a certification, after exploring and before its first run.

The certified walk tests candidates in rising cost and ends at the first that holds, so that what matters is to name
designs around and below the apparent optimum: those that the exploration liked, and cheaper neighbours of them, some of
which it never tried. A hopeless candidate costs the walk a few runs, one that was not named cannot be found.
"""

from collections.abc import Callable, Iterator, Sequence
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
    n_candidates : how many at most; a third each are tried ones up to the price of the apparent optimum, untried
        cheaper neighbours, and dearer, safer ones, tried as far as there are such. Where a third is short the others
        fill it.
    slack : margins that a candidate may have at most, see `score.score`: one further off does not hold.
    dearest : prices that a candidate may have at most, as multiples of the apparent optimum's.
    """

    n_candidates: int = 300
    slack: float = 1.5
    dearest: float = 4.0

    def __post_init__(self):
        require.count("n_candidates", self.n_candidates, at_most=MAX_CANDIDATES)
        require.within("slack", self.slack, low=1.0, high=100.0)
        require.within("dearest", self.dearest, low=1.0, high=1e6)


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
    trials: Sequence[Trial], variables: Variables, fixed: Fixed, bench: Bench, plan: NamingPlan,
    *, is_over: Callable[[], bool] = lambda: False,
) -> list[Named]:  # fmt: skip
    """Candidates in the order named: tried ones, the cheap before the dear ones, then neighbours of these.

    Neighbours change one variable of a candidate a little, or two. They are taken first from the candidates nearest to
    the front, and only if they cost no more than the apparent optimum. Without one, all prices count as low. `is_over`
    is asked before each whether to end with them, for limits of time.
    """
    cheap, dear = _promising(trials, plan)
    if not cheap and not dear:
        return []
    third = max(1, plan.n_candidates // 3)
    tried = [*cheap[:third], *dear[:third]][: plan.n_candidates]
    named = {trial.proposal.key: _of(trial) for trial in tried}
    best = apparent_optimum(trials)
    most = max(trial.cost_cents for trial in cheap) if best is None else best.cost_cents
    # Where few tried ones are safe, dearer neighbours stand in for them.
    n_cheap = plan.n_candidates - max(0, third - len(dear))
    dearer: list[_Neighbour] = []
    neighbours = _neighbours(list(named.values()), variables, fixed)
    for found in islice(neighbours, LOOKS_PER_CANDIDATE * plan.n_candidates):
        if len(named) >= n_cheap or is_over():
            break
        # Tags are laid, for exact prices, only of what is named.
        is_new = found.proposal.key not in named and bench.fault(found.proposal) is None
        if is_new and bench.about_cents(found.proposal) <= most:
            named[found.proposal.key] = _beside(found, bench)
        elif is_new:
            dearer.append(found)
    for trial in [*cheap[third:], *dear[third:]]:
        if len(named) < n_cheap:
            named.setdefault(trial.proposal.key, _of(trial))
    for found in dearer:
        if len(named) < plan.n_candidates:
            named.setdefault(found.proposal.key, _beside(found, bench))
    return list(named.values())


def _beside(found: "_Neighbour", bench: Bench) -> Named:
    return Named(found.proposal, bench.cost_cents(found.proposal), found.trial, False)


def _of(trial: Trial) -> Named:
    return Named(trial.proposal, trial.cost_cents, trial.number, True)


def _promising(trials: Sequence[Trial], plan: NamingPlan) -> tuple[list[Trial], list[Trial]]:
    """Distinct trials that can be built, up to the price of the apparent optimum and above, the best first.

    Best are those nearest to the front of cost against margin. Those beyond the slack and the dearest price are left
    out, unless nothing is within.
    """
    distinct = {trial.proposal.key: trial for trial in reversed(trials) if trial.is_built}
    built = sorted(distinct.values(), key=lambda trial: trial.number)
    if not built:
        return [], []
    layer = layers(np.array([[float(trial.cost_cents), trial.score] for trial in built]))
    ranked = [
        built[place] for place in sorted(range(len(built)), key=lambda i: (layer[i], built[i].score, built[i].number))
    ]
    best = apparent_optimum(built)
    if best is None:
        return [trial for trial in ranked if trial.score <= plan.slack] or ranked, []
    cheap = [trial for trial in ranked if trial.cost_cents <= best.cost_cents and trial.score <= plan.slack]
    dear = [
        trial
        for trial in ranked
        if best.cost_cents < trial.cost_cents <= plan.dearest * best.cost_cents and trial.score <= 1.0
    ]
    return cheap, dear


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
