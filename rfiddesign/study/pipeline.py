"""A study from question to answer: space -> screens -> search for each fleet -> one folder of results."""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from rfiddesign import __version__
from rfiddesign.catalog import antennas, readers
from rfiddesign.cost import Cost, Site, cost
from rfiddesign.design import Design
from rfiddesign.errors import StudyError
from rfiddesign.floor import read_ros_map
from rfiddesign.metrics import Requirement, RunMetrics
from rfiddesign.optimize import (
    Decision,
    Progress,
    SearchResult,
    SearchRules,
    TestPlan,
    battery,
    cheapest_certified,
    judge,
    next_best,
    weaker_designs,
)
from rfiddesign.study.candidates import Candidates
from rfiddesign.study.criteria import Criteria
from rfiddesign.study.load import Study
from rfiddesign.study.outcomes import StoredOutcomes, StoredRuns
from rfiddesign.study.placements import placed_layout, searched_placements
from rfiddesign.study.stages import OnStage, Stage
from rfiddesign.study.survey_config import recorded_log

# Fewer runs say nothing of a share as high as those asked for.
FRONT_RUNS = 16
# Raise it with every change of the program that changes what a run measures: stored runs must not mix with new ones.
RUNS_FORMAT = 5

# Sums of cents must fit 64 bits.
MAX_CENTS = 10**18

# The runs of a design, a list of them for each scenario.
Runs = tuple[list[RunMetrics], ...]


@dataclass(frozen=True)
class Answer:
    """What the search found for one size of fleet.

    Parameters
    ----------
    n_robots : the fleet.
    costs : cost of each candidate, by number.
    search : what the search found; its indices point into `Candidates.numbers`.
    """

    n_robots: int
    costs: dict[int, Cost]
    search: SearchResult


@dataclass(frozen=True)
class Fleet:
    """What one search is for, and what it may spend.

    Parameters
    ----------
    n_robots : the fleet.
    costs : cost of each candidate, by number.
    n_runs, time_used : the budget, see `SearchRules`.
    """

    n_robots: int
    costs: dict[int, Cost]
    n_runs: int | None = None
    time_used: Callable[[], float] | None = None


@dataclass(frozen=True)
class Front:
    """The cheapest tested design (by number) at limits times `factor`, with the test's word on its runs; or none."""

    factor: float
    number: int | None
    decision: Decision | None


def study_hash(study: Study) -> str:
    """Hash of everything that the answer depends on: study, prices, catalog, map and version of the program."""
    return joined_hash(hash_parts(study))


def hash_parts(study: Study) -> dict[str, str]:
    """Hashes of the parts that an answer depends on, by what they are."""
    parts = {
        "program": hash_of(f"{__version__} {RUNS_FORMAT}"),
        "catalog": hash_of(repr(antennas()) + repr(readers())),
        "study": hash_of(study.file.model_dump_json()),
        "prices": hash_of(repr(study.prices)),
    }
    if study.shelf_prices is not None:
        parts["shelf prices"] = hash_of(repr(study.shelf_prices))
    if study.file.floor.map is not None:
        plan = read_ros_map(study.path.parent / study.file.floor.map)
        rules = (plan.resolution_m, plan.origin_m_rad, plan.is_negated, plan.occupied_thresh, plan.free_thresh)
        parts["map"] = hash_of(repr((plan.grey.shape, *rules)).encode() + plan.grey.tobytes())
    placed = [placed_layout(study.path, study.file, name) for name in searched_placements(study.file)]
    if placed:
        parts["placements"] = hash_of(repr(placed))
    log = recorded_log(study.path, study.file)
    if log is not None:
        parts["survey log"] = hash_of(b"".join(part.tobytes() for part in log.arrays))
    return parts


def hash_of(content: str | bytes) -> str:
    """Hash of some content."""
    return hashlib.sha256(content.encode() if isinstance(content, str) else content).hexdigest()


def joined_hash(parts: dict[str, str]) -> str:
    """One hash of the hashes of parts."""
    return hash_of("\0".join(f"{name}={digest}" for name, digest in parts.items()))


def test_plan(study: Study, n_designs: int) -> TestPlan:
    """The test as the study declares it."""
    search = study.file.search
    return TestPlan(
        n_designs=n_designs,
        hold_probability=search.hold_probability,
        fail_probability=search.fail_probability,
        alpha_refute=search.alpha_refute,
        alpha_certify=search.alpha_certify,
        max_runs=search.max_runs,
        criteria=study.criteria.declared(),
    )


def price_design(study: Study, design: Design, n_tags: int, site: Site) -> Cost:
    """Cost of a design on a site by the study's price list."""
    path = study.path.parent / study.file.prices
    try:
        price = cost(design, n_tags, site, study.prices)
    except ValueError as error:
        raise StudyError(str(error), file=path, key="per_robot.antenna") from None
    if price.total_cents > MAX_CENTS:
        raise StudyError(f"{design.name} would cost {price.total_cents:.3g} cents, at most {MAX_CENTS:.3g}", file=path)
    return price


def price_candidates(study: Study, candidates: Candidates, n_robots: int) -> dict[int, Cost]:
    """Cost of every candidate for a fleet, by number."""
    return {
        number: price_design(study, found.design, found.n_tags, Site(n_robots, found.tagged_m2))
        for number, found in candidates.by_number.items()
    }


def search_fleet(study: Study, candidates: Candidates, fleet: Fleet, runs: StoredRuns, on_stage: OnStage) -> Answer:
    """Search the cheapest certified design for one fleet."""
    n_robots = fleet.n_robots
    cents = np.array([fleet.costs[number].total_cents for number in candidates.numbers])
    plan = test_plan(study, len(candidates.numbers))
    outcomes = StoredOutcomes(runs, list(candidates.numbers), study.criteria)

    def show(progress: Progress) -> None:
        on_stage(
            Stage(
                f"{n_robots:,} robots",
                progress.n_refuted,
                progress.n_racing,
                progress.n_remaining,
                progress.n_runs,
            )
        )

    rules = replace(search_rules(study, candidates, plan), run_budget=fleet.n_runs, time_used=fleet.time_used)
    search = cheapest_certified(cents, outcomes, plan, rules=rules, on_progress=show)
    if search.winner is not None and study.file.search.next_best:
        if rules.run_budget is not None:
            rules = replace(rules, run_budget=max(0, rules.run_budget - search.n_runs_used))
        search = next_best(
            search, cents, outcomes, plan, count=study.file.search.next_best, rules=rules, on_progress=show
        )
    runs.drop_ahead()
    return Answer(n_robots, fleet.costs, search)


def search_rules(study: Study, candidates: Candidates, plan: TestPlan) -> SearchRules:
    """How the study lets its searches spend runs, budgets apart."""
    search, found = study.file.search, list(candidates.by_number.values())
    weaker = None
    if search.assume:
        designs = [each.design for each in found]
        weaker = weaker_designs(designs, [each.estimator for each in found], search.assume, plan)
    promise = [candidates.promise[number] for number in candidates.numbers] if candidates.promise else None
    return SearchRules(search.cost_tolerance, promise=promise, weaker=weaker)


def fronts(study: Study, candidates: Candidates, answer: Answer, runs: dict[int, Runs]) -> list[Front]:
    """The cheapest design at tighter and looser limits, as far as the runs that were made tell.

    A design counts if the test certifies it at those limits, or if at least `FRONT_RUNS` runs suggest that it passes
    more than `fail_probability` of them; nothing is run for it.
    """
    tests = battery(test_plan(study, len(candidates.numbers)))
    winner = None if answer.search.winner is None else candidates.numbers[answer.search.winner]
    # Of equal prices the certified one first.
    rising = sorted(runs, key=lambda number: (answer.costs[number].total_cents, number != winner))
    found = []
    for factor in sorted({1.0, *study.file.search.limit_factors}):
        criteria = study.criteria.scaled(factor)
        best = Front(factor, None, None)
        for number in rising:
            decision = judge(tests, criteria.scores(runs[number]))
            # Of all runs, as the decision stops at the first that decides.
            n_runs = len(runs[number][0])
            is_likely = decision.verdict != "refuted" and n_runs >= FRONT_RUNS
            is_likely = is_likely and _is_likely(study, criteria, runs[number])
            if decision.verdict == "certified" or is_likely:
                best = Front(factor, number, decision)
                break
        found.append(best)
    return found


def _is_likely(study: Study, criteria: Criteria, runs: Runs) -> bool:
    """Whether the runs, as they are, keep the limits in more than `fail_probability` of drives in each scenario."""
    n_passed = min(sum(criteria.requirement.is_met(run) for run in row) for row in runs)
    return (n_passed + 1) / (len(runs[0]) + 2) > study.file.search.fail_probability


def loosest(study: Study) -> Requirement | None:
    """The loosest limits that a run is held against, beyond which it may stop; None if it must be completed.

    A mean or a quantile over drives needs what each drive measures to its end.
    """
    if study.file.requirements:
        return None
    return study.requirement.scaled(max([1.0, *study.file.search.limit_factors]))
