"""Monte-Carlo localization with particles restarted under read tags (hf_multireader_mcl, section 3)."""

import math
from dataclasses import dataclass, field, replace

import numpy as np

from rfiddesign import require
from rfiddesign.estimators import _mcl_kernels as kernels
from rfiddesign.estimators.start import KnownStart, Start
from rfiddesign.geometry import DetectionArea, ReaderLayout
from rfiddesign.models._math_kernels import RADIANS_PER_BINARY_UNIT, binary_angle
from rfiddesign.models.likelihood import DistanceLikelihood
from rfiddesign.models.motion import OmnidirectionalMotion
from rfiddesign.models.recording import Recording

MAX_PARTICLES = 1_000_000
# The compiled noise of a step's turn must stay below half a turn, at 5.8 sigma.
MAX_TURN_DEVIATION = 0.5


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
    rules : (inner_radius, log_tail, log_alpha) of the compiled filter.
    """

    settings: Mcl
    dt_s: float
    positions_mm: np.ndarray
    whitening: np.ndarray
    deviations: np.ndarray
    rules: np.ndarray


@dataclass(frozen=True)
class MclState:
    """The belief: M equally weighted particles after resampling, and the estimate made before it (eq. 3).

    Parameters
    ----------
    key : stream of the run (`_noise_kernels.run_key`).
    step : steps taken so far.
    particles : (2, 2, M) float32 [mm], slot 0 the belief, slot 1 spare.
    headings : (2, M) int32 binary angles.
    pose : (3,) estimate [mm, mm, rad].
    """

    key: np.uint64
    step: int
    particles: np.ndarray
    headings: np.ndarray
    pose: np.ndarray


@dataclass(frozen=True)
class Estimate:
    """Mean pose (3,) and covariance (3, 3) of a belief [mm, mm, rad]."""

    pose: np.ndarray
    covariance: np.ndarray


def build(settings: Mcl, layout: ReaderLayout, area: DetectionArea, dt_s: float) -> MclModel:
    """Make the filter ready for a robot with `layout`, whose antennas see `area` and are heard every `dt_s` seconds.

    Raises
    ------
    ValueError : if the motion's noise turns the robot by more than 0.5 rad (one sigma) within a step.
    """
    deviations = np.array(settings.motion.step_deviations(dt_s))
    require.within("noise_heading_rad_per_s times dt_s", float(deviations[2]), low=0.0, high=MAX_TURN_DEVIATION)
    poses = np.asarray(layout.poses_mm, float)
    # Eq. 6 measures from the antenna's centre, which is the area's centroid for every symmetric antenna.
    centre = np.asarray(area.centroid_mm, float)
    cosine, sine = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    offset = np.stack([cosine * centre[0] - sine * centre[1], sine * centre[0] + cosine * centre[1]], axis=-1)
    log_alpha = math.log(settings.alpha) if settings.reinitialize else -math.inf
    rules = np.array([settings.likelihood.inner_radius, settings.likelihood.log_tail, log_alpha])
    return MclModel(
        settings=settings,
        dt_s=dt_s,
        positions_mm=poses[:, :2] + offset,
        whitening=settings.likelihood.whitening(area, poses[:, 2]).astype(np.float32),
        deviations=deviations,
        rules=rules,
    )


def init(model: MclModel, start: Start, key: int) -> MclState:
    """The belief before the first step; `key` names the run's random streams."""
    m = model.settings.n_particles
    particles = np.zeros((2, 2, m), np.float32)
    headings = np.zeros((2, m), np.int32)
    if isinstance(start, KnownStart):
        pose = np.asarray(start.pose, float)
        particles[:, 0], particles[:, 1] = pose[0], pose[1]
        headings[:] = binary_angle(pose[2])
    else:
        low_x, low_y, high_x, high_y = (float(bound) for bound in start.bounds_mm)
        kernels.scatter(np.uint64(key), low_x, low_y, high_x, high_y, particles[0, 0], particles[0, 1], headings[0])
        pose = np.array([(low_x + high_x) / 2, (low_y + high_y) / 2, 0.0])
    return MclState(np.uint64(key), 0, particles, headings, pose)


def predict(model: MclModel, state: MclState, increment: np.ndarray) -> MclState:
    """Move the belief by an odometry increment (3,) in the robot's frame [mm, mm, rad] (line 3)."""
    state = _copy(state)
    kernels.predict(
        state.key, state.step, np.asarray(increment, float), model.deviations,
        state.particles[0, 0], state.particles[0, 1], state.headings[0], _scratch(model.settings.n_particles)[0][0],
    )  # fmt: skip
    return state


def update(model: MclModel, state: MclState, antenna: np.ndarray, tag_mm: np.ndarray) -> MclState:
    """Weigh, estimate, resample and restart by one step's reads (lines 4-13).

    Parameters
    ----------
    antenna : (n_reads,) index of each reading antenna.
    tag_mm : (n_reads, 2) position of each read tag on the map [mm].
    """
    state = _copy(state)
    antenna = np.asarray(antenna, np.int64)
    tags = np.asarray(tag_mm, float).reshape(-1, 2)
    kernels.update(
        state.key, state.step, tags, model.positions_mm[antenna], model.whitening[antenna], model.rules,
        state.particles, state.headings, *_scratch(model.settings.n_particles), state.pose,
    )  # fmt: skip
    return replace(state, step=state.step + 1)


def estimate(state: MclState) -> Estimate:
    """Pose of eq. 3 and the spread of the particles about it."""
    x, y = state.particles[0].astype(float)
    heading = state.headings[0] * RADIANS_PER_BINARY_UNIT
    turn = np.angle(np.exp(1j * (heading - state.pose[2])))
    offsets = np.stack([x - state.pose[0], y - state.pose[1], turn])
    return Estimate(state.pose.copy(), offsets @ offsets.T / x.size)


def track(model: MclModel, state: MclState, recording: Recording, last: int, poses: np.ndarray) -> MclState:
    """Run the filter over a recording from its state's step up to step `last`, in compiled code.

    `poses` (n_steps + 1, 3) receives the estimate after each step, [mm, mm, rad].

    Raises
    ------
    ValueError : if `last` is not a step of the recording, `poses` is too short, or an antenna is not on the robot.
    """
    n_antennas = len(model.positions_mm)
    if not state.step <= last <= recording.n_steps:
        raise ValueError(f"last is {last!r}, must be from {state.step} to {recording.n_steps}, the recording's end")
    if poses.shape[0] <= last:
        raise ValueError(f"poses has {poses.shape[0]} rows, must have more than {last}")
    if recording.read_antenna.max(initial=-1) >= n_antennas or recording.read_antenna.min(initial=0) < 0:
        raise ValueError(f"read_antenna has an index outside 0 to {n_antennas - 1}, the robot's antennas")
    state = _copy(state)
    log = (
        recording.odometry, recording.read_start, recording.read_antenna, recording.read_tag_mm,
        recording.read_age_s, recording.dt_s,
    )  # fmt: skip
    settings = (model.positions_mm, model.whitening, model.deviations, model.rules, model.settings.is_age_compensated)
    scratch = _scratch(model.settings.n_particles)
    kernels.track(state.key, state.step, last, log, settings, state.particles, state.headings, *scratch, poses)
    return replace(state, step=last, pose=poses[last].copy())


def _scratch(n_particles: int) -> tuple[np.ndarray, np.ndarray]:
    return np.empty((5, n_particles), np.float32), np.empty(n_particles + kernels.BLOCK, np.int32)


def _copy(state: MclState) -> MclState:
    return replace(state, particles=state.particles.copy(), headings=state.headings.copy(), pose=state.pose.copy())
