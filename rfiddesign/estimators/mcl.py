"""Monte-Carlo localization with particles restarted under read tags (hf_multireader_mcl, section 3)."""

import math
from dataclasses import dataclass, field

import numpy as np

from rfiddesign import require
from rfiddesign.estimators import _mcl_kernels as kernels
from rfiddesign.estimators import _particle_kernels as particle_kernels
from rfiddesign.estimators import _regularize_kernels as regularize_kernels
from rfiddesign.estimators import _scatter_kernels as scatter_kernels
from rfiddesign.estimators._evidence_kernels import MOST_REACHES, MOST_UNREAD, SIGMAS
from rfiddesign.estimators.operations import (
    ANTENNA_THEN,
    EXP_32,
    LOG_32,
    NORMAL_32,
    SIN_COS_32,
    SIN_COS_64,
    STEP_VARIANCES,
    Load,
    tags_within,
)
from rfiddesign.estimators.start import KnownStart, Start, UncertainStart, moments_of_start
from rfiddesign.estimators.verbs import (
    N_ESTIMATE,
    Belief,
    Filter,
    Kernels,
    belief,
    estimate,
    known,
    moments_of,
    predict,
    track,
    update,
    workspace,
)
from rfiddesign.models._motion_kernels import MAX_TURN_DEVIATION
from rfiddesign.models.likelihood import DistanceLikelihood
from rfiddesign.models.motion import Motion, OmnidirectionalMotion
from rfiddesign.models.robot import Robot
from rfiddesign.numerics._lane_kernels import LANES
from rfiddesign.numerics._math_kernels import RADIANS_PER_BINARY_UNIT, binary_angle

__all__ = [
    "KERNELS", "N_ESTIMATE", "Mcl", "build", "estimate", "flops_per_step", "headings", "init", "known", "positions",
    "predict", "track", "update", "workspace",
]  # fmt: skip

MAX_PARTICLES = 1_000_000
KERNELS = Kernels(kernels.predict_step, kernels.update_step, kernels.track)

# Floating-point operations per particle: `_mcl_kernels.predict` (three normals, two of sine and cosine, eq. 1),
# `_estimate_kernels._sums` (weight, 13 sums), `resample`, and what `_regularize_kernels.predict_apart` adds.
_PREDICT, _ESTIMATE, _RESAMPLE, _APART = 3 * NORMAL_32 + 2 * SIN_COS_32 + 14, 28 + EXP_32, 2, 13
# Of a step: `_regularize_kernels.move_moments`, and the root of what noise is due.  Of a poll that read nothing: where
# its antenna may be; of a tag near there: its distance.
_MOMENTS, _ROOT, _WHEREABOUTS, _NEAR = STEP_VARIANCES + 2 * SIN_COS_64 + 103, SIN_COS_64 + 80, SIN_COS_64 + 40, 5
# Per particle and row: `weigh_by_distance` (alike in all directions, and not), `weigh_by_field`, `weigh_by_discs` (of
# one circle, and what a second one adds), and the logarithm that the last takes of every eight factors.
_BY_DISTANCE, _BY_ELLIPSE, _BY_FIELD, _BY_DISCS, _BY_RING, _PER_LOG = 16, 22, 21, 24, 8, LOG_32 + 1
_ROWS_PER_LOG = 8


@dataclass(frozen=True)
class Mcl:
    """Settings of the filter: what it believes of the robot, and how it weighs.

    Parameters
    ----------
    likelihood : weight of a read tag (eq. 6).
    motion : noise that the filter adds to the odometry (eq. 1).
    n_particles : M of Algorithm 1.
    reinitialize : whether lines 11-13 of Algorithm 1 run.
    alpha : weight below which a particle restarts; the weight of a step is the product over its reads.
    is_age_compensated : whether a read is applied to where its antenna was when it polled, or to where it is when the
        step ends.
    """

    likelihood: DistanceLikelihood = field(default_factory=DistanceLikelihood)
    motion: Motion = field(default_factory=OmnidirectionalMotion)
    n_particles: int = 500
    reinitialize: bool = True
    alpha: float = 1e-6
    is_age_compensated: bool = True

    def __post_init__(self) -> None:
        check_particles(self.n_particles)
        require.within("alpha", self.alpha, low=0.0, high=1.0, is_low_open=True)


def check_particles(n_particles: int) -> None:
    """Raise ValueError unless this is a number of particles that a filter takes."""
    if not isinstance(n_particles, int) or not 2 <= n_particles <= MAX_PARTICLES:
        raise ValueError(f"n_particles is {n_particles!r}, must be from 2 to {MAX_PARTICLES:,}")


def build(settings: Mcl, robot: Robot, dt_s: float) -> Filter:
    """Make the filter ready for a robot whose antennas are heard every `dt_s` seconds.

    Raises
    ------
    ValueError : if the motion's noise turns the robot by more than 0.49 rad (one sigma) within a step.
    """
    noise = motion_noise(settings.motion, dt_s)
    poses = np.asarray(robot.layout.poses_mm, float)
    # Eq. 6 measures from the antenna's centre, which is the area's centroid for every symmetric antenna.
    centre = np.asarray(robot.area.centroid_mm, float)
    cosine, sine = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    offset = np.stack([cosine * centre[0] - sine * centre[1], sine * centre[0] + cosine * centre[1]], axis=-1)
    log_alpha = math.log(settings.alpha) if settings.reinitialize else -math.inf
    likelihood = settings.likelihood
    table, cell_mm = likelihood.log_table(robot.area)
    model = (
        settings.n_particles,
        # A field is tabulated about the antenna, a distance counts from the area's centre.
        poses[:, :2].copy() if table.size else poses[:, :2] + offset,
        np.ascontiguousarray(likelihood.whitening(robot.area, poses[:, 2]), np.float32),
        noise,
        np.array([likelihood.inner_radius, likelihood.log_tail, log_alpha, cell_mm, *[0.0] * 6]),
        table[None],
        (settings.is_age_compensated, robot.reads.delay_s / dt_s),
        looks(robot, dt_s),
    )
    return Filter(settings, dt_s, len(poses), KERNELS, model)


def motion_noise(motion: Motion, dt_s: float) -> np.ndarray:
    """The noise of a step, see `Motion.noise`; ValueError if it turns the robot by more than 0.49 rad (one sigma)."""
    noise = motion.noise(dt_s)
    require.within("noise of the heading per step", math.sqrt(noise[2, 0]), low=0.0, high=MAX_TURN_DEVIATION)
    return noise


def looks(
    robot: Robot, dt_s: float, *, uses_rssi: bool = False, learns_from_nothing: bool = False, reach: float = 0.0,
    table_number: int = 0,
) -> tuple:  # fmt: skip
    """How the compiled filter looks at reads, see `_evidence_kernels.gather_nothing_seen`."""
    schedule = robot.reads.schedule(robot.layout.n_readers, dt_s)
    return (
        uses_rssi, learns_from_nothing, robot.reads.answers == "all", schedule.slots, schedule.phases, schedule.period,
        float(reach), table_number,
    )  # fmt: skip


def init(ready: Filter, start: Start, key: int) -> Belief:
    """The belief before the first step; `key` names the run's random streams."""
    m = ready.settings.n_particles
    width, room = -(-m // LANES) * LANES, particle_kernels.room_for(m)
    cloud = particle_kernels.aligned_zeros((particle_kernels.N_FIELDS, width), np.float32)
    drawn = particle_kernels.aligned_zeros((3, room), np.float32)
    angles = particle_kernels.aligned_zeros((room,), np.int32)
    pose, covariance = moments_of_start(start)
    if isinstance(start, KnownStart):
        drawn[0], drawn[1] = pose[0], pose[1]
        angles[:m] = binary_angle(pose[2])
    elif isinstance(start, UncertainStart):
        root = np.linalg.cholesky(covariance + np.diag([1e-9, 1e-9, 1e-15]))
        scatter_kernels.scatter_about(np.uint64(key), pose, root, drawn[0, :m], drawn[1, :m], angles)
    else:
        low_x, low_y, high_x, high_y = (float(bound) for bound in start.bounds_mm)
        scatter_kernels.scatter(np.uint64(key), low_x, low_y, high_x, high_y, drawn[0, :m], drawn[1, :m], angles)
    # Lanes beyond the last particle weigh nothing, and stay near the others.
    drawn[:2, m:] = drawn[:2, m - 1 : m]
    angles[m:] = angles[m - 1]
    moments, about = moments_of(pose, covariance, m), np.zeros((1, regularize_kernels.N_ABOUT))
    about[0, :N_ESTIMATE] = moments
    return belief(key, (drawn, angles, cloud, about), moments)


def flops_per_step(ready: Filter, load: Load) -> float:
    """Floating-point operations per step, about; see `operations`.

    Tempering is not counted: while a robot is tracked it is for few steps (`_temper_kernels`).
    """
    _, _, whitening, _, rules, table, _, looks = ready.model
    uses_rssi, learns_from_nothing = looks[:2]
    near = _tags_looked_at(looks[6], load) if learns_from_nothing else 0.0
    silent = load.silent_polls if learns_from_nothing else 0.0
    rows = load.reads + silent * near
    if table.shape[2] == 1:
        weigh = rows * (_BY_DISCS + _BY_RING * uses_rssi) + (rows // _ROWS_PER_LOG + 1) * _PER_LOG
    elif table.shape[1] > 0:
        weigh = rows * _BY_FIELD
    else:
        is_isotropic = bool((whitening[:, 0, 0] == whitening[:, 1, 1]).all() and (whitening[:, 0, 1] == 0).all())
        weigh = rows * (_BY_DISTANCE if is_isotropic else _BY_ELLIPSE)
    # Without evidence there is nothing to draw anew by.
    has_evidence = 1.0 if learns_from_nothing else load.read_share
    is_regularized = rules[regularize_kernels.BANDWIDTH] > 0.0
    per_particle = _PREDICT + weigh + _ESTIMATE + has_evidence * (_RESAMPLE + _APART * is_regularized)
    of_polls = load.reads * ANTENNA_THEN + silent * (ANTENNA_THEN + _WHEREABOUTS + near * _NEAR)
    of_moments = (rules[4] > 0.0) * _MOMENTS + has_evidence * is_regularized * _ROOT
    return float(ready.settings.n_particles * per_particle + of_polls + of_moments)


def _tags_looked_at(reach_mm: float, load: Load) -> float:
    """Tags near a poll that read nothing, see `_evidence_kernels.gather_nothing_seen`."""
    far = reach_mm + SIGMAS * load.spread_mm
    tags = tags_within(load, far)
    return tags if far <= MOST_REACHES * reach_mm and tags <= MOST_UNREAD else 0.0


def positions(ready: Filter, state: Belief) -> np.ndarray:
    """Positions of the particles, shape (2, M) float32 [mm]."""
    return state.arrays[0][:2, : ready.settings.n_particles]


def headings(ready: Filter, state: Belief) -> np.ndarray:
    """Headings of the particles, shape (M,) [rad]."""
    return state.arrays[1][: ready.settings.n_particles] * RADIANS_PER_BINARY_UNIT
