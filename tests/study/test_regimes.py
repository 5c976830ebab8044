"""A map over fleets and floors: each cell is the search of that fleet and floor, and the claims hold of all at once."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rfiddesign.cost import Site, cost
from rfiddesign.errors import StudyError
from rfiddesign.optimize import TestPlan, cheapest_certified
from rfiddesign.report import write_report
from rfiddesign.results.folder import read_record
from rfiddesign.results.regimes import Regimes
from rfiddesign.results.study_result import StudyResult
from rfiddesign.simulation.monte_carlo import Simulator
from rfiddesign.study import load_study, pipeline, run_study
from rfiddesign.study.candidates import find_candidates
from rfiddesign.study.load import floor_of, scenario_of
from rfiddesign.study.pipeline import price_design
from rfiddesign.study.regimes import cell_bill, cell_cents, mix, n_mixes, tolerance_cents
from rfiddesign.study.storage import RunTable

TINY = Path(__file__).parents[1] / "tiny-study"
ROBOTS = (1, 10, 40, 160)
MAP = ("regimes.robots=[1, 4]", "regimes.areas_m2=[10.0, 20.0]")


def study_with_map(folder=TINY):
    """The tiny study with a map whose second area is its own floor's, and that area."""
    area_m2 = round(floor_of(load_study(folder)).area_m2, 2)
    areas = [round(factor * area_m2, 2) for factor in (0.25, 1, 4)]
    return load_study(folder, (f"regimes.robots={list(ROBOTS)}", f"regimes.areas_m2={areas}")), area_m2


@pytest.fixture(scope="module")
def mapped(tmp_path_factory):
    """Results of the tiny study with a map."""
    out = tmp_path_factory.mktemp("mapped") / "out"
    run_study(study_with_map()[0], out, 1, lambda stage: None)
    return out


@pytest.fixture(scope="module")
def regimes(mapped) -> Regimes:
    return read_record(mapped / "regimes.json", Regimes)


@pytest.fixture(scope="module")
def candidates():
    study, _ = study_with_map()
    floor = floor_of(study)
    with Simulator(scenario_of(study, floor), study.file.seed, 1) as simulator:
        return study, floor, find_candidates(study, floor, simulator, lambda stage: None)


def test_a_cell_of_the_studys_own_fleet_and_floor_is_its_answer(mapped, regimes):
    answers = read_record(mapped / "result.json", StudyResult).answers
    _, area_m2 = study_with_map()
    for answer in answers:
        cell = regimes.cell(answer.n_robots, area_m2)
        assert (cell.winner, cell.cost_cents) == (answer.winner.design, answer.winner.cost_cents)
        assert (cell.n_runs, cell.n_passed) == (answer.winner.n_runs, answer.winner.n_passed)
        assert (cell.claim, cell.lower_bound) == (answer.claim, answer.lower_bound.design)
        groups = {}
        for line in answer.cost_lines:
            groups[line.group] = groups.get(line.group, 0) + line.amount_cents
        found = [cell.robots_cents, cell.tags_cents, cell.area_cents, cell.project_cents]
        assert found == [groups[name] for name in ("per robot", "per tag", "per m2", "per project")]


def test_the_map_has_more_than_one_regime(regimes):
    """Else the tests here would show little."""
    assert len({cell.winner for cell in regimes.cells}) > 1
    assert regimes.boundaries


def test_cells_decide_as_if_each_was_searched_alone(mapped, regimes, candidates):
    """The stored runs, held against the requirement by hand, through a search of its own for each cell."""
    study, floor, found = candidates
    with RunTable(mapped / "runs.sqlite") as table:
        stored = table.runs()

    class Alone:
        def scores(self, design, n_runs):
            runs = stored[0, found.numbers[design]][:n_runs]
            return np.array([study.requirement.is_met(run) for run in runs], bool)

        def prefetch(self, requests):
            pass

    for cell in regimes.cells:
        cents = cell_cents(study, found, floor, Site(cell.n_robots, cell.area_m2))
        alone = cheapest_certified(cents, Alone(), pipeline.test_plan(study, len(found.numbers)))
        assert (found.numbers[alone.winner], alone.claim) == (cell.winner, cell.claim)
        assert alone.n_runs_used == cell.n_runs_used
        assert cents[alone.winner] == cell.cost_cents


def test_prices_of_a_cell_are_those_of_a_bill_written_for_it(candidates):
    study, floor, found = candidates
    for site in (Site(1, 7.5), Site(40, floor.area_m2), Site(1000, 123456.78)):
        cents = cell_cents(study, found, floor, site)
        for i, candidate in enumerate(found.by_number.values()):
            n_tags, own_site = cell_bill(candidate, floor, site)
            assert n_tags == pytest.approx(candidate.n_tags * site.area_m2 / floor.area_m2, abs=0.5)
            assert own_site == Site(site.n_robots, round(site.area_m2, 2))
            assert cents[i] == price_design(study, candidate.design, n_tags, own_site).total_cents


def test_a_design_that_covers_part_of_the_floor_covers_that_part_in_every_cell(candidates):
    _, floor, found = candidates
    candidate = replace(next(iter(found.by_number.values())), n_tags=120, tagged_m2=0.25 * floor.area_m2)
    assert cell_bill(candidate, floor, Site(3, 10 * floor.area_m2)) == (1200, Site(3, round(2.5 * floor.area_m2, 2)))


def test_two_workers_draw_the_same_map(mapped, tmp_path):
    run_study(study_with_map()[0], tmp_path / "out", 2, lambda stage: None)
    assert (tmp_path / "out" / "regimes.json").read_bytes() == (mapped / "regimes.json").read_bytes()


def test_a_study_without_a_map_writes_none(finished):
    assert not (finished / "regimes.json").exists()


@pytest.mark.usefixtures("without_pictures")
def test_the_report_shows_the_map(mapped):
    write_report(mapped)
    page = (mapped / "report.html").read_text()
    assert 'id="regimes"' in page
    assert 'id="figure-regimes"' in page
    rows = (mapped / "regimes.csv").read_text().splitlines()
    assert len(rows) == 1 + 3 * len(ROBOTS)


@pytest.mark.parametrize(
    ("settings", "key"),
    [
        (("regimes.robots=[1]", "regimes.areas_m2=[10.0, 20.0]"), "regimes.robots"),
        (("regimes.robots=[4, 1]", "regimes.areas_m2=[10.0, 20.0]"), "regimes"),
        (("regimes.robots=[1, 4]", "regimes.areas_m2=[10.0, 10.0]"), "regimes"),
        (("regimes.robots=[0, 4]", "regimes.areas_m2=[10.0, 20.0]"), "regimes.robots"),
        (("regimes.robots=[1, 4]", "regimes.areas_m2=[0.0, 20.0]"), "regimes.areas_m2"),
        (("regimes.robots=[1, 4]", "regimes.areas_m2=[10.0, nan]"), "regimes.areas_m2"),
        (("regimes.robots=[1, 4]", "regimes.areas_m2=[10.123, 20.0]"), "regimes.areas_m2"),
        ((f"regimes.robots={list(range(1, 26))}", "regimes.areas_m2=[10.0, 20.0]"), "regimes.robots"),
        (("regimes.robots=[1, 4]",), "regimes.areas_m2"),
    ],
)
def test_a_map_that_makes_no_sense_is_refused_with_its_key(settings, key):
    with pytest.raises(StudyError) as caught:
        load_study(TINY, settings)
    assert str(caught.value.key).startswith(key)


@pytest.mark.parametrize(
    "setting", ["budget_runs=100", "budget_minutes=1.0", "cost_tolerance=0.02", 'assume=["fewer tags"]']
)
def test_a_map_needs_a_search_that_goes_on_to_the_cheapest(setting):
    with pytest.raises(StudyError, match=f"without search.{setting.partition('=')[0]}"):
        load_study(TINY, (*MAP, f"search.{setting}"))


def test_mixes_are_counted_exactly():
    sites = [Site(n, area) for n in (1, 2, 4, 8) for area in (250.0, 500.0, 1000.0)]
    assert n_mixes(sites) == 6
    assert mix(Site(1, 0.3)) == mix(Site(3, 0.1 + 0.8))
    assert n_mixes([Site(3, 10.0), Site(3, 10.01)]) == 2


# --- What the docstring of rfiddesign.study.regimes says of all cells at once ---


@given(
    holding=st.lists(st.integers(0, 15), min_size=1, max_size=6, unique=True),
    n_robots=st.integers(1, 60),
    area_m2=st.integers(5, 500),
    factor=st.integers(2, 40),
)
def test_one_design_stands_for_all_cells_of_its_mix(candidates, holding, n_robots, area_m2, factor):
    """Whichever designs hold: the cheapest of a mix is, to within the tolerance, the cheapest in each of its cells."""
    study, floor, found = candidates
    sites = [Site(n_robots, float(area_m2)), Site(factor * n_robots, float(factor * area_m2))]
    assert n_mixes(sites) == 1
    unrounded = [_unrounded(study, found, floor, i, sites[0]) for i in holding]
    stands = holding[int(np.argmin(unrounded))]
    for site in sites:
        cents = cell_cents(study, found, floor, site)
        assert cents[stands] <= cents[holding].min() + tolerance_cents(study.prices)


def _unrounded(study, found, floor, i: int, site: Site) -> float:
    """Cents of a design's hardware and tags, tags in fractions, without rounding."""
    candidate, prices = found.by_number[found.numbers[i]], study.prices
    a_robot = sum(
        line.quantity * line.unit_price
        for line in cost(candidate.design, 0, Site(1, 1.0), prices).lines
        if line.group == "per robot"
    )
    tags = candidate.n_tags * site.area_m2 / floor.area_m2
    return 100 * (site.n_robots * float(a_robot) + tags * float(prices.tag.amount + prices.tag_laying.amount))


class _Luck:
    def __init__(self, rows):
        self.rows = rows

    def scores(self, design, n_runs):
        return self.rows[design, :n_runs]

    def prefetch(self, requests):
        pass


def test_refutation_errs_per_cell_within_alpha_and_on_the_map_within_the_number_of_mixes():
    """Designs at p0 on a hull, each the cheapest at some mix: the hardest case. Alone alpha_refute covers one cell."""
    hardware, tags = np.array([900, 500, 250, 100]), np.array([10, 20, 45, 110])
    sites = [Site(n, a) for n in (1, 3, 9, 27) for a in (9.0, 27.0, 81.0)]
    plan = TestPlan(4, 0.9, 0.5, alpha_refute=0.2, alpha_certify=0.2, max_runs=200)
    n_maps = 250
    wrong = np.zeros((n_maps, len(sites)), bool)
    for seed in range(n_maps):
        outcomes = _Luck(np.random.default_rng(seed).random((4, plan.max_runs)) < plan.hold_probability)
        for k, site in enumerate(sites):
            cents = (site.n_robots * hardware + site.area_m2 * tags).astype(np.int64)
            bound = cheapest_certified(cents, outcomes, plan).lower_bound
            wrong[seed, k] = bound is None or cents[bound] > cents.min()
    noise = 3 * np.sqrt(plan.alpha_refute / n_maps)
    assert wrong.mean(axis=0).max() <= plan.alpha_refute + noise
    assert wrong.mean() <= plan.alpha_refute
    anywhere = wrong.any(axis=1).mean()
    assert plan.alpha_refute < anywhere <= n_mixes(sites) * plan.alpha_refute
