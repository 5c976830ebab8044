"""Particle filter whose likelihood is what the antennas can read, nothing seen included (rssi_kalman_navifloor, IV-C).

The same compiled filter as Monte-Carlo localization, with tables of the detection field in place of eq. 6.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from rfiddesign import require
from rfiddesign.estimators.mcl import (
    KERNELS,
    check_particles,
    estimate,
    flops_per_step,
    headings,
    init,
    looks,
    motion_noise,
    positions,
    predict,
    track,
    update,
    workspace,
)
from rfiddesign.estimators.verbs import Filter
from rfiddesign.geometry import Disc
from rfiddesign.models.motion import Motion, OmnidirectionalMotion
from rfiddesign.models.robot import Robot
from rfiddesign.models.soft_field import blur_mm, read_tables, soft_discs

__all__ = [
    "ParticleFilter", "build", "estimate", "flops_per_step", "headings", "init", "positions", "predict", "track",
    "update", "workspace",
]  # fmt: skip


# Effective share of the particles below which a step's evidence is applied in stages, and number that always will do:
# a mean of so many is good to a twelfth of a sigma.
_LEAST_SHARE, _ENOUGH = 0.3, 150
# Of two particles each keeps something of its own.
_MOST_SQUARED_BANDWIDTH = 0.9


@dataclass(frozen=True)
class ParticleFilter:
    """Settings of the filter.

    Parameters
    ----------
    motion : noise that the filter adds to the odometry.
    n_particles : number of particles.
    uses_rssi : whether a read with RSSI j puts the tag into the ring between the radii of j and j + 1.
    learns_from_nothing : whether a poll that read nothing speaks against places with a tag in view.
    softness_mm : standard deviation by which the field's border is blurred [mm]: installation errors and the like.
    radius_tolerance : share by which the field may be larger or smaller than it is believed; blurs the border, too.
    read_probability : chance that a tag in the field is read, as the filter believes; at most 0.999.
    reinitialize : whether the particles restart in the detection region once all of them contradict a read.
    alpha : weight that counts as a contradiction if that of every particle is below it, times 1/2 for every tag that
        was looked at: on the border of the field is no contradiction.
    is_age_compensated : as in `mcl.Mcl`.
    is_regularized : whether drawn particles are set apart by a Liu-West kernel, see `_regularize_kernels`.
    is_tempered : whether evidence that leaves few particles is applied in stages, see `_temper_kernels`.
    """

    motion: Motion = field(default_factory=OmnidirectionalMotion)
    n_particles: int = 500
    uses_rssi: bool = False
    learns_from_nothing: bool = True
    softness_mm: float = 3.0
    radius_tolerance: float = 0.0
    read_probability: float = 0.98
    reinitialize: bool = True
    alpha: float = 5e-3
    is_age_compensated: bool = True
    is_regularized: bool = True
    is_tempered: bool = True

    def __post_init__(self) -> None:
        check_particles(self.n_particles)
        require.within("softness_mm", self.softness_mm, low=0.0, high=1e4)
        require.within("radius_tolerance", self.radius_tolerance, low=0.0, high=1.0)
        require.within("read_probability", self.read_probability, low=0.01, high=0.999)
        require.within("alpha", self.alpha, low=0.0, high=1.0, is_low_open=True)


def build(settings: ParticleFilter, robot: Robot, dt_s: float) -> Filter:
    """Make the filter ready for a robot whose antennas are heard every `dt_s` seconds.

    Raises
    ------
    ValueError : if the motion's noise turns the robot by more than 0.49 rad (one sigma) within a step.
    """
    poses = np.asarray(robot.layout.poses_mm, float)
    uses_rssi = settings.uses_rssi and bool(robot.rssi_radii_mm)
    softness = blur_mm(robot.area, settings.softness_mm, settings.radius_tolerance)
    believed = (robot.rssi_radii_mm if uses_rssi else (), softness, settings.read_probability)
    if isinstance(robot.area, Disc):
        tables, per_width, reach = soft_discs(robot.area.radius_mm, *believed)
        cell_mm = 1.0
    else:
        tables, cell_mm, reach = read_tables(robot.area, *believed)
        per_width = 0.0
    cosine, sine = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    log_alpha = math.log(settings.alpha) if settings.reinitialize else -math.inf
    model = (
        settings.n_particles,
        poses[:, :2].copy(),
        np.ascontiguousarray(np.array([[cosine, sine], [-sine, cosine]]).transpose(2, 0, 1), np.float32),
        motion_noise(settings.motion, dt_s),
        np.array([0.0, 0.0, log_alpha, cell_mm, 1.0, per_width, *_care_of_particles(settings, reach)]),
        tables,
        (settings.is_age_compensated, robot.reads.delay_s / dt_s),
        looks(
            robot, dt_s, uses_rssi=uses_rssi, learns_from_nothing=settings.learns_from_nothing, reach=reach,
            table_number=len(tables) - 1,
        ),
    )  # fmt: skip
    return Filter(settings, dt_s, len(poses), KERNELS, model)


def _care_of_particles(settings: ParticleFilter, reach_mm: float) -> tuple[float, float, float, float]:
    """Rules of regularization and tempering, see `_mcl_kernels.update`.

    The bandwidth is Silverman's for a Gaussian in 3 dimensions, (4 / 5)^(1/7) M^(-1/7); it is for beliefs that lie
    within the reach of an antenna, since wider ones may be of several heaps, which a Gaussian would join.
    """
    squared = min((0.8 / settings.n_particles) ** (2 / 7), _MOST_SQUARED_BANDWIDTH)
    share = min(_LEAST_SHARE, _ENOUGH / settings.n_particles)
    return (
        squared if settings.is_regularized else 0.0, reach_mm**2, share if settings.is_tempered else 0.0, squared,
    )  # fmt: skip
