"""A study from question to answer: space -> screens -> search for each fleet -> one folder of results."""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rfiddesign import __version__
from rfiddesign.catalog import antennas, readers
from rfiddesign.cost import Cost, Site, cost
from rfiddesign.design import Design
from rfiddesign.errors import StudyError
from rfiddesign.estimators.registry import Settings
from rfiddesign.floor import Floor, read_ros_map
from rfiddesign.metrics import Requirement, RunMetrics
from rfiddesign.optimize import (
    Decision,
    Progress,
    Screen,
    SearchResult,
    Space,
    TestPlan,
    Unbuildable,
    boundaries,
    cheapest_certified,
    decide,
    next_best,
    screen_by_reads,
    unbuildable,
)
from rfiddesign.simulation.monte_carlo import Job, Simulator
from rfiddesign.study.estimators import estimators_of
from rfiddesign.study.load import Study, check_tag_count, space_of
from rfiddesign.study.outcomes import StoredOutcomes, StoredRuns

# Fewer runs say nothing of a share as high as those asked for.
FRONT_RUNS = 16
# Raise it with every change of the program that changes what a run measures: stored runs must not mix with new ones.
RUNS_FORMAT = 4

# Sums of cents must fit 64 bits.
MAX_CENTS = 10**18


@dataclass(frozen=True)
class Candidates:
    """What of a space is to be tested, with what each design costs per fleet.

    Parameters
    ----------
    space : the space; a candidate's number is its place in `space.candidates()`.
    unbuildable : what cannot be built.
    screens : screens with what they removed.
    numbers : numbers of the candidates to be tested.
    designs : their designs by number.
    n_tags : tags of each on the floor, by number.
    settings : those of the space's estimators, in their order.
    """

    space: Space
    unbuildable: tuple[Unbuildable, ...]
    screens: tuple[Screen, ...]
    numbers: tuple[int, ...]
    designs: dict[int, Design]
    n_tags: dict[int, int]
    settings: tuple[Settings, ...]

    def estimator(self, number: int) -> str:
        """Name of the estimator that a candidate has."""
        return self.space.estimators[self.space.estimator_of(number)]

    def name(self, number: int) -> str:
        """A candidate in a line: its design, and its estimator where there is a choice."""
        name = self.designs[number].name
        return f"{name}, {self.estimator(number)}" if len(self.space.estimators) > 1 else name

    def job(self, number: int, run: int) -> Job:
        """A run of a candidate."""
        return Job(self.designs[number], run, self.settings[self.space.estimator_of(number)])

    @property
    def n_unbuildable(self) -> int:
        """Combinations that cannot be built."""
        return sum(len(fault.numbers) for fault in self.unbuildable)


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
class Front:
    """The cheapest tested design (by number) at limits times `factor`, with the test's word on its runs; or none."""

    factor: float
    number: int | None
    decision: Decision | None


@dataclass(frozen=True)
class Stage:
    """Where a study stands, for whoever shows progress."""

    what: str
    n_refuted: int = 0
    n_racing: int = 0
    n_remaining: int = 0
    n_runs: int = 0


OnStage = Callable[[Stage], None]


def study_hash(study: Study) -> str:
    """Hash of everything that the answer depends on: study, prices, catalog, map and version of the program."""
    digest = hashlib.sha256()
    parts = [
        __version__,
        str(RUNS_FORMAT),
        repr(antennas()),
        repr(readers()),
        study.file.model_dump_json(),
        repr(study.prices),
    ]
    for part in parts:
        digest.update(part.encode())
        digest.update(b"\0")
    if study.file.floor.map is not None:
        plan = read_ros_map(study.path.parent / study.file.floor.map)
        rules = (plan.resolution_m, plan.origin_m_rad, plan.is_negated, plan.occupied_thresh, plan.free_thresh)
        digest.update(repr((plan.grey.shape, *rules)).encode())
        digest.update(plan.grey.tobytes())
    return digest.hexdigest()


def find_candidates(study: Study, floor: Floor, simulator: Simulator, on_stage: OnStage) -> Candidates:
    """List the space, drop what cannot be built, apply the declared screens and count tags.

    Raises
    ------
    StudyError : if nothing is left to test, or a floor would take too many tags.
    """
    space = space_of(study)
    for pattern in space.patterns:
        check_tag_count(study, pattern, floor, "space.tags_per_m2")
    misfits = unbuildable(space, study.footprint)
    ruled_out = frozenset().union(*(misfit.numbers for misfit in misfits))
    found = space.candidates()
    built = [i for i in range(len(found)) if i not in ruled_out]
    if not built:
        raise StudyError(f"no design can be built: {misfits[0].reason}", file=study.path, key="space")
    on_stage(Stage(f"screening {len(built):,} designs by what their antennas see"))
    minimum = study.file.search.min_expected_reads
    is_kept, screen = screen_by_reads(tuple(found[i].design for i in built), minimum, simulator.map)
    numbers = tuple(i for i, kept in zip(built, is_kept, strict=True) if kept)
    if not numbers:
        raise StudyError(f"every design has {screen.rule}", file=study.path, key="search.min_expected_reads")
    on_stage(Stage(f"laying tags for {len(space.patterns)} patterns"))
    counts = simulator.map(lambda pattern: simulator.tags(pattern).n_tags, space.patterns)
    n_tags = dict(zip(space.patterns, counts, strict=True))
    return Candidates(
        space, misfits, (screen,), numbers, {i: found[i].design for i in numbers},
        {i: n_tags[found[i].design.pattern] for i in numbers},
        tuple(estimators_of(study.file, study.file.world, study.file.scenario.fastest_mm_per_s).values()),
    )  # fmt: skip


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


def price_candidates(study: Study, candidates: Candidates, site: Site) -> dict[int, Cost]:
    """Cost of every candidate on a site, by number."""
    return {
        number: price_design(study, design, candidates.n_tags[number], site)
        for number, design in candidates.designs.items()
    }


def search_fleet(
    study: Study, candidates: Candidates, n_robots: int, costs: dict[int, Cost], runs: StoredRuns, on_stage: OnStage
) -> Answer:
    """Search the cheapest certified design for one fleet."""
    cents = np.array([costs[number].total_cents for number in candidates.numbers])
    plan = test_plan(study, len(candidates.numbers))
    outcomes = StoredOutcomes(runs, list(candidates.numbers), study.requirement)

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

    search = cheapest_certified(cents, outcomes, plan, on_progress=show)
    if search.winner is not None and study.file.search.next_best:
        search = next_best(search, cents, outcomes, plan, count=study.file.search.next_best, on_progress=show)
    runs.drop_ahead()
    return Answer(n_robots, costs, search)


def fronts(study: Study, candidates: Candidates, answer: Answer, runs: dict[int, list[RunMetrics]]) -> list[Front]:
    """The cheapest design at tighter and looser limits, as far as the runs that were made tell.

    A design counts if the test certifies it at those limits, or if at least `FRONT_RUNS` runs suggest that it passes
    more than `fail_probability` of them; nothing is run for it.
    """
    table = boundaries(test_plan(study, len(candidates.numbers)))
    winner = None if answer.search.winner is None else candidates.numbers[answer.search.winner]
    # Of equal prices the certified one first.
    rising = sorted(runs, key=lambda number: (answer.costs[number].total_cents, number != winner))
    found = []
    for factor in sorted({1.0, *study.file.search.limit_factors}):
        requirement = study.requirement.scaled(factor)
        best = Front(factor, None, None)
        for number in rising:
            passed = np.array([requirement.is_met(run) for run in runs[number]])
            decision = decide(table, passed)
            estimate = (passed.sum() + 1) / (passed.size + 2)
            is_likely = decision.verdict != "refuted" and passed.size >= FRONT_RUNS
            is_likely = is_likely and estimate > study.file.search.fail_probability
            if decision.verdict == "certified" or is_likely:
                best = Front(factor, number, decision)
                break
        found.append(best)
    return found


def loosest(study: Study) -> Requirement:
    """The loosest limits that a run is held against: beyond them it may stop."""
    return study.requirement.scaled(max([1.0, *study.file.search.limit_factors]))
