"""Runs are simulated when first asked for and never twice, in this session or the next."""

from concurrent.futures import Future
from dataclasses import replace

import pytest

from rfiddesign.metrics import Requirement, RunMetrics
from rfiddesign.simulation.monte_carlo import Job
from rfiddesign.study.criteria import Criteria
from rfiddesign.study.outcomes import DESIGNS_AHEAD, RUNS_PER_COMMIT, StoredOutcomes, StoredRuns
from rfiddesign.study.storage import RunTable

CRITERIA = Criteria(Requirement((("position_mean_mm", 1.0),)), 0.95, 0.9)
RUN = RunMetrics(1.0, 1.0, 1.0, 1.0, 0.1, 0.1, 0.1, 0.1, 1.0, 0.0, 100)


def job_of(design, run, scenario):
    return Job(f"design {design}", run, scenario=scenario)


class Simulator:
    """Answers at once, or leaves everything pending; run i has a mean error of i mm."""

    def __init__(self, *, is_idle: bool = False):
        self.is_idle = is_idle
        self.jobs: list[tuple[str, int]] = []

    def submit(self, job) -> Future:
        self.jobs.append((job.design, job.run))
        future: Future = Future()
        if not self.is_idle:
            future.set_result(replace(RUN, position_mean_mm=float(job.run)))
        return future


@pytest.fixture
def table(tmp_path):
    with RunTable(tmp_path / "runs.sqlite") as opened:
        yield opened


def test_a_run_is_simulated_once_however_often_it_is_asked_for(table):
    simulator = Simulator()
    runs = StoredRuns(job_of, simulator, table)
    assert [run.position_mean_mm for run in runs.first(3, 2)[0]] == [0.0, 1.0]
    assert [run.position_mean_mm for run in runs.first(3, 4)[0]] == [0.0, 1.0, 2.0, 3.0]
    runs.begin(3, 4)
    assert simulator.jobs == [("design 3", run) for run in range(4)]
    assert (runs.n_simulated, runs.n_stored) == (4, 0)


def test_the_next_session_finds_what_was_saved(table):
    runs = StoredRuns(job_of, Simulator(), table)
    runs.first(3, 2)
    runs.begin(4, 1)  # asked for by nobody yet, but done
    runs.save()
    simulator = Simulator()
    again = StoredRuns(job_of, simulator, table)
    assert len(again.first(3, 2)[0]) == 2
    assert len(again.first(4, 1)[0]) == 1
    assert simulator.jobs == []
    assert (again.n_simulated, again.n_stored) == (0, 3)


def test_a_killed_session_loses_less_than_one_batch(table):
    runs = StoredRuns(job_of, Simulator(), table)
    runs.first(3, RUNS_PER_COMMIT + 5)
    assert len(table.runs()[0, 3]) == RUNS_PER_COMMIT


def test_runs_begun_ahead_and_not_started_can_be_dropped_and_begun_again(table):
    simulator = Simulator(is_idle=True)
    runs = StoredRuns(job_of, simulator, table)
    runs.begin(5, 2)
    runs.drop_ahead()
    runs.save()
    assert table.runs() == {}
    simulator.is_idle = False
    assert len(runs.first(5, 2)[0]) == 2
    assert simulator.jobs == [("design 5", 0), ("design 5", 1)] * 2


def test_a_run_that_failed_is_told_when_it_is_asked_for_and_not_stored(table):
    class Broken(Simulator):
        def submit(self, job):
            future: Future = Future()
            future.set_exception(MemoryError("full"))
            return future

    runs = StoredRuns(job_of, Broken(), table)
    runs.begin(1, 1)
    runs.save()
    assert table.runs() == {}
    with pytest.raises(MemoryError, match="full"):
        runs.first(1, 1)


def test_outcomes_hold_each_run_against_the_limits_under_the_study_s_own_number(table):
    simulator = Simulator()
    outcomes = StoredOutcomes(StoredRuns(job_of, simulator, table), [7, 9], CRITERIA)
    assert outcomes.scores(1, 4).tolist() == [True, True, False, False]
    assert {design for design, _ in simulator.jobs} == {"design 9"}


def test_a_few_designs_are_begun_ahead_but_none_while_stored_runs_answer(table):
    simulator = Simulator()
    numbers = list(range(100))
    outcomes = StoredOutcomes(StoredRuns(job_of, simulator, table), numbers, CRITERIA)
    requests = [(design, 2) for design in numbers]
    outcomes.prefetch(requests)
    assert len(simulator.jobs) == 2 * (1 + DESIGNS_AHEAD)
    outcomes.scores(0, 2)
    outcomes.prefetch([(0, 2), (50, 2)])
    assert len(simulator.jobs) == 2 * (1 + DESIGNS_AHEAD)
    outcomes.prefetch([(0, 3), (50, 2)])
    assert len(simulator.jobs) == 2 * (1 + DESIGNS_AHEAD) + 3
