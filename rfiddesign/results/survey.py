"""As-built surveys of the chosen design's floor: what `survey.json` holds, and a page is drawn from.

As in `result.json` nothing here depends on when, where or with how many workers the study ran.
"""

from typing import Literal

from pydantic import Field

from rfiddesign.results.study_result import CostLineRecord, MeanRecord, Record

MapName = Literal["nominal", "checked", "surveyed", "true"]
Advice = Literal["pays", "does not pay", "makes it worse"]


class SurveyedMap(Record):
    """Drives with one map on one floor.

    `sigma_mm` is what the filter is told of the map: standard deviation per axis of where tags lie about it; None if it
    cannot be told.
    """

    name: MapName
    sigma_mm: float | None
    n_tags: int
    position_mean_mm: MeanRecord
    position_p95_mm: MeanRecord
    pass_share: MeanRecord


class DenserFloor(Record):
    """A denser floor, and what it costs more than the chosen design's.

    Drives have its dead and swapped tags put right, from the simulation's truth, which is not charged.  `reaches`: the
    mean error is at most that with the surveyed map.
    """

    tags_per_m2: float
    n_tags: int
    extra_cents: int
    position_mean_mm: MeanRecord
    reaches: bool


class TagErrors(Record):
    """How far the tags that were read lie from where a map has them [mm].

    Root mean square per axis, the same of the distance, and the mean of the distance.
    """

    per_axis_rms_mm: float
    radial_rms_mm: float
    radial_mean_mm: float


class SampleTag(Record):
    """A tag for the figure [mm]; `covariance_mm2` is xx, xy, yy; `true_mm` is None if nobody knows."""

    id: int
    status: str
    nominal_mm: tuple[float, float]
    surveyed_mm: tuple[float, float]
    true_mm: tuple[float, float] | None
    covariance_mm2: tuple[float, float, float]


class Mistakes(Record):
    """Tags of one kind: how many there are in truth (None: unknown), were found, were missed, and were no such tags."""

    n_true: int | None
    n_found: int
    n_missed: int | None
    n_false: int | None


class SurveyedFloor(Record):
    """One floor as laid, its survey, and what follows.

    `n_unknown` are reads of ids that the plan does not have.  `laid_mm` is how far off tags lie per axis as their reads
    have it, whatever was declared, `scatter_mm` how far off these places are by themselves, from which less than twice
    as much is hardly told; `is_as_declared` whether that fits.  `before` and `after` are errors of
    the nominal and of the surveyed map (None for a recorded log, whose truth nobody knows), over tags that were read
    and belong where they were found; `distances_*` are those distances, tag by tag, of large floors of every k-th.
    `calibration` is the mean squared error over the covariance said, 2 if that is right.  `early_*` are
    mistakes found after the first two passes.  `gain_mm` is the paired mean saving of the surveyed over the checked
    map.  `cheapest_denser` is the place of the cheapest denser floor that reaches the surveyed error, None if there is
    none.
    """

    installation_error_mm: float
    is_recorded: bool
    n_tags: int
    n_read: int
    n_unseen: int
    n_unknown: int
    reads_per_tag: float
    visits_per_tag: float
    mean_correction_mm: float
    sigma_mm: float
    laid_mm: float
    scatter_mm: float
    is_as_declared: bool
    before: TagErrors | None
    after: TagErrors | None
    calibration: float | None
    distances_before_mm: list[float]
    distances_after_mm: list[float]
    sample: list[SampleTag]
    dead: list[int]
    swapped: list[tuple[int, int]]
    misplaced: list[int]
    dead_counts: Mistakes
    swapped_counts: Mistakes
    early_dead: Mistakes | None
    early_swapped: Mistakes | None
    maps: list[SurveyedMap]
    gain_mm: MeanRecord
    denser: list[DenserFloor]
    cheapest_denser: int | None
    advice: Advice
    reasons: list[str]

    def map(self, name: MapName) -> SurveyedMap:
        """The drives with a map."""
        return next(one for one in self.maps if one.name == name)


class SurveyRecord(Record):
    """The surveys of a study.

    `hours`, `driven_m` and `n_lanes` are those of one survey, whatever the floor's errors are; `hours` of a recorded
    log are the sum of its stretches.
    """

    format: Literal[1] = 1
    version: str
    study_hash: str
    currency: str
    n_robots: int
    design: str
    estimator: str
    tags_per_m2: float
    passes: int
    directions: str
    lane_pitch_mm: float
    speed_mm_per_s: float
    pose_error_mm: float
    heading_error_deg: float
    correlation_s: float
    n_runs: int
    least_gain: float
    hours: float
    driven_m: float
    n_lanes: int
    cost_lines: list[CostLineRecord]
    cost_cents: int
    floors: list[SurveyedFloor] = Field(min_length=1)
