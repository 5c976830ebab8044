"""Explore for each fleet of a study, name candidates, and keep both in the folder before certification begins."""

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from math import log
from pathlib import Path

from rfiddesign.errors import StudyError
from rfiddesign.floor import Floor
from rfiddesign.optimize import Screen
from rfiddesign.optimize.explore import (
    FIRST_FRONT_RUN,
    FIRST_RUN,
    Front,
    Proposal,
    Trial,
    Variables,
    choose,
    explore,
    measure_front,
    name_candidates,
    propose,
)
from rfiddesign.results import folder as files
from rfiddesign.results.exploration import Exploration
from rfiddesign.simulation.monte_carlo import Job, Simulator
from rfiddesign.study.budget import Budget
from rfiddesign.study.candidates import Candidate, Candidates
from rfiddesign.study.estimators import estimators_of
from rfiddesign.study.explore_document import Counted, exploration_record, pareto_record
from rfiddesign.study.exploring import (
    RANGES,
    Explored,
    Maker,
    SimulatedBench,
    explore_plan,
    fixed_of,
    naming_plan,
)
from rfiddesign.study.load import Study, design_of, scenario_of
from rfiddesign.study.outcomes import StoredRuns
from rfiddesign.study.stages import OnStage, Stage
from rfiddesign.study.storage import RunTable

# Where time is limited: share of that for exploring in which designs are tried; pricing their neighbours has the rest.
TRYING_SHARE = 0.7
# How much of its margin a neighbour is taken to lose for what it spares, as a power of the ratio of prices.
PRICE_OF_MARGIN = 3.0


@dataclass(frozen=True)
class Explorer:
    """What exploring a study takes: floor, folder, the simulator of the certification, and checked variables."""

    study: Study
    floor: Floor
    out: Path
    simulator: Simulator
    variables: Variables
    on_stage: OnStage


def with_explored(explorer: Explorer, listed: Candidates, budget: Budget) -> Candidates:
    """The listed candidates of a study and those that its exploration names.

    What was explored is in the folder before the first run of the certification; a study that goes on takes it from
    there.

    Raises
    ------
    StudyError : if nothing that was tried can be built, or the folder cannot be used.
    """
    study, out = explorer.study, explorer.out
    if not (out / files.EXPLORATION).exists():
        explored, n_tags = _explore_fleets(explorer, budget)
        numbers = _numbered(explored, listed.n_combinations)
        if not numbers and not listed.by_number:
            raise StudyError("no design that was tried can be built", file=study.path, key=RANGES)
        if study.file.pareto is not None:
            files.write_record(out / files.PARETO, pareto_record(study, explored))
        counted = Counted(numbers, n_tags)
        files.write_record(out / files.EXPLORATION, exploration_record(study, explorer.variables, explored, counted))
    record = files.read_record(out / files.EXPLORATION, Exploration)
    named = named_candidates(study, explorer.floor, explorer.simulator, record)
    rule = f"not among the {len(named):,} candidates that exploring {record.n_designs:,} designs has named"
    screen = Screen(rule, "heuristic", record.n_designs - len(named))
    return replace(
        listed,
        n_combinations=listed.n_combinations + record.n_designs,
        screens=(*listed.screens, screen),
        by_number=listed.by_number | named,
        promise=dict.fromkeys(listed.by_number, 0.0) | _promises(record),
    )


def named_candidates(study: Study, floor: Floor, simulator: Simulator, record: Exploration) -> dict[int, Candidate]:
    """The candidates that an exploration named, by number."""
    maker, fixed = Maker(study, floor, simulator), fixed_of(study)
    return {
        each.number: maker.candidate(propose(tuple(each.values.items()), fixed), each.n_tags)
        for fleet in record.fleets
        for each in fleet.named
    }


def _promises(record: Exploration) -> dict[int, float]:
    """How likely candidates seem to hold: the less the margin of the trial that they were, or are beside, the more."""
    promises: dict[int, float] = {}
    for fleet in record.fleets:
        for named in fleet.named:
            trial = fleet.trials[named.trial]
            # What spares cost takes margin, and more than in proportion: floor and project cost the same for all.
            spared = log(max(trial.cost_cents, 1) / max(named.cost_cents, 1))
            promise = -log(trial.score) - (0.0 if named.is_tried else PRICE_OF_MARGIN * spared)
            promises[named.number] = max(promise, promises.get(named.number, promise))
    return promises


def _explore_fleets(explorer: Explorer, budget: Budget) -> tuple[list[Explored], dict[int, int]]:
    """Explore for one fleet after the other; runs are shared, since they know nothing of fleets.

    Returns
    -------
    What was explored, and the tags of each proposal named, by its key.
    """
    study = explorer.study
    with ExitStack() as stack:
        simulator = explorer.simulator
        if study.file.pareto is not None:
            # Errors on a front are those of whole runs, never stopped.
            scenario = scenario_of(study, explorer.floor)
            simulator = stack.enter_context(Simulator(scenario, study.file.seed, simulator.n_workers))
        maker = Maker(study, explorer.floor, simulator)
        kept = [(FIRST_RUN, files.EXPLORE_RUNS)]
        if study.file.pareto is not None:
            kept.append((FIRST_FRONT_RUN, files.FRONT_RUNS))
        tries, *fronts = (
            StoredRuns(_job_of(maker, first), simulator, stack.enter_context(RunTable(explorer.out / name)))
            for first, name in kept
        )
        if budget.minutes is not None:
            _warm_up(study, simulator)
        try:
            found = []
            for place, n_robots in enumerate(study.file.fleet.robots):
                bench = SimulatedBench(study, explorer.floor, maker, tries, n_robots)
                n_left = len(study.file.fleet.robots) - place
                time_used = budget.time_for_one_of(n_left, study.file.explore.budget_share)
                found.append(_explore_one(explorer, place, bench, fronts, time_used))
            named = [each.proposal.key for fleet in found for each in fleet.named]
            return found, {key: maker.of_key(key).n_tags for key in named}
        finally:
            for runs in (tries, *fronts):
                runs.save()


def _warm_up(study: Study, simulator: Simulator) -> None:
    """Compile what nobody ran before: that is not exploring."""
    design = design_of(study)
    for settings in estimators_of(study.file, study.file.world, study.file.scenario.fastest_mm_per_s).values():
        simulator.submit(Job(design, 0, settings)).result()


def _job_of(maker: Maker, first: int) -> Callable[[int, int, int], Job]:
    return lambda key, run, scenario: maker.of_key(key).job(first + run, scenario)


def _explore_one(
    explorer: Explorer,
    place: int,
    bench: SimulatedBench,
    fronts: list[StoredRuns],
    time_used: Callable[[], float] | None,
) -> Explored:
    study = explorer.study
    n_robots, plan, fixed = study.file.fleet.robots[place], explore_plan(study, place), fixed_of(study)

    def show(trials: list[Trial]) -> None:
        left, runs = plan.n_trials - len(trials), sum(len(trial.runs) for trial in trials)
        explorer.on_stage(Stage(f"exploring for {n_robots:,} robots", n_remaining=left, n_runs=runs))

    def is_past(share: float) -> Callable[[], bool]:
        return lambda: time_used is not None and time_used() >= share

    trials = explore(explorer.variables, fixed, bench, plan, is_over=is_past(TRYING_SHARE), on_batch=show)
    explorer.on_stage(Stage("naming candidates"))
    named = name_candidates(trials, explorer.variables, fixed, bench, naming_plan(study), is_over=is_past(1.0))
    front = _front(explorer, trials, place, fronts[0]) if fronts else None
    return Explored(n_robots, tuple(trials), tuple(named), front, len(trials) < plan.n_trials)


def _front(explorer: Explorer, trials: list[Trial], place: int, fronts: StoredRuns) -> Front | None:
    pareto = explorer.study.file.pareto
    plan = explore_plan(explorer.study, place)
    chosen = choose(trials, plan, pareto.n_front)
    if not chosen:
        return None
    explorer.on_stage(Stage(f"measuring {len(chosen)} designs for the front", n_runs=pareto.runs * len(chosen)))
    for trial in chosen:
        fronts.begin(trial.proposal.key, pareto.runs)
    return measure_front(chosen, plan, lambda trial: fronts.first(trial.proposal.key, pareto.runs)[0])


def _numbered(explored: list[Explored], first: int) -> dict[int, int]:
    """A number for each proposal named for any fleet, by its key: those of the listed designs go before."""
    proposals: dict[int, Proposal] = {}
    for fleet in explored:
        for named in fleet.named:
            proposals.setdefault(named.proposal.key, named.proposal)
    return {key: first + place for place, key in enumerate(proposals)}
