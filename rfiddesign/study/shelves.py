"""Floor or shelf: the cheapest certified design of two families on the same hall, at several limits.

Floor designs are those of the study: HF readers under the robots, tags in the floor.  Shelf designs are UHF antennas on
the robots, tags on the fronts of shelves and training drives with a reference localizer.  Both are held against the
same requirement on the same drives: run i of either family drives the same way with the same wheels, and starts without
knowing where it is.

What may be said at once
------------------------
With p, p0 and p1 as in :mod:`rfiddesign.optimize.certify`, N designs in a family and L limits:

1. *Every winner of a family, at every limit and for every fleet, passes more than p1*, but for a chance of at most
   alpha_certify.  What is certified is a design at a limit, and alpha_certify is divided by the N L of them.
2. *Nothing of the family that is cheaper than an answer's lower bound has p >= p0*, but for a chance of at most
   alpha_refute, answer by answer: the statement of :mod:`rfiddesign.optimize.cheapest`.

Each family has these chances of its own: that anything said of either is wrong has at most twice the chance.  Their
prices are known, so that "the shelves are cheaper" is wrong only if one of the four statements behind it is.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rfiddesign.cost import Cost, ShelfEquipment, shelf_cost
from rfiddesign.errors import StudyError
from rfiddesign.estimators.snapshot import SnapshotMcl
from rfiddesign.floor.scene import Scene
from rfiddesign.metrics import RunMetrics
from rfiddesign.models.fingerprint import Smoothing
from rfiddesign.models.fingerprint_table import TableGrid
from rfiddesign.models.uhf import UhfField
from rfiddesign.optimize import Progress, SearchResult, TestPlan, cheapest_certified
from rfiddesign.results import folder as files
from rfiddesign.simulation.scenario import Scenario
from rfiddesign.simulation.shelf_run import ShelfDesign, ShelfJob, ShelfSimulator, ShelfTrial
from rfiddesign.simulation.snapshot_drive import DriveSettings
from rfiddesign.study.candidates import Candidates
from rfiddesign.study.checked import checked
from rfiddesign.study.config import StudyFile
from rfiddesign.study.hall import hall_of
from rfiddesign.study.load import Study
from rfiddesign.study.outcomes import StoredOutcomes, StoredRuns
from rfiddesign.study.pipeline import test_plan
from rfiddesign.study.stages import OnStage, Stage
from rfiddesign.study.storage import RunTable

FLOOR, SHELVES = "floor", "shelves"
# Antennas of a pair: one sends, one listens.
ANTENNAS_PER_PAIR = 2
# Shelf designs whose runs are begun before their turn: a run takes seconds.
SHELVES_AHEAD = 1


@dataclass(frozen=True, eq=False)
class FamilySearch:
    """What the search found of a family for a fleet at a limit; its indices point into `cents` (n,)."""

    family: str
    n_robots: int
    factor: float
    cents: NDArray[np.int64]
    search: SearchResult


@dataclass(frozen=True, eq=False)
class ShelvesFound:
    """What is known when both families were searched.

    Parameters
    ----------
    trial : how shelf designs were exercised.
    designs : the shelf designs.
    costs : cost of each shelf design, by size of fleet.
    searches : both families' answers.
    runs : the runs that searches consumed, by family and number of the design.
    """

    trial: ShelfTrial
    designs: tuple[ShelfDesign, ...]
    costs: dict[int, tuple[Cost, ...]]
    searches: tuple[FamilySearch, ...]
    runs: dict[tuple[str, int], list[RunMetrics]]


def shelf_designs(study: Study) -> tuple[ShelfDesign, ...]:
    """Every shelf design of the study's space."""
    space = study.file.shelves.space
    values = product(space.tags_per_m, space.antenna_pairs, space.n_cycles, space.training_drives, space.k_prime)
    return tuple(ShelfDesign(*each) for each in values)


def shelf_trial(study: Study, scenario: Scenario) -> ShelfTrial:
    """How the study exercises shelf designs."""
    section = study.file.shelves
    given = section.uhf.model_dump(exclude_none=True)
    training = DriveSettings(
        duration_s=section.training_drive_s, motion=scenario.world.motion, faults=scenario.world.faults,
        reference_mm=section.reference_mm, reference_rad=section.reference_rad,
    )  # fmt: skip
    return ShelfTrial(
        scene_of=_scenes(study),
        scenario=scenario,
        seed=study.file.seed,
        uhf=checked(study.path, "shelves.uhf", lambda: UhfField(**given)),
        training=training,
        # Within the hull, as far out as an antenna of 50 mm goes.
        antenna_radius_mm=max(study.file.robot.footprint_radius_mm - 50.0, 1.0),
        filter=SnapshotMcl(n_particles=section.n_particles),
        noise_factor=section.noise_factor,
        smoothing=Smoothing(sigma_mm=section.smoothing_mm, sigma_rad=math.radians(section.smoothing_deg)),
        grid=TableGrid(section.cell_mm, section.n_headings),
    )


def price_shelves(study: Study, trial: ShelfTrial, designs: tuple[ShelfDesign, ...], n_robots: int) -> tuple[Cost, ...]:
    """Cost of every shelf design for a fleet."""
    prices = []
    for design in designs:
        n_antennas, n_tags = ANTENNAS_PER_PAIR * design.n_pairs, trial.scene_of(design.tags_per_m).n_tags
        equipment = ShelfEquipment(n_antennas, n_tags, training_min(trial, design))
        prices.append(shelf_cost(equipment, n_robots, study.shelf_prices))
    return tuple(prices)


def training_min(trial: ShelfTrial, design: ShelfDesign) -> float:
    """Minutes of training drives that a design takes [min]."""
    return design.n_training * trial.training.duration_s / 60.0


def check_shelves(study: Study) -> None:
    """Raise StudyError for what is wrong with a study's shelves before anything is run or written."""
    if study.file.shelves is None:
        return
    if study.shelf_prices.currency != study.prices.currency:
        path = study.path.parent / study.file.shelves.prices
        problem = f"is {study.shelf_prices.currency}, must be {study.prices.currency} as in {study.file.prices}"
        raise StudyError(problem, file=path, key="currency")
    for design in shelf_designs(study):
        hall_of(study.path, study.file, design.tags_per_m)


def search_shelves(
    study: Study, candidates: Candidates, floor_runs: StoredRuns, floor_cents: dict[int, NDArray[np.int64]],
    scenario: Scenario, where: tuple[Path, int, OnStage],
) -> ShelvesFound | None:  # fmt: skip
    """Search both families for every fleet at every limit; None if the study has no shelves.

    Parameters
    ----------
    floor_runs, floor_cents : runs of the study's own candidates, and their prices by size of fleet.
    scenario : how both are exercised.
    where : the folder that runs are kept in, number of workers, and whom to tell.
    """
    if study.file.shelves is None:
        return None
    out, n_workers, on_stage = where
    trial, designs = shelf_trial(study, scenario), shelf_designs(study)
    costs = {n_robots: price_shelves(study, trial, designs, n_robots) for n_robots in floor_cents}
    cents = {n_robots: np.array([cost.total_cents for cost in each]) for n_robots, each in costs.items()}
    numbers = list(range(len(designs)))
    searches: list[FamilySearch] = []
    with RunTable(out / files.SHELF_RUNS) as table, ShelfSimulator(trial, n_workers) as simulator:
        runs = StoredRuns(lambda number, run, _: ShelfJob(designs[number], run), simulator, table)
        try:
            for factor in factors_of(study.file):
                searches += _search(study, FLOOR, factor, floor_cents, (floor_runs, list(candidates.numbers)), on_stage)
                searches += _search(study, SHELVES, factor, cents, (runs, numbers), on_stage)
        finally:
            runs.save()
        consumed = _consumed(searches, {FLOOR: (floor_runs, list(candidates.numbers)), SHELVES: (runs, numbers)})
    return ShelvesFound(trial, designs, costs, tuple(searches), consumed)


def factors_of(file: StudyFile) -> list[float]:
    """What the limits are multiplied by, rising; 1 is among them."""
    return sorted({1.0, *file.search.limit_factors})


def family_plan(file: StudyFile, plan: TestPlan, family: str, n_designs: int) -> TestPlan:
    """The study's test for a family of so many designs: certification is divided by designs and limits."""
    own_cap = file.shelves.max_runs if family == SHELVES else None
    return replace(plan, n_designs=n_designs * len(factors_of(file)), max_runs=own_cap or plan.max_runs)


def _search(
    study: Study, family: str, factor: float, cents: dict[int, NDArray[np.int64]],
    sampled: tuple[StoredRuns, list[int]], on_stage: OnStage,
) -> list[FamilySearch]:  # fmt: skip
    """One family at one limit, for every fleet."""
    runs, numbers = sampled
    plan = family_plan(study.file, test_plan(study, len(numbers)), family, len(numbers))
    ahead = {"designs_ahead": SHELVES_AHEAD} if family == SHELVES else {}
    outcomes = StoredOutcomes(runs, numbers, study.criteria.scaled(factor), **ahead)
    found = []
    for n_robots, prices in cents.items():
        told = _teller(on_stage, f"{family}, limits x {factor:g}, {n_robots:,} robots")
        found.append(
            FamilySearch(family, n_robots, factor, prices, cheapest_certified(prices, outcomes, plan, on_progress=told))
        )
        runs.drop_ahead()
    return found


def _teller(on_stage: OnStage, what: str) -> Callable[[Progress], None]:
    def tell(progress: Progress) -> None:
        on_stage(Stage(what, progress.n_refuted, progress.n_racing, progress.n_remaining, progress.n_runs))

    return tell


def _consumed(
    searches: list[FamilySearch], sampled: dict[str, tuple[StoredRuns, list[int]]]
) -> dict[tuple[str, int], list[RunMetrics]]:
    """The runs that any search looked at, by family and number of the design."""
    most: dict[tuple[str, int], int] = {}
    for each in searches:
        for index, decision in each.search.decisions.items():
            key = (each.family, sampled[each.family][1][index])
            most[key] = max(most.get(key, 0), decision.n_runs)
    return {(family, n): sampled[family][0].first(n, n_runs)[0] for (family, n), n_runs in sorted(most.items())}


def _scenes(study: Study) -> Callable[[float], Scene]:
    return cache(lambda tags_per_m: hall_of(study.path, study.file, tags_per_m))
