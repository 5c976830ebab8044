"""From a study's [explore] table to what explores it: variables, plan, and a bench that simulates and prices."""

from dataclasses import dataclass, replace
from functools import cached_property

from shapely.geometry import Polygon

from rfiddesign.catalog import antenna
from rfiddesign.cost import Site
from rfiddesign.errors import StudyError
from rfiddesign.estimators.registry import Settings
from rfiddesign.floor import Floor
from rfiddesign.geometry import TagPattern
from rfiddesign.metrics import RunMetrics
from rfiddesign.optimize.explore import (
    KIND_VARIABLES,
    Choice,
    ExplorePlan,
    Fixed,
    Front,
    Named,
    NamingPlan,
    Objectives,
    Proposal,
    Range,
    Trial,
    Variables,
    check_evaluator,
    check_exploration,
    fault_of,
    propose,
)
from rfiddesign.simulation.monte_carlo import Simulator
from rfiddesign.simulation.scenario import Scenario
from rfiddesign.study.candidates import Candidate
from rfiddesign.study.checked import checked
from rfiddesign.study.estimator_config import SECTIONS
from rfiddesign.study.estimators import estimators_of
from rfiddesign.study.explore_config import RangeSection
from rfiddesign.study.load import Study, check_tag_count, layout_of, reader_of, scenarios_of
from rfiddesign.study.outcomes import StoredRuns
from rfiddesign.study.pipeline import price_design

RANGES = "explore.ranges"
#: Steps that a range has unless it says otherwise: 1 mm, 1 tag/m2, one reader.
_STEPS = {"n_particles": 50.0, "speed_mm_per_s": 50.0}
# Apart from the study's own seed, which draws routes and noise.
_SAMPLER_SEED = 20_261_128


@dataclass(frozen=True)
class Explored:
    """What was explored for one fleet; `front` is None where none was asked for or nothing could go on it."""

    n_robots: int
    trials: tuple[Trial, ...]
    named: tuple[Named, ...]
    front: Front | None
    is_cut_short: bool


def variables_of(study: Study) -> Variables:
    """The variables of a study's exploration; StudyError for what no variable may be."""
    ranges = study.file.explore.ranges
    found = []
    for name in type(ranges).model_fields:
        value = getattr(ranges, name)
        if value is None:
            continue
        try:
            found.append(Choice(name, tuple(value)) if isinstance(value, list) else _range(name, value))
        except ValueError as error:
            raise StudyError(str(error), file=study.path, key=f"{RANGES}.{name}") from None
    own = tuple(kind for kind in ranges.kind if kind not in KIND_VARIABLES)
    for name in own:
        layout_of(study, name, f"{RANGES}.kind")
    try:
        return Variables(tuple(found), own)
    except ValueError as error:
        raise StudyError(str(error), file=study.path, key=RANGES) from None


def _range(name: str, section: RangeSection) -> Range:
    return Range(name, section.low, section.high, section.step or _STEPS.get(name, 1.0), section.log)


def fixed_of(study: Study) -> Fixed:
    """What all proposals of a study share."""
    kinds = [kind for kind in study.file.explore.ranges.kind if kind not in KIND_VARIABLES]
    layouts = {name: layout_of(study, name, f"{RANGES}.kind") for name in kinds}
    return Fixed(reader_of(study), study.file.seed, layouts)


def explore_plan(study: Study, place: int = 0) -> ExplorePlan:
    """How a study explores for the fleet at that place of its list."""
    explore, pareto, scenario = study.file.explore, study.file.pareto, study.file.scenario
    return ExplorePlan(
        requirement=study.requirement,
        share=study.file.search.hold_probability,
        sampler=explore.sampler,
        seed=(study.file.seed + _SAMPLER_SEED * (place + 1)) % 2**63,
        n_trials=explore.n_trials,
        n_runs=explore.runs_per_trial,
        n_pilot=explore.pilot_runs,
        objectives=None if pareto is None else Objectives(tuple(pareto.objectives), scenario.duration_s),
        speed_mm_per_s=scenario.fastest_mm_per_s,
        slack=2.0 if pareto is None else pareto.slack,
    )


def naming_plan(study: Study) -> NamingPlan:
    """How many candidates a study names for a fleet."""
    return NamingPlan(study.file.explore.n_candidates)


def check_explore(study: Study, floor: Floor) -> Variables:
    """The variables of a study's exploration, if all is well with it.

    Raises
    ------
    StudyError : if a variable is at fault, the densest floor would take too many tags, or the sampler cannot explore
        this.
    """
    variables, fixed = variables_of(study), fixed_of(study)
    densest = {variable.name: _last(variable) for variable in variables.all}
    for pattern in variables.by_name["pattern"].values:
        try:
            proposal = propose(variables.made(densest | {"pattern": pattern}), fixed)
        except ValueError as error:
            raise StudyError(str(error), file=study.path, key=RANGES) from None
        check_tag_count(study, proposal.design.pattern, floor, f"{RANGES}.tags_per_m2")
    _check_heights(study, variables)
    for evaluator in study.file.explore.importance:
        try:
            check_evaluator(evaluator)
        except ValueError as error:
            raise StudyError(str(error), file=study.path, key="explore.importance") from None
    try:
        check_exploration(variables, explore_plan(study))
    except ValueError as error:
        raise StudyError(str(error), file=study.path, key="explore.sampler") from None
    return variables


def _check_heights(study: Study, variables: Variables) -> None:
    """StudyError unless all antennas reach the floor from the lowest and the highest place, and so from between."""
    heights = variables.by_name.get("antenna_height_mm")
    for name in variables.by_name["antenna"].values if isinstance(heights, Range) else ():
        for height in (heights.low, heights.high):
            checked(study.path, f"{RANGES}.antenna_height_mm", lambda h=height, name=name: antenna(name).at_height(h))


def _last(variable: Choice | Range) -> str | float:
    return variable.values[-1] if isinstance(variable, Choice) else variable.high


class Maker:
    """Makes candidates of proposals: lays and counts their tags, sets their filter and their robots' speed.

    A proposal is made once, so that what is prepared for its runs is found again.
    """

    def __init__(self, study: Study, floor: Floor, simulator: Simulator):
        self._study = study
        self._floor = floor
        self._simulator = simulator
        self._made: dict[int, Candidate] = {}
        self._n_tags: dict[TagPattern, int] = {}
        self._settings: dict[tuple, Settings] = {}
        self._scenarios: dict[float | None, tuple[Scenario, ...]] = {}

    @cached_property
    def footprint(self) -> Polygon:
        """The robot's footprint, made once."""
        return self._study.footprint

    def candidate(self, proposal: Proposal, n_tags: int | None = None) -> Candidate:
        """The candidate that a proposal is; its tags are laid and counted unless their number is known."""
        if proposal.key not in self._made:
            estimator = proposal.estimator or self._study.file.estimator_names[0]
            if n_tags is None:
                n_tags = self._count(proposal.design.pattern)
            self._made[proposal.key] = Candidate(
                proposal.name, proposal.design, estimator, self._settings_of(proposal, estimator), n_tags,
                self._floor.area_m2, self._scenarios_of(proposal.speed_mm_per_s),
            )  # fmt: skip
        return self._made[proposal.key]

    def of_key(self, key: int) -> Candidate:
        """The candidate made of the proposal with that key."""
        return self._made[key]

    def _count(self, pattern: TagPattern) -> int:
        if pattern not in self._n_tags:
            self._n_tags[pattern] = self._simulator.tags(pattern).n_tags
        return self._n_tags[pattern]

    def _settings_of(self, proposal: Proposal, estimator: str) -> Settings:
        key = (estimator, proposal.n_particles, proposal.speed_mm_per_s)
        if key not in self._settings:
            file = self._study.file
            choice = file
            if proposal.n_particles is not None:
                section = file.settings_of(estimator).model_copy(update={"n_particles": proposal.n_particles})
                choice = file.model_copy(update={SECTIONS[estimator]: section})
            choice = choice.model_copy(update={"estimator": estimator})
            fastest = proposal.speed_mm_per_s or file.scenario.fastest_mm_per_s
            self._settings[key] = estimators_of(choice, file.world, fastest)[estimator]
        return self._settings[key]

    def _scenarios_of(self, speed_mm_per_s: float | None) -> tuple[Scenario, ...]:
        if speed_mm_per_s not in self._scenarios:
            found = scenarios_of(self._study, self._floor)
            if speed_mm_per_s is not None:
                found = tuple(
                    replace(each, routes=replace(each.routes, speeds_mm_per_s=(speed_mm_per_s,))) for each in found
                )
            self._scenarios[speed_mm_per_s] = found
        return self._scenarios[speed_mm_per_s]


class SimulatedBench:
    """Tries proposals for one fleet: prices them and simulates their runs, which are stored by the proposals' keys."""

    def __init__(self, study: Study, floor: Floor, maker: Maker, stored: StoredRuns, n_robots: int):
        self._study = study
        self._maker = maker
        self._stored = stored
        self._site = Site(n_robots, floor.area_m2)

    def fault(self, proposal: Proposal) -> str | None:
        """Why it cannot be built; None if it can."""
        return fault_of(proposal, self._maker.footprint)

    def cost_cents(self, proposal: Proposal) -> int:
        """What it costs, its tags laid and counted."""
        return self._cents(proposal, self._maker.candidate(proposal).n_tags)

    def about_cents(self, proposal: Proposal) -> int:
        """What it costs if its floor takes as many tags as its density says."""
        return self._cents(proposal, round(proposal.design.pattern.tags_per_m2 * self._site.area_m2))

    def begin(self, proposal: Proposal, n_runs: int) -> None:
        """Begin its runs."""
        self._maker.candidate(proposal)
        self._stored.begin(proposal.key, n_runs)

    def runs(self, proposal: Proposal, n_runs: int) -> list[RunMetrics]:
        """Its first runs in the study's own scenario."""
        self._maker.candidate(proposal)
        return self._stored.first(proposal.key, n_runs)[0]

    def _cents(self, proposal: Proposal, n_tags: int) -> int:
        return price_design(self._study, proposal.design, n_tags, self._site).total_cents
