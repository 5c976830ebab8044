"""From what an exploration found to the records that are saved: `exploration.json` and `pareto.json`."""

from dataclasses import dataclass

from rfiddesign.optimize.explore import (
    FIRST_FRONT_RUN,
    FIRST_RUN,
    Choice,
    Front,
    Objectives,
    Trial,
    Variable,
    Variables,
    importance,
    interactions,
)
from rfiddesign.optimize.explore.score import EXACT
from rfiddesign.results import exploration as records
from rfiddesign.study.design_document import rounded
from rfiddesign.study.exploring import Explored
from rfiddesign.study.load import Study


@dataclass(frozen=True)
class Counted:
    """Number and tags of each candidate, by its proposal's key."""

    numbers: dict[int, int]
    n_tags: dict[int, int]


def exploration_record(
    study: Study, variables: Variables, explored: list[Explored], counted: Counted
) -> records.Exploration:
    """All explorations of a study."""
    section = study.file.explore
    return records.Exploration(
        sampler=section.sampler,
        seed=study.file.seed,
        runs_per_trial=section.runs_per_trial,
        pilot_runs=section.pilot_runs,
        first_run=FIRST_RUN,
        n_designs=variables.n_designs,
        variables=[_variable(variable) for variable in variables.all],
        objectives=["cost"] if study.file.pareto is None else list(study.file.pareto.objectives),
        fleets=[_fleet(study, variables, fleet, counted) for fleet in explored],
    )


def pareto_record(study: Study, explored: list[Explored]) -> records.Pareto:
    """The front of each fleet that has one."""
    section = study.file.pareto
    signs = Objectives(tuple(section.objectives), study.file.scenario.duration_s)
    return records.Pareto(
        objectives=[
            records.ObjectiveRecord(name=name, is_exact=name in EXACT, is_maximised=signs.sign(name) < 0)
            for name in section.objectives
        ],
        slack=section.slack,
        first_run=FIRST_FRONT_RUN,
        fronts=[_front(study, fleet.n_robots, fleet.front) for fleet in explored if fleet.front is not None],
    )


def _variable(variable: Variable) -> records.VariableRecord:
    if isinstance(variable, Choice):
        return records.VariableRecord(name=variable.name, values=list(variable.values))
    return records.VariableRecord(
        name=variable.name, low=variable.low, high=variable.high, step=variable.step, is_log=variable.is_log
    )


def _fleet(study: Study, variables: Variables, fleet: Explored, counted: Counted) -> records.FleetExploration:
    built = [trial for trial in fleet.trials if trial.is_built]
    made = [dict(trial.proposal.values) for trial in built]
    drawn = [
        {name: value for name, value in trial.drawn.items() if name in own}
        for trial, own in zip(built, made, strict=True)
    ]
    scores = [trial.score for trial in built]
    searched = variables.searched
    found = [importance(name, searched, drawn, scores, seed=study.file.seed) for name in study.file.explore.importance]
    return records.FleetExploration(
        n_robots=fleet.n_robots,
        currency=study.prices.currency,
        is_cut_short=fleet.is_cut_short,
        trials=[_trial(study, trial) for trial in fleet.trials],
        named=[
            records.NamedRecord(
                number=counted.numbers[named.proposal.key],
                name=named.proposal.name,
                values=dict(named.proposal.values),
                n_tags=counted.n_tags[named.proposal.key],
                cost_cents=named.cost_cents,
                trial=named.trial,
                is_tried=named.is_tried,
            )
            for named in fleet.named
        ],
        importance=[
            records.ImportanceRecord(
                evaluator=each.evaluator, shares={name: rounded(share) for name, share in each.shares}
            )
            for each in found
        ],
        interactions=[
            records.InteractionRecord(first=each.first, second=each.second, share=rounded(each.share))
            for each in interactions(list(searched), drawn, scores)
        ],
    )


def _trial(study: Study, trial: Trial) -> records.TrialRecord:
    return records.TrialRecord(
        number=trial.number,
        name=trial.proposal.name,
        values=dict(trial.proposal.values),
        cost_cents=trial.cost_cents,
        n_runs=len(trial.runs),
        n_passed=sum(study.requirement.is_met(run) for run in trial.runs),
        score=rounded(trial.score) if trial.is_built else None,
        fault=trial.fault,
        is_stopped=trial.is_stopped,
    )


def _front(study: Study, n_robots: int, front: Front) -> records.FrontOfFleet:
    return records.FrontOfFleet(
        n_robots=n_robots,
        currency=study.prices.currency,
        n_runs=front.n_runs,
        members=[
            records.MemberRecord(
                trial=member.trial.number,
                name=member.trial.proposal.name,
                values=[rounded(value) for value in member.values],
                stderr=[rounded(value) for value in member.stderr],
                chance=rounded(member.chance),
                is_on_front=member.is_on,
            )
            for member in front.members
        ],
        knee=front.knee.index,
        knee_method=front.knee.method,
    )
