"""Computing times of cases: the least of several rounds, and a round takes every case in turn."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from rfiddesign.reproduce import load_reproduction, reproduce
from rfiddesign.reproduce.cases import case_of
from rfiddesign.reproduce.timing import us_per_step
from rfiddesign.simulation.monte_carlo import Simulator

ASKS = ('metrics = ["x_mm", "rmse_mm"]', 'metrics = ["x_mm", "us_per_step"]')


@pytest.fixture
def cases(write):
    loaded = load_reproduction(str(write()))
    return {row.row: case_of(loaded, row) for row in loaded.file.rows}


def test_the_least_of_rounds_that_take_every_case_in_turn(cases, monkeypatch):
    script, asked, counted = iter([5.0, 70.0, 4.0, 90.0, 6.0, 60.0]), [], []

    def computing_time(self, job):
        asked.append(job.design)
        return SimpleNamespace(us_per_step=next(script))

    monkeypatch.setattr(Simulator, "computing_time", computing_time)
    found = us_per_step(cases, 3, lambda: counted.append(1))
    assert found == {"MCL": 4.0, "odometry": 60.0}
    assert [id(design) for design in asked] == [id(case.design) for case in cases.values()] * 3
    assert len(counted) == 6


def test_many_particles_take_longer_than_few(write):
    loaded = load_reproduction(str(write()))
    row = loaded.file.rows[0]
    cases = {
        str(n): case_of(loaded, row.model_copy(update={"set": {"mcl.n_particles": n}})) for n in (50, 20_000)
    }  # fmt: skip
    found = us_per_step(cases, 3, lambda: None)
    assert 0 < 10 * found["50"] < found["20000"]


def test_a_look_times_the_beginning_of_a_drive_once(cases, monkeypatch):
    asked = []

    def computing_time(self, job):
        asked.append((self.scenario.duration_s, self.scenario.settle_s))
        return SimpleNamespace(us_per_step=1.0)

    monkeypatch.setattr(Simulator, "computing_time", computing_time)
    late = {
        name: replace(case, scenario=replace(case.scenario, settle_s=case.scenario.duration_s - 0.1))
        for name, case in cases.items()
    }
    us_per_step(late, 3, lambda: None, is_quick=True)
    assert asked == [(2.0, 0.0), (2.0, 0.0)]
    # The cases themselves stay as long as they are.
    assert [case.scenario.duration_s for case in cases.values()] == pytest.approx([2.0, 4.0])


def test_a_row_that_asks_gets_its_time_and_no_error_of_it(write):
    seen = []
    loaded = load_reproduction(str(write(*ASKS)))
    found = reproduce(loaded, n_workers=1, on_progress=lambda *step: seen.append(step))
    (time,) = [row for row in found.rows if row.metric == "us_per_step"]
    assert (time.table, time.row, time.unit, time.stderr) == ("table 1", "odometry", "us", None)
    assert 0 < time.measured < 1e4
    # Once all runs are done.
    assert seen[-3:] == [("table 1, computing times", done, 3) for done in (1, 2, 3)]
    assert [row for row in found.rows if row is not time] == [
        row for row in reproduce(load_reproduction(str(write())), n_workers=1).rows if row.metric != "rmse_mm"
    ]


def test_a_time_can_be_claimed(write):
    folder = write(*ASKS)
    expected = folder / "expected.toml"
    expected.write_text('[[claims]]\ntable = "table 1"\nrow = "odometry"\nmetric = "us_per_step"\nat_least = 0.0\n')
    (claim,) = reproduce(load_reproduction(str(folder)), is_quick=True).claims
    assert claim.holds
    assert claim.measured > 0
