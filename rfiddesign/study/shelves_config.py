"""What a study file may say of shelves: rows of them on its floor, and what it takes to localize by tags on them."""

import math
from typing import Annotated, Literal

from pydantic import Field, model_validator

from rfiddesign.study.sections import Name, Positive, Section

# What a tabulated field may be made of without filling memory: 2^18 rows of some hundred tags.
MAX_TAGS_PER_M = 100.0
Millimetres = Annotated[float, Field(ge=1, le=1e5, allow_inf_nan=False)]
Count = Annotated[int, Field(ge=1, le=100)]


class ShelfSpaceSection(Section):
    """Values of each variable of a shelf design; the space is every combination of them."""

    tags_per_m: Annotated[list[Annotated[float, Field(gt=0, le=MAX_TAGS_PER_M)]], Field(min_length=1, max_length=50)]
    antenna_pairs: Annotated[list[Literal[1, 2, 4]], Field(min_length=1, max_length=3)] = Field(
        [2], description="antenna pairs on a robot: 1 looks ahead, 2 ahead and to the sides, 4 all around"
    )
    n_cycles: Annotated[list[Annotated[int, Field(ge=1, le=16)]], Field(min_length=1, max_length=16)] = Field(
        [2], description="inquiry cycles of a snapshot"
    )
    training_drives: Annotated[list[Count], Field(min_length=1, max_length=50)]
    k_prime: Annotated[list[Annotated[int, Field(ge=1, le=10_000)]], Field(min_length=1, max_length=20)] = Field(
        [50], description="tags that count in the likelihood of a snapshot"
    )

    @model_validator(mode="after")
    def _distinct(self) -> "ShelfSpaceSection":
        for name in type(self).model_fields:
            values = getattr(self, name)
            if len(set(values)) < len(values):
                raise ValueError(f"{name} is {values}, must not name a value twice")
        return self


class UhfSection(Section):
    """How UHF antennas read, see `models.uhf.UhfField`; what is not given is its default."""

    range_mm: Millimetres | None = None
    most_range_mm: Millimetres | None = None
    fading_db: Annotated[float, Field(ge=0, le=60)] | None = None
    fading_mm: Millimetres | None = None
    day_share: Annotated[float, Field(ge=0, le=1)] | None = None
    tag_db: Annotated[float, Field(ge=0, le=60)] | None = None
    tag_day_db: Annotated[float, Field(ge=0, le=60)] | None = None


class ShelvesSection(Section):
    """Rows of metal shelves on a rectangle, and the other family of designs: UHF tags on their fronts."""

    prices: Name = Field("shelf-prices.toml", description="price list of the shelf designs, relative to the study file")
    depth_mm: Millimetres = Field(1_200.0, description="depth of a row, of two shelves back to back")
    aisle_mm: Millimetres = Field(2_000.0, description="least width of an aisle; rows as many as fit")
    tag_heights_mm: Annotated[list[Millimetres], Field(min_length=1, max_length=20)] = Field(
        [700.0, 1_300.0], description="heights at which the tags of a front sit in turn"
    )
    training_drive_s: Annotated[float, Field(ge=30, le=7_200)] = Field(300.0, description="length of a training drive")
    reference_mm: Annotated[float, Field(ge=0, le=1_000)] = Field(
        30.0, description="standard deviation per axis of the poses that the reference localizer gives in training"
    )
    reference_deg: Annotated[float, Field(ge=0, le=45)] = 1.0
    n_particles: Annotated[int, Field(ge=10, le=100_000)] = 2_000
    noise_factor: Annotated[float, Field(ge=1, le=100)] = Field(
        3.0, description="the filter takes the odometry for so many times as noisy as it is"
    )
    smoothing_mm: Millimetres = Field(500.0, description="bandwidth by way of what a training snapshot speaks for")
    smoothing_deg: Annotated[float, Field(ge=1, le=3_600)] = Field(60.0, description="the same by turn of the antenna")
    cell_mm: Annotated[float, Field(ge=20, le=1_000)] = Field(200.0, description="cells of the look-up table")
    n_headings: Annotated[int, Field(ge=4, le=360)] = Field(36, description="headings of the look-up table")
    max_runs: Annotated[int, Field(ge=10, le=100_000)] | None = Field(
        None, description="runs of a shelf design at most; default: search.max_runs"
    )
    uhf: UhfSection = UhfSection()
    space: ShelfSpaceSection

    @property
    def reference_rad(self) -> float:
        """Standard deviation of the reference's headings [rad]."""
        return math.radians(self.reference_deg)


#: Limits that have a meaning for both families.
COMPARABLE = ("position_", "heading_")
_WORDS = "shelves compares limits on position and heading"


def check_comparable(
    start: str, limits: list[str], n_scenarios: int, n_further: int, rectangle_m: list[Positive] | None
) -> None:
    """Raise ValueError for a study whose question cannot be asked of shelf designs as well.

    Parameters
    ----------
    start : where filters start.
    limits : names of the limits that a drive must keep.
    n_scenarios, n_further : further scenarios, and limits over all drives.
    rectangle_m : the floor, None if it is a map.
    """
    if rectangle_m is None:
        raise ValueError("shelves needs floor.rectangle_m, the hall that the rows stand in")
    if start != "unknown":
        raise ValueError(f'shelves needs scenario.start = "unknown", as snapshots start, found {start!r}')
    for name in limits:
        if not name.startswith(COMPARABLE):
            raise ValueError(f"{_WORDS}; requirement.{name} is made for tagged floors")
    if n_scenarios or n_further:
        raise ValueError(f"{_WORDS} of each drive, in one scenario: without scenarios and requirements")
