"""A study from question to answer: the same bytes whatever happens on the way, and files that agree."""

import csv
import json
import signal
import subprocess
import sys
from datetime import datetime
from decimal import Decimal

import pytest

from rfiddesign.errors import StudyError
from rfiddesign.results.study_result import ChosenDesign, StudyResult, Traces
from rfiddesign.study import load_study, run_study
from rfiddesign.study.storage import RunTable

# A run of the study that stops dead, for as long as it takes to be killed, once 100 runs were looked at.
HANGING = """
import sys, time
from pathlib import Path
from rfiddesign.study import load_study, run_study

def show(stage):
    if stage.n_runs >= 66:
        print("midway", flush=True)
        time.sleep(60)

run_study(load_study(sys.argv[1]), Path(sys.argv[2]), 2, show)
"""


def run(folder, out, workers=2, on_stage=lambda stage: None) -> StudyResult:
    return run_study(load_study(folder), out, workers, on_stage)


def provenance(out) -> dict:
    return json.loads((out / "provenance.json").read_text())


def result_of(out) -> StudyResult:
    return StudyResult.model_validate_json((out / "result.json").read_bytes())


def folders(out) -> list:
    return [out, out / "robots-40"]


def test_two_workers_find_what_one_finds_to_the_byte(tiny, finished, tmp_path):
    returned = run(tiny, tmp_path / "out", workers=2)
    for name in ("result.json", "design.json", "tags.csv", "traces.json", "plan.geojson", "robots-40/tags.csv"):
        assert (tmp_path / "out" / name).read_bytes() == (finished / name).read_bytes(), name
    assert returned == result_of(finished)
    assert (provenance(tmp_path / "out")["workers"], provenance(finished)["workers"]) == (2, 1)


@pytest.mark.parametrize("n_stages", [1, 6, 12, 25])
def test_an_interrupted_study_goes_on_to_the_same_bytes(tiny, finished, tmp_path, n_stages):
    out = tmp_path / "out"
    seen = []

    def interrupt(stage) -> None:
        seen.append(stage)
        if len(seen) == n_stages:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(tiny, out, on_stage=interrupt)
    assert not (out / "result.json").exists()
    run(tiny, out)
    assert (out / "result.json").read_bytes() == (finished / "result.json").read_bytes()
    if seen[-1].n_runs:
        # Those looked at but one design's, and perhaps some that were begun ahead.
        assert provenance(out)["runs_stored_before"] > 0


def test_a_study_interrupted_while_saving_has_all_its_runs_when_it_goes_on(tiny, finished, tmp_path):
    def interrupt(stage) -> None:
        if stage.what == "saving":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(tiny, tmp_path / "out", on_stage=interrupt)
    run(tiny, tmp_path / "out")
    assert provenance(tmp_path / "out")["runs_simulated"] == 0
    assert (tmp_path / "out" / "result.json").read_bytes() == (finished / "result.json").read_bytes()


def test_a_killed_study_goes_on_to_the_same_bytes(tiny, finished, tmp_path):
    out = tmp_path / "out"
    child = subprocess.Popen([sys.executable, "-c", HANGING, tiny, out], stdout=subprocess.PIPE, text=True)
    assert child.stdout.readline() == "midway\n"
    child.send_signal(signal.SIGKILL)
    child.communicate()
    assert child.returncode == -signal.SIGKILL
    assert not (out / "result.json").exists()
    run(tiny, out)
    assert (out / "result.json").read_bytes() == (finished / "result.json").read_bytes()
    assert 0 < provenance(out)["runs_stored_before"] < provenance(finished)["runs_simulated"] + 100
    assert provenance(out)["runs_simulated"] > 0


def test_a_finished_study_simulates_nothing_when_run_again(tiny, tmp_path):
    run(tiny, tmp_path / "out")
    first = (tmp_path / "out" / "result.json").read_bytes()
    n_runs = provenance(tmp_path / "out")["runs_simulated"]
    run(tiny, tmp_path / "out")
    again = provenance(tmp_path / "out")
    assert (again["runs_simulated"], again["runs_stored_before"]) == (0, n_runs)
    assert (tmp_path / "out" / "result.json").read_bytes() == first


def test_a_study_changed_in_between_is_refused_and_its_folder_left_alone(tiny, edit, tmp_path):
    out = tmp_path / "out"
    run(tiny, out)
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    edit("price = 42.00", "price = 43.00", file="prices.toml")
    with pytest.raises(StudyError, match=rf"{out}: holds another study, or this one before a change"):
        run(tiny, out)
    assert {path: path.read_bytes() for path in out.rglob("*") if path.is_file()} == before


def test_another_run_in_the_same_folder_is_refused(tiny, tmp_path):
    out = tmp_path / "out"
    run(tiny, out)
    with RunTable(out / "runs.sqlite") as table:
        table.add([])
        with pytest.raises(StudyError, match=r"runs.sqlite: is in use by another run"):
            run(tiny, out)


def test_a_damaged_run_table_is_one_line(tiny, tmp_path):
    out = tmp_path / "out"
    run(tiny, out)
    (out / "runs.sqlite").write_bytes(b"not a database" * 1000)
    with pytest.raises(StudyError, match=r"runs.sqlite: cannot be used: file is not a database"):
        run(tiny, out)


@pytest.mark.parametrize("content", ["", "[]", "{", '{"hash": null}', "[" * 50_000])
def test_a_folder_with_a_broken_study_json_is_refused(tiny, tmp_path, content):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "study.json").write_text(content)
    with pytest.raises(StudyError, match=r"out: holds another study"):
        run(tiny, tmp_path / "out")


def test_the_answer_differs_between_one_robot_and_forty(finished):
    few, many = result_of(finished).answers
    names = {design.number: design for design in result_of(finished).designs}
    assert (few.n_robots, many.n_robots) == (1, 40)
    assert few.claim == many.claim == "cheapest"
    assert names[few.winner.design].n_readers == 8
    assert names[many.winner.design].n_readers == 2
    assert names[many.winner.design].tags_per_m2 > names[few.winner.design].tags_per_m2


def test_cheaper_designs_are_refuted_and_the_winner_is_the_first_certified(finished):
    for answer in result_of(finished).answers:
        for decision in answer.decisions:
            if decision.cost_cents < answer.winner.cost_cents:
                assert decision.verdict == "refuted"
        assert answer.winner.verdict == "certified"
        assert answer.lower_bound == answer.winner
        assert all(design.cost_cents > answer.winner.cost_cents for design in answer.runners_up)
        assert answer.n_runs_used == sum(decision.n_runs for decision in answer.decisions)


def test_looser_limits_never_cost_more_and_the_front_passes_through_the_winner(finished):
    for answer in result_of(finished).answers:
        assert [front.factor for front in answer.fronts] == [1.0, 1.5]
        assert answer.fronts[0].decision.design == answer.winner.design
        assert answer.fronts[1].decision.cost_cents <= answer.winner.cost_cents


def test_cost_lines_designs_and_tags_tell_one_story(finished):
    result = result_of(finished)
    names = {design.number: design for design in result.designs}
    for answer, folder in zip(result.answers, folders(finished), strict=True):
        chosen = ChosenDesign.model_validate_json((folder / "design.json").read_bytes())
        winner = names[answer.winner.design]
        rows = list(csv.DictReader((folder / "tags.csv").open()))
        assert len(rows) == chosen.n_tags == winner.n_tags
        assert [int(row["id"]) for row in rows] == list(range(len(rows)))
        assert all(0 <= float(row["x_mm"]) <= 6000 and 0 <= float(row["y_mm"]) <= 5000 for row in rows)
        assert (chosen.name, chosen.n_robots) == (winner.name, answer.n_robots)
        assert len(chosen.antennas) == winner.n_readers
        assert chosen.cost_cents == answer.winner.cost_cents == sum(line.amount_cents for line in answer.cost_lines)
        quantities = {line.item: Decimal(line.quantity) for line in answer.cost_lines}
        assert quantities["tag"] == quantities["laying a tag"] == winner.n_tags
        assert quantities["reader"] == answer.n_robots * winner.n_readers
        assert quantities["covering"] == Decimal(30)
        for line in answer.cost_lines:
            exact = Decimal(line.quantity) * Decimal(line.unit_price) * 100
            assert abs(line.amount_cents - exact) <= Decimal("0.5")


def test_each_tested_design_reports_the_runs_that_decisions_were_made_on(finished):
    result = result_of(finished)
    n_looked_at: dict[int, int] = {}
    for answer in result.answers:
        for decision in answer.decisions:
            n_looked_at[decision.design] = max(n_looked_at.get(decision.design, 0), decision.n_runs)
    assert {design.number: design.n_runs for design in result.designs} == n_looked_at
    assert result.space.n_candidates == result.test.n_designs == 24


def test_traces_are_of_the_winners(finished):
    traces = Traces.model_validate_json((finished / "traces.json").read_bytes()).traces
    assert {(trace.n_robots, trace.run) for trace in traces} == {(n, run) for n in (1, 40) for run in range(8)}
    for trace in traces:
        assert trace.time_s == [0.5 * (i + 1) for i in range(10)]
        assert len(trace.position_error_mm) == len(trace.heading_error_rad) == 10


def test_times_and_paths_are_in_the_provenance_and_nowhere_else(tiny, tmp_path):
    out = tmp_path / "some-unusual-place"
    run(tiny, out)
    found = provenance(out)
    assert datetime.fromisoformat(found["finished"]).tzinfo is not None
    assert found["wall_s"] > 0
    assert found["study_file"] == str(tiny / "study.toml")
    assert found["out"] == str(out)
    assert {"numpy", "numba", "shapely"} <= set(found["packages"])
    for path in out.rglob("*.json"):
        if path.name != "provenance.json":
            assert str(tmp_path) not in path.read_text(), path.name
            assert found["finished"][:10] not in path.read_text(), path.name


def test_a_map_as_floor_leads_to_an_answer_with_its_sensitivity(tiny, grey_map, tmp_path):
    grey_map(254)
    result = run(tiny, tmp_path / "out")
    assert result.floor.source == "ROS map map.yaml, footprint radius 300 mm"
    assert 20 < result.floor.area_m2 < 30
    assert {row.name for row in result.floor.sensitivity} >= {"speck_pixels"}
