"""What an exploration tried, named and found out: `exploration.json`, and the front of `pareto.json`.

As in `result.json` nothing here depends on when, where or with how many workers the study ran, but for explorations
that a budget of minutes ended, which say so.
"""

from typing import Literal

from rfiddesign.results.study_result import Record

Value = str | int | float


class VariableRecord(Record):
    """A variable: listed values, or a range with the step that can be made."""

    name: str
    values: list[str] | None = None
    low: float | None = None
    high: float | None = None
    step: float | None = None
    is_log: bool = False


class TrialRecord(Record):
    """A proposal that was tried.

    `values` : of the variables that it is made of.  `score` : margin that most of its runs keep, at most 1 if it seems
    to hold, estimated from `n_runs` runs, of which `n_passed` passed; None: it cannot be built, and `fault` says why.
    """

    number: int
    name: str
    values: dict[str, Value]
    cost_cents: int
    n_runs: int
    n_passed: int
    score: float | None
    fault: str | None
    is_stopped: bool


class NamedRecord(Record):
    """A candidate: its number in `result.json`, its tags, the trial it was or, if not tried, is a neighbour of."""

    number: int
    name: str
    values: dict[str, Value]
    n_tags: int
    cost_cents: int
    trial: int
    is_tried: bool


class ImportanceRecord(Record):
    """Importance of each variable for the score by one evaluator: shares that sum to 1, the largest first."""

    evaluator: str
    shares: dict[str, float]


class InteractionRecord(Record):
    """Share of the score's variance that two variables explain together beyond what they explain one by one."""

    first: str
    second: str
    share: float


class FleetExploration(Record):
    """The exploration for one size of fleet.

    `is_cut_short` : a budget of minutes ended it before all its trials.
    """

    n_robots: int
    currency: str
    is_cut_short: bool
    trials: list[TrialRecord]
    named: list[NamedRecord]
    importance: list[ImportanceRecord]
    interactions: list[InteractionRecord]


class Exploration(Record):
    """All explorations of a study; `n_designs` : how many different designs the ranges hold at their steps."""

    format: Literal[1] = 1
    sampler: str
    seed: int
    runs_per_trial: int
    pilot_runs: int
    first_run: int
    n_designs: int
    variables: list[VariableRecord]
    objectives: list[str]
    fleets: list[FleetExploration]

    def fleet(self, n_robots: int) -> FleetExploration | None:
        """The exploration for a fleet."""
        return next((fleet for fleet in self.fleets if fleet.n_robots == n_robots), None)


class ObjectiveRecord(Record):
    """An objective of a front; an exact one is known without a run."""

    name: str
    is_exact: bool
    is_maximised: bool


class MemberRecord(Record):
    """A design that was measured for a front.

    `values` and `stderr` are in the order of the objectives.  `chance` : that it is on the front, by bootstrap over the
    runs, which all members share.  `is_on_front` goes by the means.
    """

    trial: int
    name: str
    values: list[float]
    stderr: list[float]
    chance: float
    is_on_front: bool


class FrontOfFleet(Record):
    """The front for one size of fleet, by rising cost; `knee` points into `members`."""

    n_robots: int
    currency: str
    n_runs: int
    members: list[MemberRecord]
    knee: int
    knee_method: str


class Pareto(Record):
    """The fronts of a study (`pareto.json`), measured on runs from `first_run` on, which took no part in the choice."""

    format: Literal[1] = 1
    objectives: list[ObjectiveRecord]
    slack: float
    first_run: int
    fronts: list[FrontOfFleet]
