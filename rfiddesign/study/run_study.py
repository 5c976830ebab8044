"""Run a study into a folder, or go on with one that was interrupted."""

import json
import os
import platform
import sys
import time
from contextlib import ExitStack
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

import numpy as np
import shapely

from rfiddesign.cost import Cost
from rfiddesign.floor import AreaRow, Floor, area_sensitivity, read_ros_map, write_tags_csv
from rfiddesign.results import folder as files
from rfiddesign.results.computing import Computing, MeasuredTime
from rfiddesign.results.study_result import StudyResult, Traces
from rfiddesign.simulation.computing import ComputingTime
from rfiddesign.simulation.monte_carlo import Simulator
from rfiddesign.study import claim
from rfiddesign.study.budget import Budget
from rfiddesign.study.candidates import Candidates, find_candidates
from rfiddesign.study.certificate import certificate
from rfiddesign.study.design_document import about, traces_record
from rfiddesign.study.document import Findings, chosen_design, study_result
from rfiddesign.study.exploration import Explorer, with_explored
from rfiddesign.study.exploring import check_explore
from rfiddesign.study.load import Study, floor_of, map_thresholds, scenario_of
from rfiddesign.study.outcomes import StoredRuns
from rfiddesign.study.pipeline import (
    Answer,
    Fleet,
    Runs,
    loosest,
    price_candidates,
    search_fleet,
    study_hash,
    test_plan,
)
from rfiddesign.study.placements import placements_record, searched_placements
from rfiddesign.study.regimes import search_regimes
from rfiddesign.study.regimes_document import save_regimes
from rfiddesign.study.routes_document import RoutesFound, save_routes, search_other_kinds
from rfiddesign.study.shelves import check_shelves, search_shelves
from rfiddesign.study.shelves_document import save_shelves
from rfiddesign.study.stages import OnStage, Stage
from rfiddesign.study.storage import RunTable
from rfiddesign.study.survey import survey_chosen
from rfiddesign.study.survey_document import save_survey

# Runs of each chosen design that the report draws as curves.
RUNS_TRACED = 8
PACKAGES = ("numpy", "scipy", "shapely", "numba", "pydantic", "matplotlib", "optuna")


@dataclass(frozen=True)
class Session:
    """One go at a study: who ran it, on what, and how long it took (`provenance.json`)."""

    n_workers: int
    wall_s: float
    n_simulated: int
    n_stored_before: int


def run_study(study: Study, out: Path, n_workers: int | None, on_stage: OnStage) -> StudyResult:
    """Search the cheapest certified design of a study for each of its fleets and save everything in `out`.

    Runs already in `out` are used, so that an interrupted study goes on; its answer is that of an uninterrupted one.

    Raises
    ------
    StudyError : if the study is at fault, or `out` cannot be used or holds another study.
    """
    begin = time.perf_counter()
    check_shelves(study)
    placed = searched_placements(study.file)
    if placed:
        on_stage(Stage("placing readers"))
    placements = placements_record(study.path, study.file, placed)
    digest = study_hash(study)
    is_begun = claim.is_begun(out, digest)
    on_stage(Stage("reading the floor"))
    floor = floor_of(study)
    workers = n_workers or os.cpu_count() or 1
    with ExitStack() as stack:
        simulator = stack.enter_context(Simulator(scenario_of(study, floor), study.file.seed, workers, loosest(study)))
        candidates = find_candidates(study, floor, simulator, on_stage)
        variables = None if study.file.explore is None else check_explore(study, floor)
        # Nothing is written before all that can be at fault with a study has been looked at.
        if not is_begun:
            claim.claim_folder(out, digest, {"study": json.loads(study.file.model_dump_json())})
        budget = Budget(study.file.search.budget_runs, study.file.search.budget_minutes)
        if variables is not None:
            explorer = Explorer(study, floor, out, simulator, variables, on_stage)
            candidates = with_explored(explorer, candidates, budget)
        costs = {n: price_candidates(study, candidates, n) for n in study.file.fleet.robots}
        table = stack.enter_context(RunTable(out / files.RUNS))
        runs = StoredRuns(candidates.job, simulator, table, candidates.n_scenarios)
        n_before = runs.n_stored
        try:
            answers = _search(study, candidates, costs, runs, budget, on_stage)
            cells = search_regimes(study, candidates, floor, runs, on_stage)
            others = search_other_kinds(study, candidates, answers, runs, on_stage)
            cents = {n: np.array([each[k].total_cents for k in candidates.numbers]) for n, each in costs.items()}
            where = (out, workers, on_stage)
            shelves = search_shelves(study, candidates, runs, cents, simulator.scenario, where)
            survey = survey_chosen(study, candidates, floor, answers, simulator, on_stage)
        finally:
            runs.save()
        on_stage(Stage("saving"))
        computing = _computing_times(candidates, answers, simulator)
        findings = Findings(
            study, floor, sensitivity(study), candidates, test_plan(study, len(candidates.numbers)), answers,
            _consumed(candidates.numbers, answers, runs), digest, computing,
        )  # fmt: skip
        result = study_result(findings)
        for answer in answers:
            _save_answer(out, findings, answer, simulator)
        traces = [
            (answer.n_robots, run, simulator.trace(candidates.job(candidates.numbers[winner], run)))
            for answer in answers
            if (winner := answer.search.winner) is not None
            for run in range(RUNS_TRACED)
        ]
        files.write_record(out / files.TRACES, Traces(traces=traces_record(traces)))
        if placed:
            files.write_record(out / files.PLACEMENTS, placements)
        _save_plan(out, floor)
        save_regimes(out, study, candidates, floor, cells, digest)
        save_shelves(out, study, candidates, floor, shelves, digest)
        save_survey(out, study, survey, digest)
        save_routes(out, RoutesFound(study, floor, candidates, answers, others), on_stage)
        _save_computing(out, findings)
        files.write_record(out / files.CERTIFICATE, certificate(findings, result, out))
        files.write_record(out / files.RESULT, result)
        session = Session(workers, time.perf_counter() - begin, runs.n_simulated, n_before)
    _save_provenance(out, study, session)
    return result


def _search(
    study: Study, candidates: Candidates, costs: dict[int, dict[int, Cost]], runs: StoredRuns, budget: Budget,
    on_stage: OnStage,
) -> tuple[Answer, ...]:  # fmt: skip
    """The answer for each fleet; what one leaves of the budget is for those after it."""
    if budget.minutes is not None:
        # The first run compiles the program where nobody ran it before; that is not searching.
        runs.first(candidates.numbers[0], 1)
    answers = []
    for i, n_robots in enumerate(costs):
        n_left = len(costs) - i
        fleet = Fleet(n_robots, costs[n_robots], budget.runs_for_one_of(n_left), budget.time_for_one_of(n_left))
        answers.append(search_fleet(study, candidates, fleet, runs, on_stage))
        budget.spend(answers[-1].search.n_runs_used)
    return tuple(answers)


def sensitivity(study: Study) -> tuple[AreaRow, ...]:
    """How the floor's area moves with the thresholds of its map; nothing for a rectangle."""
    section = study.file.floor
    if section.map is None:
        return ()
    occupancy_map = read_ros_map(study.path.parent / section.map)
    return area_sensitivity(occupancy_map, study.file.robot.footprint_radius_mm, map_thresholds(section))


def _consumed(numbers: tuple[int, ...], answers: tuple[Answer, ...], runs: StoredRuns) -> dict[int, Runs]:
    """The runs that any search looked at: those begun ahead in vain are left out, for they depend on the workers."""
    n_consumed: dict[int, int] = {}
    for answer in answers:
        looked_at = [*answer.search.decisions.items(), *answer.search.strictly.items()]
        for index, decision in looked_at:
            number = numbers[index]
            n_consumed[number] = max(n_consumed.get(number, 0), decision.n_runs)
    return {number: runs.first(number, n) for number, n in n_consumed.items() if n}


def _computing_times(
    candidates: Candidates, answers: tuple[Answer, ...], simulator: Simulator
) -> dict[int, ComputingTime]:
    """What the estimator of each winner computes, by number."""
    winners = {candidates.numbers[answer.search.winner] for answer in answers if answer.search.winner is not None}
    return {number: simulator.computing_time(candidates.job(number, 0)) for number in sorted(winners)}


def _save_computing(out: Path, findings: Findings) -> None:
    """Times of this machine, apart from what is the same everywhere."""
    times = []
    for answer in findings.answers:
        if answer.search.winner is not None:
            number = findings.candidates.numbers[answer.search.winner]
            us_per_step = about(findings.computing[number].us_per_step)
            estimator = findings.candidates.by_number[number].estimator
            times.append(MeasuredTime(n_robots=answer.n_robots, estimator=estimator, us_per_step=us_per_step))
    files.write_record(out / files.COMPUTING, Computing(times=times))


def _save_answer(out: Path, findings: Findings, answer: Answer, simulator: Simulator) -> None:
    if answer.search.winner is None:
        return
    target = files.answer_folder(out, answer.n_robots, is_first=answer is findings.answers[0])
    target.mkdir(exist_ok=True)
    files.write_record(target / files.DESIGN, chosen_design(findings, answer))
    design = findings.candidates.by_number[findings.candidates.numbers[answer.search.winner]].design
    write_tags_csv(target / files.TAGS, simulator.tags(design.pattern))


def _save_plan(out: Path, floor: Floor) -> None:
    features = [
        {"type": "Feature", "properties": {"role": role, "unit": "mm"}, "geometry": shapely.geometry.mapping(part)}
        for role, part in (("drivable", floor.drivable), ("navigable", floor.navigable))
    ]
    files.write_text(out / files.PLAN, json.dumps({"type": "FeatureCollection", "features": features}) + "\n")


def _save_provenance(out: Path, study: Study, session: Session) -> None:
    versions = {name: metadata.version(name) for name in PACKAGES}
    provenance = {
        "study_file": str(study.path.resolve()),
        "out": str(out.resolve()),
        "finished": time.strftime("%Y-%m-%dT%H:%M:%S%z"),
        "wall_s": round(session.wall_s, 3),
        "workers": session.n_workers,
        "runs_simulated": session.n_simulated,
        "runs_stored_before": session.n_stored_before,
        "python": sys.version.split()[0],
        "machine": platform.platform(),
        "packages": versions,
    }
    files.write_text(out / files.PROVENANCE, json.dumps(provenance, indent=1) + "\n")
