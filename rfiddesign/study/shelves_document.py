"""From the families that were searched to the record that is saved: `shelves.json`."""

import hashlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rfiddesign import __version__
from rfiddesign.cost import Cost, Site
from rfiddesign.floor import Floor
from rfiddesign.metrics import RunMetrics
from rfiddesign.results import folder as files
from rfiddesign.results.shelves import FamilyAnswer, HallRecord, Shelves, TestedRecord
from rfiddesign.results.study_result import Limit, MeanRecord
from rfiddesign.study.candidates import Candidates
from rfiddesign.study.certificate import runs_hash
from rfiddesign.study.design_document import rounded
from rfiddesign.study.document import cost_line_records
from rfiddesign.study.load import Study
from rfiddesign.study.pipeline import price_design
from rfiddesign.study.shelves import FLOOR, FamilySearch, ShelvesFound, factors_of


def save_shelves(
    out: Path, study: Study, candidates: Candidates, floor: Floor, found: ShelvesFound | None, digest: str
) -> None:
    """Write what was found into the folder of a study that has shelves."""
    if found is not None:
        files.write_record(out / files.SHELVES, shelves_record(study, candidates, floor, found, digest))


def shelves_record(study: Study, candidates: Candidates, floor: Floor, found: ShelvesFound, digest: str) -> Shelves:
    """Both families as one record."""
    search, metric = study.file.search, study.requirement.limits[0][0]
    length_m, width_m = study.file.floor.rectangle_m
    rows = [obstacle.outline.bounds for obstacle in found.trial.scene_of(found.designs[0].tags_per_m).obstacles]
    return Shelves(
        version=__version__,
        study_hash=digest,
        currency=study.prices.currency,
        metric=metric,
        hall=HallRecord(
            length_mm=1e3 * length_m,
            width_mm=1e3 * width_m,
            rows_mm=[tuple(map(rounded, row)) for row in rows],
            area_m2=rounded(floor.area_m2),
        ),
        robots=list(found.costs),
        factors=factors_of(study.file),
        hold_probability=search.hold_probability,
        fail_probability=search.fail_probability,
        alpha_refute=search.alpha_refute,
        alpha_certify=search.alpha_certify,
        n_floor_designs=len(candidates.numbers),
        n_shelf_designs=len(found.designs),
        training_drive_s=found.trial.training.duration_s,
        answers=[_answer(study, candidates, found, each) for each in found.searches],
        tested=[
            _tested(study, candidates, found, family, number, runs, metric)
            for (family, number), runs in found.runs.items()
            if runs
        ],
        runs_sha256=runs_digest([(*key, runs) for key, runs in found.runs.items() if runs]),
    )


def _answer(study: Study, candidates: Candidates, found: ShelvesFound, each: FamilySearch) -> FamilyAnswer:
    search = each.search
    winner, bound = search.winner, search.lower_bound
    number, name, lines, decision = None, "", [], None
    if winner is not None:
        number = candidates.numbers[winner] if each.family == FLOOR else winner
        price, name = _price(study, candidates, found, (each.family, number), each.n_robots)
        lines, decision = cost_line_records(price), search.decisions[winner]
    limits = study.requirement.scaled(each.factor).limits
    return FamilyAnswer(
        family=each.family,
        n_robots=each.n_robots,
        factor=each.factor,
        limits=[Limit(metric=name, limit=rounded(limit)) for name, limit in limits],
        claim=search.claim,
        winner=number,
        name=name,
        cost_cents=None if winner is None else int(each.cents[winner]),
        cost_lines=lines,
        lower_bound_cents=None if bound is None else int(each.cents[bound]),
        n_undecided=len(search.undecided),
        n_runs=0 if decision is None else decision.n_runs,
        n_passed=0 if decision is None else decision.n_passed,
        n_runs_used=search.n_runs_used,
    )


def _price(
    study: Study, candidates: Candidates, found: ShelvesFound, which: tuple[str, int], n_robots: int
) -> tuple[Cost, str]:
    """Price and name of a design, by family and number."""
    family, number = which
    if family != FLOOR:
        return found.costs[n_robots][number], found.designs[number].name
    candidate = candidates.by_number[number]
    price = price_design(study, candidate.design, candidate.n_tags, Site(n_robots, candidate.tagged_m2))
    return price, candidate.name


def _tested(
    study: Study, candidates: Candidates, found: ShelvesFound, family: str, number: int, runs: list[RunMetrics],
    metric: str,
) -> TestedRecord:  # fmt: skip
    priced = [_price(study, candidates, found, (family, number), n_robots) for n_robots in found.costs]
    errors = np.array([getattr(run, metric) for run in runs])
    stderr = rounded(float(errors.std(ddof=1) / np.sqrt(len(errors)))) if len(errors) > 1 else None
    if family == FLOOR:
        n_tags = candidates.by_number[number].n_tags
    else:
        n_tags = found.trial.scene_of(found.designs[number].tags_per_m).n_tags
    return TestedRecord(
        family=family,
        number=number,
        name=priced[0][1],
        n_tags=n_tags,
        costs_cents=[price.total_cents for price, _ in priced],
        n_runs=len(runs),
        n_complete=sum(run.is_complete for run in runs),
        error=MeanRecord(mean=rounded(float(errors.mean())), stderr=stderr),
    )


def runs_digest(consumed: Sequence[tuple[str, int, Sequence[RunMetrics]]]) -> str:
    """Hash of runs, given as (family, number of the design, its runs)."""
    digest = hashlib.sha256()
    for family, number, runs in consumed:
        digest.update(f"{family} {number} {runs_hash([runs])}\0".encode())
    return digest.hexdigest()
