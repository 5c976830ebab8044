"""What a study file may say of exploring a space too large to list, and of a front of several objectives."""

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from rfiddesign.study.estimator_config import EstimatorName
from rfiddesign.study.sections import Name, PatternKind, Positive, Section


class RangeSection(Section):
    """Values from low to high; `step` is the finest difference that can be made."""

    low: Positive
    high: Positive
    step: Positive | None = None
    log: bool = Field(False, description="whether draws spread over the logarithm")


def _range(value: Any) -> Any:
    """A number as the range of that number alone."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return {"low": value, "high": value} if is_number else value


Numbers = Annotated[RangeSection, BeforeValidator(_range, json_schema_input_type=RangeSection | float)]


class RangesSection(Section):
    """The variables: lists of names, and ranges of numbers (or one number, which is then not varied)."""

    kind: Annotated[list[Name], Field(min_length=1, max_length=100)] = Field(
        description="cross, bar, ring, single, or the name of a layout, which is then taken as it is"
    )
    antenna: Annotated[list[Name], Field(min_length=1, max_length=100)]
    pattern: Annotated[list[PatternKind], Field(min_length=1, max_length=10)]
    estimator: Annotated[list[EstimatorName], Field(min_length=1, max_length=20)] | None = None
    tags_per_m2: Numbers = Field(description="default step: 1")
    readers_per_arm: Numbers | None = Field(None, description="of a cross of four arms")
    readers: Numbers | None = Field(None, description="of a bar or ring")
    first_mm: Numbers | None = Field(None, description="of a cross: distance of the first antennas from the centre")
    spacing_mm: Numbers | None = Field(None, description="of a cross or bar: distance between antennas")
    radius_mm: Numbers | None = Field(None, description="of a ring")
    antenna_height_mm: Numbers | None = Field(
        None, description="of the antennas above the floor, in place of the catalog's; all must have detection spheres"
    )
    n_particles: Numbers | None = Field(None, description="of filters that have particles; default step: 50")
    speed_mm_per_s: Numbers | None = Field(
        None, description="the speed at which robots drive, in place of the scenario's; default step: 50"
    )


class ExploreSection(Section):
    """Explore ranges of variables, then name the candidates that are certified."""

    sampler: Literal["tpe", "nsga2", "nsga3", "cmaes", "qmc", "random"] = "tpe"
    n_trials: Annotated[int, Field(ge=1, le=100_000)] = 200
    runs_per_trial: Annotated[int, Field(ge=1, le=10_000)] = 16
    pilot_runs: Annotated[int, Field(ge=1, le=10_000)] = Field(
        8, description="runs after which a trial that is significantly worse than another is stopped"
    )
    n_candidates: Annotated[int, Field(ge=1, le=10_000)] = Field(
        300, description="candidates named for each fleet before the first run of the certification"
    )
    budget_share: Annotated[float, Field(gt=0, lt=1)] = Field(
        0.5, description="share of search.budget_minutes that exploring may take, where there is such a budget"
    )
    importance: Annotated[list[Literal["ped_anova", "fanova", "impurity"]], Field(max_length=3)] = Field(
        ["ped_anova"], description="evaluators of the variables' importance; the last two need scikit-learn"
    )
    ranges: RangesSection


ObjectiveName = Literal[
    "cost", "speed_mm_per_s", "convergence_s", "lost_share", "position_mean_mm", "position_rms_mm", "position_p95_mm",
    "position_max_mm", "heading_mean_rad", "heading_rms_rad", "heading_p95_rad", "heading_max_rad",
]  # fmt: skip


class ParetoSection(Section):
    """Explore for a front of several objectives in place of the cheapest design alone."""

    objectives: Annotated[list[ObjectiveName], Field(min_length=2, max_length=6)] = Field(
        ["cost", "position_p95_mm", "speed_mm_per_s", "convergence_s"],
        description="all as small as can be, but for the speed",
    )
    n_front: Annotated[int, Field(ge=1, le=500)] = Field(30, description="designs that are measured for the front")
    runs: Annotated[int, Field(ge=2, le=100_000)] = Field(100, description="fresh runs of each of them")
    slack: Annotated[float, Field(ge=1, le=8)] = Field(
        2.0, description="designs on the front keep limits this many times as large"
    )

    @model_validator(mode="after")
    def _distinct(self) -> "ParetoSection":
        if len(set(self.objectives)) < len(self.objectives):
            raise ValueError(f"objectives is {self.objectives}, must not name one twice")
        return self
