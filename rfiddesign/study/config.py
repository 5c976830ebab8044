"""What a study file may say: keys, types, ranges and defaults.

Lengths are mm, times s; any other unit is a suffix of the key.  `study.schema.json` beside this file is the same as
JSON Schema, for editors.
"""

from decimal import Decimal
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

Positive = Annotated[float, Field(gt=0, le=1e9, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, le=1e9, allow_inf_nan=False)]
Share = Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)]
Density = Annotated[float, Field(gt=0, le=10_000, allow_inf_nan=False)]
Pitch = Annotated[float, Field(ge=10, le=100_000, allow_inf_nan=False)]
Name = Annotated[str, Field(max_length=100, pattern=r"^[^\x00-\x1f\x7f]+$")]
PatternKind = Literal["square", "triangular", "random", "striped", "thinned"]


class Section(BaseModel):
    """A table of the file: unknown keys and wrong types are errors."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


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

    robots: Annotated[list[Annotated[int, Field(ge=1, le=1_000_000)]], Field(min_length=1, max_length=20)] = [1]

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
    speeds_mm_per_s: Annotated[list[Annotated[float, Field(gt=0, le=10_000)]], Field(min_length=1, max_length=100)] = [
        100.0,
        200.0,
        300.0,
    ]
    aligned_share: Share = 0.5
    headings: Annotated[list[Literal["along", "constant"]], Field(min_length=1, max_length=2)] = ["along", "constant"]
    turn_rate_deg_per_s: Annotated[float, Field(ge=0.1, le=3600)] = 60.0


class OdometrySection(Section):
    """Noise of the odometry, by a model of the robot's drive.

    "omnidirectional": white noise of the velocity (hf_multireader_mcl, eq. 1), `noise_mm_per_s` and `noise_rad_per_s`.
    "mecanum": noise that grows with the way, `noise_mm_per_sqrt_m`, `noise_sideways_mm_per_sqrt_m` (as forward unless
    given), `noise_rad_per_sqrt_m`, and with turns, `noise_rad_per_sqrt_rad`.  "differential": noise of two wheels
    `track_mm` apart, `wheel_noise_mm_per_sqrt_m`.
    """

    model: Literal["omnidirectional", "mecanum", "differential"] = "omnidirectional"
    noise_mm_per_s: Annotated[float, Field(ge=0, le=1e5)] | None = None
    noise_rad_per_s: Annotated[float, Field(ge=0, le=1e3)] | None = None
    noise_mm_per_sqrt_m: Annotated[float, Field(ge=0, le=1e5)] | None = None
    noise_sideways_mm_per_sqrt_m: Annotated[float, Field(ge=0, le=1e5)] | None = None
    noise_rad_per_sqrt_m: Annotated[float, Field(ge=0, le=1e3)] | None = None
    noise_rad_per_sqrt_rad: Annotated[float, Field(ge=0, le=1e3)] | None = None
    wheel_noise_mm_per_sqrt_m: Annotated[float, Field(ge=0, le=1e5)] | None = None
    track_mm: Annotated[float, Field(ge=10, le=1e5)] | None = None

    @model_validator(mode="after")
    def _own_noise(self) -> "OdometrySection":
        own = ODOMETRY_KEYS[self.model]
        for key in self.given():
            if key not in own:
                raise ValueError(f"{key} has no meaning for model {self.model!r}, only {', '.join(own)}")
        return self

    def given(self) -> dict[str, float]:
        """The noises that the file gives."""
        return {key: value for key, value in self.model_dump(exclude={"model"}).items() if value is not None}


#: Noises of each model of the odometry.
ODOMETRY_KEYS = {
    "omnidirectional": ("noise_mm_per_s", "noise_rad_per_s"),
    "mecanum": (
        "noise_mm_per_sqrt_m", "noise_sideways_mm_per_sqrt_m", "noise_rad_per_sqrt_m", "noise_rad_per_sqrt_rad",
    ),
    "differential": ("wheel_noise_mm_per_sqrt_m", "track_mm"),
}  # fmt: skip


class FaultsSection(Section):
    """What is systematically wrong with the odometry."""

    scale_x: Annotated[float, Field(ge=-0.5, le=0.5)] = Field(0.0, description="relative error of ways forward")
    scale_y: Annotated[float, Field(ge=-0.5, le=0.5)] = Field(0.0, description="relative error of ways sideways")
    drift_rad_per_m: Annotated[float, Field(ge=-10, le=10)] = 0.0
    slips_per_m: Annotated[float, Field(ge=0, le=1000)] = Field(0.0, description="wheel slips per metre of way")
    slip_mm: Annotated[float, Field(ge=0, le=1e4)] = 0.0
    slip_rad: Annotated[float, Field(ge=0, le=3)] = 0.0


class WorldSection(Section):
    """What is true, whatever the estimator believes."""

    odometry: OdometrySection = OdometrySection()
    faults: FaultsSection = FaultsSection()
    read_probability: Share = 1.0
    polling: Literal["common", "staggered", "multiplexed"] = "common"
    poll_s: Annotated[float, Field(ge=1e-5, le=10)] = Field(0.01, description="time of one poll of a multiplexer")
    read_time_s: Annotated[float, Field(ge=0, le=10)] = Field(
        0.0, description="a tag answers if it has been in the field for this long"
    )
    delay_s: Annotated[float, Field(ge=0, le=10)] = Field(0.0, description="how late a read reaches the filter")
    answers: Literal["one", "all"] = Field("one", description="tags in view that answer to a poll")
    installation_error_mm: Annotated[float, Field(ge=0, le=1000)] = 0.0


Believed = Annotated[
    OdometrySection | None, Field(description="noise that the filter believes in; default: the true one")
]
Particles = Annotated[int, Field(ge=2, le=1_000_000)]


class MclSection(Section):
    """Monte-Carlo localization, and what it believes of the robot."""

    likelihood: Literal["gaussian", "combination"] = "combination"
    sigma_per_radius: Annotated[float, Field(ge=0.01, le=100)] = 1.1
    beta: Annotated[float, Field(gt=0, le=1)] = 0.3
    n_particles: Particles = 500
    reinitialize: bool = True
    alpha: Annotated[float, Field(gt=0, le=1)] = 1e-6
    is_age_compensated: bool = True
    odometry: Believed = None


class FieldSection(Section):
    """What a filter with the detection field as likelihood believes of the readers."""

    uses_rssi: bool = True
    learns_from_nothing: bool = Field(
        True, description="a poll without a read speaks against places with a tag in view"
    )
    softness_mm: Annotated[float, Field(ge=0, le=1e4)] | None = Field(
        None, description="blur of the field's border; default: 1 mm and the installation error, squares added"
    )
    read_probability: Annotated[float, Field(ge=0.01, le=0.999)] | None = Field(
        None, description="default: the true one, at most 0.98"
    )
    is_age_compensated: bool = True
    odometry: Believed = None


class ParticleFilterSection(FieldSection):
    """Particle filter with the detection field as likelihood (rssi_kalman_navifloor, section IV-C)."""

    n_particles: Particles = 500
    reinitialize: bool = True


class EkfSection(Section):
    """Quantized or constrained extended Kalman filter (rssi_kalman_navifloor, section IV)."""

    uses_rssi: bool = True
    read_noise_mm: Annotated[float, Field(ge=0.1, le=1e4)] | None = Field(
        None, description="sigma of a read; default: 3 mm and the installation error, squares added"
    )
    pushes_out: bool = Field(False, description="rule 3 of the constrained filter, for both")
    patience: Annotated[int, Field(ge=0, le=1_000_000)] = 3
    is_age_compensated: bool = True
    odometry: Believed = None


class MarkovSection(Section):
    """Markov localization on a moving grid with Kalman heading (markov_kalman_smart_floor)."""

    n_cells: Annotated[int, Field(ge=3, le=1001)] = 141
    cell_mm: Annotated[float, Field(ge=0.1, le=1000)] = 10.0
    sigma_per_radius: Annotated[float, Field(ge=0.01, le=100)] = 0.5
    corrects_heading: bool = True
    baseline_mm: Annotated[float, Field(ge=1, le=1e5)] = 300.0
    is_age_compensated: bool = True
    odometry: Believed = None


class GeometricSection(Section):
    """The methods without probabilities of table 1 of hf_multireader_mcl, and dead reckoning."""

    uses_odometry: bool = Field(True, description="between reads; else the last pose is held")
    window: Annotated[int, Field(ge=1, le=10_000)] = Field(40, description="sightings or steps looked back on")
    is_age_compensated: bool = True
    odometry: Believed = None


class HistogramSection(FieldSection):
    """The exact reference: a histogram over the pose in a moving window."""

    cell_mm: Annotated[float, Field(ge=0.5, le=100)] = 6.0
    cell_deg: Annotated[float, Field(ge=0.05, le=15)] = 1.5
    n_cells: Annotated[int, Field(ge=11, le=501)] = 91
    n_headings: Annotated[int, Field(ge=11, le=241)] = 41


EstimatorName = Literal[
    "mcl", "particle_filter", "quantized_ekf", "constrained_ekf", "markov", "rigid_fit", "trigonometric",
    "motion_continuity", "weighted_centre", "odometry", "histogram",
]  # fmt: skip


#: The table that sets each estimator.
SECTIONS = {
    "mcl": "mcl",
    "particle_filter": "particle_filter",
    "quantized_ekf": "ekf",
    "constrained_ekf": "ekf",
    "markov": "markov",
    "rigid_fit": "geometric",
    "trigonometric": "geometric",
    "motion_continuity": "geometric",
    "weighted_centre": "geometric",
    "odometry": "geometric",
    "histogram": "histogram",
}


class EstimatorChoice(Section):
    """The filter on the robots, and the settings of each."""

    estimator: EstimatorName = Field("mcl", description="the filter on the robots")
    mcl: MclSection = MclSection()
    particle_filter: ParticleFilterSection = ParticleFilterSection()
    ekf: EkfSection = EkfSection()
    markov: MarkovSection = MarkovSection()
    geometric: GeometricSection = GeometricSection()
    histogram: HistogramSection = HistogramSection()

    @property
    def chosen(self) -> Section:
        """The settings of the chosen estimator."""
        return getattr(self, SECTIONS[self.estimator])


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
    pattern: Annotated[list[PatternKind], Field(min_length=1, max_length=10)]
    tags_per_m2: Annotated[list[Density], Field(min_length=1, max_length=1000)]


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
    min_expected_reads: NotNegative = Field(
        0.0, description="heuristic screen: designs with fewer expected reads per poll of all readers are not tried"
    )

    @model_validator(mode="after")
    def _gap(self) -> "SearchSection":
        if not self.fail_probability < self.hold_probability:
            raise ValueError("fail_probability must be below hold_probability")
        return self

    @model_validator(mode="after")
    def _distinct(self) -> "SearchSection":
        if len({1.0, *self.limit_factors}) <= len(self.limit_factors):
            raise ValueError(f"limit_factors is {self.limit_factors}, must not name a factor twice, nor 1")
        return self


class StudyFile(EstimatorChoice):
    """A study: the question, as data."""

    title: Annotated[str, Field(min_length=1, max_length=200)]
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 1
    prices: Name = Field("prices.toml", description="price list, relative to the study file")
    floor: FloorSection
    robot: RobotSection = RobotSection()
    fleet: FleetSection = FleetSection()
    requirement: RequirementSection
    scenario: ScenarioSection = ScenarioSection()
    world: WorldSection = WorldSection()
    design: DesignSection = DesignSection()
    layouts: dict[Name, dict[str, Any]] = Field({}, description="layouts of one's own, by name")
    space: SpaceSection
    search: SearchSection = SearchSection()


def _exact(value: Any) -> Decimal:
    if isinstance(value, bool) or not isinstance(value, int | Decimal):
        raise ValueError(f"found {value!r:.60}, must be a number")
    return Decimal(value)


class PriceEntry(Section):
    """A price and where it comes from."""

    price: Annotated[Decimal, BeforeValidator(_exact), Field(ge=0, le=1e9, decimal_places=6)]
    source: Annotated[str, Field(min_length=1, max_length=500)] = Field(description='a source, or "assumption"')


class ControllerEntry(PriceEntry):
    """A controller or multiplexer."""

    channels: Annotated[int, Field(ge=1, le=10_000)]


class PerRobot(Section):
    """Prices counted per reader of each robot."""

    reader: PriceEntry
    cabling: PriceEntry
    antenna: Annotated[dict[Name, PriceEntry], Field(min_length=1)]
    controller: Annotated[list[ControllerEntry], Field(min_length=1, max_length=100)]


class PerTag(Section):
    """Prices counted per tag."""

    tag: PriceEntry
    laying: PriceEntry


class PerSquareMetre(Section):
    """Prices counted per m2 of tagged floor."""

    covering: PriceEntry
    survey: PriceEntry


class PriceFile(Section):
    """A price list."""

    currency: Annotated[str, Field(pattern=r"^[A-Z]{3}$")]
    per_robot: PerRobot
    per_tag: PerTag
    per_m2: PerSquareMetre
    per_project: PriceEntry


SCHEMA_PATH = Path(__file__).with_name("study.schema.json")
