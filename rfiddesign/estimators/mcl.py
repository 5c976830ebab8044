"""Monte-Carlo localization with particles restarted under read tags (hf_multireader_mcl, section 3)."""

import math
from dataclasses import dataclass, field, replace

import numpy as np

from rfiddesign import require
from rfiddesign.estimators import _estimate_kernels
from rfiddesign.estimators import _mcl_kernels as kernels
from rfiddesign.estimators import _particle_kernels as particle_kernels
from rfiddesign.estimators.start import KnownStart, Start
from rfiddesign.geometry import DetectionArea, ReaderLayout
from rfiddesign.models.likelihood import DistanceLikelihood
from rfiddesign.models.motion import OmnidirectionalMotion
from rfiddesign.models.recording import Recording
from rfiddesign.numerics._lane_kernels import LANES
from rfiddesign.numerics._math_kernels import binary_angle

MAX_PARTICLES = 1_000_000
# The compiled noise of a step's turn must stay below half a turn, at 6.4 sigma.
MAX_TURN_DEVIATION = 0.49
# Columns of an estimate: x, y, heading; var_x, cov_xy, var_y, cov_x_heading, cov_y_heading, var_heading; effective
# sample size.
N_ESTIMATE = _estimate_kernels.N_ESTIMATE


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
    motion: OmnidirectionalMotion = field(default_factory=OmnidirectionalMotion)
    n_particles: int = 500
    reinitialize: bool = True
    alpha: float = 1e-6
    is_age_compensated: bool = True

    def __post_init__(self) -> None:
        if not isinstance(self.n_particles, int) or not 2 <= self.n_particles <= MAX_PARTICLES:
            raise ValueError(f"n_particles is {self.n_particles!r}, must be from 2 to {MAX_PARTICLES:,}")
        require.within("alpha", self.alpha, low=0.0, high=1.0, is_low_open=True)


@dataclass(frozen=True)
class MclModel:
    """The filter's settings made ready for one robot.

    Parameters
    ----------
    positions_mm : (n_antennas, 2) antennas in the robot's frame.
    whitening : (n_antennas, 2, 2) float32, see `DistanceLikelihood.whitening`.
    deviations : (3,) noise of one step [mm, mm, rad].
    rules : (inner_radius, log_tail, log_alpha, cell_mm) of the compiled filter.
    table : (n, m) float32 log probability of a read in cells of `cell_mm` about the antenna; without cells the
        likelihood is that of the distance.
    """

    settings: Mcl
    dt_s: float
    positions_mm: np.ndarray
    whitening: np.ndarray
    deviations: np.ndarray
    rules: np.ndarray
    table: np.ndarray


@dataclass(frozen=True)
class MclState:
    """The belief: M equally weighted particles after resampling, and the estimate made before it.

    Parameters
    ----------
    key : stream of the run (`_noise_kernels.run_key`).
    step : steps taken so far.
    particles : (2, M) float32 x and y [mm].
    headings : (M,) int32 binary angles.
    moments : (N_ESTIMATE,) the estimate, see there.
    """

    key: np.uint64
    step: int
    particles: np.ndarray
    headings: np.ndarray
    moments: np.ndarray


@dataclass(frozen=True)
class Estimate:
    """Mean pose (3,) and covariance (3, 3) of a belief [mm, mm, rad], and its effective sample size."""

    pose: np.ndarray
    covariance: np.ndarray
    effective_sample_size: float


def build(settings: Mcl, layout: ReaderLayout, area: DetectionArea, dt_s: float) -> MclModel:
    """Make the filter ready for a robot with `layout`, whose antennas see `area` and are heard every `dt_s` seconds.

    Raises
    ------
    ValueError : if the motion's noise turns the robot by more than 0.49 rad (one sigma) within a step.
    """
    deviations = np.array(settings.motion.step_deviations(dt_s))
    require.within("noise_heading_rad_per_s times dt_s", float(deviations[2]), low=0.0, high=MAX_TURN_DEVIATION)
    poses = np.asarray(layout.poses_mm, float)
    # Eq. 6 measures from the antenna's centre, which is the area's centroid for every symmetric antenna.
    centre = np.asarray(area.centroid_mm, float)
    cosine, sine = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    offset = np.stack([cosine * centre[0] - sine * centre[1], sine * centre[0] + cosine * centre[1]], axis=-1)
    log_alpha = math.log(settings.alpha) if settings.reinitialize else -math.inf
    likelihood = settings.likelihood
    table, cell_mm = likelihood.log_table(area)
    return MclModel(
        settings=settings,
        dt_s=dt_s,
        # A field is tabulated about the antenna, a distance counts from the area's centre.
        positions_mm=poses[:, :2] if table.size else poses[:, :2] + offset,
        whitening=np.ascontiguousarray(likelihood.whitening(area, poses[:, 2]), np.float32),
        deviations=deviations,
        rules=np.array([likelihood.inner_radius, likelihood.log_tail, log_alpha, cell_mm]),
        table=table,
    )


def init(model: MclModel, start: Start, key: int) -> MclState:
    """The belief before the first step; `key` names the run's random streams."""
    m = model.settings.n_particles
    particles = np.zeros((2, m), np.float32)
    headings = np.zeros(m, np.int32)
    moments = np.zeros(N_ESTIMATE)
    moments[-1] = m
    if isinstance(start, KnownStart):
        pose = np.asarray(start.pose, float)
        particles[0], particles[1] = pose[0], pose[1]
        headings[:] = binary_angle(pose[2])
        moments[:3] = pose
    else:
        low_x, low_y, high_x, high_y = (float(bound) for bound in start.bounds_mm)
        kernels.scatter(np.uint64(key), low_x, low_y, high_x, high_y, particles[0], particles[1], headings)
        moments[:3] = (low_x + high_x) / 2, (low_y + high_y) / 2, 0.0
        # Of uniform distributions over the box and the turn.
        moments[[3, 5, 8]] = (high_x - low_x) ** 2 / 12, (high_y - low_y) ** 2 / 12, math.pi**2 / 3
    return MclState(np.uint64(key), 0, particles, headings, moments)


def predict(model: MclModel, state: MclState, increment: np.ndarray) -> MclState:
    """Move the belief by an odometry increment (3,) in the robot's frame [mm, mm, rad] (line 3)."""
    _, drawn, headings, cloud = workspace(state)
    kernels.predict(
        state.key, state.step, np.asarray(increment, float).reshape(1, 3), 0, model.deviations, drawn, headings, cloud,
    )  # fmt: skip
    particle_kernels.store(cloud, drawn, headings)
    return _with_particles(state, drawn, headings)


def update(model: MclModel, state: MclState, antenna: np.ndarray, tag_mm: np.ndarray) -> MclState:
    """Weigh, estimate, resample and restart by one step's reads (lines 4-13).

    Parameters
    ----------
    antenna : (n_reads,) index of each reading antenna.
    tag_mm : (n_reads, 2) position of each read tag on the map [mm].
    """
    antenna = np.asarray(antenna, np.int64)
    tags = np.asarray(tag_mm, float).reshape(-1, 2)
    _, drawn, headings, cloud = workspace(state)
    particle_kernels.load(drawn, headings, cloud)
    moments = np.empty((1, N_ESTIMATE))
    reads = np.column_stack([tags, model.positions_mm[antenna], model.whitening[antenna].reshape(-1, 4)])
    kernels.update(
        state.key, state.step, model.settings.n_particles, reads.astype(np.float32), len(tags), model.rules,
        model.table, cloud, drawn, headings, moments, 0,
    )  # fmt: skip
    return replace(_with_particles(state, drawn, headings), step=state.step + 1, moments=moments[0])


def estimate(state: MclState) -> Estimate:
    """Weighted mean (eq. 3), covariance and effective sample size of the particles before they were last resampled."""
    xx, xy, yy, xh, yh, hh = state.moments[3:9]
    covariance = np.array([[xx, xy, xh], [xy, yy, yh], [xh, yh, hh]])
    return Estimate(state.moments[:3].copy(), covariance, float(state.moments[9]))


def track(model: MclModel, state: MclState, recording: Recording, last: int, estimates: np.ndarray) -> MclState:
    """Run the filter over a recording from its state's step up to step `last`, in compiled code.

    Row t + 1 of `estimates` (n_steps + 1, N_ESTIMATE) receives the estimate after step t.

    Raises
    ------
    ValueError : if `last` is not a step of the recording, `estimates` has another shape, or an antenna is not on the
        robot.
    """
    n_antennas = len(model.positions_mm)
    if not state.step <= last <= recording.n_steps:
        raise ValueError(f"last is {last!r}, must be from {state.step} to {recording.n_steps}, the recording's end")
    if estimates.ndim != 2 or estimates.shape[0] <= last or estimates.shape[1] != N_ESTIMATE:
        raise ValueError(f"estimates has shape {estimates.shape}, must have more than {last} rows of {N_ESTIMATE}")
    if recording.read_antenna.max(initial=-1) >= n_antennas or recording.read_antenna.min(initial=0) < 0:
        raise ValueError(f"read_antenna has an index outside 0 to {n_antennas - 1}, the robot's antennas")
    log = (
        recording.odometry, recording.read_start, recording.read_antenna, recording.read_tag_mm,
        recording.read_age_s, recording.dt_s,
    )  # fmt: skip
    n_particles, drawn, headings, cloud = workspace(state)
    kernels.track(state.key, state.step, last, n_particles, log, compiled(model), cloud, drawn, headings, estimates)
    moments = estimates[last].copy() if last > state.step else state.moments
    return replace(_with_particles(state, drawn, headings), step=last, moments=moments)


def compiled(model: MclModel) -> tuple:
    """The model as the compiled filter takes it."""
    return (
        model.positions_mm, model.whitening, model.deviations, model.rules, model.table,
        model.settings.is_age_compensated,
    )  # fmt: skip


def workspace(state: MclState) -> tuple[int, np.ndarray, np.ndarray, np.ndarray]:
    """Number of particles, and the arrays of the compiled filter with the state's particles: drawn, headings, cloud."""
    m = state.headings.size
    width, room = -(-m // LANES) * LANES, particle_kernels.room_for(m)
    cloud = particle_kernels.aligned_zeros((particle_kernels.N_FIELDS, width), np.float32)
    drawn = particle_kernels.aligned_zeros((3, room), np.float32)
    headings = particle_kernels.aligned_zeros((room,), np.int32)
    drawn[:2, :m] = state.particles
    # Lanes beyond the last particle weigh nothing, and stay near the others.
    drawn[:2, m:] = state.particles[:, -1:]
    headings[:m] = state.headings
    return m, drawn, headings, cloud


def _with_particles(state: MclState, drawn: np.ndarray, headings: np.ndarray) -> MclState:
    m = state.headings.size
    return replace(state, particles=drawn[:2, :m].copy(), headings=headings[:m].copy())
