"""Localization without probabilities: dead reckoning, and earlier methods that hf_multireader_mcl lists in table 1."""

from dataclasses import dataclass, field

import numpy as np

from rfiddesign import require
from rfiddesign.estimators import _acquisition_kernels
from rfiddesign.estimators import _geometric_kernels as kernels
from rfiddesign.estimators._sighting_kernels import N_HISTORY
from rfiddesign.estimators.ekf import pose_of
from rfiddesign.estimators.operations import ANTENNA_THEN, ATAN2_64, SIN_COS_64, STEP_VARIANCES, Load
from rfiddesign.estimators.start import Start
from rfiddesign.estimators.verbs import (
    N_ESTIMATE,
    Belief,
    Filter,
    Kernels,
    belief,
    estimate,
    moments_of,
    predict,
    track,
    update,
    workspace,
)
from rfiddesign.models.motion import Motion, OmnidirectionalMotion
from rfiddesign.models.robot import Robot
from rfiddesign.models.shape import radius_of

__all__ = [
    "METHODS", "N_ESTIMATE", "Geometric", "build", "estimate", "flops_per_step", "init", "predict", "track", "update",
    "workspace",
]  # fmt: skip

KERNELS = Kernels(kernels.predict, kernels.update, kernels.track)
METHODS = {
    "odometry": kernels.ODOMETRY,
    "rigid_fit": kernels.RIGID_FIT,
    "trigonometric": kernels.TRIGONOMETRIC,
    "motion_continuity": kernels.MOTION_CONTINUITY,
    "weighted_centre": kernels.WEIGHTED_CENTRE,
}
MAX_WINDOW = 100_000
_GAIN, _SLOW_GAIN = 1.0, 0.2

# Floating-point operations of a step with odometry (`predict_pose`, `advance`, `keep_positive`) and of `hold`; of a
# read in `sight`; of every sighting (`remember`); of one that moves the robot (`in_map`, `stand`).
_MOVE, _HOLD, _PER_READ = 2 * SIN_COS_64 + STEP_VARIANCES + 96, 32, ANTENNA_THEN + 20
_PER_SIGHTING, _CORRECT = SIN_COS_64 + 33, 2 * SIN_COS_64 + 42
# What each method adds to a sighting: `fit_turn`; `two_tags`; per sighting of the window two of `fit_line`, beside
# their directions; and `weigh`, beside `two_tags`.
_FIT_TURN, _TWO_TAGS = ATAN2_64 + 20, 2 * SIN_COS_64 + 2 * ATAN2_64 + 90
_FIT_LINES, _LINES, _WEIGH = 2 * 18, 4 * ATAN2_64 + 2 * SIN_COS_64 + 60, 20


@dataclass(frozen=True)
class Geometric:
    """Settings of the methods.

    All reads of a step make one sighting: the centre t of their tags is where the mean place a of their antennas was.
    The position is t - R(theta) a, and the covariance C / n of n reads, with C that of the detection area, plus what
    the heading's error does to a.  Between sightings the pose follows the odometry and its covariance grows by the
    motion's noise.  The methods differ in theta, and in which reads count:

    - "odometry": dead reckoning from the start; told nothing, from the first two tags on; never corrected.
    - "rigid_fit" (the kinematics method of Takahashi): the least squares rigid transform from antennas to tags.
      Heading variance: that of a read per axis over the sum of squared distances of the antennas from their mean.
      Where one step's reads give no heading it stays.
    - "trigonometric" (Park): the direction from one tag to the next that is at least a baseline away, against that of
      the way between them by odometry.  Heading variance: 2 s^2 / base^2 with s^2 that of a sighting across the way.
    - "motion_continuity" (Han): the straight line through the last `window` sightings with the least squared distances;
      the newest is put on it, if they follow each other along it.  Odometry's line through the same places tells how
      the robot faces its way, and what a bent way differs from a line.  Across the line the variance is shared by the
      different places seen; the heading's is that of a place over the sum of squares along the line.
    - "weighted_centre" (Yang): the centre of the tags read in the last `window` steps, each with the weight of its
      reads, moved along with the odometry.  The variance is that of one step over the different places seen; without
      odometry the centre lags, by the reads' mean age, and the way in that time is added.  Heading as "trigonometric"
      between centres; with odometry it is taken over slowly.

    Parameters
    ----------
    method : one of `METHODS`.
    motion : noise by which the covariance grows.
    uses_odometry : if not, the robot is held where it was seen last, and taken to drive ahead wherever a direction
        tells the heading; reads are not compensated for their age.
    window : sightings of "motion_continuity", steps of "weighted_centre".
    baseline_mm : least distance that a direction is taken from: between tags or centres, along a line, or of two
        antennas [mm]; None: the diameter of the detection area, as nothing nearer is seen apart.
    heading_gain : share of what is missing to a heading that was seen; None: 1, or 0.2 for "weighted_centre"
        with odometry.
    is_age_compensated : whether a read is applied to where its antenna was when it polled.
    held_speed_mm_per_s, held_turn_rate_rad_per_s : how fast a pose that is held grows uncertain; without odometry only.
    """

    method: str
    motion: Motion = field(default_factory=OmnidirectionalMotion)
    uses_odometry: bool = True
    window: int = 40
    baseline_mm: float | None = None
    heading_gain: float | None = None
    is_age_compensated: bool = True
    held_speed_mm_per_s: float = 200.0
    held_turn_rate_rad_per_s: float = 0.5

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise ValueError(f"method is {self.method!r}, must be one of {', '.join(METHODS)}")
        if self.method == "odometry" and not self.uses_odometry:
            raise ValueError("uses_odometry is False, must be True for method 'odometry'")
        if not isinstance(self.window, int) or not 1 <= self.window <= MAX_WINDOW:
            raise ValueError(f"window is {self.window!r}, must be from 1 to {MAX_WINDOW:,}")
        if self.baseline_mm is not None:
            require.within("baseline_mm", self.baseline_mm, low=0.0, high=1e6, is_low_open=True)
        if self.heading_gain is not None:
            require.within("heading_gain", self.heading_gain, low=0.0, high=1.0)
        require.within("held_speed_mm_per_s", self.held_speed_mm_per_s, low=0.0, high=1e6)
        require.within("held_turn_rate_rad_per_s", self.held_turn_rate_rad_per_s, low=0.0, high=1e3)


def build(settings: Geometric, robot: Robot, dt_s: float) -> Filter:
    """Make the method ready for a robot whose antennas are heard every `dt_s` seconds."""
    poses, area = np.asarray(robot.layout.poses_mm, float), robot.area
    cosine, sine = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    turns = np.array([[cosine, -sine], [sine, cosine]]).transpose(2, 0, 1)
    radius = radius_of(area)
    baseline = 2.0 * radius if settings.baseline_mm is None else float(settings.baseline_mm)
    gain = settings.heading_gain
    if gain is None:
        is_slow = settings.method == "weighted_centre" and settings.uses_odometry
        gain = _SLOW_GAIN if is_slow else _GAIN
    model = (
        METHODS[settings.method],
        settings.uses_odometry,
        # A read tag is about the middle of what the antenna sees.
        poses[:, :2] + turns @ np.asarray(area.centroid_mm, float),
        np.ascontiguousarray(turns @ np.asarray(area.covariance_mm2, float) @ turns.transpose(0, 2, 1)),
        settings.motion.noise(dt_s),
        (baseline, radius, float(gain)),
        (settings.held_speed_mm_per_s * dt_s, settings.held_turn_rate_rad_per_s * dt_s),
        (settings.is_age_compensated, robot.reads.delay_s / dt_s),
    )
    return Filter(settings, dt_s, len(poses), KERNELS, model)


def flops_per_step(ready: Filter, load: Load) -> float:
    """Floating-point operations per step, about; see `operations`."""
    settings = ready.settings
    added = {
        "odometry": 0,
        "rigid_fit": _CORRECT + _FIT_TURN,
        "trigonometric": _CORRECT + _TWO_TAGS,
        "motion_continuity": _CORRECT + _FIT_LINES * settings.window + _LINES,
        "weighted_centre": _CORRECT + _WEIGH * settings.window * load.read_share + _TWO_TAGS,
    }[settings.method]
    move = _MOVE if settings.uses_odometry else _HOLD
    return move + load.reads * _PER_READ + load.read_share * (_PER_SIGHTING + added)


def init(ready: Filter, start: Start, key: int) -> Belief:
    """The belief before the first step; told nothing, the method waits for two tags (eq. 13) or a rigid fit."""
    pose, covariance, search = pose_of(start)
    memory = np.zeros(kernels.N_MEMORY)
    memory[kernels.IS_KNOWN] = search[_acquisition_kernels.STAGE] == 2.0
    search[:] = 0.0
    history = np.zeros((ready.settings.window, N_HISTORY))
    moments = moments_of(pose, covariance)
    return belief(key, (pose, covariance, search, history, memory), moments)
