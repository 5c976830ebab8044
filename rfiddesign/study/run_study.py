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

import shapely

from rfiddesign.cost import Site
from rfiddesign.errors import StudyError
from rfiddesign.floor import AreaRow, Floor, area_sensitivity, read_ros_map, write_tags_csv
from rfiddesign.metrics import RunMetrics
from rfiddesign.results import folder as files
from rfiddesign.results.study_result import StudyResult, Traces
from rfiddesign.simulation.monte_carlo import Job, Simulator
from rfiddesign.study.document import Findings, chosen_design, study_result, traces_record
from rfiddesign.study.load import Study, floor_of, map_thresholds, scenario_of
from rfiddesign.study.outcomes import StoredRuns
from rfiddesign.study.pipeline import (
    Answer,
    OnStage,
    Stage,
    find_candidates,
    loosest,
    price_candidates,
    search_fleet,
    study_hash,
    test_plan,
)
from rfiddesign.study.storage import RunTable

# Runs of each chosen design that the report draws as curves.
RUNS_TRACED = 8
PACKAGES = ("numpy", "scipy", "shapely", "numba", "pydantic", "matplotlib")


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
    digest = study_hash(study)
    is_begun = _is_begun(out, digest)
    on_stage(Stage("reading the floor"))
    floor = floor_of(study)
    workers = n_workers or os.cpu_count() or 1
    with ExitStack() as stack:
        simulator = stack.enter_context(Simulator(scenario_of(study, floor), study.file.seed, workers, loosest(study)))
        candidates = find_candidates(study, floor, simulator, on_stage)
        costs = {n: price_candidates(study, candidates, Site(n, floor.area_m2)) for n in study.file.fleet.robots}
        # Nothing is written before all that can be at fault with a study has been looked at.
        if not is_begun:
            _claim_folder(study, out, digest)
        runs = StoredRuns(candidates.designs, simulator, stack.enter_context(RunTable(out / files.RUNS)))
        n_before = runs.n_stored
        try:
            answers = tuple(search_fleet(study, candidates, n, costs[n], runs, on_stage) for n in costs)
        finally:
            runs.save()
        on_stage(Stage("saving"))
        findings = Findings(
            study, floor, sensitivity(study), candidates, test_plan(study, len(candidates.numbers)), answers,
            _consumed(candidates.numbers, answers, runs), digest,
        )  # fmt: skip
        result = study_result(findings)
        for answer in answers:
            _save_answer(out, findings, answer, simulator)
        traces = [
            (answer.n_robots, run, simulator.trace(Job(candidates.designs[candidates.numbers[winner]], run)))
            for answer in answers
            if (winner := answer.search.winner) is not None
            for run in range(RUNS_TRACED)
        ]
        files.write_record(out / files.TRACES, Traces(traces=traces_record(traces)))
        _save_plan(out, floor)
        files.write_record(out / files.RESULT, result)
        session = Session(workers, time.perf_counter() - begin, runs.n_simulated, n_before)
    _save_provenance(out, study, session)
    return result


def _is_begun(out: Path, digest: str) -> bool:
    """Whether the folder holds this very study; StudyError if it holds anything else."""
    try:
        if (out / files.STUDY).exists():
            if _held_hash(out / files.STUDY) != digest:
                raise StudyError("holds another study, or this one before a change; choose another --out", file=out)
            return True
        # A process killed while it claimed the folder leaves a hidden temporary file.
        if out.exists() and (not out.is_dir() or any(not path.name.startswith(".") for path in out.iterdir())):
            raise StudyError("is not an empty folder or one of this study; choose another --out", file=out)
    except OSError as error:
        raise StudyError(f"cannot be read: {error.strerror}", file=out) from None
    return False


def _held_hash(path: Path) -> str | None:
    try:
        return json.loads(path.read_text(encoding="utf-8")).get("hash")
    except (ValueError, AttributeError, RecursionError):
        return None


def _claim_folder(study: Study, out: Path, digest: str) -> None:
    """Make the folder and write the resolved study."""
    resolved = {"hash": digest, "study": json.loads(study.file.model_dump_json())}
    try:
        out.mkdir(parents=True, exist_ok=True)
        files.write_text(out / files.STUDY, json.dumps(resolved, indent=1) + "\n")
    except OSError as error:
        raise StudyError(f"cannot be written: {error.strerror}", file=out) from None


def sensitivity(study: Study) -> tuple[AreaRow, ...]:
    """How the floor's area moves with the thresholds of its map; nothing for a rectangle."""
    section = study.file.floor
    if section.map is None:
        return ()
    occupancy_map = read_ros_map(study.path.parent / section.map)
    return area_sensitivity(occupancy_map, study.file.robot.footprint_radius_mm, map_thresholds(section))


def _consumed(numbers: tuple[int, ...], answers: tuple[Answer, ...], runs: StoredRuns) -> dict[int, list[RunMetrics]]:
    """The runs that any search looked at: those begun ahead in vain are left out, for they depend on the workers."""
    n_consumed: dict[int, int] = {}
    for answer in answers:
        for index, decision in answer.search.decisions.items():
            number = numbers[index]
            n_consumed[number] = max(n_consumed.get(number, 0), decision.n_runs)
    return {number: runs.first(number, n) for number, n in n_consumed.items() if n}


def _save_answer(out: Path, findings: Findings, answer: Answer, simulator: Simulator) -> None:
    if answer.search.winner is None:
        return
    target = files.answer_folder(out, answer.n_robots, is_first=answer is findings.answers[0])
    target.mkdir(exist_ok=True)
    files.write_record(target / files.DESIGN, chosen_design(findings, answer))
    design = findings.candidates.designs[findings.candidates.numbers[answer.search.winner]]
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
