"""What a study file may say of readers that the program is to place: `[placements.NAME]`."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from rfiddesign.study.sections import Density, Name, PatternKind, Pitch, Positive, Section

Box = Annotated[
    list[Annotated[float, Field(ge=-5_000, le=5_000, allow_inf_nan=False)]], Field(min_length=4, max_length=4)
]


class PlacementSection(Section):
    """A layout to be found: its readers are mounted so that reads come in time over one lattice of tags."""

    antenna: Name = "60x60"
    pattern: PatternKind = Field("square", description="tags for which readers are placed: a lattice")
    tags_per_m2: Density | None = None
    pitch_mm: Pitch | None = None
    distance_mm: Positive = Field(description="driven straight on, from anywhere, before the reads have come [mm]")
    n_readers: Annotated[int, Field(ge=1, le=200)] | None = Field(None, description="default: the fewest")
    n_reads: Annotated[int, Field(ge=1, le=20)] = Field(1, description="different readers that must read")
    motions: Annotated[list[Literal["forward", "sideways", "turning"]], Field(min_length=1, max_length=3)] = Field(
        ["forward"]
    )
    is_one_dead: bool = Field(False, description="also with any one reader dead")
    turn_deg: Annotated[float, Field(ge=1, le=360)] = Field(
        180.0, description="turned on the spot before the reads have come, where motions name turning"
    )
    grid_mm: Annotated[float, Field(ge=1, le=1_000)] = Field(25.0, description="distance between mount points [mm]")
    keep_outs_mm: Annotated[list[Box], Field(max_length=100)] = Field(
        [], description="boxes x0, y0, x1, y1 under the robot that housings must not enter [mm]"
    )
    allowed_share: Annotated[float, Field(ge=0, le=0.5)] = Field(
        0.0, description="share of sampled poses that may stay without their reads"
    )

    @model_validator(mode="after")
    def _one_density(self) -> "PlacementSection":
        if (self.tags_per_m2 is None) == (self.pitch_mm is None):
            raise ValueError("needs exactly one of tags_per_m2 and pitch_mm")
        return self
