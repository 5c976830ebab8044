"""A small result folder made up of plausible numbers: what a study writes, without running one."""

import json
import math
from dataclasses import replace
from decimal import Decimal
from pathlib import Path

import numpy as np
import shapely

from rfiddesign.catalog import antenna
from rfiddesign.cost import Price, PriceList, Site, cost
from rfiddesign.design import Design
from rfiddesign.floor import rectangle_floor
from rfiddesign.geometry import make_layout, make_pattern
from rfiddesign.results.folder import DESIGN, PLAN, RESULT, TAGS, TRACES, answer_folder, write_record, write_text
from rfiddesign.results.study_result import (
    AnswerRecord,
    AntennaPose,
    AreaRecord,
    Assumption,
    ChosenDesign,
    CostLineRecord,
    CoverageRecord,
    DecisionRecord,
    DesignRecord,
    DriveRecord,
    FloorRecord,
    FrontRecord,
    Limit,
    MeanRecord,
    RequirementRecord,
    ScreenRecord,
    SpaceRecord,
    StudyResult,
    TestRecord,
    TraceRecord,
    Traces,
    UnbuildableRecord,
)


def price(amount: str, source: str = "assumption") -> Price:
    return Price(Decimal(amount), source)


PRICES = PriceList(
    currency="EUR",
    reader=price("38.50", "list price of a vendor, 2024"),
    antennas=tuple((name, price(amount)) for name, amount in (("30x30", "6"), ("60x60", "9.20"), ("80x80", "14"))),
    controllers=((4, price("120")), (8, price("190")), (16, price("310")), (32, price("540"))),
    cabling=price("4.75"),
    tag=price("0.21", "quotation for 100,000 pieces"),
    tag_laying=price("0.35"),
    covering_per_m2=price("24"),
    survey_per_m2=price("3.80"),
    project=price("6500"),
)
LIMITS = [Limit(metric="position_p95_mm", limit=20.0), Limit(metric="heading_p95_rad", limit=math.radians(2))]


def designs() -> list[Design]:
    """Every design of a small space."""
    bars = [{"kind": "bar", "n": n, "spacing_mm": 70, "name": f"bar-{n}"} for n in (4, 8)]
    layouts = [make_layout(spec) for spec in (*bars, "cross-8", "cross-20", "cross-24")]
    patterns = [
        make_pattern(kind, tags_per_m2=density)
        for kind in ("square", "triangular")
        for density in (9, 16, 25, 36, 50, 64, 100, 150, 225, 400)
    ]
    return [
        Design(layout, antenna(size), pattern)
        for layout in layouts
        for size in ("30x30", "60x60", "80x80")
        for pattern in patterns
    ]


def measured(number: int, design: Design, n_tags: int, rng: np.random.Generator) -> tuple[DesignRecord, str, int]:
    """A design's record, verdict and passed runs, by a rule of thumb for its error."""
    density, readers = design.pattern.tags_per_m2, design.layout.n_readers
    error = 420 / density**0.55 / readers**0.45 * (1.3 if design.antenna.name == "30x30" else 1.0) + rng.exponential(
        0.6
    )
    if density * readers < 250:
        error *= float(rng.uniform(3, 20))
    verdict, n_runs, n_passed = "refuted", int(rng.integers(2, 40)), 0
    if error < 13.5:
        verdict, n_runs, n_passed = "certified", 137, 137
    elif error < 14.5:
        verdict, n_runs, n_passed = "undecided", 1000, 921
    n_complete = n_runs if verdict == "certified" else n_passed + (n_runs - n_passed) // 3
    mean = MeanRecord(mean=error, stderr=0.08 * error)
    record = DesignRecord(
        number=number,
        name=design.name,
        layout=design.layout.name,
        antenna=design.antenna.name,
        pattern=design.pattern.name,
        tags_per_m2=density,
        n_readers=readers,
        n_tags=n_tags,
        n_runs=n_runs,
        n_complete=n_complete,
        metrics={
            "position_p95_mm": mean,
            "position_mean_mm": MeanRecord(mean=error / 2.2, stderr=None),
            "heading_p95_rad": MeanRecord(mean=error / 900, stderr=None),
        },
    )
    return record, verdict, n_passed


def coverage_record() -> CoverageRecord:
    aligned = {0.0, 26.565, 45.0, 63.435}
    headings = sorted(aligned | {7.5, 15.0, 22.5, 35.0, 52.5, 75.0, 82.5})
    drives = [
        DriveRecord(
            heading_deg=heading,
            mean_mm=18.0 + (120 if heading == 0 else 0),
            p95_mm=61.0 + 5 * math.sin(heading) + (1900 if heading == 0 else 0),
            max_mm=5000.0 if heading == 0 else 240.0,
            share_over_limit=0.11 if heading == 0 else 0.0,
            is_aligned=heading in aligned,
        )
        for heading in headings
    ]
    return CoverageRecord(
        k_coverage=[0.973, 0.846, 0.55],
        expected_reads=2.61,
        two_tags_share=0.0,
        method="exact",
        stderr=2e-5,
        drives=drives,
        warnings=["at heading 0° rows are 200 mm apart and 11 % of lateral places never read a tag"],
    )


def traces(n_robots: int, rng: np.random.Generator, n_steps: int = 200) -> list[TraceRecord]:
    time = np.arange(1, n_steps + 1) * 0.3
    return [
        TraceRecord(
            n_robots=n_robots,
            run=run,
            time_s=time.round(3).tolist(),
            position_error_mm=(900 * np.exp(-time * 1.5) + 5 * np.abs(rng.normal(1.4, 0.6, n_steps))).tolist(),
            heading_error_rad=(0.8 * np.exp(-time * 1.2) + np.abs(rng.normal(0, 0.008, n_steps))).tolist(),
        )
        for run in range(4)
    ]


def write_folder(
    folder: Path, robots: tuple[int, ...] = (5, 200), *, has_winners: bool = True, tag_source: str = "offer", **changes
) -> StudyResult:
    """Write a result folder for a hall of 14 x 9 m; `changes` replace fields of the result.

    Without winners every design counts as refuted.
    """
    rng = np.random.Generator(np.random.PCG64(7))
    floor = rectangle_floor(14_000, 9_000, 300)
    space = designs()
    tags = {pattern: pattern.lay(floor.drivable) for pattern in dict.fromkeys(design.pattern for design in space)}
    tested = [measured(i, design, len(tags[design.pattern]), rng) for i, design in enumerate(space)]
    if not has_winners:
        tested = [(record, "refuted", 0) for record, _, _ in tested]
    prices = replace(PRICES, tag=replace(PRICES.tag, source=tag_source))
    answers, all_traces = [], []
    for i, n_robots in enumerate(robots):
        costs = [cost(d, len(tags[d.pattern]), Site(n_robots, floor.area_m2), prices) for d in space]
        answers.append(_answer(n_robots, costs, tested))
        winner = answers[-1].winner
        if winner is not None:
            place = answer_folder(folder, n_robots, is_first=i == 0)
            place.mkdir(parents=True, exist_ok=True)
            _write_design(place, space[winner.design], tags[space[winner.design].pattern], answers[-1])
            all_traces += traces(n_robots, rng)
    result = StudyResult(**{**_fields(space, floor, tested, answers), **changes})
    folder.mkdir(parents=True, exist_ok=True)
    write_record(folder / RESULT, result)
    write_record(folder / TRACES, Traces(traces=all_traces))
    write_text(folder / PLAN, json.dumps(plan_geojson(floor)))
    return result


def plan_geojson(floor) -> dict:
    roles = {"drivable": floor.drivable, "navigable": floor.navigable}
    return {
        "type": "FeatureCollection",
        "features": [
            {"type": "Feature", "properties": {"role": role}, "geometry": json.loads(shapely.to_geojson(area))}
            for role, area in roles.items()
        ],
    }


def _answer(n_robots: int, costs: list, tested: list) -> AnswerRecord:
    order = sorted(range(len(costs)), key=lambda i: costs[i].total_cents)
    decisions, winners = [], []
    for i in order:
        record, verdict, n_passed = tested[i]
        decision = DecisionRecord(
            design=i, cost_cents=costs[i].total_cents, verdict=verdict, n_runs=record.n_runs, n_passed=n_passed
        )
        decisions.append(decision)
        winners += [decision] if verdict == "certified" else []
        if len(winners) == 3:
            break
    winner = winners[0] if winners else None
    undecided = [d for d in decisions if d.verdict == "undecided" and winner and d.cost_cents < winner.cost_cents]
    claim = "none holds" if winner is None else "certified, cheaper undecided" if undecided else "cheapest"
    words = {
        "none holds": "every design was refuted",
        "cheapest": "the winner is certified and every cheaper design was refuted",
        "certified, cheaper undecided": "the winner is certified, but cheaper designs reached the cap of runs without a"
        " verdict; the cheapest design that holds costs at least as much as the lower bound",
    }
    lines = costs[winner.design].lines if winner else ()
    return AnswerRecord(
        n_robots=n_robots,
        currency="EUR",
        claim=claim,
        claim_words=words[claim],
        winner=winner,
        cost_lines=[
            CostLineRecord(
                group=line.group,
                item=line.item,
                quantity=str(line.quantity),
                unit=line.unit,
                unit_price=str(line.unit_price),
                amount_cents=line.amount_cents,
                source=line.source,
            )
            for line in lines
        ],
        runners_up=winners[1:],
        lower_bound=min([*undecided, *winners], key=lambda d: d.cost_cents, default=None),
        undecided=undecided,
        decisions=decisions,
        n_runs_used=sum(d.n_runs for d in decisions),
        fronts=_fronts(decisions, tested),
        coverage=coverage_record() if winner else None,
    )


def _fronts(decisions: list[DecisionRecord], tested: list) -> list[FrontRecord]:
    fronts = []
    for factor in (0.5, 0.75, 1.5, 2.0):
        holding = [d for d in decisions if tested[d.design][0].metrics["position_p95_mm"].mean < 13.5 * factor]
        verdict = "certified" if factor < 2 else "undecided"
        decision = holding[0].model_copy(update={"verdict": verdict}) if holding else None
        limits = [Limit(metric=limit.metric, limit=limit.limit * factor) for limit in LIMITS]
        fronts.append(FrontRecord(factor=factor, limits=limits, decision=decision))
    return fronts


def _write_design(place: Path, design: Design, tags: np.ndarray, answer: AnswerRecord) -> None:
    lattice = design.pattern.lattice
    chosen = ChosenDesign(
        name=design.name,
        n_robots=answer.n_robots,
        layout=design.layout.name,
        antennas=[AntennaPose(x_mm=x, y_mm=y, yaw_rad=yaw) for x, y, yaw in design.layout.poses],
        antenna=design.antenna.name,
        antenna_housing_mm=design.antenna.housing_mm,
        antenna_source=design.antenna.source,
        footprint_radius_mm=300,
        pattern=design.pattern.name,
        tags_per_m2=design.pattern.tags_per_m2,
        lattice_basis_mm=None if lattice is None else list(lattice.basis_mm),
        pattern_seed=0,
        n_tags=len(tags),
        cost_cents=answer.winner.cost_cents,
        currency=answer.currency,
    )
    write_record(place / DESIGN, chosen)
    rows = "".join(f"{i},{x:.1f},{y:.1f}\n" for i, (x, y) in enumerate(tags))
    write_text(place / TAGS, f"id,x_mm,y_mm\n{rows}")


def _fields(space: list[Design], floor, tested: list, answers: list[AnswerRecord]) -> dict:
    tested_numbers = {decision.design for answer in answers for decision in answer.decisions}
    area = {"area_m2": floor.area_m2, "navigable_m2": floor.navigable_m2}
    return {
        "version": "0.1.0",
        "study": "hall",
        "title": "Which tags and readers for a hall of 14 x 9 m?",
        "seed": 11,
        "study_hash": "4f" * 32,
        "requirement": RequirementRecord(limits=LIMITS, converged_within_s=10.0),
        "test": TestRecord(
            hold_probability=0.95, fail_probability=0.9, alpha_refute=0.025, alpha_certify=0.025, n_designs=300,
            max_runs=1000,
        ),
        "floor": FloorRecord(
            name="hall", source="14 x 9 m", footprint_radius_mm=300, **area,
            sensitivity=[
                AreaRecord(name="chosen", value=None, **area),
                AreaRecord(name="footprint_radius_mm", value=350, area_m2=floor.area_m2 - 1, navigable_m2=110.0),
            ],
        ),
        "space": SpaceRecord(
            n_combinations=340, n_unbuildable=40, n_candidates=300,
            unbuildable=[
                UnbuildableRecord(
                    layout="cross-96", antenna=size,
                    reason="layout cross-96: antennas 1 and 2 overlap by 15.5 mm; antenna 3 sticks out",
                )
                for size in ("60x60", "80x80")
            ],
            screens=[ScreenRecord(rule="fewer than 0 expected reads per poll", kind="heuristic", n_removed=0)],
        ),
        "assumptions": [
            Assumption(what="duration of a drive", value="60 s", source="assumption"),
            Assumption(what="odometry noise", value="25 mm/s and 0.05 rad/s", source="hf_multireader_mcl, calibrated"),
            Assumption(what="price of laying a tag", value="EUR 0.35", source="assumption"),
        ],
        "answers": answers,
        "designs": [record for record, _, _ in tested if record.number in tested_numbers],
    }  # fmt: skip
