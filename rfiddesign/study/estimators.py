"""From a study's words to the estimator on its robots, and to what is true of their odometry and readers."""

import math
from collections.abc import Callable

from rfiddesign.estimators.ekf import Ekf
from rfiddesign.estimators.geometric import Geometric
from rfiddesign.estimators.histogram import Histogram
from rfiddesign.estimators.markov import Markov
from rfiddesign.estimators.mcl import Mcl
from rfiddesign.estimators.particle_filter import ParticleFilter
from rfiddesign.estimators.pmg import Pmg
from rfiddesign.estimators.registry import Settings
from rfiddesign.evaluate import MOST_CERTAIN_READ, SOFTNESS_MM
from rfiddesign.models.likelihood import DistanceLikelihood
from rfiddesign.models.motion import DifferentialMotion, MecanumMotion, Motion, OdometryFaults, OmnidirectionalMotion
from rfiddesign.models.reads import ReadModel
from rfiddesign.simulation.scenario import World
from rfiddesign.study.estimator_config import EstimatorChoice, FieldSection
from rfiddesign.study.world_config import OdometrySection, WorldSection

# Sigma of a read that a filter allows for where nothing is said [mm].
_READ_NOISE_MM = 3.0


def world_of(section: WorldSection) -> World:
    """What is true in a study."""
    reads = ReadModel(
        section.read_probability, section.polling, section.poll_s, section.read_time_s, section.delay_s, section.answers
    )
    faults = OdometryFaults(**section.faults.model_dump())
    return World(
        motion_of(section.odometry), reads, section.installation_error_mm, faults, section.dead_share,
        section.field_scale,
    )  # fmt: skip


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


def _mcl(choice: EstimatorChoice, world: WorldSection, late_mm: float) -> Mcl:
    section = choice.mcl
    return Mcl(
        likelihood=DistanceLikelihood(section.likelihood, section.sigma_per_radius, section.beta),
        motion=motion_of(section.odometry or world.odometry),
        n_particles=section.n_particles,
        reinitialize=section.reinitialize,
        alpha=section.alpha,
        is_age_compensated=section.is_age_compensated,
    )


def _field(section: FieldSection, world: WorldSection, late_mm: float) -> dict:
    """What filters with the detection field believe, by the names of their settings."""
    softness, radius, probability = section.softness_mm, section.radius_tolerance, section.read_probability
    if softness is None:
        softness = math.hypot(SOFTNESS_MM, world.installation_error_mm, late_mm)
    if radius is None:
        radius = abs(1.0 - world.field_scale)
    if probability is None:
        probability = min(max(world.read_probability * (1.0 - world.dead_share), 0.01), MOST_CERTAIN_READ)
    return {
        "motion": motion_of(section.odometry or world.odometry),
        "uses_rssi": section.uses_rssi,
        "learns_from_nothing": section.learns_from_nothing,
        "softness_mm": softness,
        "radius_tolerance": radius,
        "read_probability": probability,
        "is_age_compensated": section.is_age_compensated,
    }


def _particle_filter(choice: EstimatorChoice, world: WorldSection, late_mm: float) -> ParticleFilter:
    section = choice.particle_filter
    return ParticleFilter(
        n_particles=section.n_particles,
        reinitialize=section.reinitialize,
        is_regularized=section.is_regularized,
        is_tempered=section.is_tempered,
        **_field(section, world, late_mm),
    )


def _pmg(choice: EstimatorChoice, world: WorldSection, late_mm: float) -> Pmg:
    section = choice.pmg
    return Pmg(n_components=section.n_components, **_field(section, world, late_mm))


def _ekf(kind: str) -> Callable[[EstimatorChoice, WorldSection, float], Ekf]:
    def build(choice: EstimatorChoice, world: WorldSection, late_mm: float) -> Ekf:
        section, noise = choice.ekf, choice.ekf.read_noise_mm
        return Ekf(
            kind=kind,
            motion=motion_of(section.odometry or world.odometry),
            uses_rssi=section.uses_rssi,
            read_noise_mm=math.hypot(_READ_NOISE_MM, world.installation_error_mm, late_mm) if noise is None else noise,
            pushes_out=section.pushes_out,
            patience=section.patience,
            is_age_compensated=section.is_age_compensated,
        )

    return build


def _markov(choice: EstimatorChoice, world: WorldSection, late_mm: float) -> Markov:
    section = choice.markov
    return Markov(motion=motion_of(section.odometry or world.odometry), **section.model_dump(exclude={"odometry"}))


def _geometric(method: str) -> Callable[[EstimatorChoice, WorldSection, float], Geometric]:
    def build(choice: EstimatorChoice, world: WorldSection, late_mm: float) -> Geometric:
        section = choice.geometric
        return Geometric(
            method=method,
            motion=motion_of(section.odometry or world.odometry),
            uses_odometry=section.uses_odometry,
            window=section.window,
            is_age_compensated=section.is_age_compensated,
        )

    return build


def _histogram(choice: EstimatorChoice, world: WorldSection, late_mm: float) -> Histogram:
    section = choice.histogram
    return Histogram(
        cell_mm=section.cell_mm,
        cell_rad=math.radians(section.cell_deg),
        n_cells=section.n_cells,
        n_headings=section.n_headings,
        **_field(section, world, late_mm),
    )


#: Every estimator that a study may name.
ESTIMATORS: dict[str, Callable[[EstimatorChoice, WorldSection, float], Settings]] = {
    "mcl": _mcl,
    "pmg": _pmg,
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


def estimators_of(choice: EstimatorChoice, world: WorldSection, fastest_mm_per_s: float) -> dict[str, Settings]:
    """The filters that may be on the robots, by name, the preferred one first.

    `fastest_mm_per_s` : the highest speed, which tells filters what reads are worth that come late.
    """
    late = _late_mm(world, fastest_mm_per_s)
    return {name: ESTIMATORS[name](choice, world, late) for name in choice.estimator_names}


def reference_of(choice: EstimatorChoice, world: WorldSection, fastest_mm_per_s: float) -> Settings:
    """The exact reference that filters are compared with: it believes what is true of the odometry.

    Of the field it believes what its own section says, else what the filter's does, else what `_field` makes of it.
    """
    section = choice.histogram.model_copy(update={"odometry": None})
    for key in ("softness_mm", "radius_tolerance", "read_probability"):
        if getattr(section, key) is None:
            section = section.model_copy(update={key: getattr(choice.chosen, key, None)})
    late = _late_mm(world, fastest_mm_per_s)
    return _histogram(choice.model_copy(update={"histogram": section}), world, late)


def _late_mm(world: WorldSection, fastest_mm_per_s: float) -> float:
    """How far a robot drives within the delay of a read that its filter is not told of."""
    return 0.0 if world.is_delay_known else world.delay_s * fastest_mm_per_s
