"""Answer every variant of a study, one after the other, and set the answers side by side."""

import hashlib
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from rfiddesign import __version__
from rfiddesign.results import comparison as records
from rfiddesign.results import folder as files
from rfiddesign.results.study_result import AnswerRecord, StudyResult
from rfiddesign.study import claim
from rfiddesign.study.commands import check_variants
from rfiddesign.study.load import Study
from rfiddesign.study.pipeline import study_hash
from rfiddesign.study.run_study import run_study
from rfiddesign.study.stages import OnStage, Stage
from rfiddesign.study.variants import Variant, in_variant


def run_variants(
    study: Study,
    out: Path,
    n_workers: int | None,
    on_stage: OnStage,
    on_answer: Callable[[Path], object] = lambda folder: None,
) -> records.Comparison:
    """Run every variant of a study into a folder of its own in `out`, and save the comparison there.

    Variants whose folders hold their answers are read, one that was interrupted goes on.  `on_answer` is called with
    the folder of each answer.

    Raises
    ------
    StudyError : if a variant is at fault, or `out` cannot be used or holds another study.
    """
    digest = comparison_hash(study)
    claim.is_begun(out, digest)
    on_stage(Stage(f"checking {len(study.variants)} variants"))
    check_variants([variant for variant in study.variants if not _is_begun(variant, out)])
    resolved = {"study": json.loads(study.file.model_dump_json())}
    claim.claim_folder(out, digest, resolved | {"variants": [variant.listed() for variant in study.variants]})
    results = []
    for i, variant in enumerate(study.variants, start=1):
        told = f"variant {i} of {len(study.variants)}: {variant.name}"
        with in_variant(variant.name):
            results.append(_answer_variant(variant, out / variant.folder, n_workers, _prefixed(on_stage, told)))
            on_stage(Stage(f"{told}: drawing the report"))
            on_answer(out / variant.folder)
    on_stage(Stage("saving the comparison"))
    comparison = comparison_record(study, results)
    files.write_record(out / files.COMPARISON, comparison)
    return comparison


def comparison_hash(study: Study) -> str:
    """Hash that claims a folder for comparisons of a study: variants may be added, and each has a hash of its own."""
    return hashlib.sha256(f"comparison\0{study_hash(study)}".encode()).hexdigest()


def comparison_record(study: Study, results: list[StudyResult]) -> records.Comparison:
    """The answers to a study's variants, given in their order, side by side, with what each saves."""
    base = study.file.comparison.base or study.variants[0].section.row
    variants = [_variant(variant, result) for variant, result in zip(study.variants, results, strict=True)]
    bases = {variant.condition: variant for variant in variants if variant.group == base}
    return records.Comparison(
        version=__version__,
        study=study.name,
        title=study.file.title,
        base=base,
        variants=[_with_savings(variant, bases.get(variant.condition)) for variant in variants],
    )


def _is_begun(variant: Variant, out: Path) -> bool:
    with in_variant(variant.name):
        return claim.is_begun(out / variant.folder, study_hash(variant.study))


def _answer_variant(variant: Variant, out: Path, n_workers: int | None, on_stage: OnStage) -> StudyResult:
    """The variant's answer: read if its folder holds it whole, else searched."""
    if (out / files.PROVENANCE).exists() and (out / files.RESULT).exists():
        result = files.read_record(out / files.RESULT, StudyResult)
        is_cut = any("stopped by budget" in answer.claim for answer in result.answers)
        if result.study_hash == study_hash(variant.study) and not is_cut:
            on_stage(Stage("answered before"))
            return result
    return run_study(variant.study, out, n_workers, on_stage)


def _prefixed(on_stage: OnStage, words: str) -> OnStage:
    return lambda stage: on_stage(replace(stage, what=f"{words}: {stage.what}"))


def _variant(variant: Variant, result: StudyResult) -> records.VariantRecord:
    section = variant.section
    return records.VariantRecord(
        name=section.name,
        group=section.row,
        condition=section.condition,
        folder=variant.folder,
        settings=variant.settings,
        seed=result.seed,
        prices=variant.study.file.prices,
        requirement=result.requirement,
        test=result.test,
        study_hash=result.study_hash,
        n_runs=sum(design.n_runs for design in result.designs),
        answers=[_answer(answer, result) for answer in result.answers],
    )


def _answer(answer: AnswerRecord, result: StudyResult) -> records.VariantAnswer:
    return records.VariantAnswer(
        n_robots=answer.n_robots,
        currency=answer.currency,
        claim=answer.claim,
        claim_words=answer.claim_words,
        winner=_winner(answer, result),
        lower_bound_cents=None if answer.lower_bound is None else answer.lower_bound.cost_cents,
        n_undecided=len(answer.undecided),
        n_runs_used=answer.n_runs_used,
        saving=None,
    )


def _winner(answer: AnswerRecord, result: StudyResult) -> records.WinnerRecord | None:
    if answer.winner is None:
        return None
    design = next(design for design in result.designs if design.number == answer.winner.design)
    return records.WinnerRecord(
        name=design.name,
        estimator=design.estimator,
        layout=design.layout,
        antenna=design.antenna,
        pattern=design.pattern,
        tags_per_m2=design.tags_per_m2,
        n_readers=design.n_readers,
        n_tags=design.n_tags,
        cost_cents=answer.winner.cost_cents,
        n_runs=answer.winner.n_runs,
        n_passed=answer.winner.n_passed,
    )


def _with_savings(variant: records.VariantRecord, base: records.VariantRecord | None) -> records.VariantRecord:
    if base is None or base.group == variant.group:
        return variant
    answers = [
        answer.model_copy(update={"saving": records.saving(answer, base.answer(answer.n_robots))})
        for answer in variant.answers
    ]
    return variant.model_copy(update={"answers": answers})
