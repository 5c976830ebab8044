"""A study that leaves the estimator open: the search chooses it with the design."""

import csv
import json
from pathlib import Path

import pytest

from rfiddesign.errors import StudyError
from rfiddesign.report import write_report
from rfiddesign.results.study_result import ChosenDesign, StudyResult
from rfiddesign.study import check_study, load_study, run_study
from rfiddesign.study.estimator_config import AUTO_ESTIMATORS
from rfiddesign.study.load import space_of
from rfiddesign.study.storage import RunTable

TINY = Path(__file__).parents[1] / "tiny-study"
LISTED = ("quantized_ekf", "mcl")
AUTO = ("estimator=auto", f"space.estimator={json.dumps(LISTED)}")


def run(folder, out, *settings, workers=2, on_stage=lambda stage: None) -> StudyResult:
    return run_study(load_study(folder, settings), out, workers, on_stage)


def runs_of(out) -> dict:
    with RunTable(out / "runs.sqlite") as table:
        return {design: runs for (_, design), runs in table.runs().items()}


@pytest.fixture(scope="module")
def auto(tmp_path_factory):
    """Results of the tiny study with the estimator left open."""
    out = tmp_path_factory.mktemp("auto") / "out"
    run(TINY, out, *AUTO, workers=1)
    return out


def result_of(out) -> StudyResult:
    return StudyResult.model_validate_json((out / "result.json").read_bytes())


def test_the_answer_is_the_cheapest_that_any_of_the_estimators_has(tiny, auto, finished, tmp_path):
    """Both estimators alone bracket it: of the cheaper pairs each was refuted, and the winner holds with its own."""
    alone = [result_of(finished), run(tiny, tmp_path / "ekf", "estimator=quantized_ekf")]
    found = result_of(auto)
    for i, answer in enumerate(found.answers):
        winners = [single.answers[i].winner for single in alone]
        assert answer.winner.cost_cents == min(winner.cost_cents for winner in winners if winner is not None)
        by_number = {decision.design: decision for decision in answer.decisions}
        for decision in answer.decisions:
            if decision.cost_cents < answer.winner.cost_cents:
                # Whatever the walk looked at, it looked at with each estimator.
                pair = [by_number[2 * (decision.design // 2) + i].verdict for i in range(2)]
                assert pair == ["refuted", "refuted"]


def test_runs_with_each_estimator_are_those_of_a_study_that_names_it(auto, finished, tiny, tmp_path):
    run(tiny, tmp_path / "ekf", "estimator=quantized_ekf")
    named = [runs_of(tmp_path / "ekf"), runs_of(finished)]
    n_compared = 0
    for number, runs in runs_of(auto).items():
        own = named[number % 2].get(number // 2, [])
        n = min(len(runs), len(own))
        assert runs[:n] == own[:n]
        n_compared += n
    assert n_compared > 50


def test_prices_do_not_ask_for_the_estimator_and_numbers_follow_the_design_s(auto, finished):
    named = {design.number: design for design in result_of(finished).designs}
    for design in result_of(auto).designs:
        assert design.estimator == LISTED[design.number % 2]
        assert design.name.endswith(f", {design.estimator}")
        if design.number // 2 in named:
            assert design.name == f"{named[design.number // 2].name}, {design.estimator}"
    for answer in result_of(auto).answers:
        prices = {decision.design: decision.cost_cents for decision in answer.decisions}
        assert all(prices.get(number ^ 1, price) == price for number, price in prices.items())


def test_two_workers_find_what_one_finds_and_an_interrupted_study_goes_on(tiny, auto, tmp_path):
    seen = []

    def interrupt(stage) -> None:
        seen.append(stage)
        if len(seen) == 8:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(tiny, tmp_path / "out", *AUTO, on_stage=interrupt)
    run(tiny, tmp_path / "out", *AUTO)
    assert json.loads((tmp_path / "out" / "provenance.json").read_text())["runs_stored_before"] > 0
    for name in ("result.json", "design.json", "traces.json"):
        assert (tmp_path / "out" / name).read_bytes() == (auto / name).read_bytes(), name


@pytest.mark.usefixtures("without_pictures")
def test_every_place_that_names_a_design_names_its_estimator(auto):
    result, page = result_of(auto), write_report(auto).read_text()
    assert [each.name for each in result.estimators] == list(LISTED)
    assert result.is_estimator_open
    for answer, folder in zip(result.answers, (auto, auto / "robots-40"), strict=True):
        winner = next(design for design in result.designs if design.number == answer.winner.design)
        chosen = ChosenDesign.model_validate_json((folder / "design.json").read_bytes())
        assert (chosen.name, chosen.estimator) == (winner.name, winner.estimator)
        assert answer.computing.estimator == winner.estimator
        assert answer.computing.flops_per_step > 0
        rows = list(csv.DictReader((folder / "cost.csv").open()))
        (row,) = [row for row in rows if row["item"] == f"estimator {winner.estimator}"]
        assert row["amount"] == "0.00"
        assert sum(round(100 * float(row["amount"])) for row in rows[:-1]) == answer.winner.cost_cents
        assert winner.name in page
        assert f"the design with {winner.estimator} keeps every limit" in page
    assert "48 pairs of design and estimator could be tested" in page
    assert "on the machine that ran this study" in page
    assumptions = {row.what: row.value for row in result.assumptions}
    assert assumptions["estimator"] == "chosen by the search with each design: quantized_ekf, mcl"
    assert assumptions["mcl: likelihood"].startswith("combination")


def test_a_named_estimator_is_said_once_with_what_it_computes(finished):
    result = result_of(finished)
    assert [each.name for each in result.estimators] == ["mcl"]
    assert not result.is_estimator_open
    assert all("mcl" not in design.name for design in result.designs)
    assert {design.estimator for design in result.designs} == {"mcl"}
    times = json.loads((finished / "computing.json").read_text())["times"]
    assert [time["n_robots"] for time in times] == [1, 40]
    assert all(time["us_per_step"] > 0 for time in times)
    assert "us_per_step" not in (finished / "result.json").read_text()


def test_without_a_list_there_is_a_usual_one(tiny):
    study = load_study(tiny, ("estimator=auto",))
    assert space_of(study).estimators == AUTO_ESTIMATORS
    assert space_of(load_study(tiny)).estimators == ("mcl",)
    summary = check_study(study)
    assert summary["estimators"] == list(AUTO_ESTIMATORS)
    assert summary["space"]["n_combinations"] == 24 * len(AUTO_ESTIMATORS)


def test_a_short_key_means_the_estimator_that_comes_first(tiny):
    study = load_study(tiny, (*AUTO, "patience=7", "world.odometry.noise_mm_per_s=20.0"))
    assert study.file.ekf.patience == 7
    study = load_study(tiny, ("estimator=auto", 'space.estimator=["particle_filter", "mcl"]', "n_particles=70"))
    assert (study.file.particle_filter.n_particles, study.file.mcl.n_particles) == (70, 60)


@pytest.mark.parametrize(
    ("settings", "line"),
    [
        (('space.estimator=["mcl"]',), 'study.toml: space.estimator needs estimator = "auto", found "mcl"'),
        (("estimator=auto", "space.estimator=[]"), r"space.estimator: found \[\]; list should have at least 1 item"),
        (("estimator=auto", 'space.estimator=["amcl"]'), r"space.estimator.0: found 'amcl'; input should be 'mcl', .*"),
        (("estimator=auto", 'space.estimator=["auto"]'), r"space.estimator.0: found 'auto'; input should be 'mcl', .*"),
        (("estimator=best",), "estimator: found 'best'; input should be 'mcl', .* or 'auto'"),
        (
            ("estimator=auto", 'space.estimator=["mcl", "mcl"]'),
            r"space.estimator: found \['mcl', 'mcl'\], must not name a value twice",
        ),
        (
            ("estimator=auto", 'space.estimator=["odometry", "mcl"]', "mcl.odometry.noise_rad_per_s=12.0"),
            "scenario: estimator: noise of the heading per step",
        ),
    ],
)
def test_bad_input_is_one_line(tiny, settings, line):
    with pytest.raises(StudyError, match=line) as error:
        check_study(load_study(tiny, settings))
    assert "\n" not in str(error.value)
