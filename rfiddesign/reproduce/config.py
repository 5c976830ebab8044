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
Analysis = Literal["hf_multireader", "navifloor", "smart_floor", "none"]


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
    metrics: Annotated[list[Name], Field(min_length=1, max_length=20)]
    set: dict[str, Any] = Field({}, description="dotted keys of the case and their values")
    runs: Runs | None = None


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


class ReproductionFile(Section):
    """A reproduction: the published system as data."""

    title: Annotated[str, Field(min_length=1, max_length=200)]
    source: Annotated[str, Field(min_length=1, max_length=500)]
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 1
    runs: Runs = Field(100, description="runs per row")
    quick_runs: Runs = Field(5, description="runs per row with --quick")
    analysis: Analysis = Field("none", description="what is worked out beside the rows")
    layouts: dict[Name, dict[str, Any]] = Field({}, description="layouts of its own, by name")
    antennas: dict[Name, AntennaSection] = Field({}, description="antennas that the catalog does not have")
    base: dict[str, Any] = Field({}, description="the case that every row starts from")
    rows: Annotated[list[RowSection], Field(min_length=1, max_length=1000)]

    @model_validator(mode="after")
    def _distinct(self) -> "ReproductionFile":
        seen = set()
        for row in self.rows:
            if (row.table, row.row) in seen:
                raise ValueError(f"rows names ({row.table}, {row.row}) twice")
            seen.add((row.table, row.row))
        return self


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
