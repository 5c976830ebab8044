"""Quantized and constrained extended Kalman filters (rssi_kalman_navifloor, section IV)."""

from dataclasses import dataclass, field

import numpy as np

from rfiddesign import require
from rfiddesign.estimators import _acquisition_kernels
from rfiddesign.estimators import _ekf_kernels as kernels
from rfiddesign.estimators.operations import ANTENNA_THEN, SIN_COS_64, STEP_VARIANCES, Load
from rfiddesign.estimators.start import KnownStart, Start, UnknownStart, moments_of_start
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
from rfiddesign.models.shape import radius_of, shape_of

__all__ = [
    "KINDS", "N_ESTIMATE", "Ekf", "build", "estimate", "flops_per_step", "init", "predict", "track", "update",
    "workspace",
]  # fmt: skip

KERNELS = Kernels(kernels.predict, kernels.update, kernels.track)
KINDS = {"quantized": kernels.QUANTIZED, "constrained": kernels.CONSTRAINED}
# A known start is known to this much: covariances must stay positive definite.
_KNOWN = (1.0, 1.0, 1e-6)

# Floating-point operations of `_pose_gaussian_kernels.direction_of` for a small turn; `carry`; `in_antenna_frame`.
_DIRECTION, _CARRY, _IN_ANTENNA_FRAME = 24, STEP_VARIANCES + 49, 31
# `signed_distance` to a rounded rectangle, or to each segment of a border; the gradient by pose; a scalar update with
# the distance in sigmas; one of both coordinates, and the distance for it.
_DISTANCE, _PER_SEGMENT, _GRADIENT, _CORRECT, _CORRECT_PLACE = 8, 20, 9, 45, 109 + 32
# As a rule tags are read where they were expected: reads that correct, and silent polls of what was in the area.
_CORRECTING, _PUSHING = 0.2, 0.05


@dataclass(frozen=True)
class Ekf:
    """Settings of the filter.

    A read whose tag is predicted in the detection area tells nothing.  Otherwise "quantized" takes it as a measured
    place, with mean and covariance of the area (eqs. 5-7), and "constrained" moves the pose towards the area's border,
    g = 0 with g the signed distance (rules 1 and 2, eq. 12).  Several reads of a step follow each other, each measured
    from the pose that the one before it left.

    Parameters
    ----------
    kind : "quantized" or "constrained".
    motion : noise that the filter adds to the odometry.
    uses_rssi : whether RSSI j narrows the area to the disc of step j.
    read_noise_mm : sigma of a read: delays and misplaced tags [mm].
    pushes_out : whether rule 3 applies: a tag no longer read though predicted in the area moves the pose to the border,
        as long as that is so.  Off by default: the nearest border is often not the one that the robot left by.
    is_age_compensated : whether a read is applied to where its antenna was when it polled.
    gate_sigmas, patience : after `patience` reads in a row, each more than `gate_sigmas` beyond the area, the robot is
        lost and starts from two tags again; 0: never.
    """

    kind: str = "constrained"
    motion: Motion = field(default_factory=OmnidirectionalMotion)
    uses_rssi: bool = False
    read_noise_mm: float = 20.0
    pushes_out: bool = False
    is_age_compensated: bool = True
    gate_sigmas: float = 5.0
    patience: int = 3

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise ValueError(f"kind is {self.kind!r}, must be one of {', '.join(KINDS)}")
        require.within("read_noise_mm", self.read_noise_mm, low=0.1, high=1e4)
        require.within("gate_sigmas", self.gate_sigmas, low=1.0, high=1e3)
        if not isinstance(self.patience, int) or not 0 <= self.patience <= 1_000_000:
            raise ValueError(f"patience is {self.patience!r}, must be from 0 to 1,000,000")


def build(settings: Ekf, robot: Robot, dt_s: float) -> Filter:
    """Make the filter ready for a robot whose antennas are heard every `dt_s` seconds."""
    poses = np.asarray(robot.layout.poses_mm, float)
    antennas = np.column_stack([poses, np.sin(poses[:, 2]), np.cos(poses[:, 2])])
    schedule = robot.reads.schedule(len(antennas), dt_s)
    model = (
        KINDS[settings.kind],
        settings.pushes_out,
        antennas,
        (schedule.slots, schedule.period),
        settings.motion.noise(dt_s),
        tuple(shape_of(robot.area, robot.rssi_radii_mm if settings.uses_rssi else ())),
        (radius_of(robot.area), float(settings.read_noise_mm) ** 2, float(settings.gate_sigmas), settings.patience),
        (settings.is_age_compensated, robot.reads.delay_s / dt_s),
    )
    return Filter(settings, dt_s, len(antennas), KERNELS, model)


def init(ready: Filter, start: Start, key: int) -> Belief:
    """The belief before the first step; told nothing, the filter waits for two tags (eq. 13)."""
    pose, covariance, search = pose_of(start)
    arrays = (pose, covariance, search, np.zeros((ready.n_antennas, 4)), np.zeros(1), np.array([0.0, 0.0, 1.0]))
    moments = moments_of(pose, covariance)
    return belief(key, arrays, moments)


def flops_per_step(ready: Filter, load: Load) -> float:
    """Floating-point operations per step, about; see `operations`."""
    kind, pushes_out, _, _, _, shape, _, _ = ready.model
    distance = _IN_ANTENNA_FRAME + _DISTANCE + _PER_SEGMENT * len(shape[3])
    correct = _DIRECTION + _GRADIENT + (_CORRECT if kind == kernels.CONSTRAINED else _CORRECT_PLACE)
    per_read = ANTENNA_THEN + SIN_COS_64 + 2 + distance + _CORRECTING * correct
    pushed = _PUSHING * load.silent_polls * (distance + _DIRECTION + _GRADIENT + _CORRECT) if pushes_out else 0.0
    return _CARRY + _DIRECTION + load.reads * per_read + pushed


def pose_of(start: Start) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pose (3,), covariance (3, 3) and search (see `_acquisition_kernels`) that a start means."""
    search, (pose, covariance) = np.zeros(_acquisition_kernels.N_SEARCH), moments_of_start(start)
    if not isinstance(start, UnknownStart):
        search[_acquisition_kernels.STAGE] = 2.0
        covariance = covariance + np.diag(_KNOWN) * (1.0 if isinstance(start, KnownStart) else 1e-3)
    return pose, covariance, search
