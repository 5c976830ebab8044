"""Explore for each fleet of a study, name candidates, and keep both in the folder before certification begins."""

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
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
from rfiddesign.study.candidates import Candidates
from rfiddesign.study.explore_document import exploration_record, pareto_record
from rfiddesign.study.exploring import (
    RANGES,
    Explored,
    Maker,
    SimulatedBench,
    check_explore,
    explore_plan,
    fixed_of,
    naming_plan,
)
from rfiddesign.study.load import Study, scenario_of
from rfiddesign.study.outcomes import StoredRuns
from rfiddesign.study.pipeline import loosest
from rfiddesign.study.stages import OnStage, Stage
from rfiddesign.study.storage import RunTable


def with_explored(
    study: Study, floor: Floor, out: Path, simulator: Simulator, listed: Candidates, budget: Budget, on_stage: OnStage
) -> Candidates:
    """The listed candidates of a study and those that its exploration names, as far as it has one.

    What was explored is in the folder before the first run of the certification; a study that goes on takes it from
    there.
    """
    if study.file.explore is None:
        return listed
    variables, fixed = check_explore(study, floor), fixed_of(study)
    maker = Maker(study, floor, simulator)
    first = listed.n_combinations
    if not (out / files.EXPLORATION).exists():
        explored = _explore_fleets(study, floor, out, simulator, variables, budget, on_stage)
        numbers = _numbered(explored, first)
        if not numbers and not listed.by_number:
            raise StudyError("no design that was tried can be built", file=study.path, key=RANGES)
        if study.file.pareto is not None:
            files.write_record(out / files.PARETO, pareto_record(study, explored))
        files.write_record(out / files.EXPLORATION, exploration_record(study, variables, explored, numbers))
    on_stage(Stage("laying tags for the named candidates"))
    record = files.read_record(out / files.EXPLORATION, Exploration)
    by_number = dict(listed.by_number)
    for fleet in record.fleets:
        for named in fleet.named:
            by_number[named.number] = maker.candidate(propose(tuple(named.values.items()), fixed))
    rule = f"exploring {variables.n_designs:,} designs and naming {len(by_number) - len(listed.by_number):,} of them"
    screen = Screen(rule, "heuristic", variables.n_designs - (len(by_number) - len(listed.by_number)))
    return replace(
        listed,
        n_combinations=listed.n_combinations + variables.n_designs,
        screens=(*listed.screens, screen),
        by_number=by_number,
        promise=listed.promise if len(by_number) == len(listed.by_number) else {},
    )


def _explore_fleets(
    study: Study, floor: Floor, out: Path, simulator: Simulator, variables: Variables, budget: Budget,
    on_stage: OnStage,
) -> list[Explored]:  # fmt: skip
    """Explore for one fleet after the other; runs are shared, since they know nothing of fleets."""
    fleets = study.file.fleet.robots
    with ExitStack() as stack:
        bench_simulator = stack.enter_context(
            # Errors on a front are those of whole runs.
            Simulator(
                scenario_of(study, floor), study.file.seed, simulator.n_workers,
                None if study.file.pareto is not None else loosest(study),
            )
        )  # fmt: skip
        maker = Maker(study, floor, bench_simulator)
        tries, fronts = (
            StoredRuns(_job_of(maker, first), bench_simulator, stack.enter_context(RunTable(out / name)))
            for first, name in ((FIRST_RUN, files.EXPLORE_RUNS), (FIRST_FRONT_RUN, files.FRONT_RUNS))
        )
        try:
            found = []
            for place, n_robots in enumerate(fleets):
                bench = SimulatedBench(study, floor, maker, tries, n_robots)
                time_used = budget.time_for_one_of(len(fleets) - place, study.file.explore.budget_share)
                found.append(_explore_one(study, place, bench, variables, fronts, time_used, on_stage))
            return found
        finally:
            tries.save()
            fronts.save()


def _job_of(maker: Maker, first: int) -> Callable[[int, int, int], Job]:
    return lambda key, run, scenario: maker.of_key(key).job(first + run, scenario)


def _explore_one(
    study: Study, place: int, bench: SimulatedBench, variables: Variables, fronts: StoredRuns,
    time_used: Callable[[], float] | None, on_stage: OnStage,
) -> Explored:  # fmt: skip
    n_robots, plan, fixed = study.file.fleet.robots[place], explore_plan(study, place), fixed_of(study)

    def show(trials: list[Trial]) -> None:
        left, runs = plan.n_trials - len(trials), sum(len(trial.runs) for trial in trials)
        on_stage(Stage(f"exploring for {n_robots:,} robots", n_remaining=left, n_runs=runs))

    trials = explore(
        variables, fixed, bench, plan, is_over=lambda: time_used is not None and time_used() >= 1.0, on_batch=show
    )
    on_stage(Stage("naming candidates"))
    named = name_candidates(trials, variables, fixed, bench, naming_plan(study))
    return Explored(
        n_robots, tuple(trials), tuple(named), _front(study, trials, place, fronts, on_stage),
        len(trials) < plan.n_trials,
    )  # fmt: skip


def _front(study: Study, trials: list[Trial], place: int, fronts: StoredRuns, on_stage: OnStage) -> Front | None:
    pareto = study.file.pareto
    if pareto is None:
        return None
    plan = explore_plan(study, place)
    chosen = choose(trials, plan, pareto.n_front)
    if not chosen:
        return None
    on_stage(Stage(f"measuring {len(chosen)} designs for the front", n_runs=pareto.runs * len(chosen)))
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
