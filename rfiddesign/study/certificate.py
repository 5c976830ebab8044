"""The certificate of a finished study: its test, candidates, prices, runs and conclusions as one record."""

import hashlib
import struct
from collections.abc import Sequence
from dataclasses import astuple
from pathlib import Path

from pydantic import TypeAdapter

from rfiddesign import __version__
from rfiddesign.cost import PriceList
from rfiddesign.metrics import RunMetrics
from rfiddesign.optimize import Boundaries, TestPlan, battery
from rfiddesign.results import certificate as records
from rfiddesign.results import folder as files
from rfiddesign.results.study_result import StudyResult
from rfiddesign.study.document import Findings, decision_record
from rfiddesign.study.pipeline import Answer, hash_parts, search_rules

PRICES = TypeAdapter(PriceList)


def certificate(findings: Findings, result: StudyResult, out: Path) -> records.Certificate:
    """The certificate of what a study found and wrote in `out`, and whose result says the same in more words."""
    candidates, plan = findings.candidates, findings.plan
    weaker = search_rules(findings.study, candidates, plan).weaker
    n_longest = max((len(runs[0]) for runs in findings.runs.values()), default=0)
    return records.Certificate(
        version=__version__,
        study=result.study,
        seed=result.seed,
        study_hash=findings.digest,
        hashes=hash_parts(findings.study),
        prices=PRICES.dump_python(findings.study.prices, mode="json"),
        test=result.test,
        refute_threshold=plan.refute_threshold,
        certify_threshold=plan.certify_threshold,
        strict_threshold=None if weaker is None else weaker.refute_threshold,
        boundaries=boundary_records(plan, n_longest),
        candidates=[
            records.CandidateRecord(
                number=number,
                name=found.name,
                n_readers=found.design.layout.n_readers,
                antenna=found.design.antenna.name,
                n_tags=found.n_tags,
                tagged_m2=found.tagged_m2,
            )
            for number, found in candidates.by_number.items()
        ],
        runs=[
            records.RunsRecord(design=number, n_runs=len(runs[0]), sha256=runs_hash(runs))
            for number, runs in sorted(findings.runs.items())
        ],
        files=file_hashes(out, [answer.n_robots for answer in findings.answers]),
        answers=[_answer(candidates.numbers, answer, result) for answer in findings.answers],
    )


def boundary_records(plan: TestPlan, n_runs: int) -> list[records.BoundaryRecord]:
    """The tables of all shares up to a number of runs."""
    return [
        records.BoundaryRecord(
            criterion=i,
            refute_at=test.refute_at[: n_runs + 1].tolist(),
            certify_at=test.certify_at[: n_runs + 1].tolist(),
        )
        for i, test in enumerate(battery(plan).tests)
        if isinstance(test, Boundaries)
    ]


def file_hashes(folder: Path, n_robots: Sequence[int]) -> dict[str, str]:
    """Hash of each file that is there, by its path in the folder of a study with answers for these fleets."""
    places = [files.answer_folder(folder, n, is_first=i == 0) for i, n in enumerate(n_robots)]
    paths = [folder / name for name in files.BESIDE_ANSWERS]
    paths += [place / name for place in places for name in (files.DESIGN, files.TAGS)]
    found = {}
    for path in paths:
        if path.is_file():
            with path.open("rb") as file:
                found[path.relative_to(folder).as_posix()] = hashlib.file_digest(file, "sha256").hexdigest()
    return found


def runs_hash(runs: Sequence[Sequence[RunMetrics]]) -> str:
    """Hash of everything that runs measured, to the last bit, scenario by scenario."""
    digest = hashlib.sha256()
    for row in runs:
        digest.update(struct.pack("<q", len(row)))
        for run in row:
            values = astuple(run)
            digest.update(struct.pack(f"<{len(values)}d", *(float(value) for value in values)))
    return digest.hexdigest()


def _answer(numbers: tuple[int, ...], answer: Answer, result: StudyResult) -> records.CertifiedAnswer:
    said = next(each for each in result.answers if each.n_robots == answer.n_robots)
    return records.CertifiedAnswer(
        n_robots=answer.n_robots,
        cost_cents=[answer.costs[number].total_cents for number in numbers],
        claim=said.claim,
        winner=None if said.winner is None else said.winner.design,
        lower_bound=None if said.lower_bound is None else said.lower_bound.design,
        runners_up=[decision.design for decision in said.runners_up],
        decisions=said.decisions,
        assumed=said.assumed,
        strictly=[
            decision_record(answer, numbers[index], decision) for index, decision in answer.search.strictly.items()
        ],
    )
