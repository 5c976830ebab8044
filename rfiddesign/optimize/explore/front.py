"""The front that an exploration found, measured again on fresh runs.

Which trials go on is decided by the few runs of the exploration, which flatters the lucky ones. So the front is
measured on runs that took no part in the choice, the same for every member.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rfiddesign.metrics import RunMetrics
from rfiddesign.optimize.explore.explorer import FIRST_RUN, ExplorePlan, Trial, sampled_means, speed_of
from rfiddesign.optimize.pareto import Knee, knee, layers, membership, non_dominated

#: Number of the first run of a front: neither explorations nor certifications reach it.
FIRST_FRONT_RUN = 2 * FIRST_RUN
N_BOOTSTRAPS = 1000


@dataclass(frozen=True, eq=False)
class Member:
    """A design that was measured for the front.

    Parameters
    ----------
    trial : the trial that it was.
    values, stderr : its objectives in the order of their names, as one thinks of them (a speed counts up), with
        standard errors, 0 where exact.
    chance : chance that it is on the front, by bootstrap over the runs.
    is_on : whether it is, by the point estimates.
    """

    trial: Trial
    values: NDArray[np.float64]
    stderr: NDArray[np.float64]
    chance: float
    is_on: bool


@dataclass(frozen=True, eq=False)
class Front:
    """Members of a front and those that turned out to be dominated, by rising cost.

    Parameters
    ----------
    names : the objectives.
    n_runs : fresh runs of each member.
    members : what was measured.
    knee : the knee among those on the front; its index points into `members`.
    """

    names: tuple[str, ...]
    n_runs: int
    members: tuple[Member, ...]
    knee: Knee


def choose(trials: Sequence[Trial], plan: ExplorePlan, n: int) -> list[Trial]:
    """At most `n` distinct trials to measure: the first fronts by point estimates, spread out where one is too large.

    Only trials that were not stopped and whose score is within the plan's slack. From the front that does not fit whole
    the one best in each objective, then ever the one farthest from all those taken.
    """
    distinct = {trial.proposal.key: trial for trial in reversed(trials) if _is_eligible(trial, plan)}
    eligible = sorted(distinct.values(), key=lambda trial: trial.number)
    if not eligible:
        return []
    values = np.array([_minimised(trial, plan) for trial in eligible])
    low, high = values.min(axis=0), values.max(axis=0)
    scaled = (values - low) / np.where(high > low, high - low, 1.0)
    layer = layers(values)
    taken: list[int] = []
    for number in range(layer.max() + 1):
        taken += _spread_out(scaled, np.flatnonzero(layer == number), taken, n - len(taken))
    return [eligible[place] for place in sorted(taken)]


def measure_front(
    chosen: Sequence[Trial], plan: ExplorePlan, runs_of: Callable[[Trial], Sequence[RunMetrics]]
) -> Front:
    """Measure some trials on fresh runs, equally many and paired for all.

    Raises
    ------
    ValueError : without a trial, or where numbers of runs differ.
    """
    if not chosen:
        raise ValueError("no trial to measure a front of")
    objectives = plan.objectives
    exact = np.array([objectives.known(trial.cost_cents, speed_of(trial.proposal, plan)) for trial in chosen])
    runs = [objectives.measured(runs_of(trial)) for trial in chosen]
    if len({len(each) for each in runs}) > 1:
        raise ValueError(f"numbers of runs are {sorted({len(each) for each in runs})}, must be equal")
    sampled = np.stack(runs)
    n_runs = sampled.shape[1]
    spread = sampled.std(axis=1, ddof=1) if n_runs > 1 else np.zeros((len(chosen), sampled.shape[2]))
    minimised = np.concatenate([exact, sampled.mean(axis=1)], axis=1)
    errors = np.concatenate([np.zeros_like(exact), spread / np.sqrt(n_runs)], axis=1)
    is_on = non_dominated(minimised)
    on = np.flatnonzero(is_on)
    found = knee(minimised[on])
    chance = membership(exact, sampled, seed=plan.seed, n_draws=N_BOOTSTRAPS)
    given = (*objectives.exact, *objectives.sampled)
    places = [given.index(name) for name in objectives.names]
    signs = np.array([objectives.sign(name) for name in objectives.names])
    order = sorted(range(len(chosen)), key=lambda i: (chosen[i].cost_cents, chosen[i].number))
    members = tuple(
        Member(chosen[i], signs * minimised[i, places], errors[i, places], float(chance[i]), bool(is_on[i]))
        for i in order
    )
    return Front(objectives.names, n_runs, members, Knee(order.index(on[found.index]), found.method, found.depth))


def _is_eligible(trial: Trial, plan: ExplorePlan) -> bool:
    return trial.is_built and not trial.is_stopped and trial.score <= plan.slack


def _minimised(trial: Trial, plan: ExplorePlan) -> NDArray[np.float64]:
    known = plan.objectives.known(trial.cost_cents, speed_of(trial.proposal, plan))
    return np.concatenate([known, sampled_means(trial, plan)])


def _spread_out(scaled: NDArray[np.float64], places: NDArray[np.int64], taken: list[int], n: int) -> list[int]:
    """At most `n` of some rows."""
    if n >= len(places):
        return places.tolist()
    found: list[int] = []
    for objective in range(scaled.shape[1]):
        best = int(places[scaled[places, objective].argmin()])
        if best not in found and len(found) < n:
            found.append(best)
    while len(found) < n:
        near = np.stack([np.linalg.norm(scaled[places] - scaled[other], axis=1) for other in [*taken, *found]])
        distance = near.min(axis=0)
        distance[np.isin(places, found)] = -1.0
        found.append(int(places[distance.argmax()]))
    return found
