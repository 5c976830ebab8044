"""From the cells that were searched to the record that is saved: `regimes.json`."""

from decimal import Decimal
from itertools import pairwise
from pathlib import Path

from rfiddesign import __version__
from rfiddesign.cost import Site
from rfiddesign.floor import Floor
from rfiddesign.optimize import TestPlan
from rfiddesign.results import folder as files
from rfiddesign.results.regimes import RegimeBoundary, RegimeCell, RegimeDesign, Regimes
from rfiddesign.study.candidates import Candidates
from rfiddesign.study.load import Study
from rfiddesign.study.pipeline import price_design, test_plan
from rfiddesign.study.regimes import (
    PER_M2,
    PER_PROJECT,
    PER_ROBOT,
    PER_TAG,
    CellAnswer,
    by_group,
    cell_bill,
    mix,
    n_mixes,
    tolerance_cents,
)


def save_regimes(
    out: Path, study: Study, candidates: Candidates, floor: Floor, answers: tuple[CellAnswer, ...], digest: str
) -> None:
    """Write the map into the folder of a study that asks for one."""
    if answers:
        files.write_record(out / files.REGIMES, regimes_record(study, candidates, floor, answers, digest))


def regimes_record(
    study: Study, candidates: Candidates, floor: Floor, answers: tuple[CellAnswer, ...], digest: str
) -> Regimes:
    """The map as one record."""
    plan = test_plan(study, len(candidates.numbers))
    named = sorted({i for answer in answers for i in (answer.search.winner, answer.search.lower_bound)} - {None})
    designs = {i: _design(study, candidates, floor, candidates.numbers[i]) for i in named}
    return Regimes(
        version=__version__,
        study_hash=digest,
        currency=study.prices.currency,
        reference_floor=floor.name,
        reference_area_m2=float(f"{floor.area_m2:.9g}"),
        n_mixes=n_mixes(answer.site for answer in answers),
        tolerance_cents=tolerance_cents(study.prices),
        n_runs=sum(_most_runs(answers).values()),
        cells=[_cell(study, candidates, floor, answer) for answer in answers],
        designs=[designs[i] for i in named],
        boundaries=_boundaries(answers, designs),
        **_declared(plan),
    )


def _declared(plan: TestPlan) -> dict[str, float | int]:
    names = ("hold_probability", "fail_probability", "alpha_refute", "alpha_certify", "n_designs")
    return {name: getattr(plan, name) for name in names}


def _most_runs(answers: tuple[CellAnswer, ...]) -> dict[int, int]:
    """Runs of each design that some cell consumed: the cells share the first ones."""
    most: dict[int, int] = {}
    for answer in answers:
        for i, decision in answer.search.decisions.items():
            most[i] = max(most.get(i, 0), decision.n_runs)
    return most


def _design(study: Study, candidates: Candidates, floor: Floor, number: int) -> RegimeDesign:
    candidate = candidates.by_number[number]
    design = candidate.design
    amounts = dict.fromkeys((PER_ROBOT, PER_TAG, PER_M2, PER_PROJECT), Decimal(0))
    for line in price_design(study, design, candidate.n_tags, Site(1, candidate.tagged_m2)).lines:
        amounts[line.group] += line.quantity * line.unit_price
    return RegimeDesign(
        number=number,
        name=candidate.name,
        layout=design.layout.name,
        antenna=design.antenna.name,
        pattern=design.pattern.name,
        tags_per_m2=float(f"{design.pattern.tags_per_m2:.9g}"),
        n_readers=design.layout.n_readers,
        estimator=candidate.estimator,
        per_robot=float(f"{amounts[PER_ROBOT]:.9g}"),
        per_m2=float(f"{float(amounts[PER_TAG] + amounts[PER_M2]) / floor.area_m2:.9g}"),
    )


def _cell(study: Study, candidates: Candidates, floor: Floor, answer: CellAnswer) -> RegimeCell:
    search, site = answer.search, answer.site
    winner, bound = search.winner, search.lower_bound
    groups, n_tags, decision = dict.fromkeys((PER_ROBOT, PER_TAG, PER_M2, PER_PROJECT), 0), 0, None
    if winner is not None:
        candidate, decision = candidates.by_number[candidates.numbers[winner]], search.decisions[winner]
        n_tags, own_site = cell_bill(candidate, floor, site)
        groups = by_group(price_design(study, candidate.design, n_tags, own_site))
    return RegimeCell(
        n_robots=site.n_robots,
        area_m2=site.area_m2,
        claim=search.claim,
        winner=None if winner is None else candidates.numbers[winner],
        lower_bound=None if bound is None else candidates.numbers[bound],
        lower_bound_cents=None if bound is None else int(answer.cents[bound]),
        n_undecided=len(search.undecided),
        n_runs=0 if decision is None else decision.n_runs,
        n_passed=0 if decision is None else decision.n_passed,
        n_tags=n_tags,
        cost_cents=sum(groups.values()),
        robots_cents=groups[PER_ROBOT],
        tags_cents=groups[PER_TAG],
        area_cents=groups[PER_M2],
        project_cents=groups[PER_PROJECT],
        n_runs_used=search.n_runs_used,
    )


def _boundaries(answers: tuple[CellAnswer, ...], designs: dict[int, RegimeDesign]) -> list[RegimeBoundary]:
    """Where winners of neighbouring mixes cost the same; of a mix's cells the largest tells, for it rounds least."""
    by_mix = {mix(answer.site): answer.search.winner for answer in sorted(answers, key=lambda one: one.site.area_m2)}
    winners = [by_mix[ratio] for ratio in sorted(by_mix)]
    found = []
    for sparse, dense in pairwise(winners):
        if sparse is None or dense is None or sparse == dense:
            continue
        below, above = designs[sparse], designs[dense]
        saved_per_robot, added_per_m2 = below.per_robot - above.per_robot, above.per_m2 - below.per_m2
        if saved_per_robot > 0 and added_per_m2 > 0:
            ratio = float(f"{1000.0 * added_per_m2 / saved_per_robot:.6g}")
            found.append(RegimeBoundary(below=below.number, above=above.number, robots_per_1000_m2=ratio))
    return found
