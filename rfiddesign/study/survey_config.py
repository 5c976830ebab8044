"""What a study file may say of an as-built survey of the chosen design's floor."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field, model_validator

from rfiddesign.models.survey_files import read_survey_log
from rfiddesign.models.survey_log import SurveyLog
from rfiddesign.study.sections import Density, Name, Section, Share

if TYPE_CHECKING:
    from rfiddesign.study.config import StudyFile

InstallationError = Annotated[float, Field(ge=0.5, le=200, allow_inf_nan=False)]
Amount = Annotated[float, Field(ge=0, le=1e7, multiple_of=0.01, allow_inf_nan=False)]


class SurveyPrices(Section):
    """Prices of a survey, in the currency of the price list."""

    per_hour: Amount = Field(description="robot and whoever is with it, per hour of driving")
    per_m: Amount = Field(0.0, description="wear and power, per metre of lanes")
    fixed: Amount = Field(0.0, description="hire and setting up of the reference localizer, evaluation")
    source: Annotated[str, Field(min_length=1, max_length=500)] = Field(description='a source, or "assumption"')


class SurveySection(Section):
    """A survey of the floor as laid, and what is to be known of it.

    For every installation error a floor is laid, surveyed, and driven over with the nominal, the checked, the surveyed
    and the true map.
    """

    installation_errors_mm: Annotated[list[InstallationError], Field(min_length=1, max_length=10)] = Field(
        description="standard deviations per axis of where tags lie about their nominal places, as declared [mm]"
    )
    passes: Annotated[int, Field(ge=1, le=100)] = Field(10, description="times that lanes cover the floor")
    directions: Literal["crossing", "along x", "along y"] = Field(
        "crossing", description="lanes along x and y in turn, or all alike"
    )
    lane_pitch_mm: Annotated[float, Field(ge=20, le=10_000)] = 100.0
    speed_mm_per_s: Annotated[float, Field(ge=10, le=5_000)] = 300.0
    turn_rate_deg_per_s: Annotated[float, Field(ge=1, le=360)] = 60.0
    pose_error_mm: Annotated[float, Field(ge=0, le=500)] = Field(
        20.0, description="standard deviation per axis of the reference localizer's error"
    )
    heading_error_deg: Annotated[float, Field(ge=0, le=20)] = 0.3
    correlation_s: Annotated[float, Field(ge=0.01, le=1e5)] = Field(
        10.0, description="time in which the correlation of the reference's error falls to 1/e"
    )
    dead_share: Share = Field(0.0, description="share of the tags that are dead")
    swapped_pairs: Annotated[int, Field(ge=0, le=1000)] = Field(
        0, description="pairs of tags laid at each other's place"
    )
    runs: Annotated[int, Field(ge=2, le=10_000)] = Field(40, description="drives with each map")
    denser_tags_per_m2: Annotated[list[Density], Field(max_length=40)] = Field(
        [], description="floors that might be laid instead of a survey; default: the densities of the space"
    )
    least_gain: Annotated[float, Field(ge=0, le=1)] = Field(
        0.05, description="share of the error that a survey must save at least to be worth anything"
    )
    prices: SurveyPrices
    log: Name | None = Field(
        None, description="folder of a recorded log (poses.csv, reads.csv, schedule.csv), relative to the study file"
    )

    @model_validator(mode="after")
    def _distinct(self) -> "SurveySection":
        for name in ("installation_errors_mm", "denser_tags_per_m2"):
            values = getattr(self, name)
            if len(set(values)) < len(values):
                raise ValueError(f"{name} is {values}, must not name a value twice")
        if self.log is not None and len(self.installation_errors_mm) > 1:
            raise ValueError("with a log, installation_errors_mm must have one value: what was declared of that floor")
        return self


def recorded_log(path: Path, file: "StudyFile") -> SurveyLog | None:
    """The recorded log that a study's file names, if it does."""
    section = file.survey
    return None if section is None or section.log is None else read_survey_log(path.parent / section.log)
