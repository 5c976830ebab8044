"""Explore a space too large to list: ask a sampler for proposals, run each a little, tell it what came out.

Proposals are asked for and told in batches of a fixed size, in one thread and one order: what is proposed depends on
the seed and on the runs' outcomes, neither on workers nor on timing. An interrupted exploration is simply explored
again: the seeded sampler asks for the same proposals, whose runs are stored, and goes on where it was. optuna's own
storage is not used.

Nothing here is a claim. Exploring leaves candidates, which are named before the first run of the certification; the
runs of the exploration have numbers from `FIRST_RUN` on, which no certification reaches, so that candidates were not
chosen by the runs that they are then judged by.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import log
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rfiddesign import require
from rfiddesign.metrics import Requirement, RunMetrics
from rfiddesign.optimize.explore.early_stop import Standing, is_beaten
from rfiddesign.optimize.explore.proposal import Fixed, Proposal, propose
from rfiddesign.optimize.explore.samplers import SAMPLERS, ask, check_sampler, new_study, tell
from rfiddesign.optimize.explore.score import WORST_MARGIN, Objectives, margins, score
from rfiddesign.optimize.explore.variables import Variables

#: Number of the first run of an exploration: certification runs are numbered from 0 and end far below.
FIRST_RUN = 1_000_000_000
MAX_TRIALS = 100_000
#: Stands for an error [mm or rad] of what cannot be built: no run is made of it.
_NO_RUNS_VALUE = 1e4
# How much a doubled margin weighs against a doubled price where a sampler heeds no constraints.
_PENALTY = 10.0


class Bench(Protocol):
    """Where proposals are tried."""

    def fault(self, proposal: Proposal) -> str | None:
        """Why it cannot be built; None if it can."""
        ...

    def cost_cents(self, proposal: Proposal) -> int:
        """What it costs."""
        ...

    def about_cents(self, proposal: Proposal) -> int:
        """What it costs, about: at once, without laying tags."""
        ...

    def begin(self, proposal: Proposal, n_runs: int) -> None:
        """A hint: its first runs will be asked for."""
        ...

    def runs(self, proposal: Proposal, n_runs: int) -> Sequence[RunMetrics]:
        """Its first runs: a pure function of both arguments."""
        ...


@dataclass(frozen=True)
class ExplorePlan:
    """How an exploration goes.

    Parameters
    ----------
    sampler : one of `SAMPLERS`.
    seed : seed of the sampler.
    n_trials : how many proposals are tried.
    n_runs : runs of a proposal.
    n_pilot : runs after which a proposal may be stopped for the first time; the next look is at twice as many.
    requirement, share : the limits that runs are held against, and the share of runs that should keep them.
    objectives : of a front; None: the least cost whose runs keep the limits.
    batch : proposals asked for at a time.
    alpha_stop : significance at which a proposal is stopped.
    speed_mm_per_s : speed of proposals that say nothing of theirs.
    slack : what goes onto a front keeps limits this many times as large, so that no robot on it is lost.
    """

    requirement: Requirement
    share: float
    sampler: str = "tpe"
    seed: int = 0
    n_trials: int = 200
    n_runs: int = 16
    n_pilot: int = 8
    objectives: Objectives | None = None
    batch: int = 8
    alpha_stop: float = 0.01
    speed_mm_per_s: float = 0.0
    slack: float = 2.0

    def __post_init__(self):
        require.count("n_trials", self.n_trials, at_most=MAX_TRIALS)
        require.count("n_runs", self.n_runs, at_most=MAX_TRIALS)
        require.count("n_pilot", self.n_pilot, at_most=MAX_TRIALS)
        require.count("batch", self.batch, at_most=1000)
        require.within("alpha_stop", self.alpha_stop, low=0.0, high=0.5)
        require.within("slack", self.slack, low=1.0, high=WORST_MARGIN)

    @property
    def n_told(self) -> int:
        """How many objectives the sampler is told."""
        if self.objectives is not None:
            return len(self.objectives.names)
        # Genetic samplers spread over a front of cost against margin; the others look for the least cost.
        return 2 if self.sampler in ("nsga2", "nsga3") else 1

    @property
    def stages(self) -> tuple[int, ...]:
        """Runs in all after each stage of a proposal."""
        stages = [min(self.n_pilot, self.n_runs)]
        while stages[-1] < self.n_runs:
            stages.append(min(2 * stages[-1], self.n_runs))
        return tuple(stages)


@dataclass(frozen=True)
class Trial:
    """A proposal that was tried.

    Parameters
    ----------
    number : its place in the order asked.
    drawn : what the sampler drew.
    proposal : what was made of it.
    cost_cents : its price.
    fault : why it cannot be built; None: it can.
    runs : its runs; none of what cannot be built.
    is_stopped : whether it was stopped early.
    score : margin that most of its runs keep, see `score.score`.
    """

    number: int
    drawn: dict[str, str | int | float]
    proposal: Proposal
    cost_cents: int
    fault: str | None
    runs: tuple[RunMetrics, ...] = field(repr=False)
    is_stopped: bool
    score: float

    @property
    def is_built(self) -> bool:
        """Whether it can be built."""
        return self.fault is None


def check_exploration(variables: Variables, plan: ExplorePlan) -> None:
    """Raise ValueError if a plan's sampler cannot explore these variables."""
    if not variables.searched:
        raise ValueError("every variable has one value, there is nothing to explore")
    check_sampler(plan.sampler, variables.searched, plan.n_told)


def explore(
    variables: Variables,
    fixed: Fixed,
    bench: Bench,
    plan: ExplorePlan,
    *,
    is_over: Callable[[], bool] = lambda: False,
    on_batch: Callable[[list[Trial]], None] = lambda trials: None,
) -> list[Trial]:
    """Try proposals of a sampler; all trials in the order asked.

    Parameters
    ----------
    variables, fixed : what is varied and what is not.
    bench : where proposals are tried.
    plan : how.
    is_over : asked before each batch whether to end now, once something was tried that can be built: only for limits of
        time, which make the end hang on timing.
    on_batch : called with all trials after each batch.

    Raises
    ------
    ValueError : as `check_exploration`.
    """
    check_exploration(variables, plan)
    study = new_study(plan.sampler, plan.seed, plan.n_trials, plan.n_told)
    trials: list[Trial] = []
    standings: list[Standing] = []
    is_any_built = False
    while len(trials) < plan.n_trials and not (is_any_built and is_over()):
        n = min(plan.batch, plan.n_trials - len(trials))
        asked = [ask(study, variables.searched) for _ in range(n)]
        tried = _try_batch([propose(variables.made(each.params), fixed) for each in asked], bench, plan, standings)
        for each, (proposal, cost_cents, fault, runs, is_stopped) in zip(asked, tried, strict=True):
            trial = Trial(
                len(trials), dict(each.params), proposal, cost_cents, fault, runs, is_stopped, _score(plan, runs)
            )
            tell(study, each, _values(trial, plan), _constraints(trial, plan))
            trials.append(trial)
            is_any_built = is_any_built or trial.is_built
            if trial.is_built and not trial.is_stopped:
                standings.append(_standing(trial.proposal, trial.cost_cents, trial.runs, plan))
        on_batch(trials)
    return trials


def _try_batch(
    proposals: list[Proposal], bench: Bench, plan: ExplorePlan, standings: list[Standing]
) -> list[tuple[Proposal, int, str | None, tuple[RunMetrics, ...], bool]]:
    """Run some proposals in stages; after each, those beaten by what was told before this batch are stopped."""
    faults = [bench.fault(proposal) for proposal in proposals]
    costs = [
        bench.cost_cents(proposal) if fault is None else bench.about_cents(proposal)
        for proposal, fault in zip(proposals, faults, strict=True)
    ]
    runs: list[tuple[RunMetrics, ...]] = [()] * len(proposals)
    stopped = [False] * len(proposals)
    for n_runs in plan.stages:
        going = [i for i in range(len(proposals)) if faults[i] is None and not stopped[i]]
        for i in going:
            bench.begin(proposals[i], n_runs)
        for i in going:
            runs[i] = tuple(bench.runs(proposals[i], n_runs))
            standing = _standing(proposals[i], costs[i], runs[i], plan)
            stopped[i] = n_runs < plan.n_runs and is_beaten(standing, standings, plan.alpha_stop)
    return list(zip(proposals, costs, faults, runs, stopped, strict=True))


def speed_of(proposal: Proposal, plan: ExplorePlan) -> float:
    """How fast a proposal's robots drive [mm/s]."""
    return plan.speed_mm_per_s if proposal.speed_mm_per_s is None else proposal.speed_mm_per_s


def _standing(proposal: Proposal, cost_cents: int, runs: tuple[RunMetrics, ...], plan: ExplorePlan) -> Standing:
    if plan.objectives is None:
        return Standing(np.array([float(cost_cents)]), np.log(margins(plan.requirement, runs))[:, None])
    known = plan.objectives.known(cost_cents, speed_of(proposal, plan))
    return Standing(known, plan.objectives.measured(runs))


def _score(plan: ExplorePlan, runs: tuple[RunMetrics, ...]) -> float:
    return score(margins(plan.requirement, runs), plan.share) if runs else WORST_MARGIN


def _constraints(trial: Trial, plan: ExplorePlan) -> dict[str, float]:
    """What a trial must keep, kept where at most 0: a front keeps larger limits."""
    most = 1.0 if plan.objectives is None else plan.slack
    return {"buildable": -1.0 if trial.is_built else 1.0, "limits": log(trial.score / most)}


def sampled_means(trial: Trial, plan: ExplorePlan) -> NDArray[np.float64]:
    """Means of the sampled objectives of a front over a trial's runs, shape (k,)."""
    return plan.objectives.measured(trial.runs).mean(axis=0)


def _values(trial: Trial, plan: ExplorePlan) -> tuple[float, ...]:
    """The objectives as the sampler is told them."""
    if plan.objectives is not None:
        known = plan.objectives.known(trial.cost_cents, speed_of(trial.proposal, plan))
        exact = dict(zip(plan.objectives.exact, known.tolist(), strict=True))
        if not trial.runs:
            return tuple(exact.get(name, _NO_RUNS_VALUE) for name in plan.objectives.names)
        sampled = dict(zip(plan.objectives.sampled, sampled_means(trial, plan).tolist(), strict=True))
        return tuple((exact | sampled)[name] for name in plan.objectives.names)
    if plan.n_told == 2:
        return (trial.cost_cents / 100, trial.score)
    if SAMPLERS[plan.sampler].takes_constraints:
        return (trial.cost_cents / 100,)
    return (log(max(trial.cost_cents, 1)) + _PENALTY * max(log(trial.score), 0.0),)
