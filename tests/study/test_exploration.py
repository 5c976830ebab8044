"""A study that explores: the same answer whatever happens on the way, and candidates named before they are judged."""

import json

import pytest

from rfiddesign.catalog import antenna
from rfiddesign.errors import StudyError
from rfiddesign.report.figures.robot import detection_area
from rfiddesign.results.exploration import Exploration, Pareto
from rfiddesign.results.study_result import ChosenDesign, StudyResult
from rfiddesign.study import load_study, rerun, run_study, verify
from rfiddesign.study.storage import RunTable

EXPLORE = """
[explore]
n_trials = 16
runs_per_trial = 4
pilot_runs = 2
n_candidates = 9
[explore.ranges]
kind = ["bar", "ring"]
antenna = ["60x60", "80x80"]
pattern = ["square"]
tags_per_m2 = { low = 40, high = 225, log = true }
readers = { low = 2, high = 5 }
spacing_mm = { low = 80, high = 120 }
radius_mm = 200.0
"""
PARETO = """
speed_mm_per_s = { low = 100, high = 200 }
[pareto]
objectives = ["cost", "position_p95_mm", "speed_mm_per_s"]
n_front = 5
runs = 6
slack = 8
"""


@pytest.fixture
def exploring(tiny):
    """Make the tiny study explore in place of its list; True: for a front, too."""

    def change(is_pareto=False, keeps_list=False):
        path = tiny / "study.toml"
        before, _, rest = path.read_text().partition("[space]")
        listed, _, after = rest.partition("[search]")
        kept = f"[space]{listed}" if keeps_list else ""
        path.write_text(f"{before}{kept}{EXPLORE}{PARETO if is_pareto else ''}[search]{after}")
        return tiny

    return change


def run(folder, out, workers=2, on_stage=lambda stage: None):
    return run_study(load_study(folder), out, workers, on_stage)


def record(out, model, name):
    return model.model_validate_json((out / name).read_bytes())


def test_an_exploration_is_the_same_with_any_number_of_workers_and_after_an_interruption(exploring, tmp_path):
    folder = exploring(is_pareto=True)
    run(folder, tmp_path / "one", 1)
    names = ("exploration.json", "pareto.json", "result.json", "traces.json")
    n_seen = 0

    def interrupt(stage):
        nonlocal n_seen
        n_seen += stage.what.startswith("exploring")
        if n_seen == 2 and not (tmp_path / "two" / "exploration.json").exists():
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(folder, tmp_path / "two", 2, interrupt)
    n_seen = 99
    run(folder, tmp_path / "two", 2)
    # And once more with all there is.
    run(folder, tmp_path / "two", 2)
    for name in names:
        assert (tmp_path / "two" / name).read_bytes() == (tmp_path / "one" / name).read_bytes(), name


def test_candidates_are_what_was_named_and_the_winner_is_one_of_them(exploring, tmp_path):
    result = run(exploring(), tmp_path / "out")
    explored = record(tmp_path / "out", Exploration, "exploration.json")
    named = {each.number: each for fleet in explored.fleets for each in fleet.named}
    assert result.test.n_designs == result.space.n_candidates == len(named) <= 18
    assert {design.number for design in result.designs} <= set(named)
    for answer in result.answers:
        winner = named[answer.winner.design]
        assert next(d.name for d in result.designs if d.number == answer.winner.design) == winner.name
        prices = {each.number: each.cost_cents for each in explored.fleet(answer.n_robots).named}
        assert all(prices.get(d.design, d.cost_cents) == d.cost_cents for d in answer.decisions)
    assert not (tmp_path / "out" / "pareto.json").exists()
    # 2 antennas x 186 densities x 4 numbers of readers x (41 spacings of bars + the one radius of rings)
    assert explored.n_designs == 2 * 186 * 4 * (41 + 1)


def test_runs_of_exploring_and_certifying_share_no_number(exploring, tmp_path):
    out = tmp_path / "out"
    run(exploring(), out)
    explored = record(out, Exploration, "exploration.json")
    with RunTable(out / "explore.sqlite") as tried, RunTable(out / "runs.sqlite") as certified:
        tried, certified = tried.runs(), certified.runs()
    # Stored from 0 in either table: what is drawn from is offset.
    assert explored.first_run == 1_000_000_000
    assert max(map(len, certified.values())) < explored.first_run
    named = [each for fleet in explored.fleets for each in fleet.named if each.is_tried]
    trial = explored.fleets[0].trials[named[0].trial]
    assert trial.n_runs in {len(runs) for runs in tried.values()}
    same = [runs for (_, number), runs in certified.items() if number == named[0].number]
    if same:
        assert same[0][0] not in [run for runs in tried.values() for run in runs]


def test_a_front_is_measured_and_its_knee_is_on_it(exploring, tmp_path):
    out = tmp_path / "out"
    run(exploring(is_pareto=True), out)
    pareto = record(out, Pareto, "pareto.json")
    explored = record(out, Exploration, "exploration.json")
    assert [each.is_maximised for each in pareto.objectives] == [False, False, True]
    assert pareto.fronts
    for front in pareto.fronts:
        trials = explored.fleet(front.n_robots).trials
        assert front.members[front.knee].is_on_front
        assert front.n_runs == 6
        for member in front.members:
            trial = trials[member.trial]
            assert member.values[0] == trial.cost_cents / 100
            assert member.values[2] == trial.values["speed_mm_per_s"]
            assert member.stderr[0] == member.stderr[2] == 0.0
            assert member.stderr[1] > 0.0
            assert 0.0 <= member.chance <= 1.0
        for member in (m for m in front.members if m.is_on_front):
            assert not any(
                other.values[0] <= member.values[0]
                and other.values[1] < member.values[1]
                and other.values[2] >= member.values[2]
                for other in front.members
            )


def test_listed_designs_compete_with_explored_ones(exploring, tmp_path):
    result = run(exploring(keeps_list=True), tmp_path / "out")
    explored = record(tmp_path / "out", Exploration, "exploration.json")
    first = min(each.number for fleet in explored.fleets for each in fleet.named)
    assert first == 24
    assert result.space.n_combinations == 24 + explored.n_designs
    numbers = {decision.design for answer in result.answers for decision in answer.decisions}
    assert any(number < 24 for number in numbers)
    assert any(number >= 24 for number in numbers)


def test_a_minute_too_short_still_names_candidates_and_claims_no_more(exploring, tmp_path):
    study = load_study(exploring(), ("search.budget_minutes=0.001",))
    result = run_study(study, tmp_path / "out", 2, lambda stage: None)
    explored = record(tmp_path / "out", Exploration, "exploration.json")
    assert all(fleet.is_cut_short and fleet.trials for fleet in explored.fleets)
    assert {answer.claim for answer in result.answers} <= {"stopped by budget", "certified, stopped by budget"}


def test_a_winner_is_certified_at_its_height_and_tried_again_there(exploring, tmp_path):
    folder = exploring()
    path = folder / "study.toml"
    path.write_text(path.read_text().replace("radius_mm = 200.0", "radius_mm = 200.0\nantenna_height_mm = 18.0"))
    result = run(folder, tmp_path / "out")
    assert all(", antennas 18 mm high" in design.name for design in result.designs)
    chosen = ChosenDesign.model_validate_json((tmp_path / "out" / "design.json").read_bytes())
    assert chosen.antenna_height_mm == 18.0
    assert detection_area(chosen) == antenna(chosen.antenna).at_height(18.0).area != antenna(chosen.antenna).area
    assert not any(check.faults for check in verify(tmp_path / "out"))
    assert next(found.name for found in rerun(tmp_path / "out", None, 1)) == chosen.name


@pytest.mark.parametrize(
    ("old", "new", "key", "message"),
    [
        ("readers = { low = 2, high = 5 }", "", "explore.ranges", "readers is missing, a layout of kind 'bar'"),
        ("high = 5 }", "high = 1 }", "explore.ranges.readers", "low is 2 and high 1"),
        ('kind = ["bar", "ring"]', 'kind = ["star"]', "explore.ranges.kind", "must be one of"),
        ('["60x60", "80x80"]', '["navifloor"]', "per_robot.antenna", "of explore.ranges.antenna"),
        ("low = 40, high = 225", "low = 40, high = 9e5", "explore.ranges.tags_per_m2", "tags, at most 20,000,000"),
        ("n_trials = 16", 'n_trials = 16\nsampler = "cmaes"', "explore.sampler", "takes no lists of names"),
        ("n_trials = 16", 'n_trials = 16\nimportance = ["fanova"]', "explore.importance", "needs the package"),
        (
            "radius_mm = 200.0", "radius_mm = 200.0\nantenna_height_mm = { low = 20, high = 60 }",
            "explore.ranges.antenna_height_mm", "antenna 60x60: height is 60, it sees tags from 0 to 54 mm",
        ),
        ('pattern = ["square"]', 'pattern = ["square"]\nestimator = ["pmg"]', None, "explore.ranges.estimator needs"),
    ],
)  # fmt: skip
def test_faults_are_named_before_anything_is_written(exploring, tmp_path, monkeypatch, old, new, key, message):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    folder = exploring()
    text = (folder / "study.toml").read_text()
    assert text.count(old) == 1
    (folder / "study.toml").write_text(text.replace(old, new))
    with pytest.raises(StudyError, match=message) as caught:
        run(folder, tmp_path / "out")
    assert key is None or caught.value.key == key
    assert not (tmp_path / "out").exists()


def test_a_study_needs_something_to_search_and_a_front_needs_an_exploration(exploring):
    folder = exploring()
    path = folder / "study.toml"
    path.write_text(path.read_text().replace(EXPLORE, ""))
    with pytest.raises(StudyError, match="needs at least one of space and explore"):
        load_study(folder)


def test_saved_result_of_an_exploration_reads_back(exploring, tmp_path):
    run(exploring(), tmp_path / "out")
    raw = json.loads((tmp_path / "out" / "exploration.json").read_text())
    assert record(tmp_path / "out", Exploration, "exploration.json").model_dump(mode="json") == raw
    assert record(tmp_path / "out", StudyResult, "result.json").space.screens[-1].kind == "heuristic"
