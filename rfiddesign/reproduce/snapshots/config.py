"""What the study file of a reproduction of snapshots may say (kind "snapshots")."""

import math
from typing import Annotated, Literal

from pydantic import Field, model_validator

from rfiddesign.estimators.snapshot import SnapshotMcl
from rfiddesign.models.fingerprint import Smoothing
from rfiddesign.models.fingerprint_table import TableGrid
from rfiddesign.models.motion import DifferentialMotion
from rfiddesign.models.step_prior import StepPrior
from rfiddesign.reproduce.config import ReproductionHead
from rfiddesign.simulation.snapshot_drive import DriveSettings
from rfiddesign.study.sections import NotNegative, Positive, Section
from rfiddesign.study.shelves_config import UhfSection

KIND = "snapshots"
Angle = Annotated[float, Field(gt=0, le=3600)]
Share = Annotated[float, Field(gt=0, lt=1)]
Speed = Annotated[float, Field(gt=0, le=10_000)]
Count = Annotated[int, Field(ge=1, le=100)]
WheelNoise = Annotated[float, Field(ge=0, le=1e4)]


class DriveSection(Section):
    """How robots drive and what their odometry and reference localizer are worth."""

    duration_s: Annotated[float, Field(ge=30, le=7200)] = 400.0
    least_speed_mm_per_s: Speed = 450.0
    most_speed_mm_per_s: Speed = 800.0
    wheel_noise_mm_per_sqrt_m: WheelNoise = 10.0
    reference_mm: NotNegative = 30.0
    reference_deg: Annotated[float, Field(ge=0, le=45)] = 1.0
    stamp_share: Annotated[float, Field(ge=0, le=1)] = Field(
        0.5, description="when in an inquiry its pose is taken: 1 is its end, when the reader reports"
    )

    def settings(self) -> DriveSettings:
        """The settings of the simulation."""
        return DriveSettings(
            duration_s=self.duration_s,
            least_speed_mm_per_s=self.least_speed_mm_per_s,
            most_speed_mm_per_s=self.most_speed_mm_per_s,
            motion=DifferentialMotion(self.wheel_noise_mm_per_sqrt_m),
            reference_mm=self.reference_mm,
            reference_rad=math.radians(self.reference_deg),
            stamp_share=self.stamp_share,
        )


class SmoothingSection(Section):
    """The kernel mean (eq. 5) and the prior of a tag's chance (section IV-A)."""

    sigma_mm: Positive = 500.0
    sigma_deg: Angle = 60.0
    beta: Positive = 0.25
    reach: Annotated[float, Field(ge=0.5, le=10)] = 2.0
    threshold: Share = 1e-3
    mass_below: Share = 0.8

    def smoothing(self, sigma_deg: float | None = None) -> Smoothing:
        """The settings of the learned field."""
        prior = StepPrior(self.threshold, self.mass_below)
        return Smoothing(self.sigma_mm, math.radians(sigma_deg or self.sigma_deg), self.beta, self.reach, prior)


class FilterSection(Section):
    """The particle filter and its look-up table."""

    n_particles: Annotated[int, Field(ge=10, le=100_000)] = 2000
    wheel_noise_mm_per_sqrt_m: WheelNoise = 20.0
    cell_mm: Annotated[float, Field(ge=20, le=1000)] = 100.0
    n_headings: Annotated[int, Field(ge=4, le=360)] = 36
    least_support: NotNegative = 1.0
    start_noise_mm: NotNegative = 100.0
    start_noise_deg: Annotated[float, Field(ge=0, le=180)] = 5.0
    weighs_start: bool = Field(False, description="particles from training poses are weighed by the first snapshot too")

    def settings(self, k_prime: int | None, start: str = "snapshots", n_particles: int | None = None) -> SnapshotMcl:
        """The settings of the filter."""
        return SnapshotMcl(
            motion=DifferentialMotion(self.wheel_noise_mm_per_sqrt_m),
            n_particles=n_particles or self.n_particles,
            k_prime=k_prime,
            start=start,
            start_noise_mm=self.start_noise_mm,
            start_noise_rad=math.radians(self.start_noise_deg),
            weighs_start=self.weighs_start,
        )

    def grid(self, factor: float = 1.0) -> TableGrid:
        """The look-up table's resolution, `factor` times as coarse."""
        headings = max(4, round(self.n_headings / factor))
        return TableGrid(self.cell_mm * factor, headings, self.least_support)


class CountsSection(Section):
    """How much is simulated: in `[full]`, and with --quick in `[quick]`."""

    worlds: Count = 3
    folds: Annotated[int, Field(ge=1, le=5)] = 5
    validations: Annotated[int, Field(ge=1, le=10)] = Field(8, description="drives that a training set is held against")
    starts: Count = Field(5, description="starts on each of them")
    table_factor: Annotated[float, Field(ge=1, le=10)] = Field(1.0, description="how much coarser the table is")


class SnapshotsFile(ReproductionHead):
    """A reproduction of localization by snapshots."""

    kind: Literal["snapshots"] = KIND
    n_logs: Annotated[int, Field(ge=2, le=100)] = Field(10, description="drives of a data set")
    lost_m: Positive = Field(1.0, description="a run with a larger mean error has failed [m]")
    uhf: UhfSection = UhfSection()
    drive: DriveSection = DriveSection()
    smoothing: SmoothingSection = SmoothingSection()
    filter: FilterSection = FilterSection()
    full: CountsSection = CountsSection()
    quick: CountsSection = CountsSection(worlds=1, folds=1, validations=1, starts=2, table_factor=2.0)

    @model_validator(mode="after")
    def _enough_logs(self) -> "SnapshotsFile":
        # The most cycles of table IV, and as many training drives.
        if self.n_logs < 9:
            raise ValueError(f"n_logs is {self.n_logs}, must be at least 9: eight to train on and one to localize")
        return self

    def counts(self, *, is_quick: bool) -> CountsSection:
        """How much to simulate."""
        return self.quick if is_quick else self.full
