"""What a report says of an exploration and of fronts, where `exploration.json` and `pareto.json` exist."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rfiddesign.report.album import Picture
from rfiddesign.report.contents import Contents
from rfiddesign.report.extra import Extra
from rfiddesign.report.figures.exploration import (
    FrontPoints,
    TriedDesigns,
    exploration_figure,
    importance_figure,
    interaction_figure,
    pareto_figure,
)
from rfiddesign.report.tables import Table
from rfiddesign.report.words import count, in_unit, metric_name, percent
from rfiddesign.results.exploration import Exploration, FleetExploration, FrontOfFleet, ObjectiveRecord, Pareto
from rfiddesign.results.folder import EXPLORATION, PARETO, read_record
from rfiddesign.units import money

#: Names of evaluators in figures.
EVALUATORS = {"ped_anova": "PED-ANOVA", "fanova": "fANOVA", "impurity": "mean decrease of impurity"}
SAMPLERS = {
    "tpe": "a tree-structured Parzen estimator",
    "nsga2": "the genetic algorithm NSGA-II",
    "nsga3": "the genetic algorithm NSGA-III",
    "cmaes": "the evolution strategy CMA-ES",
    "qmc": "quasi-random draws",
    "random": "random draws",
}


@dataclass(frozen=True)
class Explored:
    """What the folder knows of an exploration; `pareto` is None without a front."""

    exploration: Exploration
    pareto: Pareto | None


@dataclass(frozen=True)
class FrontPart:
    """What the page says of the front of one fleet."""

    fleet: str
    words: str
    table: Table


def read_explored(folder: Path) -> Explored | None:
    """The exploration in a folder, None without one; StudyError if a file is not what it should be."""
    if not (folder / EXPLORATION).exists():
        return None
    pareto = read_record(folder / PARETO, Pareto) if (folder / PARETO).exists() else None
    return Explored(read_record(folder / EXPLORATION, Exploration), pareto)


def exploration_extra(contents: Contents) -> Extra | None:
    """The section on an exploration; None where nothing was explored."""
    explored = read_explored(contents.folder)
    if explored is None:
        return None
    shown = tuple(explored_pictures(explored, contents))
    title = "How candidates were found"
    return Extra("exploration", title, "exploration.html.jinja", explored_sentences(explored), shown)


def pareto_extra(contents: Contents) -> Extra | None:
    """The section on fronts; None where none was asked for."""
    explored = read_explored(contents.folder)
    if explored is None or explored.pareto is None:
        return None
    shown = tuple(front_pictures(explored.pareto))
    return Extra("pareto", "What can be had at once", "pareto.html.jinja", front_parts(explored), shown)


def explored_pictures(explored: Explored, contents: Contents) -> Iterator[Picture]:
    """Draw the figures of an exploration, one at a time."""
    certified = {
        answer.record.n_robots: answer.record.winner.cost_cents / 100
        for answer in contents.answers
        if answer.record.winner is not None
    }
    for fleet in explored.exploration.fleets:
        key, whose = f"robots-{fleet.n_robots}", f"{count(fleet.n_robots, 'robot')}: "
        figure = exploration_figure(_tried(fleet, certified.get(fleet.n_robots)))
        yield Picture("exploration", f"exploration-{key}", f"{whose}what was tried and named.", figure)
        shares = {EVALUATORS.get(each.evaluator, each.evaluator): each.shares for each in fleet.importance}
        figure = importance_figure(shares)
        yield Picture("importance", f"importance-{key}", f"{whose}which variables decide the error.", figure)
        names = list(fleet.importance[0].shares) if fleet.importance else []
        pairs = {(each.first, each.second): each.share for each in fleet.interactions}
        names = names or sorted({name for pair in pairs for name in pair})
        figure = interaction_figure(names, pairs)
        yield Picture("importance", f"interactions-{key}", f"{whose}which variables act together.", figure)


def front_pictures(pareto: Pareto) -> Iterator[Picture]:
    """Draw the front of each fleet."""
    for front in pareto.fronts:
        figure = pareto_figure(_points(pareto, front))
        whose = f"{count(front.n_robots, 'robot')}: "
        yield Picture("pareto", f"front-{front.n_robots}", f"{whose}the front and its knee.", figure)


def explored_sentences(explored: Explored) -> tuple[str, ...]:
    """How was explored, in sentences."""
    record = explored.exploration
    sampler = SAMPLERS.get(record.sampler, record.sampler)
    stopped = (
        f" at most ({record.pilot_runs} where they were significantly worse than those of a design that costs no more)"
        if record.pilot_runs < record.runs_per_trial
        else ""
    )
    sentences = [
        f"The ranges hold {record.n_designs:,} different designs at the steps that can be made. {sampler[0].upper()}"
        f"{sampler[1:]} proposed designs, each of which was tried on {record.runs_per_trial} drives{stopped}.",
        "A certificate speaks of the candidates that were named after that and before its first drive, and of nothing"
        " else: its drives have other random numbers than those of the exploration.",
    ]
    for fleet in record.fleets:
        n_built = sum(trial.fault is None for trial in fleet.trials)
        n_tried = sum(named.is_tried for named in fleet.named)
        words = (
            f"{count(fleet.n_robots, 'robot')}: {count(len(fleet.trials), 'design')} tried, of which {n_built:,} can be"
            f" built, on {sum(trial.n_runs for trial in fleet.trials):,} drives; {count(len(fleet.named), 'candidate')}"
            f" named, {len(fleet.named) - n_tried:,} of them neighbours of designs tried."
        )
        sentences.append(f"{words} The budget of time ended the exploration early." if fleet.is_cut_short else words)
    return tuple(sentences)


def front_parts(explored: Explored) -> tuple[FrontPart, ...]:
    """The fronts in words and tables."""
    pareto = explored.pareto
    return () if pareto is None else tuple(_front_part(pareto, front) for front in pareto.fronts)


def _front_part(pareto: Pareto, front: FrontOfFleet) -> FrontPart:
    on_front = [i for i, member in enumerate(front.members) if member.is_on_front]
    knee = front.members[front.knee]
    which = "that lies" if front.knee_method.startswith("farthest") else "with the"
    words = (
        f"{len(on_front)} of {count(len(front.members), 'measured design')} are on the front, by means over"
        f" {front.n_runs} drives that took no part in the choice. Its knee is {knee.name}: the member {which}"
        f" {front.knee_method}."
    )
    headers = ("design", *(_short(objective) for objective in pareto.objectives), "chance to be on the front")
    rows = tuple(
        (
            f"{member.name} (knee)" if i == front.knee else member.name,
            *(
                _cell(objective, member.values[j], member.stderr[j], front.currency)
                for j, objective in enumerate(pareto.objectives)
            ),
            percent(member.chance, 0),
        )
        for i, member in enumerate(front.members)
        if member.is_on_front
    )
    return FrontPart(count(front.n_robots, "robot"), words, Table(headers, rows, tuple(range(1, len(headers)))))


def _short(objective: ObjectiveRecord) -> str:
    return {"cost": "cost", "speed_mm_per_s": "speed", "convergence_s": "time to converge"}.get(
        objective.name
    ) or metric_name(objective.name)


def _cell(objective: ObjectiveRecord, value: float, stderr: float, currency: str) -> str:
    if objective.name == "cost":
        return money(round(100 * value), currency)
    if objective.name == "speed_mm_per_s":
        return f"{value:g} mm/s"
    if objective.name == "convergence_s":
        return f"{value:.2f} ± {stderr:.2f} s"
    number, unit = in_unit(objective.name, value)
    return f"{number:.2f} ± {in_unit(objective.name, stderr)[0]:.2f}{unit}"


def _tried(fleet: FleetExploration, certified_cost: float | None) -> TriedDesigns:
    built = [trial for trial in fleet.trials if trial.fault is None]
    named = {each.trial for each in fleet.named if each.is_tried}
    return TriedDesigns(
        cost=np.array([trial.cost_cents / 100 for trial in built]),
        score=np.array([trial.score for trial in built], float),
        is_stopped=np.array([trial.is_stopped for trial in built], bool),
        is_named=np.array([trial.number in named for trial in built], bool),
        neighbour_cost=np.array([each.cost_cents / 100 for each in fleet.named if not each.is_tried]),
        certified_cost=certified_cost,
        currency=fleet.currency,
    )


def _points(pareto: Pareto, front: FrontOfFleet) -> FrontPoints:
    scale = np.array([in_unit(each.name, 1.0)[0] if _is_error(each) else 1.0 for each in pareto.objectives])
    return FrontPoints(
        labels=tuple(_label(each, front.currency) for each in pareto.objectives),
        values=np.array([member.values for member in front.members]) * scale,
        stderr=np.array([member.stderr for member in front.members]) * scale,
        chance=np.array([member.chance for member in front.members]),
        is_on=np.array([member.is_on_front for member in front.members], bool),
        knee=front.knee,
        is_money=tuple(each.name == "cost" for each in pareto.objectives),
    )


def _is_error(objective: ObjectiveRecord) -> bool:
    return objective.name not in ("cost", "speed_mm_per_s", "convergence_s")


def _label(objective: ObjectiveRecord, currency: str) -> str:
    units = {"cost": currency, "speed_mm_per_s": "mm/s", "convergence_s": "s"}
    unit = units.get(objective.name) or in_unit(objective.name, 1.0)[1].strip()
    words = _short(objective)
    if " of the " in words:
        words = words.replace(" of the ", " of\nthe ", 1)
    return f"{words} [{unit}]"
