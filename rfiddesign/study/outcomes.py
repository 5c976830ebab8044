"""Passed and failed runs for the search: simulated when first asked for, kept, and never simulated twice."""

from collections.abc import Callable
from concurrent.futures import Future

import numpy as np

from rfiddesign.metrics import Requirement, RunMetrics
from rfiddesign.simulation.monte_carlo import Job, Simulator
from rfiddesign.study.storage import RunTable

# Runs between two commits: about a second of work.
RUNS_PER_COMMIT = 64
# Designs whose runs are begun before their turn: enough to keep cores busy, few enough to waste little at the end.
DESIGNS_AHEAD = 12


class StoredRuns:
    """Runs of numbered candidates: designs, each with an estimator.

    Parameters
    ----------
    job_of : what to run for (number of a candidate, number of the run).
    simulator : runs what is missing.
    table : where runs are kept between sessions.
    """

    def __init__(self, job_of: Callable[[int, int], Job], simulator: Simulator, table: RunTable):
        self._job_of = job_of
        self._simulator = simulator
        self._table = table
        self._runs = {
            (design, run): metrics for design, runs in table.runs().items() for run, metrics in enumerate(runs)
        }
        self._begun: dict[tuple[int, int], Future[RunMetrics]] = {}
        self._unsaved: list[tuple[int, int, RunMetrics]] = []
        self.n_simulated = 0
        self.n_stored = len(self._runs)

    def first(self, design: int, n_runs: int) -> list[RunMetrics]:
        """The first `n_runs` runs of a design."""
        self.begin(design, n_runs)
        return [self._run(design, run) for run in range(n_runs)]

    def has(self, design: int, n_runs: int) -> bool:
        """Whether the first `n_runs` runs of a design are at hand."""
        return all((design, run) in self._runs for run in range(n_runs))

    def begin(self, design: int, n_runs: int) -> None:
        """Begin to simulate what is missing of the first `n_runs` runs, without waiting for it."""
        for run in range(n_runs):
            if (design, run) not in self._runs and (design, run) not in self._begun:
                self._begun[design, run] = self._simulator.submit(self._job_of(design, run))

    def drop_ahead(self) -> None:
        """Forget runs that were begun ahead and not yet started."""
        self._begun = {key: future for key, future in self._begun.items() if not future.cancel()}

    def save(self) -> None:
        """Store every finished run, asked for or not."""
        for (design, run), future in list(self._begun.items()):
            if future.done() and not future.cancelled() and future.exception() is None:
                self._keep(design, run, future.result())
        self._commit()

    def _run(self, design: int, run: int) -> RunMetrics:
        if (design, run) not in self._runs:
            self._keep(design, run, self._begun[design, run].result())
            if len(self._unsaved) >= RUNS_PER_COMMIT:
                self._commit()
        return self._runs[design, run]

    def _keep(self, design: int, run: int, metrics: RunMetrics) -> None:
        del self._begun[design, run]
        self._runs[design, run] = metrics
        self._unsaved.append((design, run, metrics))
        self.n_simulated += 1

    def _commit(self) -> None:
        if self._unsaved:
            self._table.add(self._unsaved)
            self._unsaved = []


class StoredOutcomes:
    """The runs held against one requirement, as the search asks for them.

    `numbers` maps the search's index of a design to its number in the study.
    """

    def __init__(self, runs: StoredRuns, numbers: list[int], requirement: Requirement):
        self._runs = runs
        self._numbers = numbers
        self._requirement = requirement
        self._passed: dict[int, list[bool]] = {}

    def passed(self, design: int, n_runs: int) -> np.ndarray:
        """Which of the first runs of a design passed."""
        known = self._passed.setdefault(design, [])
        if len(known) < n_runs:
            runs = self._runs.first(self._numbers[design], n_runs)
            known.extend(self._requirement.is_met(run) for run in runs[len(known) :])
        return np.array(known[:n_runs], bool)

    def prefetch(self, requests: list[tuple[int, int]]) -> None:
        """Begin what is likely asked for next, unless stored runs answer for now: then nobody waits."""
        if self._runs.has(self._numbers[requests[0][0]], requests[0][1]):
            return
        for design, n_runs in requests[: 1 + DESIGNS_AHEAD]:
            self._runs.begin(self._numbers[design], n_runs)
