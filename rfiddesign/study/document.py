"""From what a search found to the records that are saved: `result.json` and its companions."""

from dataclasses import dataclass

from rfiddesign import __version__
from rfiddesign.cost import Cost
from rfiddesign.design import Design
from rfiddesign.evaluate import Evaluation
from rfiddesign.floor import AreaRow, Floor
from rfiddesign.metrics import Requirement, RunMetrics
from rfiddesign.optimize import ASSUMPTIONS, CLAIMS, Claim, Decision, ShareCriterion, TestPlan
from rfiddesign.results import study_result as records
from rfiddesign.simulation.computing import ComputingTime
from rfiddesign.study.assumptions import assumptions, estimator_words
from rfiddesign.study.candidates import Candidates
from rfiddesign.study.design_document import about, antenna_poses, coverage_in_full, rounded
from rfiddesign.study.load import Study
from rfiddesign.study.pipeline import Answer, Front, Runs, fronts


@dataclass(frozen=True)
class Findings:
    """Everything that a finished study knows.

    Parameters
    ----------
    sensitivity : how the floor's area moves with the map's thresholds.
    runs : the consumed runs of each tested design, by number, for each scenario.
    digest : hash of everything that the answer depends on.
    computing : what the estimator of each winner computes, by number.
    """

    study: Study
    floor: Floor
    sensitivity: tuple[AreaRow, ...]
    candidates: Candidates
    plan: TestPlan
    answers: tuple[Answer, ...]
    runs: dict[int, Runs]
    digest: str
    computing: dict[int, ComputingTime]


def study_result(findings: Findings) -> records.StudyResult:
    """The whole answer as one record."""
    study, candidates = findings.study, findings.candidates
    is_counted = not study.file.varies("n_particles")
    return records.StudyResult(
        version=__version__,
        study=study.name,
        title=study.file.title,
        seed=study.file.seed,
        study_hash=findings.digest,
        requirement=records.RequirementRecord(
            limits=_limits(study.requirement), converged_within_s=study.requirement.converged_within_s
        ),
        test=records.TestRecord(
            hold_probability=findings.plan.hold_probability,
            fail_probability=findings.plan.fail_probability,
            alpha_refute=findings.plan.alpha_refute,
            alpha_certify=findings.plan.alpha_certify,
            n_designs=findings.plan.n_designs,
            max_runs=findings.plan.max_runs,
            criteria=criterion_records(findings.plan),
            cost_tolerance=study.file.search.cost_tolerance,
            assumptions=[ASSUMPTIONS[assumption] for assumption in study.file.search.assume],
        ),
        floor=records.FloorRecord(
            name=findings.floor.name,
            source=findings.floor.source,
            area_m2=rounded(findings.floor.area_m2),
            navigable_m2=rounded(findings.floor.navigable_m2),
            footprint_radius_mm=study.file.robot.footprint_radius_mm,
            sensitivity=[
                records.AreaRecord(
                    name=row.name,
                    value=row.value,
                    area_m2=rounded(row.area_m2),
                    navigable_m2=rounded(row.navigable_m2),
                )
                for row in findings.sensitivity
            ],
        ),
        space=records.SpaceRecord(
            n_combinations=candidates.n_combinations,
            n_unbuildable=candidates.n_unbuildable,
            unbuildable=[
                records.UnbuildableRecord(layout=pair.layout_name, antenna=pair.antenna_name, reason=pair.reason)
                for pair in candidates.unbuildable
            ],
            screens=[
                records.ScreenRecord(rule=screen.rule, kind=screen.kind, n_removed=screen.n_removed)
                for screen in candidates.screens
            ],
            n_candidates=len(candidates.numbers),
            is_named=study.file.explore is not None,
        ),
        assumptions=assumptions(study),
        estimators=[
            records.EstimatorRecord(name=name, words=estimator_words(name, settings, is_counted=is_counted))
            for name, settings in candidates.estimators
        ],
        answers=[_answer(findings, answer) for answer in findings.answers],
        designs=[
            _design(candidates, number, runs, study.criteria.scenarios)
            for number, runs in sorted((_untested_bounds(findings) | findings.runs).items())
        ],
    )


def _untested_bounds(findings: Findings) -> dict[int, Runs]:
    """Lower bounds that a budget left untested: no runs of each, by number."""
    bounds = (answer.search.lower_bound for answer in findings.answers)
    none: Runs = tuple([] for _ in findings.study.criteria.scenarios)
    return {findings.candidates.numbers[bound]: none for bound in bounds if bound is not None}


def chosen_design(findings: Findings, answer: Answer) -> records.ChosenDesign:
    """The winner of an answer as the workshop needs it."""
    number = findings.candidates.numbers[answer.search.winner]
    found, price = findings.candidates.by_number[number], answer.costs[number]
    design = found.design
    lattice = design.pattern.lattice
    return records.ChosenDesign(
        name=found.name,
        n_robots=answer.n_robots,
        layout=design.layout.name,
        antennas=antenna_poses(design),
        antenna=design.antenna.name,
        antenna_housing_mm=design.antenna.housing_mm,
        antenna_height_mm=None if design.antenna.sphere is None else design.antenna.sphere.antenna_height_mm,
        antenna_source=design.antenna.source,
        footprint_radius_mm=findings.study.file.robot.footprint_radius_mm,
        pattern=design.pattern.name,
        tags_per_m2=rounded(design.pattern.tags_per_m2),
        lattice_basis_mm=None if lattice is None else [tuple(map(rounded, row)) for row in lattice.basis_mm],
        pattern_seed=findings.study.file.seed,
        n_tags=found.n_tags,
        cost_cents=price.total_cents,
        currency=price.currency,
        estimator=found.estimator,
    )


def _limits(requirement: Requirement) -> list[records.Limit]:
    return [records.Limit(metric=metric, limit=rounded(limit)) for metric, limit in requirement.limits]


def _answer(findings: Findings, answer: Answer) -> records.AnswerRecord:
    search, numbers = answer.search, findings.candidates.numbers
    found = fronts(findings.study, findings.candidates, answer, findings.runs)

    def decision(index: int | None) -> records.DecisionRecord | None:
        return None if index is None else decision_record(answer, numbers[index], search.decisions.get(index))

    winner = None if search.winner is None else numbers[search.winner]
    price = None if winner is None else answer.costs[winner]
    return records.AnswerRecord(
        n_robots=answer.n_robots,
        currency=findings.study.prices.currency,
        claim=search.claim,
        claim_words=_claim_words(findings, search.claim),
        winner=decision(search.winner),
        cost_lines=[] if price is None else cost_line_records(price),
        runners_up=[decision(index) for index in search.runners_up],
        lower_bound=decision(search.lower_bound),
        undecided=[decision(index) for index in search.undecided],
        decisions=[decision(index) for index in search.order],
        n_runs_used=search.n_runs_used,
        n_untested=search.n_untested,
        assumed=[
            records.AssumedRecord(
                design=numbers[index],
                cost_cents=answer.costs[numbers[index]].total_cents,
                follows_from=numbers[stronger],
            )
            for index, stronger in search.assumed.items()
        ],
        fronts=[_front(findings, answer, front) for front in found],
        coverage=None if winner is None else coverage_in_full(findings.candidates.by_number[winner].design),
        computing=None if winner is None else _computing(findings, winner),
    )


def _claim_words(findings: Findings, claim: Claim) -> str:
    """A claim in words, with what it is about where a larger space was explored."""
    if findings.study.file.explore is None:
        return CLAIMS[claim]
    return f"among the {len(findings.candidates.numbers):,} candidates named before certification, {CLAIMS[claim]}"


def _computing(findings: Findings, number: int) -> records.ComputingRecord:
    name, n_flops = findings.candidates.by_number[number].estimator, about(findings.computing[number].flops_per_step)
    return records.ComputingRecord(estimator=name, dt_s=findings.study.file.scenario.dt_s, flops_per_step=n_flops)


def _front(findings: Findings, answer: Answer, front: Front) -> records.FrontRecord:
    return records.FrontRecord(
        factor=front.factor,
        limits=_limits(findings.study.requirement.scaled(front.factor)),
        decision=None if front.number is None else decision_record(answer, front.number, front.decision),
    )


def decision_record(answer: Answer, number: int, decision: Decision | None) -> records.DecisionRecord:
    """What was decided of a design, nothing where it was not tested."""
    decision = decision or Decision("undecided", 0, 0)
    return records.DecisionRecord(
        design=number,
        cost_cents=answer.costs[number].total_cents,
        verdict=decision.verdict,
        n_runs=decision.n_runs,
        n_passed=decision.n_passed,
        refuted_by=decision.refuted_by,
    )


def cost_line_records(price: Cost) -> list[records.CostLineRecord]:
    """The lines of a cost, exact."""
    return [
        records.CostLineRecord(
            group=line.group,
            item=line.item,
            quantity=f"{line.quantity:f}",
            unit=line.unit,
            unit_price=f"{line.unit_price:f}",
            amount_cents=line.amount_cents,
            source=line.source,
        )
        for line in price.lines
    ]


def _design(candidates: Candidates, number: int, runs: Runs, scenarios: tuple[str, ...]) -> records.DesignRecord:
    found = candidates.by_number[number]
    design = found.design
    return records.DesignRecord(
        number=number,
        name=found.name,
        estimator=found.estimator,
        layout=design.layout.name,
        antenna=design.antenna.name,
        pattern=design.pattern.name,
        tags_per_m2=rounded(design.pattern.tags_per_m2),
        n_readers=design.layout.n_readers,
        n_tags=found.n_tags,
        tagged_m2=rounded(found.tagged_m2),
        n_runs=len(runs[0]),
        n_complete=sum(run.is_complete for run in runs[0]),
        metrics=_means(design, runs[0]),
        scenarios={name: _means(design, row) for name, row in zip(scenarios[1:], runs[1:], strict=True)},
    )


def _means(design: Design, runs: list[RunMetrics]) -> dict[str, records.MeanRecord]:
    means = Evaluation(design.name, tuple(runs), (), 0, 0.0).metrics() if runs else {}
    return {
        name: records.MeanRecord(mean=rounded(mean.mean), stderr=None if mean.stderr is None else rounded(mean.stderr))
        for name, mean in means.items()
    }


def criterion_records(plan: TestPlan) -> list[records.CriterionRecord]:
    """What a design must keep, as tested."""
    return [
        records.CriterionRecord(
            words=criterion.name,
            kind="share" if isinstance(criterion, ShareCriterion) else "mean",
            hold=criterion.hold,
            fail=criterion.fail,
        )
        for criterion in plan.all_criteria
    ]
