"""What a report is drawn from: the files of a result folder, read and held against each other."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.errors import ShapelyError
from shapely.geometry.base import BaseGeometry

from rfiddesign.errors import StudyError
from rfiddesign.results.computing import Computing
from rfiddesign.results.folder import (
    COMPUTING,
    DESIGN,
    MAX_BYTES,
    PLAN,
    RESULT,
    ROUTES,
    TAGS,
    TRACES,
    answer_folder,
    read_record,
)
from rfiddesign.results.routes import RoutesRecord
from rfiddesign.results.study_result import (
    AnswerRecord,
    ChosenDesign,
    DecisionRecord,
    DesignRecord,
    StudyResult,
    TraceRecord,
    Traces,
)

TAGS_HEADER = "id,x_mm,y_mm"


@dataclass(frozen=True)
class Plan:
    """The floor: what is tagged, and where the robot's centre may be [mm]."""

    drivable: BaseGeometry
    navigable: BaseGeometry


@dataclass(frozen=True)
class Answer:
    """The answer for one fleet with everything that lies beside it.

    Parameters
    ----------
    record : the answer.
    folder : where its files lie.
    chosen : its design, None without a winner.
    tags_mm : its tags (n, 2) [mm], None without a winner.
    traces : errors over time of some of its runs.
    us_per_step : time that its estimator took for a step on the machine that ran the study [us], None if not measured.
    """

    record: AnswerRecord
    folder: Path
    chosen: ChosenDesign | None
    tags_mm: NDArray[np.float64] | None
    traces: tuple[TraceRecord, ...]
    us_per_step: float | None = None

    @property
    def key(self) -> str:
        """Name of the answer in file names and anchors."""
        return f"robots-{self.record.n_robots}"


@dataclass(frozen=True)
class Contents:
    """A result folder. `plan` is None where no answer has a winner, `routes` where robots drive anywhere."""

    folder: Path
    result: StudyResult
    plan: Plan | None
    answers: tuple[Answer, ...]
    routes: RoutesRecord | None = None

    def design(self, decision: DecisionRecord) -> DesignRecord:
        """The design that a decision is about."""
        return {design.number: design for design in self.result.designs}[decision.design]

    def chosen_estimator(self, decision: DecisionRecord | None) -> str | None:
        """Name of the estimator that the search chose with a design; None if it had no choice or found nothing."""
        return self.design(decision).estimator if decision is not None and self.result.is_estimator_open else None


def read_contents(folder: Path) -> Contents:
    """Read a result folder.

    Raises
    ------
    StudyError : if a file is missing, is not what it should be, or does not fit the others.
    """
    result = read_record(folder / RESULT, StudyResult)
    _check_references(result, folder / RESULT)
    traces = read_record(folder / TRACES, Traces).traces if (folder / TRACES).exists() else []
    times = read_record(folder / COMPUTING, Computing).times if (folder / COMPUTING).exists() else []
    us_per_step = {time.n_robots: time.us_per_step for time in times}
    answers = tuple(
        _read_answer(folder, record, traces, us_per_step.get(record.n_robots), is_first=i == 0)
        for i, record in enumerate(result.answers)
    )
    is_any_won = any(answer.chosen is not None for answer in answers)
    routes = read_record(folder / ROUTES, RoutesRecord) if (folder / ROUTES).exists() else None
    return Contents(folder, result, read_plan(folder / PLAN) if is_any_won else None, answers, routes)


def read_plan(path: Path) -> Plan:
    """Read the floor of a study: a FeatureCollection [mm] with features of role drivable and navigable."""
    parts = {}
    try:
        for feature in json.loads(_bounded_bytes(path))["features"]:
            parts[feature["properties"]["role"]] = shapely.from_geojson(json.dumps(feature["geometry"]))
    except (ValueError, LookupError, TypeError, ShapelyError) as error:
        if isinstance(error, StudyError):
            raise
        raise StudyError("is not a GeoJSON FeatureCollection whose features have a role", file=path) from None
    for role in ("drivable", "navigable"):
        if role not in parts or parts[role].is_empty or parts[role].area == 0:
            raise StudyError("has no such feature with an area", file=path, key=role)
    return Plan(parts["drivable"], parts["navigable"])


def read_tags(path: Path) -> NDArray[np.float64]:
    """Read the tags of a design, (n, 2) [mm], from a table with the columns id, x_mm and y_mm."""
    text = _bounded_bytes(path).decode("utf-8", errors="replace")
    header, _, rows = text.partition("\n")
    if header.strip() != TAGS_HEADER:
        raise StudyError(f"begins with {header[:60]!r}, must begin with {TAGS_HEADER}", file=path)
    if not rows.strip():
        return np.empty((0, 2))
    try:
        tags = np.loadtxt(rows.splitlines(), delimiter=",", usecols=(1, 2), ndmin=2)
    except ValueError as error:
        raise StudyError(f"has a row that is not {TAGS_HEADER}: {error}", file=path) from None
    if not np.isfinite(tags).all():
        raise StudyError("has a position that is not finite", file=path)
    return tags


def _read_answer(
    folder: Path, record: AnswerRecord, traces: list[TraceRecord], us_per_step: float | None, *, is_first: bool
) -> Answer:
    place = answer_folder(folder, record.n_robots, is_first=is_first)
    own = tuple(trace for trace in traces if trace.n_robots == record.n_robots)
    if record.winner is None:
        return Answer(record, place, None, None, own)
    return Answer(record, place, read_record(place / DESIGN, ChosenDesign), read_tags(place / TAGS), own, us_per_step)


def _check_references(result: StudyResult, path: Path) -> None:
    if not result.answers:
        raise StudyError("is empty, must have at least one answer", file=path, key="answers")
    if len({answer.n_robots for answer in result.answers}) != len(result.answers):
        raise StudyError("has two answers for one size of fleet", file=path, key="answers")
    numbers = {design.number for design in result.designs}
    for answer in result.answers:
        decisions = [answer.winner, answer.lower_bound, *answer.runners_up, *answer.undecided, *answer.decisions]
        for decision in [*decisions, *(front.decision for front in answer.fronts)]:
            if decision is not None and decision.design not in numbers:
                raise StudyError(f"has no design {decision.design}, but an answer names it", file=path, key="designs")
        total = sum(line.amount_cents for line in answer.cost_lines)
        if answer.winner is not None and total != answer.winner.cost_cents:
            problem = f"sum to {total} cents, but the winner costs {answer.winner.cost_cents} cents"
            raise StudyError(problem, file=path, key=f"answers.{answer.n_robots} robots.cost_lines")


def _bounded_bytes(path: Path) -> bytes:
    try:
        if path.stat().st_size > MAX_BYTES:
            raise StudyError(f"has {path.stat().st_size:,} bytes, at most {MAX_BYTES:,} are allowed", file=path)
        return path.read_bytes()
    except OSError as error:
        raise StudyError(f"cannot be read: {error.strerror}", file=path) from None
