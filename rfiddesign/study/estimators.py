"""From a study's words to the estimator on its robots, and to what is true of their odometry and readers."""

import math
from collections.abc import Callable

from rfiddesign.estimators.ekf import Ekf
from rfiddesign.estimators.geometric import Geometric
from rfiddesign.estimators.histogram import Histogram
from rfiddesign.estimators.markov import Markov
from rfiddesign.estimators.mcl import Mcl
from rfiddesign.estimators.particle_filter import ParticleFilter
from rfiddesign.estimators.registry import Settings
from rfiddesign.models.likelihood import DistanceLikelihood
from rfiddesign.models.motion import DifferentialMotion, MecanumMotion, Motion, OdometryFaults, OmnidirectionalMotion
from rfiddesign.models.reads import ReadModel
from rfiddesign.simulation.scenario import World
from rfiddesign.study.estimator_config import EstimatorChoice, FieldSection
from rfiddesign.study.world_config import OdometrySection, WorldSection

# What a filter allows for where nothing is said: border of the field, sigma of a read [mm].
_SOFTNESS_MM, _READ_NOISE_MM = 1.0, 3.0
_MOST_CERTAIN_READ = 0.98


def world_of(section: WorldSection) -> World:
    """What is true in a study."""
    reads = ReadModel(
        section.read_probability, section.polling, section.poll_s, section.read_time_s, section.delay_s, section.answers
    )
    faults = OdometryFaults(**section.faults.model_dump())
    return World(motion_of(section.odometry), reads, section.installation_error_mm, faults)


def motion_of(section: OdometrySection) -> Motion:
    """Noise of an odometry; what is not given is the model's default."""
    given = section.given()
    if section.model == "omnidirectional":
        names = {
            "noise_mm_per_s": ("noise_x_mm_per_s", "noise_y_mm_per_s"),
            "noise_rad_per_s": ("noise_heading_rad_per_s",),
        }
        return OmnidirectionalMotion(**{name: given[key] for key in given for name in names[key]})
    if section.model == "differential":
        return DifferentialMotion(**given)
    names = {
        "noise_mm_per_sqrt_m": "noise_x_mm_per_sqrt_m",
        "noise_sideways_mm_per_sqrt_m": "noise_y_mm_per_sqrt_m",
        "noise_rad_per_sqrt_m": "noise_heading_rad_per_sqrt_m",
        "noise_rad_per_sqrt_rad": "noise_heading_rad_per_sqrt_rad",
    }
    noises = {names[key]: value for key, value in given.items()}
    if "noise_x_mm_per_sqrt_m" in noises:
        noises.setdefault("noise_y_mm_per_sqrt_m", noises["noise_x_mm_per_sqrt_m"])
    return MecanumMotion(**noises)


def _mcl(choice: EstimatorChoice, world: WorldSection) -> Mcl:
    section = choice.mcl
    return Mcl(
        likelihood=DistanceLikelihood(section.likelihood, section.sigma_per_radius, section.beta),
        motion=motion_of(section.odometry or world.odometry),
        n_particles=section.n_particles,
        reinitialize=section.reinitialize,
        alpha=section.alpha,
        is_age_compensated=section.is_age_compensated,
    )


def _field(section: FieldSection, world: WorldSection) -> dict:
    """What filters with the detection field believe, by the names of their settings."""
    softness, probability = section.softness_mm, section.read_probability
    if softness is None:
        softness = math.hypot(_SOFTNESS_MM, world.installation_error_mm)
    if probability is None:
        probability = min(max(world.read_probability, 0.01), _MOST_CERTAIN_READ)
    return {
        "motion": motion_of(section.odometry or world.odometry),
        "uses_rssi": section.uses_rssi,
        "learns_from_nothing": section.learns_from_nothing,
        "softness_mm": softness,
        "read_probability": probability,
        "is_age_compensated": section.is_age_compensated,
    }


def _particle_filter(choice: EstimatorChoice, world: WorldSection) -> ParticleFilter:
    section = choice.particle_filter
    return ParticleFilter(n_particles=section.n_particles, reinitialize=section.reinitialize, **_field(section, world))


def _ekf(kind: str) -> Callable[[EstimatorChoice, WorldSection], Ekf]:
    def build(choice: EstimatorChoice, world: WorldSection) -> Ekf:
        section, noise = choice.ekf, choice.ekf.read_noise_mm
        return Ekf(
            kind=kind,
            motion=motion_of(section.odometry or world.odometry),
            uses_rssi=section.uses_rssi,
            read_noise_mm=math.hypot(_READ_NOISE_MM, world.installation_error_mm) if noise is None else noise,
            pushes_out=section.pushes_out,
            patience=section.patience,
            is_age_compensated=section.is_age_compensated,
        )

    return build


def _markov(choice: EstimatorChoice, world: WorldSection) -> Markov:
    section = choice.markov
    return Markov(motion=motion_of(section.odometry or world.odometry), **section.model_dump(exclude={"odometry"}))


def _geometric(method: str) -> Callable[[EstimatorChoice, WorldSection], Geometric]:
    def build(choice: EstimatorChoice, world: WorldSection) -> Geometric:
        section = choice.geometric
        return Geometric(
            method=method,
            motion=motion_of(section.odometry or world.odometry),
            uses_odometry=section.uses_odometry,
            window=section.window,
            is_age_compensated=section.is_age_compensated,
        )

    return build


def _histogram(choice: EstimatorChoice, world: WorldSection) -> Histogram:
    section = choice.histogram
    return Histogram(
        cell_mm=section.cell_mm,
        cell_rad=math.radians(section.cell_deg),
        n_cells=section.n_cells,
        n_headings=section.n_headings,
        **_field(section, world),
    )


#: Every estimator that a study may name.
ESTIMATORS: dict[str, Callable[[EstimatorChoice, WorldSection], Settings]] = {
    "mcl": _mcl,
    "particle_filter": _particle_filter,
    "quantized_ekf": _ekf("quantized"),
    "constrained_ekf": _ekf("constrained"),
    "markov": _markov,
    "rigid_fit": _geometric("rigid_fit"),
    "trigonometric": _geometric("trigonometric"),
    "motion_continuity": _geometric("motion_continuity"),
    "weighted_centre": _geometric("weighted_centre"),
    "odometry": _geometric("odometry"),
    "histogram": _histogram,
}


def estimator_of(choice: EstimatorChoice, world: WorldSection) -> Settings:
    """The filter on the robot."""
    return ESTIMATORS[choice.estimator](choice, world)


def reference_of(choice: EstimatorChoice, world: WorldSection) -> Settings:
    """The exact reference that filters are compared with: it believes what is true of the odometry."""
    section = choice.histogram.model_copy(update={"odometry": None})
    return _histogram(choice.model_copy(update={"histogram": section}), world)
