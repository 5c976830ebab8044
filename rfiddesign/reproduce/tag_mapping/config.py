"""What the study file of a tag mapping may say.  Lengths are mm, times s; any other unit is a suffix of the key."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from rfiddesign.reproduce.config import ReproductionHead
from rfiddesign.study.sections import Positive, Section, Share

KIND = "tag_mapping"
Length = Annotated[float, Field(ge=10, le=20_000)]
Decibel = Annotated[float, Field(ge=-40, le=40)]
Runs = Annotated[int, Field(ge=1, le=10_000)]
Ratio = Annotated[float, Field(ge=0.05, le=2)]
Offsets = Annotated[list[Length], Field(min_length=1, max_length=20)]
Sides = Annotated[list[Annotated[float, Field(ge=-180, le=180)]], Field(min_length=1, max_length=16)]
# Of a drive through the office.
MOST_POLLS = 100_000


class MappingSection(Section):
    """The reader and the two models of the paper."""

    cell_mm: Annotated[float, Field(ge=5, le=200)] = 10.0
    radius_mm: Annotated[float, Field(ge=500, le=5_000)] = 3000.0
    distances_mm: Annotated[list[Length], Field(min_length=1, max_length=10)] = Field(
        [700.0, 1000.0, 1400.0, 2000.0], description="communication distances that a poll tries, rising"
    )
    sides_deg: Sides = Field([45.0, -45.0], description="where the antennas look, from ahead to the left")
    fixed_mm: Length = Field(2000.0, description="long axis of the fixed ellipse")
    expanded_mm: Length = Field(2000.0, description="long axis of the expanded range")
    ratio: Ratio = Field(0.35, description="short axis over long one, of all ellipses")
    redundancy: Annotated[float, Field(ge=0, le=2)] = Field(0.2, description="RD / CD of eq. 3")
    core: Share = 0.9
    expanded: Share = 0.7
    outside: Share = 0.5

    @model_validator(mode="after")
    def _rising(self) -> "MappingSection":
        if self.distances_mm != sorted(set(self.distances_mm)):
            raise ValueError("distances_mm must rise")
        if not 0 < self.outside <= self.expanded <= self.core:
            raise ValueError("must be 0 < outside <= expanded <= core")
        return self


class LineSection(Section):
    """A robot drives along a line past one tag, turns and comes back."""

    offsets_mm: Offsets = Field([200.0, 400.0, 800.0, 1000.0], description="between the tag and the line")
    length_mm: Length = Field(3000.0, description="from where the robot begins to where it turns")
    tag_at_mm: Length = Field(2000.0, description="how far along the line the tag is")
    poll_mm: Length = Field(100.0, description="way between two polls")
    free_db: Decibel = Field(-4.5, description="signal without a desk, from that which the distances are named after")
    desk_db: Decibel = Field(1.5, description="signal above a metallic desk")
    runs: Runs = 100
    quick_runs: Runs = 8
    lengths_mm: Offsets = Field([], description="long axes of the ellipses that are tried beside fixed_mm")
    signals_db: list[Decibel] = Field([], max_length=20, description="signals that are tried beside the two")

    @model_validator(mode="after")
    def _on_the_line(self) -> "LineSection":
        if self.tag_at_mm > self.length_mm:
            raise ValueError("tag_at_mm must be at most length_mm")
        if self.poll_mm > self.length_mm:
            raise ValueError("poll_mm must be at most length_mm")
        return self


class FieldSection(Section):
    """A read field in its world, and as the posterior by read field believes it to be."""

    shape: Literal["ellipse", "sector"] = "ellipse"
    ratio: Ratio | None = Field(
        None, description="short axis over long one, of its ellipse and those of the paper's models; default: [mapping]"
    )
    beam_deg: Annotated[float, Field(ge=5, le=170)] = 70.0
    softness: Annotated[float, Field(ge=0, le=1)] = Field(0.0, description="of the logarithm of the distance needed")
    read_probability: Share = 1.0
    believed_softness: Annotated[float, Field(ge=0.01, le=1)] = 0.05
    believed_read_probability: Annotated[float, Field(ge=0.1, le=0.999)] = 0.95


class OfficeSection(Section):
    """A robot wanders along the passages of an office with tags anywhere."""

    side_m: Annotated[float, Field(ge=4, le=100)] = 16.0
    passage_mm: Length = 2000.0
    n_passages: Annotated[int, Field(ge=2, le=20)] = Field(4, description="each way, from wall to wall")
    wall_mm: Annotated[float, Field(ge=0, le=2_000)] = Field(200.0, description="how near the robot comes to a wall")
    n_tags: Annotated[int, Field(ge=1, le=2_000)] = 100
    speed_mm_per_s: Annotated[float, Field(ge=10, le=2_000)] = 200.0
    turn_deg: Annotated[float, Field(ge=1, le=180)] = Field(15.0, description="most that the robot turns in a poll")
    poll_s: Annotated[float, Field(ge=0.01, le=60)] = 1.0
    duration_s: Annotated[float, Field(ge=60, le=36_000)] = 7200.0
    marks_m: Annotated[list[Positive], Field(min_length=1, max_length=20)] = Field(
        [1.0, 2.0, 5.0, 10.0], description="ways after which errors are told"
    )
    runs: Runs = 10
    quick_runs: Runs = 1
    quick_duration_s: Annotated[float, Field(ge=60, le=36_000)] = 1200.0
    paper: FieldSection = Field(FieldSection(), description="the paper's reader")
    uhf: FieldSection = Field(FieldSection(shape="sector"), description="another one")

    @model_validator(mode="after")
    def _passages_fit(self) -> "OfficeSection":
        if self.n_passages * self.passage_mm > 1e3 * self.side_m:
            raise ValueError("passages are wider than the office")
        if max(self.duration_s, self.quick_duration_s) / self.poll_s > MOST_POLLS:
            raise ValueError(f"duration_s and poll_s make more than {MOST_POLLS:,} polls")
        if 2.0 * self.wall_mm >= self.passage_mm:
            raise ValueError("wall_mm leaves nothing of the passages")
        if self.speed_mm_per_s * self.poll_s > self.passage_mm:
            raise ValueError(
                "speed_mm_per_s times poll_s must be at most passage_mm: else no step may stay in a passage"
            )
        if self.marks_m != sorted(set(self.marks_m)):
            raise ValueError("marks_m must rise")
        return self


class TagMappingFile(ReproductionHead):
    """A reproduction of tag_mapping_adaptive_likelihood."""

    kind: Literal["tag_mapping"] = KIND
    mapping: MappingSection = MappingSection()
    line: LineSection = LineSection()
    office: OfficeSection = OfficeSection()
