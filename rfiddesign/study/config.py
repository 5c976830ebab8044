"""What a study file may say: keys, types, ranges and defaults.

Lengths are mm, times s; any other unit is a suffix of the key.  `study.schema.json` beside this file is the same as
JSON Schema, for editors.
"""

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from rfiddesign.optimize.assume import ASSUMPTIONS, Assumption
from rfiddesign.study.estimator_config import AUTO, AUTO_ESTIMATORS, EstimatorChoice, EstimatorName
from rfiddesign.study.explore_config import ExploreSection, ParetoSection
from rfiddesign.study.placement_config import PlacementSection
from rfiddesign.study.regimes_config import RegimesSection, check_whole
from rfiddesign.study.requirements_config import FurtherRequirement
from rfiddesign.study.routes_config import RoutesSection
from rfiddesign.study.scenarios_config import Scenarios
from rfiddesign.study.sections import (
    Density,
    Name,
    NotNegative,
    PatternKind,
    Pitch,
    Positive,
    RoutePatternKind,
    Section,
    Share,
)
from rfiddesign.study.shelves_config import ShelvesSection, check_comparable
from rfiddesign.study.survey_config import SurveySection
from rfiddesign.study.variants_config import ComparisonSection, Variants
from rfiddesign.study.world_config import WorldSection


class FloorSection(Section):
    """Where robots drive: a ROS map, or a rectangle."""

    map: Name | None = Field(None, description="map.yaml of a ROS map, relative to the study file")
    rectangle_m: Annotated[list[Positive], Field(min_length=2, max_length=2)] | None = Field(
        None, description="length and width of an empty floor [m]"
    )
    occupied_threshold: Share | None = Field(None, description="occupancy from which a cell is a wall")
    speck_pixels: Annotated[int, Field(ge=0, le=1000)] | None = Field(
        None, description="occupied specks of up to this many pixels are dropped"
    )

    @model_validator(mode="after")
    def _one_floor(self) -> "FloorSection":
        if (self.map is None) == (self.rectangle_m is None):
            raise ValueError("needs exactly one of map and rectangle_m")
        return self


class RobotSection(Section):
    """The robot's body."""

    footprint_radius_mm: Annotated[float, Field(ge=10, le=5_000)] = Field(
        300.0, description="radius of the disc that antennas must keep inside and walls outside [mm]"
    )
    reader: Name = Field("hf-anticollision", description="reader of the catalog")


class FleetSection(Section):
    """How many robots the floor serves; one answer is searched for each."""

    robots: Annotated[list[Annotated[int, Field(ge=1, le=1_000_000)]], Field(min_length=1, max_length=20)] = Field([1])

    @model_validator(mode="after")
    def _distinct(self) -> "FleetSection":
        if len(set(self.robots)) < len(self.robots):
            raise ValueError(f"robots is {self.robots}, must not name a size twice")
        return self


class RequirementSection(Section):
    """Limits that a run must keep to pass."""

    position_mean_mm: Positive | None = None
    position_rms_mm: Positive | None = None
    position_p95_mm: Positive | None = None
    position_max_mm: Positive | None = None
    heading_mean_deg: Positive | None = None
    heading_rms_deg: Positive | None = None
    heading_p95_deg: Positive | None = None
    heading_max_deg: Positive | None = None
    lost_share: Annotated[float, Field(gt=0, le=1)] | None = None
    converged_within_s: Positive | None = None

    @model_validator(mode="after")
    def _some_limit(self) -> "RequirementSection":
        if not self.model_fields_set:
            raise ValueError(f"needs at least one of {', '.join(type(self).model_fields)}")
        return self


class ScenarioSection(Section):
    """How designs are exercised."""

    start: Literal["known", "unknown"] = "known"
    duration_s: Annotated[float, Field(gt=0, le=36_000)] = 60.0
    dt_s: Annotated[float, Field(ge=1e-3, le=10)] = 0.05
    settle_s: NotNegative | None = Field(
        None, description="errors count from here on; default: converged_within_s if the start is unknown, else 0"
    )
    speeds_mm_per_s: Annotated[list[Annotated[float, Field(gt=0, le=10_000)]], Field(min_length=1, max_length=100)] = (
        Field([100.0, 200.0, 300.0])
    )
    aligned_share: Share = 0.5
    headings: Annotated[list[Literal["along", "constant"]], Field(min_length=1, max_length=2)] = Field(
        ["along", "constant"]
    )
    turn_rate_deg_per_s: Annotated[float, Field(ge=0.1, le=3600)] = 60.0
    drive: Literal["floor", "routes"] | None = Field(
        None, description="anywhere on the floor, or along [routes]; default: along routes if the study has any"
    )

    @property
    def fastest_mm_per_s(self) -> float:
        """The highest speed."""
        return max(self.speeds_mm_per_s)


class DesignSection(Section):
    """The design that `evaluate` and `coverage` take where --set does not say otherwise."""

    layout: Name = "cross-8"
    antenna: Name = "60x60"
    pattern: PatternKind = "square"
    tags_per_m2: Density | None = None
    pitch_mm: Pitch | None = None

    @model_validator(mode="after")
    def _one_density(self) -> "DesignSection":
        if self.tags_per_m2 is not None and self.pitch_mm is not None:
            raise ValueError("needs one of tags_per_m2 and pitch_mm, not both")
        return self


class SpaceSection(Section):
    """Values of each variable; the space is every combination of them."""

    layout: Annotated[list[Name], Field(min_length=1, max_length=1000)]
    antenna: Annotated[list[Name], Field(min_length=1, max_length=100)]
    pattern: Annotated[list[PatternKind | RoutePatternKind], Field(min_length=1, max_length=10)]
    tags_per_m2: Annotated[list[Density], Field(min_length=1, max_length=1000)]
    estimator: Annotated[list[EstimatorName], Field(min_length=1, max_length=20)] | None = Field(
        None,
        description='with estimator = "auto": what the search may put on the robots, the preferred one first;'
        f" default: {', '.join(AUTO_ESTIMATORS)}",
    )


class SearchSection(Section):
    """How sure the answer must be, and what is not even tried."""

    hold_probability: Annotated[float, Field(gt=0, lt=1)] = Field(
        0.95, description="a design holds if at least this share of its runs pass"
    )
    fail_probability: Annotated[float, Field(gt=0, lt=1)] = Field(
        0.90, description="a certified design passes more than this share of its runs"
    )
    alpha_refute: Annotated[float, Field(gt=0, le=0.5)] = 0.025
    alpha_certify: Annotated[float, Field(gt=0, le=0.5)] = 0.025
    max_runs: Annotated[int, Field(ge=10, le=100_000)] = 2000
    next_best: Annotated[int, Field(ge=0, le=20)] = 1
    limit_factors: Annotated[list[Positive], Field(max_length=10)] = Field(
        [0.5, 0.75, 1.5, 2.0], description="tighter and looser limits at which the runs made are looked at again"
    )
    cost_tolerance: Annotated[float, Field(ge=0, le=10, allow_inf_nan=False)] = Field(
        0.0, description="a certified design that costs at most this share more than the cheapest possible is enough"
    )
    assume: Annotated[list[Assumption], Field(max_length=len(ASSUMPTIONS))] = Field(
        [], description="designs that are not tried once a stronger one is refuted; nothing proves these assumptions"
    )
    # Left out of what is saved and hashed: a larger budget goes on where a smaller one ended.
    budget_runs: Annotated[int, Field(ge=1, le=10**9)] | None = Field(
        None, exclude=True, description="runs of the whole search at most; the answer says what it did not come to"
    )
    budget_minutes: Annotated[float, Field(gt=0, le=100_000, allow_inf_nan=False)] | None = Field(
        None, exclude=True, description="minutes of the whole search at most; what is found then depends on the machine"
    )
    min_expected_reads: NotNegative = Field(
        0.0, description="heuristic screen: designs with fewer expected reads per poll of all readers are not tried"
    )

    @property
    def is_short(self) -> bool:
        """Whether runs or minutes are limited."""
        return self.budget_runs is not None or self.budget_minutes is not None

    @model_validator(mode="after")
    def _gap(self) -> "SearchSection":
        if not self.fail_probability < self.hold_probability:
            raise ValueError("fail_probability must be below hold_probability")
        return self

    @model_validator(mode="after")
    def _distinct(self) -> "SearchSection":
        if len({1.0, *self.limit_factors}) <= len(self.limit_factors):
            raise ValueError(f"limit_factors is {self.limit_factors}, must not name a factor twice, nor 1")
        if len(set(self.assume)) < len(self.assume):
            raise ValueError(f"assume is {self.assume}, must not name an assumption twice")
        return self


class StudyFile(EstimatorChoice):
    """A study: the question, as data."""

    title: Annotated[str, Field(min_length=1, max_length=200)]
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 1
    estimator: Literal[EstimatorName, "auto"] = Field(
        "mcl", description='the filter on the robots; "auto": the search chooses from space.estimator for each design'
    )
    prices: Name = Field("prices.toml", description="price list, relative to the study file")
    floor: FloorSection
    robot: RobotSection = RobotSection()
    fleet: FleetSection = FleetSection()
    requirement: RequirementSection
    requirements: Annotated[list[FurtherRequirement], Field(max_length=20)] = Field(
        [], description="limits on means and quantiles over all drives, beside those that each drive must keep"
    )
    scenario: ScenarioSection = ScenarioSection()
    routes: RoutesSection | None = Field(None, description="stations, and the routes that robots drive between them")
    scenarios: Scenarios = Field([], description="more scenarios, each of which a design must hold in, too")
    world: WorldSection = WorldSection()
    design: DesignSection = DesignSection()
    layouts: dict[Name, dict[str, Any]] = Field({}, description="layouts of one's own, by name")
    placements: dict[Name, PlacementSection] = Field({}, description="layouts that the program is to find, by name")
    space: SpaceSection | None = None
    explore: ExploreSection | None = None
    pareto: ParetoSection | None = None
    search: SearchSection = SearchSection()
    regimes: RegimesSection | None = Field(None, description="a map of the cheapest design over fleets and floors")
    survey: SurveySection | None = Field(None, description="an as-built survey of the chosen design's floor")
    shelves: ShelvesSection | None = Field(
        None, description="rows of shelves on the floor, and designs that localize by tags on them"
    )
    # Left out of what is saved and hashed: the study's own answer does not depend on them.
    variants: Variants = Field([], exclude=True, description="variants of this study, to be answered and compared")
    comparison: ComparisonSection = Field(ComparisonSection(), exclude=True)

    @property
    def estimator_names(self) -> tuple[str, ...]:
        """The estimators that may be on the robots, the preferred one first."""
        if self.estimator != AUTO:
            return (self.estimator,)
        named = [name for _, names in self._named_estimators() for name in names]
        return tuple(dict.fromkeys(named)) or AUTO_ESTIMATORS

    @property
    def antenna_names(self) -> tuple[str, ...]:
        """The antennas that the search may choose from."""
        explored = [] if self.explore is None else self.explore.ranges.antenna
        return tuple(dict.fromkeys([*([] if self.space is None else self.space.antenna), *explored]))

    def varies(self, name: str) -> bool:
        """Whether an exploration gives each design a value of its own of that variable."""
        return self.explore is not None and getattr(self.explore.ranges, name) is not None

    def _named_estimators(self) -> list[tuple[str, list[EstimatorName]]]:
        """The keys that say what the search may put on the robots, as far as they do, with what they say."""
        found = [("space.estimator", None if self.space is None else self.space.estimator)]
        found.append(("explore.ranges.estimator", None if self.explore is None else self.explore.ranges.estimator))
        return [(key, names) for key, names in found if names is not None]

    @property
    def drives_on_routes(self) -> bool:
        """Whether robots keep to the study's routes."""
        return self.routes is not None and self.scenario.drive != "floor"

    @model_validator(mode="after")
    def _routes_for_all(self) -> "StudyFile":
        if self.routes is None and self.scenario.drive == "routes":
            raise ValueError('scenario.drive = "routes" needs a section [routes]')
        named = [kind for kind in (self.space.pattern if self.space else []) if kind.endswith("routes")]
        if named and not self.drives_on_routes:
            raise ValueError(f'space.pattern "{named[0]}" needs robots that drive along a section [routes]')
        return self

    @model_validator(mode="after")
    def _open_estimator(self) -> "StudyFile":
        for key, _ in self._named_estimators():
            if self.estimator != AUTO:
                raise ValueError(f'{key} needs estimator = "{AUTO}", found "{self.estimator}"')
        return self

    @model_validator(mode="after")
    def _something_to_search(self) -> "StudyFile":
        if self.space is None and self.explore is None:
            raise ValueError("needs at least one of space and explore")
        if self.pareto is not None and self.explore is None:
            raise ValueError("pareto needs explore")
        return self

    @model_validator(mode="after")
    def _whole_regimes(self) -> "StudyFile":
        if self.regimes is not None:
            check_whole(self.search)
            if self.explore is not None:
                raise ValueError("regimes is for listed spaces, not for explore")
        return self

    @model_validator(mode="after")
    def _listed_survey(self) -> "StudyFile":
        if self.survey is not None and self.explore is not None:
            raise ValueError("survey is for listed spaces, not for explore")
        return self

    @model_validator(mode="after")
    def _comparable_shelves(self) -> "StudyFile":
        if self.shelves is not None:
            if self.explore is not None or self.search.is_short:
                raise ValueError("shelves is for listed spaces and whole searches, without explore and budgets")
            limits = [name for name in self.requirement.model_fields_set if getattr(self.requirement, name) is not None]
            check_comparable(
                self.scenario.start, sorted(limits), len(self.scenarios), len(self.requirements), self.floor.rectangle_m
            )
        return self


SCHEMA_PATH = Path(__file__).with_name("study.schema.json")
