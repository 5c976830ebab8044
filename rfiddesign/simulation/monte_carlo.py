"""Many runs, on many cores, with the answer of one."""

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Self, TypeVar

from rfiddesign.design import Design
from rfiddesign.estimators.registry import Settings
from rfiddesign.floor import TagMap
from rfiddesign.geometry import TagPattern
from rfiddesign.metrics import Requirement, RunMetrics
from rfiddesign.simulation.computing import ComputingTime, measure
from rfiddesign.simulation.installed import InstalledTags
from rfiddesign.simulation.run import PreparedDesign, Trace, key_of, prepare, score, trace_run, true_poses
from rfiddesign.simulation.scenario import Scenario

# What a compiled key holds.
MAX_SEED = 2**63 - 1
# Runs begun before their turn: enough for many cores, few enough for a million runs to be asked for.
RUNS_AHEAD = 256
DESIGNS_KEPT = 64

Item = TypeVar("Item")
Result = TypeVar("Result")


@dataclass(frozen=True)
class Job:
    """Run number `run` of `design`; an estimator or a scenario given here takes the place of the simulator's.

    A scenario given here must have the simulator's floor.
    """

    design: Design
    run: int
    estimator: Settings | None = None
    scenario: Scenario | None = None


class Simulator:
    """Runs designs through scenarios on one floor.  The runs release the GIL, so that threads use all cores.

    Parameters
    ----------
    scenario : how designs are exercised, unless a job says otherwise.
    seed : seed of the study; run i of every design draws from (seed, i) alone.
    n_workers : threads; None: one per core.
    stop_at : a run that has certainly failed this requirement ends; None: every run is completed.

    Raises
    ------
    ValueError : if the seed is not from 0 to 2^63 - 1 or there is not at least one worker.
    """

    def __init__(self, scenario: Scenario, seed: int, n_workers: int | None = None, stop_at: Requirement | None = None):
        if not 0 <= seed <= MAX_SEED:
            raise ValueError(f"seed is {seed!r}, must be from 0 to {MAX_SEED}")
        if n_workers is not None and n_workers < 1:
            raise ValueError(f"n_workers is {n_workers!r}, must be at least 1")
        self.scenario = scenario
        self.seed = seed
        self.stop_at = stop_at
        self._tags = InstalledTags(scenario.floor)
        # Design and estimator are kept beside what belongs to them, so that no other can get their identity.
        self._prepared: dict[tuple[int, int, int], tuple[Job, PreparedDesign]] = {}
        self.n_workers = n_workers or os.cpu_count() or 1
        self._pool = ThreadPoolExecutor(self.n_workers)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self._pool.shutdown(cancel_futures=True)

    def runs(self, jobs: Iterable[Job]) -> Iterator[RunMetrics]:
        """Metrics of each job in the order of the jobs."""
        begun: deque[Future[RunMetrics]] = deque()
        for job in jobs:
            begun.append(self.submit(job))
            if len(begun) > RUNS_AHEAD:
                yield begun.popleft().result()
        while begun:
            yield begun.popleft().result()

    def submit(self, job: Job) -> Future[RunMetrics]:
        """Begin one run and do not wait for it."""
        return self._pool.submit(self._score, job)

    def map(self, function: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
        """As `map`, on the workers."""
        return self._pool.map(function, items)

    def tags(self, pattern: TagPattern) -> TagMap:
        """The tags of a pattern on the scenario's floor."""
        return self._tags.lay(pattern)

    def trace(self, job: Job) -> Trace:
        """One run step by step, completed whatever happens."""
        return self._trace(job, None)

    def computing_time(self, job: Job) -> ComputingTime:
        """What the estimator computes on a recording of this run; measured on this thread."""
        scenario = job.scenario or self.scenario
        tags, poses = self.tags(job.design.pattern), true_poses(scenario, self.seed, job.run)
        return measure(self._prepare(job), scenario, tags, poses, key_of(self.seed, job.run))

    def _trace(self, job: Job, stop_at: Requirement | None) -> Trace:
        key, tags, scenario = key_of(self.seed, job.run), self.tags(job.design.pattern), job.scenario or self.scenario
        poses = true_poses(scenario, self.seed, job.run)
        return trace_run(self._prepare(job), scenario, tags, poses, key, stop_at)

    def _prepare(self, job: Job) -> PreparedDesign:
        """What a job consists of made ready; those asked for last are kept, by identity: hashing takes as long."""
        identity = (id(job.design), id(job.estimator), id(job.scenario))
        kept = self._prepared.get(identity)
        if kept is None:
            scenario = job.scenario or self.scenario
            if job.estimator is not None:
                scenario = replace(scenario, estimator=job.estimator)
            kept = (job, prepare(job.design, scenario))
            if len(self._prepared) >= DESIGNS_KEPT:
                self._prepared.clear()
            self._prepared[identity] = kept
        return kept[1]

    def _score(self, job: Job) -> RunMetrics:
        return score(self._trace(job, self.stop_at), job.scenario or self.scenario)
