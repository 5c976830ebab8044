"""What the files of a reproduction may say: cases to simulate, and what was published of them.

Lengths are mm, times s; any other unit is a suffix of the key.
"""

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from rfiddesign.study.estimator_config import EstimatorChoice
from rfiddesign.study.sections import Density, Name, NotNegative, PatternKind, Pitch, Positive, Section
from rfiddesign.study.world_config import WorldSection

Coordinate = Annotated[float, Field(ge=-1e6, le=1e6)]
Point = Annotated[list[Coordinate], Field(min_length=2, max_length=2)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Runs = Annotated[int, Field(ge=1, le=100_000)]
Analysis = Literal["hf_multireader", "navifloor", "robustness", "smart_floor", "none"]
Metrics = Annotated[list[Name], Field(min_length=1, max_length=20)]
# Keys that tell some cases from others: dotted keys of the case and their values.
Changes = dict[str, Any]
# An estimator and a condition together name a row.
NamePart = Annotated[str, Field(max_length=49, pattern=r"^[^\x00-\x1f\x7f]+$")]
MAX_ROWS = 1000
# The kind of reproduction whose study file need not name it.
FLOOR = "floor"


class RouteSection(Section):
    """Where the robot drives: a circle, a polyline, or legs at random over the floor."""

    kind: Literal["circle", "polyline", "random"] = "circle"
    centre_mm: Point | None = Field(None, description="of a circle; default: the middle of the floor")
    radius_mm: Positive = 1000.0
    laps: Annotated[float, Field(gt=0, le=100)] = 1.0
    start_deg: Annotated[float, Field(ge=-360, le=360)] = Field(0.0, description="where on a circle the route begins")
    waypoints_mm: Annotated[list[Point], Field(min_length=2, max_length=10_000)] | None = None
    speed_mm_per_s: Annotated[float, Field(gt=0, le=10_000)] = 100.0
    heading_deg: Annotated[float, Field(ge=-3600, le=3600)] | None = Field(
        None, description="heading held all the way; default: the robot faces where it drives"
    )
    turn_rate_deg_per_s: Annotated[float, Field(ge=0.1, le=1e5)] = 60.0
    stay_s: NotNegative = 0.0
    shift_mm: NotNegative = Field(0.0, description="each run shifts the route by up to half of this")
    is_turned: bool = Field(False, description="each run turns the route by any angle")
    aligned_share: Annotated[float, Field(ge=0, le=1)] = 0.5

    @model_validator(mode="after")
    def _waypoints(self) -> "RouteSection":
        if (self.kind == "polyline") != (self.waypoints_mm is not None):
            raise ValueError("waypoints_mm belongs to a route of kind polyline, which needs it")
        return self


class CaseSection(EstimatorChoice):
    """One thing to simulate: a design, its filter, its drive, its world."""

    layout: Name = "single"
    antenna: Name = "60x60"
    pattern: PatternKind = "square"
    tags_per_m2: Density | None = None
    pitch_mm: Pitch | None = None
    floor_m: Annotated[list[Positive], Field(min_length=2, max_length=2)] = Field([6.0, 6.0])
    route: RouteSection = RouteSection()
    world: WorldSection = WorldSection()
    start: Literal["known", "unknown", "two_tags"] = "known"
    start_offset_mm: Point = Field([0.0, 0.0])
    start_offset_rad: Annotated[float, Field(ge=-10, le=10)] = 0.0
    dt_s: Annotated[float, Field(ge=1e-3, le=10)] = 0.05
    duration_s: Annotated[float, Field(gt=0, le=36_000)] | None = Field(None, description="default: the whole route")
    settle_s: NotNegative = 0.0
    scores_standing_only: bool = Field(False, description="errors count only while the robot stands at a corner")

    @model_validator(mode="after")
    def _one_density(self) -> "CaseSection":
        if (self.tags_per_m2 is None) == (self.pitch_mm is None):
            raise ValueError("needs exactly one of tags_per_m2 and pitch_mm")
        return self


class RowSection(Section):
    """A row of a published table, or one beside it: the case is the base with `set` on top."""

    table: Name
    row: Name
    metrics: Metrics
    set: Changes = Field({}, description="dotted keys of the case and their values")
    runs: Runs | None = None


class GridSection(Section):
    """Rows written at once: in every table each estimator under each condition, as row "estimator condition".

    The case of a row is the base with the keys of its table, its estimator and its condition on top, in this order.
    """

    metrics: Metrics
    tables: Annotated[dict[Name, Changes], Field(min_length=1)]
    estimators: Annotated[dict[NamePart, Changes], Field(min_length=1)]
    conditions: Annotated[dict[NamePart, Changes], Field(min_length=1)]
    only: dict[str, list[str]] = Field({}, description="conditions of an estimator; default: all")
    runs: Runs | None = None

    @model_validator(mode="after")
    def _known_names(self) -> "GridSection":
        for estimator, conditions in self.only.items():
            for name, known in ((estimator, self.estimators), *((name, self.conditions) for name in conditions)):
                if name not in known:
                    raise ValueError(f"only names {name!r}, must be one of {', '.join(known)}")
        return self

    @property
    def pairs(self) -> list[tuple[str, str]]:
        """Estimators with their conditions."""
        return [
            (estimator, condition)
            for estimator in self.estimators
            for condition in self.conditions
            if condition in self.only.get(estimator, self.conditions)
        ]

    @property
    def n_rows(self) -> int:
        """How many rows that makes."""
        return len(self.tables) * len(self.pairs)

    def rows(self) -> list[RowSection]:
        """The rows, table by table."""
        return [
            RowSection(
                table=table, row=f"{estimator} {condition}", metrics=self.metrics, runs=self.runs,
                set={**changes, **self.estimators[estimator], **self.conditions[condition]},
            )
            for table, changes in self.tables.items()
            for estimator, condition in self.pairs
        ]  # fmt: skip


class AntennaSection(Section):
    """An antenna that the catalog does not have: what it sees of the floor."""

    disc_radius_mm: Positive | None = None
    rectangle_mm: Annotated[list[Positive], Field(min_length=2, max_length=2)] | None = None
    source: Annotated[str, Field(min_length=1, max_length=500)]

    @model_validator(mode="after")
    def _one_area(self) -> "AntennaSection":
        if (self.disc_radius_mm is None) == (self.rectangle_mm is None):
            raise ValueError("needs exactly one of disc_radius_mm and rectangle_mm")
        return self


class ReproductionHead(Section):
    """What the study file of every kind of reproduction says."""

    kind: str
    title: Annotated[str, Field(min_length=1, max_length=200)]
    source: Annotated[str, Field(min_length=1, max_length=500)]
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 1


class ReproductionFile(ReproductionHead):
    """A reproduction of floor systems: the published ones as data."""

    kind: Literal["floor"] = FLOOR
    runs: Runs = Field(100, description="runs per row")
    quick_runs: Runs = Field(5, description="runs per row with --quick")
    analysis: Analysis = Field("none", description="what is worked out beside the rows")
    layouts: dict[Name, dict[str, Any]] = Field({}, description="layouts of its own, by name")
    antennas: dict[Name, AntennaSection] = Field({}, description="antennas that the catalog does not have")
    base: dict[str, Any] = Field({}, description="the case that every row starts from")
    rows: list[RowSection] = Field([])
    grids: list[GridSection] = Field([], description="rows written at once; they come before those of `rows`")

    @model_validator(mode="after")
    def _distinct(self) -> "ReproductionFile":
        n_rows, seen = len(self.rows) + sum(grid.n_rows for grid in self.grids), set()
        if not 1 <= n_rows <= MAX_ROWS:
            raise ValueError(f"rows and grids make {n_rows:,} rows, must be from 1 to {MAX_ROWS:,}")
        for row in self.with_grids().rows:
            if (row.table, row.row) in seen:
                raise ValueError(f"rows names ({row.table}, {row.row}) twice")
            seen.add((row.table, row.row))
        return self

    def with_grids(self) -> "ReproductionFile":
        """The same file with the rows of its grids written out, before those given one by one."""
        written = [row for grid in self.grids for row in grid.rows()]
        return self.model_copy(update={"rows": [*written, *self.rows]})


class ClaimSection(Section):
    """A bound that a measured number must keep."""

    table: Name
    row: Name
    metric: Name
    at_least: Finite | None = None
    at_most: Finite | None = None

    @model_validator(mode="after")
    def _some_bound(self) -> "ClaimSection":
        if self.at_least is None and self.at_most is None:
            raise ValueError("needs at_least or at_most")
        return self


class ExpectedFile(Section):
    """What was published: numbers by table, row and metric; and what is claimed of the measured ones."""

    published: dict[Name, dict[Name, dict[Name, Finite]]] = Field({})
    claims: list[ClaimSection] = Field([])
