"""Floor or shelf: both families are searched by the same test, and a page compares them."""

import shutil
import sqlite3
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rfiddesign.cli.extras import extras_of
from rfiddesign.errors import StudyError
from rfiddesign.optimize import cheapest_certified
from rfiddesign.report import write_report
from rfiddesign.report.shelves import cheaper_table, verdict
from rfiddesign.results.folder import read_record
from rfiddesign.results.shelves import Shelves
from rfiddesign.simulation.shelf_run import ShelfJob, shelf_metrics
from rfiddesign.study import load_study, pipeline, run_study
from rfiddesign.study.load import floor_of, scenario_of
from rfiddesign.study.pipeline import study_hash
from rfiddesign.study.shelves import SHELVES, factors_of, family_plan, price_shelves, shelf_designs, shelf_trial
from rfiddesign.study.storage import RunTable
from rfiddesign.study.verify import verify

STUDY = Path(__file__).parents[1] / "shelf-study"


@pytest.fixture(scope="module")
def shelved(tmp_path_factory):
    """Results of the tiny study with a shelf, on two workers."""
    out = tmp_path_factory.mktemp("shelved") / "out"
    run_study(load_study(STUDY), out, 2, lambda stage: None)
    return out


@pytest.fixture(scope="module")
def shelves(shelved) -> Shelves:
    return read_record(shelved / "shelves.json", Shelves)


@pytest.fixture(scope="module")
def trial():
    study = load_study(STUDY)
    return study, shelf_trial(study, scenario_of(study, floor_of(study)))


def test_the_floor_has_the_shelf_cut_out():
    floor = floor_of(load_study(STUDY))
    assert floor.area_m2 == pytest.approx(7.0 * 6.0 - 3.4 * 1.2)


def test_every_answer_is_that_of_a_search_of_its_own(shelved, shelves, trial):
    """Stored runs, held against the limits by hand, and prices worked out anew."""
    study, setting = trial
    designs = shelf_designs(study)
    with RunTable(shelved / "shelf-runs.sqlite") as table:
        stored = table.runs()

    class Alone:
        def __init__(self, limit):
            self.limit = limit

        def scores(self, design, n_runs):
            runs = stored[0, design][:n_runs]
            assert len(runs) == n_runs
            return np.array([run.is_complete and run.position_mean_mm <= self.limit for run in runs], bool)

        def prefetch(self, requests):
            pass

    plan = family_plan(study.file, pipeline.test_plan(study, len(designs)), SHELVES, len(designs))
    assert plan.n_designs == len(designs) * 2
    assert plan.max_runs == 30
    for n_robots in (1, 20):
        prices = price_shelves(study, setting, designs, n_robots)
        cents = np.array([price.total_cents for price in prices])
        for factor in factors_of(study.file):
            answer = shelves.answer("shelves", n_robots, factor)
            alone = cheapest_certified(cents, Alone(500.0 * factor), plan)
            assert (answer.winner, answer.claim, answer.n_runs_used) == (alone.winner, alone.claim, alone.n_runs_used)
            assert answer.limits[0].limit == 500.0 * factor
            if alone.winner is not None:
                assert answer.cost_cents == cents[alone.winner]
                assert answer.name == designs[alone.winner].name
                assert sum(line.amount_cents for line in answer.cost_lines) == answer.cost_cents
    assert any(answer.winner is not None for answer in shelves.answers if answer.family == "shelves")


def test_stored_runs_are_what_anyone_simulates(shelved, trial):
    study, setting = trial
    with RunTable(shelved / "shelf-runs.sqlite") as table:
        stored = table.runs()
    n_looked_at = 0
    for (_, number), runs in stored.items():
        assert runs[1] == shelf_metrics(setting, ShelfJob(shelf_designs(study)[number], 1))
        n_looked_at += 1
    assert n_looked_at >= 3


def test_the_floors_answer_at_the_studys_limits_is_the_studys(shelves, shelved):
    from rfiddesign.results.study_result import StudyResult

    for own in read_record(shelved / "result.json", StudyResult).answers:
        answer = shelves.answer("floor", own.n_robots, 1.0)
        assert (answer.winner, answer.cost_cents) == (own.winner.design, own.winner.cost_cents)


def test_one_worker_and_an_interruption_change_nothing(shelved, tmp_path):
    study, out = load_study(STUDY), tmp_path / "out"
    n_told = 0

    def interrupt(stage):
        nonlocal n_told
        n_told += stage.what.startswith("shelves")
        if n_told == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_study(study, out, 1, interrupt)
    with RunTable(out / "shelf-runs.sqlite") as table:
        n_before = sum(map(len, table.runs().values()))
    assert n_before > 0
    assert not (out / "shelves.json").exists()
    run_study(study, out, 1, lambda stage: None)
    assert (out / "shelves.json").read_bytes() == (shelved / "shelves.json").read_bytes()


def test_the_certificate_holds_the_record(shelved, tmp_path):
    assert all(not check.faults for check in verify(shelved))
    changed = shutil.copytree(shelved, tmp_path / "changed")
    text = (changed / "shelves.json").read_text()
    (changed / "shelves.json").write_text(text.replace('"n_passed": ', '"n_passed": 1', 1))
    faults = [fault for check in verify(changed) for fault in check.faults]
    assert any("shelves.json: is not what was written" in fault for fault in faults)
    assert any("the winner is certified on 1" in fault for fault in faults)


def test_a_run_that_was_changed_or_lost_is_found(shelved, tmp_path):
    for change, words in (
        ("UPDATE runs SET position_mean_mm = position_mean_mm + 1e-9 WHERE run = 0", "its hash differs"),
        ("DELETE FROM runs WHERE run = 0", "0 are stored"),
    ):
        changed = shutil.copytree(shelved, tmp_path / words.replace(" ", "-"))
        with sqlite3.connect(changed / "shelf-runs.sqlite") as connection:
            connection.execute(change)
        connection.close()
        faults = [fault for check in verify(changed) for fault in check.faults]
        assert any(fault.startswith("shelves.json") and words in fault for fault in faults)


@pytest.mark.usefixtures("without_pictures")
def test_the_report_compares_both(shelved, tmp_path):
    folder = shutil.copytree(shelved, tmp_path / "out")
    write_report(folder)
    page = (folder / "report.html").read_text()
    assert 'id="shelves"' in page
    assert 'id="figure-floor-or-shelf-20"' in page
    rows = (folder / "shelves.csv").read_text().splitlines()
    assert len(rows) == 1 + 2 * 2 * 2


def test_the_command_tells_people_and_machines_which_is_cheaper(shelved, shelves):
    told, lines = extras_of(shelved)
    assert [answer["cost_cents"] for answer in told["shelves"]["answers"]] == [a.cost_cents for a in shelves.answers]
    assert "cost_lines" not in told["shelves"]["answers"][0]
    assert "floor or shelf" in lines
    for row in cheaper_table(shelves).rows:
        assert any(row[2] in line and row[3] in line and row[4] in line for line in lines)


def test_verdicts_say_no_more_than_the_answers(shelves):
    floor = shelves.answer("floor", 1, 1.0)
    cheap = floor.model_copy(update={"family": "shelves", "cost_cents": floor.cost_cents - 100, "winner": 0})
    assert verdict(shelves, floor, cheap) == "tags on shelves, by EUR 1.00"
    # The floor's cheaper undecided designs might undercut the shelves' answer.
    open_floor = floor.model_copy(update={"lower_bound_cents": floor.cost_cents - 200})
    assert verdict(shelves, open_floor, cheap) == "tags on shelves, by EUR 1.00 *"
    none = cheap.model_copy(update={"cost_cents": None, "winner": None, "lower_bound_cents": None})
    assert verdict(shelves, floor, none) == "tags in the floor; the others were all refuted"
    undecided = none.model_copy(update={"lower_bound_cents": floor.cost_cents - 1})
    assert verdict(shelves, floor, undecided) == "tags in the floor, of those certified"
    assert verdict(shelves, none.model_copy(update={"family": "floor"}), none) == "neither certified"


def test_the_hash_changes_with_the_shelf_prices(tmp_path):
    copied = shutil.copytree(STUDY, tmp_path / "study")
    before = study_hash(load_study(copied))
    assert before == study_hash(load_study(STUDY))
    prices = copied / "shelf-prices.toml"
    prices.write_text(prices.read_text().replace("price = 1450.00", "price = 1450.01"))
    assert study_hash(load_study(copied)) != before


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (('scenario.start="known"',), "scenario.start"),
        (("requirement.converged_within_s=5.0",), "requirement.converged_within_s"),
        (("search.budget_runs=100",), "whole searches"),
        (("shelves.aisle_mm=4000.0",), "no row of shelves fits"),
        (("shelves.space.tags_per_m=[1.0, 1.0]",), "must not name a value twice"),
        (("shelves.space.antenna_pairs=[3]",), "shelves.space.antenna_pairs"),
        (("shelves.uhf.day_share=2.0",), "shelves.uhf.day_share"),
    ],
)
def test_what_cannot_be_compared_is_refused_with_its_key(settings, words):
    with pytest.raises(StudyError, match=words):
        floor_of(load_study(STUDY, settings))


def test_prices_in_two_currencies_are_refused(tmp_path):
    copied = shutil.copytree(STUDY, tmp_path / "study")
    prices = copied / "shelf-prices.toml"
    prices.write_text(prices.read_text().replace('"EUR"', '"USD"'))
    with pytest.raises(StudyError, match="is USD, must be EUR"):
        run_study(load_study(copied), tmp_path / "out", 1, lambda stage: None)
    assert not (tmp_path / "out").exists()


def test_a_study_without_shelves_has_no_such_record(finished):
    assert not (finished / "shelves.json").exists()


def test_a_shelf_plan_has_the_studys_alphas(trial):
    study, _ = trial
    own = pipeline.test_plan(study, 10)
    plan = family_plan(study.file, own, SHELVES, 5)
    assert replace(plan, max_runs=own.max_runs) == own
