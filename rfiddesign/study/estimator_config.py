"""What a study file may say of the filter on its robots: which, and what it believes."""

from typing import Annotated, Literal

from pydantic import Field

from rfiddesign.study.sections import Section, Share
from rfiddesign.study.world_config import OdometrySection

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
        None,
        description="blur of the field's border; default: 1 mm, the installation error and the way at the highest "
        "speed within a delay that the filter is not told of, squares added",
    )
    radius_tolerance: Share | None = Field(
        None, description="share by which the field may be larger or smaller; default: by which it is in truth"
    )
    read_probability: Annotated[float, Field(ge=0.01, le=0.999)] | None = Field(
        None, description="default: the true one with dead tags counted as missed, at most 0.98"
    )
    is_age_compensated: bool = True
    odometry: Believed = None


class ParticleFilterSection(FieldSection):
    """Particle filter with the detection field as likelihood (rssi_kalman_navifloor, section IV-C)."""

    n_particles: Particles = 500
    reinitialize: bool = True
    is_regularized: bool = Field(True, description="drawn particles are set apart by a Liu-West kernel")
    is_tempered: bool = Field(True, description="evidence that leaves few particles is applied in stages")


class PmgSection(FieldSection):
    """Projected-moment Gaussian filter: a few Gaussians that learn from every poll."""

    n_components: Annotated[int, Field(ge=1, le=64)] = 7


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
    "mcl", "pmg", "particle_filter", "quantized_ekf", "constrained_ekf", "markov", "rigid_fit", "trigonometric",
    "motion_continuity", "weighted_centre", "odometry", "histogram",
]  # fmt: skip


#: The table that sets each estimator.
SECTIONS = {
    "mcl": "mcl",
    "pmg": "pmg",
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


#: What leaves the choice of the estimator to the search, and among which it chooses where nothing is said: of those
#: that do alike the first.
AUTO = "auto"
AUTO_ESTIMATORS: tuple[EstimatorName, ...] = ("pmg", "particle_filter", "mcl")


class EstimatorChoice(Section):
    """The filter on the robots, and the settings of each."""

    estimator: EstimatorName = Field("mcl", description="the filter on the robots")
    mcl: MclSection = MclSection()
    pmg: PmgSection = PmgSection()
    particle_filter: ParticleFilterSection = ParticleFilterSection()
    ekf: EkfSection = EkfSection()
    markov: MarkovSection = MarkovSection()
    geometric: GeometricSection = GeometricSection()
    histogram: HistogramSection = HistogramSection()

    @property
    def estimator_names(self) -> tuple[str, ...]:
        """The estimators that may be on the robots, the preferred one first."""
        return (self.estimator,)

    def settings_of(self, name: str) -> Section:
        """The settings of an estimator."""
        return getattr(self, SECTIONS[name])

    @property
    def chosen(self) -> Section:
        """The settings of the chosen estimator; where the choice is left open, of the preferred one."""
        return self.settings_of(self.estimator_names[0])
