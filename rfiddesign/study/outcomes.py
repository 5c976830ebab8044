"""Passed and failed runs for the search: simulated when first asked for, kept, and never simulated twice."""

from collections.abc import Callable, Iterator
from concurrent.futures import Future
from typing import Any, Protocol

import numpy as np

from rfiddesign.metrics import RunMetrics
from rfiddesign.study.criteria import Criteria
from rfiddesign.study.storage import RunTable

# Runs between two commits: about a second of work.
RUNS_PER_COMMIT = 64
# Designs whose runs are begun before their turn: enough to keep cores busy, few enough to waste little at the end.
DESIGNS_AHEAD = 12


class Runner(Protocol):
    """What runs jobs of its own kind."""

    def submit(self, job: Any) -> Future[RunMetrics]:
        """Begin one run and do not wait for it."""
        ...


class StoredRuns:
    """Runs of numbered candidates: designs, each with an estimator, in one scenario or several.

    Parameters
    ----------
    job_of : what to run for (number of a candidate, number of the run, place of the scenario).
    simulator : runs what is missing.
    table : where runs are kept between sessions.
    n_scenarios : scenarios that every candidate is run in.
    """

    def __init__(
        self, job_of: Callable[[int, int, int], Any], simulator: Runner, table: RunTable, n_scenarios: int = 1
    ):
        self._job_of = job_of
        self._simulator = simulator
        self._table = table
        self.n_scenarios = n_scenarios
        self._runs = {(*key, run): metrics for key, runs in table.runs().items() for run, metrics in enumerate(runs)}
        self._begun: dict[tuple[int, int, int], Future[RunMetrics]] = {}
        self._unsaved: list[tuple[int, int, int, RunMetrics]] = []
        self.n_simulated = 0
        self.n_stored = len(self._runs)

    def first(self, design: int, n_runs: int) -> tuple[list[RunMetrics], ...]:
        """The first `n_runs` runs of a design in each scenario."""
        self.begin(design, n_runs)
        return tuple(
            [self._run((scenario, design, run)) for run in range(n_runs)] for scenario in range(self.n_scenarios)
        )

    def has(self, design: int, n_runs: int) -> bool:
        """Whether the first `n_runs` runs of a design are at hand."""
        return all(key in self._runs for key in self._keys(design, n_runs))

    def begin(self, design: int, n_runs: int) -> None:
        """Begin to simulate what is missing of the first `n_runs` runs, without waiting for it."""
        for key in self._keys(design, n_runs):
            if key not in self._runs and key not in self._begun:
                scenario, _, run = key
                self._begun[key] = self._simulator.submit(self._job_of(design, run, scenario))

    def drop_ahead(self) -> None:
        """Forget runs that were begun ahead and not yet started."""
        self._begun = {key: future for key, future in self._begun.items() if not future.cancel()}

    def save(self) -> None:
        """Store every finished run, asked for or not."""
        for key, future in list(self._begun.items()):
            if future.done() and not future.cancelled() and future.exception() is None:
                self._keep(key, future.result())
        self._commit()

    def _keys(self, design: int, n_runs: int) -> Iterator[tuple[int, int, int]]:
        # Run by run: what a verdict needs first is begun first.
        return ((scenario, design, run) for run in range(n_runs) for scenario in range(self.n_scenarios))

    def _run(self, key: tuple[int, int, int]) -> RunMetrics:
        if key not in self._runs:
            self._keep(key, self._begun[key].result())
            if len(self._unsaved) >= RUNS_PER_COMMIT:
                self._commit()
        return self._runs[key]

    def _keep(self, key: tuple[int, int, int], metrics: RunMetrics) -> None:
        del self._begun[key]
        self._runs[key] = metrics
        self._unsaved.append((*key, metrics))
        self.n_simulated += 1

    def _commit(self) -> None:
        if self._unsaved:
            self._table.add(self._unsaved)
            self._unsaved = []


class StoredOutcomes:
    """The runs held against what a study asks, as the search asks for them.

    `numbers` maps the search's index of a design to its number in the study; runs of up to `designs_ahead` designs are
    begun before their turn.
    """

    def __init__(self, runs: StoredRuns, numbers: list[int], criteria: Criteria, designs_ahead: int = DESIGNS_AHEAD):
        self._designs_ahead = designs_ahead
        self._runs = runs
        self._numbers = numbers
        self._criteria = criteria
        self._scores: dict[int, np.ndarray] = {}

    def scores(self, design: int, n_runs: int) -> np.ndarray:
        """Scores of the first runs of a design, see `Criteria.scores`."""
        known = self._scores.get(design)
        if known is None or len(known) < n_runs:
            known = self._scores[design] = self._criteria.scores(self._runs.first(self._numbers[design], n_runs))
        return known[:n_runs]

    def prefetch(self, requests: list[tuple[int, int]]) -> None:
        """Begin what is likely asked for next, unless stored runs answer for now: then nobody waits."""
        if self._runs.has(self._numbers[requests[0][0]], requests[0][1]):
            return
        for design, n_runs in requests[: 1 + self._designs_ahead]:
            self._runs.begin(self._numbers[design], n_runs)
