"""What a study is to test: designs with their filters that can be built and pass the screens, their tags counted."""

from dataclasses import dataclass

import numpy as np

from rfiddesign.design import Design
from rfiddesign.errors import StudyError
from rfiddesign.estimators.registry import Settings
from rfiddesign.floor import Floor
from rfiddesign.geometry import tagged_mm2
from rfiddesign.optimize import Screen, Unbuildable, expected_reads, screen_by_reads, unbuildable
from rfiddesign.simulation.monte_carlo import Job, Simulator
from rfiddesign.simulation.scenario import Scenario
from rfiddesign.study.estimators import estimators_of
from rfiddesign.study.load import Study, check_tag_count, scenarios_of, space_of
from rfiddesign.study.route_placement import place_planned
from rfiddesign.study.stages import OnStage, Stage
from rfiddesign.units import MM2_PER_M2


@dataclass(frozen=True, eq=False)
class Candidate:
    """What runs try and money buys.

    Parameters
    ----------
    name : one line that tells it from all others.
    design : the design.
    estimator, settings : name and settings of the filter on the robots.
    n_tags : tags on the floor.
    tagged_m2 : floor to be covered and surveyed [m2].
    scenarios : what it must hold in, the study's own first.
    """

    name: str
    design: Design
    estimator: str
    settings: Settings
    n_tags: int
    tagged_m2: float
    scenarios: tuple[Scenario, ...]

    def job(self, run: int, scenario: int = 0) -> Job:
        """A run in one of its scenarios."""
        return Job(self.design, run, self.settings, self.scenarios[scenario])


@dataclass(frozen=True)
class Candidates:
    """What of a space is to be tested.

    Parameters
    ----------
    estimators : (name, settings) of those that may be on the robots, the preferred one first.
    n_combinations : designs of the whole space, those counted that cannot be built.
    unbuildable : what cannot be built.
    screens : screens with what they removed.
    by_number : candidates by their number, which names them in all results.
    promise : how likely each seems to hold beforehand, by number: the reads that it expects; empty if nobody asked.
    """

    estimators: tuple[tuple[str, Settings], ...]
    n_combinations: int
    unbuildable: tuple[Unbuildable, ...]
    screens: tuple[Screen, ...]
    by_number: dict[int, Candidate]
    promise: dict[int, float]

    @property
    def numbers(self) -> tuple[int, ...]:
        """Numbers of the candidates, in the order in which the search knows them."""
        return tuple(self.by_number)

    @property
    def n_scenarios(self) -> int:
        """Scenarios that each is run in."""
        return len(next(iter(self.by_number.values())).scenarios)

    @property
    def n_unbuildable(self) -> int:
        """Combinations that cannot be built."""
        return sum(len(fault.numbers) for fault in self.unbuildable)

    def job(self, number: int, run: int, scenario: int = 0) -> Job:
        """A run of a candidate."""
        return self.by_number[number].job(run, scenario)


def find_candidates(study: Study, floor: Floor, simulator: Simulator, on_stage: OnStage) -> Candidates:
    """List the space, drop what cannot be built, apply the declared screens and count tags; none without a space.

    Raises
    ------
    StudyError : if nothing is left to test, or a floor would take too many tags.
    """
    settings = estimators_of(study.file, study.file.world, study.file.scenario.fastest_mm_per_s)
    if study.file.space is None:
        return Candidates(tuple(settings.items()), 0, (), (), {}, {})
    space = space_of(study, floor)
    for pattern in space.patterns:
        check_tag_count(study, pattern, floor, "space.tags_per_m2")
    misfits = unbuildable(space, study.footprint)
    ruled_out = frozenset().union(*(misfit.numbers for misfit in misfits))
    found = space.candidates()
    built = [i for i in range(len(found)) if i not in ruled_out]
    placed = place_planned(study, floor, {i: found[i][0] for i in built}, simulator, on_stage)
    built, misfits = list(placed.designs), (*misfits, *placed.unbuildable)
    if not built:
        raise StudyError(f"no design can be built: {misfits[0].reason}", file=study.path, key="space")
    on_stage(Stage(f"screening {len(built):,} designs by what their antennas see"))
    minimum = study.file.search.min_expected_reads
    designs = tuple(placed.designs.values())
    search = study.file.search
    is_needed = bool(minimum > 0 or search.is_short or search.assume)
    # Where nobody asks what they read, all that can be said is that no screen removes them.
    reads = expected_reads(designs, simulator.map) if is_needed else np.full(len(built), np.inf)
    is_kept, screen = screen_by_reads(reads, minimum)
    numbers = tuple(i for i, kept in zip(built, is_kept, strict=True) if kept)
    if not numbers:
        raise StudyError(f"every design has {screen.rule}", file=study.path, key="search.min_expected_reads")
    patterns = list(dict.fromkeys(placed.designs[number].pattern for number in numbers))
    on_stage(Stage(f"laying tags for {len(patterns)} patterns"))
    counts = simulator.map(lambda pattern: simulator.tags(pattern).n_tags, patterns)
    n_tags = dict(zip(patterns, counts, strict=True))
    scenarios = scenarios_of(study, floor)
    by_number = {}
    for number in numbers:
        design, estimator = placed.designs[number], found[number][1]
        tagged_m2 = tagged_mm2(design.pattern, floor.drivable.area) / MM2_PER_M2
        name = f"{design.name}, {estimator}" if len(settings) > 1 else design.name
        by_number[number] = Candidate(
            name, design, estimator, settings[estimator], n_tags[design.pattern], tagged_m2, scenarios
        )
    promise = dict(zip(numbers, reads[is_kept].tolist(), strict=True)) if is_needed else {}
    return Candidates(tuple(settings.items()), space.size, misfits, (screen,), by_number, promise)
