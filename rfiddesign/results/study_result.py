"""The answer to a study as data: what `result.json` holds, and all that a report is drawn from.

Nothing here depends on when, where or with how many workers a study ran; that is in `provenance.json`.
"""

from typing import Literal

from pydantic import BaseModel, ConfigDict

Verdict = Literal["certified", "refuted", "undecided"]


class Record(BaseModel):
    """A frozen record that reads and writes itself as JSON; unknown keys are errors."""

    model_config = ConfigDict(extra="forbid", frozen=True, ser_json_inf_nan="null")


class Limit(Record):
    """A limit that a run must keep."""

    metric: str
    limit: float


class RequirementRecord(Record):
    """What a run must keep to pass."""

    limits: list[Limit]
    converged_within_s: float | None


class CriterionRecord(Record):
    """What a design must keep over its runs: a share of them, or a mean of scores, with both thresholds."""

    words: str
    kind: Literal["share", "mean"]
    hold: float
    fail: float


class TestRecord(Record):
    """What was declared of the test before the first run.

    `criteria` has all that a design must keep in the order in which verdicts count them; `assumptions` what was assumed
    to spare runs, in words.
    """

    __test__ = False

    hold_probability: float
    fail_probability: float
    alpha_refute: float
    alpha_certify: float
    n_designs: int
    max_runs: int
    criteria: list[CriterionRecord] = []
    cost_tolerance: float = 0.0
    assumptions: list[str] = []


class AreaRecord(Record):
    """Drivable and navigable area with one threshold of the map changed."""

    name: str
    value: float | None
    area_m2: float
    navigable_m2: float


class FloorRecord(Record):
    """The floor that was tagged."""

    name: str
    source: str
    area_m2: float
    navigable_m2: float
    footprint_radius_mm: float
    sensitivity: list[AreaRecord]


class UnbuildableRecord(Record):
    """A layout that does not take an antenna, or an antenna that may see two tags of a pattern at once."""

    layout: str
    antenna: str
    reason: str


class ScreenRecord(Record):
    """A rule declared before the first run, and how many designs it removed."""

    rule: str
    kind: Literal["heuristic", "proof"]
    n_removed: int


class SpaceRecord(Record):
    """The space: all combinations, what of it can be built, and what was tested.

    `is_named` : candidates were named by an exploration of a larger space, before the first drive of the certification.
    """

    n_combinations: int
    n_unbuildable: int
    unbuildable: list[UnbuildableRecord]
    screens: list[ScreenRecord]
    n_candidates: int
    is_named: bool = False


class Assumption(Record):
    """Something the answer rests on, with where it comes from."""

    what: str
    value: str
    source: str


class MeanRecord(Record):
    """A mean over runs and its standard error."""

    mean: float
    stderr: float | None


class EstimatorRecord(Record):
    """An estimator that may be on the robots: its name in the study, and what it is."""

    name: str
    words: str


class ComputingRecord(Record):
    """What the estimator of a chosen design computes in every step of `dt_s` seconds: operations, about.

    How long that takes depends on the machine and is in `computing.json`.
    """

    estimator: str
    dt_s: float
    flops_per_step: float


class DesignRecord(Record):
    """A design that was tested, with what its consumed runs measured.

    Where the study leaves the estimator open, a design stands here once with each estimator that it was tested with,
    and its name says which.
    `n_complete` of the `n_runs` runs went to their end; the others were stopped once they had certainly failed, and the
    errors in `metrics` (means over all runs) are then those up to the stop.  Of several scenarios `metrics` are those
    of the study's own, and `scenarios` has those of the others.  `tagged_m2` is the floor that is covered and surveyed.
    """

    number: int
    name: str
    estimator: str | None = None
    layout: str
    antenna: str
    pattern: str
    tags_per_m2: float
    n_readers: int
    n_tags: int
    n_runs: int
    n_complete: int
    metrics: dict[str, MeanRecord]
    scenarios: dict[str, dict[str, MeanRecord]] = {}
    tagged_m2: float | None = None


class DecisionRecord(Record):
    """What the search decided of a design, on how many runs, at which cost.

    `refuted_by` is the place of the criterion that refuted it, where there are several.
    """

    design: int
    cost_cents: int
    verdict: Verdict
    n_runs: int
    n_passed: int
    refuted_by: int | None = None


class AssumedRecord(Record):
    """A design that counts as refuted by assumption alone, since `follows_from`, assumed to be no weaker, was."""

    design: int
    cost_cents: int
    follows_from: int


class CostLineRecord(Record):
    """One line of a cost table; quantity and unit price are exact decimals as text."""

    group: str
    item: str
    quantity: str
    unit: str
    unit_price: str
    amount_cents: int
    source: str


class FrontRecord(Record):
    """The cheapest tested design had every limit on an error been `factor` times as large, from the runs made.

    Its verdict is the test's at those limits: unless "certified", the design is an estimate.
    """

    factor: float
    limits: list[Limit]
    decision: DecisionRecord | None


class DriveRecord(Record):
    """Distance that the robot drives from a random pose to its next read, along one heading of the tag lattice.

    Distances are capped at 5 m.
    """

    heading_deg: float
    mean_mm: float
    p95_mm: float
    max_mm: float
    share_over_limit: float
    is_aligned: bool


class CoverageRecord(Record):
    """What the antennas of the chosen design see of its tags, over all lattice phases and headings."""

    k_coverage: list[float]
    expected_reads: float
    two_tags_share: float
    method: str
    stderr: float
    drives: list[DriveRecord]
    warnings: list[str]


class AnswerRecord(Record):
    """The answer for one size of fleet.

    `undecided` lists the designs cheaper than the winner that came to no verdict; `decisions` every design tested,
    those of the winner's own price that lost the race included.  `n_untested` counts the designs cheaper than the
    winner that a budget left untested, `assumed` those that only an assumption refutes.
    """

    n_robots: int
    currency: str
    claim: str
    claim_words: str
    winner: DecisionRecord | None
    cost_lines: list[CostLineRecord]
    runners_up: list[DecisionRecord]
    lower_bound: DecisionRecord | None
    undecided: list[DecisionRecord]
    decisions: list[DecisionRecord]
    n_runs_used: int
    fronts: list[FrontRecord]
    coverage: CoverageRecord | None
    computing: ComputingRecord | None = None
    n_untested: int = 0
    assumed: list[AssumedRecord] = []

    @property
    def gap(self) -> float | None:
        """What the winner costs above the lower bound, as a share of that; None without both."""
        if self.winner is None or self.lower_bound is None:
            return None
        return self.winner.cost_cents / max(self.lower_bound.cost_cents, 1) - 1


class StudyResult(Record):
    """The whole answer.

    `estimators` : those that may be on the robots, the preferred one first; more than one where the study leaves open
    which.
    """

    format: Literal[1] = 1
    version: str
    study: str
    title: str
    seed: int
    study_hash: str
    requirement: RequirementRecord
    test: TestRecord
    floor: FloorRecord
    space: SpaceRecord
    assumptions: list[Assumption]
    estimators: list[EstimatorRecord] = []
    answers: list[AnswerRecord]
    designs: list[DesignRecord]

    @property
    def is_estimator_open(self) -> bool:
        """Whether the search chose the estimator."""
        return len(self.estimators) > 1


class TraceRecord(Record):
    """Errors of one run of a chosen design over time."""

    n_robots: int
    run: int
    time_s: list[float]
    position_error_mm: list[float]
    heading_error_rad: list[float]


class Traces(Record):
    """Some runs of the chosen designs (`traces.json`)."""

    traces: list[TraceRecord]


class AntennaPose(Record):
    """Where an antenna sits on the robot."""

    x_mm: float
    y_mm: float
    yaw_rad: float


class ChosenDesign(Record):
    """A chosen design as the workshop needs it (`design.json`)."""

    name: str
    n_robots: int
    layout: str
    antennas: list[AntennaPose]
    antenna: str
    antenna_housing_mm: tuple[float, float]
    antenna_height_mm: float | None = None
    antenna_source: str
    footprint_radius_mm: float
    pattern: str
    tags_per_m2: float
    lattice_basis_mm: list[tuple[float, float]] | None
    pattern_seed: int
    n_tags: int
    cost_cents: int
    currency: str
    estimator: str | None = None
