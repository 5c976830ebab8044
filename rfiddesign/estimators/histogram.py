"""The exact filter, for comparison: the probability of every cell of (x, y, heading) in a window about the robot.

It solves the same model as `particle_filter`, by sums over cells in place of draws: slow, but without the noise of
sampling and without the Gaussians of a Kalman filter.  What remains is the size of its cells, which are halved and
doubled to fit the belief; layers of equal heading move by real numbers, so that motion costs no accuracy.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from scipy.special import ndtr

from rfiddesign import require
from rfiddesign.estimators import _histogram_evidence_kernels as evidence_kernels
from rfiddesign.estimators import _histogram_kernels as kernels
from rfiddesign.estimators import _histogram_window_kernels as window_kernels
from rfiddesign.estimators._acquisition_kernels import N_SEARCH, STAGE
from rfiddesign.estimators.mcl import motion_noise
from rfiddesign.estimators.operations import Load, tags_within
from rfiddesign.estimators.start import Start, UnknownStart, moments_of_start
from rfiddesign.estimators.verbs import (
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
from rfiddesign.geometry import DetectionArea, Disc, ProbabilityMap
from rfiddesign.models.motion import Motion, OmnidirectionalMotion
from rfiddesign.models.robot import Robot
from rfiddesign.models.shape import radius_of
from rfiddesign.models.soft_field import blur_mm, read_tables

__all__ = [
    "Histogram", "build", "cells", "estimate", "flops_per_step", "init", "predict", "share_lost", "track", "update",
    "workspace",
]  # fmt: skip

KERNELS = Kernels(kernels.predict, kernels.update, kernels.track)
MAX_CELLS = 20_000_000
# Cells shrink and grow by so much at most.
_FINER, _COARSER = 1 / 16, 64.0
# Edges of evidence are resolved to this, even without softness [mm], at the least lever of a turn [mm].
_FEATURE_MM, _LEVER_MM = 1.0, 100.0
_MAX_TABLE_SIDE = 1024

# Floating-point operations per cell: `diffuse_layer` along three directions, `exchange_layers` with two neighbours of
# four cells each, sums, `moments` and `_scale`; per cell and row of evidence: distance or place, chance, product, sum.
_MOVE, _MEASURE, _WEIGH = 3 * 5 + 17, 9, 15


@dataclass(frozen=True)
class Histogram:
    """Settings of the filter.

    Beliefs much wider than the finest edges of the evidence (NaviFloor's rings of 5 mm in a start of 60 mm) want more
    cells than the default, thus time: compare with 121 x 121 x 81.  A known start is a point.  Noise along one axis
    alone gets a fiftieth of it along the other.

    Parameters
    ----------
    motion : noise that the filter adds to the odometry.
    cell_mm, cell_rad : side of a cell in x and y, and step in heading, if not `is_adaptive`; else what bounds them.
    n_cells : cells of the window in x and in y (odd).
    n_headings : layers of the window in heading (odd); 1: the heading is taken as known but for what odometry says.
    uses_rssi : whether a read with RSSI j puts the tag into the ring between the radii of j and j + 1.
    learns_from_nothing : whether a poll that read nothing speaks against places with a tag in view.
    softness_mm : standard deviation by which the field's border is blurred [mm].
    radius_tolerance : share by which the field may be larger or smaller than it is believed; blurs the border, too.
    read_probability : chance that a tag in the field is read, as the filter believes; at most 0.999.
    is_age_compensated : as in `mcl.Mcl`.
    is_adaptive : whether cells are halved where the belief is narrow and doubled where it outgrows the window: from
        1/16 of the given ones to 64 times them, and to layers all around.
    """

    motion: Motion = field(default_factory=OmnidirectionalMotion)
    cell_mm: float = 6.0
    cell_rad: float = math.radians(1.5)
    n_cells: int = 91
    n_headings: int = 41
    uses_rssi: bool = True
    learns_from_nothing: bool = True
    softness_mm: float = 1.0
    radius_tolerance: float = 0.0
    read_probability: float = 0.98
    is_age_compensated: bool = True
    is_adaptive: bool = True

    def __post_init__(self) -> None:
        require.within("cell_mm", self.cell_mm, low=0.01, high=1e4)
        require.within("cell_rad", self.cell_rad, low=1e-5, high=0.5)
        for name, is_one_allowed in (("n_cells", False), ("n_headings", True)):
            n = getattr(self, name)
            if not isinstance(n, int) or n % 2 == 0 or not (9 <= n <= 10_001 or (n == 1 and is_one_allowed)):
                raise ValueError(f"{name} is {n!r}, must be an odd number from 9 to 10,001")
        n = self.n_cells**2 * self.n_headings
        if n > MAX_CELLS:
            raise ValueError(f"n_cells^2 n_headings is {n:,}, must be at most {MAX_CELLS:,}")
        if self.n_headings * self.cell_rad > 2 * math.pi + 1e-9:
            raise ValueError(f"n_headings cell_rad is {self.n_headings * self.cell_rad:.4g}, must be at most a turn")
        require.within("softness_mm", self.softness_mm, low=0.0, high=1e4)
        require.within("radius_tolerance", self.radius_tolerance, low=0.0, high=1.0)
        require.within("read_probability", self.read_probability, low=0.01, high=0.999)


def build(settings: Histogram, robot: Robot, dt_s: float) -> Filter:
    """Make the filter ready for a robot whose antennas are heard every `dt_s` seconds.

    Raises
    ------
    ValueError : if the motion's noise turns the robot by more than 0.49 rad (one sigma) within a step.
    """
    poses = np.asarray(robot.layout.poses_mm, float)
    schedule = robot.reads.schedule(len(poses), dt_s)
    lever = max(float(np.hypot(poses[:, 0], poses[:, 1]).max()), _LEVER_MM)
    softness = blur_mm(robot.area, settings.softness_mm, settings.radius_tolerance)
    feature = max(softness, _FEATURE_MM)
    limits = (
        settings.cell_mm * _FINER, settings.cell_mm * _COARSER, settings.cell_rad * _FINER,
        2 * math.pi / settings.n_headings, feature, feature / lever,
    )  # fmt: skip
    uses_rssi = settings.uses_rssi and bool(robot.rssi_radii_mm)
    model = (
        np.column_stack([poses[:, :2], np.cos(poses[:, 2]), np.sin(poses[:, 2])]),
        motion_noise(settings.motion, dt_s),
        _field(robot.area, robot.rssi_radii_mm if uses_rssi else (), softness),
        (
            float(softness), float(settings.read_probability), uses_rssi, settings.learns_from_nothing,
            settings.is_adaptive, radius_of(robot.area), limits,
        ),
        (settings.is_age_compensated, robot.reads.delay_s / dt_s),
        (robot.reads.answers == "all", schedule.slots, schedule.phases, schedule.period),
    )  # fmt: skip
    return Filter(settings, dt_s, len(poses), KERNELS, model)


def _field(area: DetectionArea, rssi_radii_mm: tuple[float, ...], softness_mm: float) -> tuple:
    """What an antenna reads, see `_histogram_evidence_kernels`."""
    z = np.arange(-evidence_kernels.CDF_MOST, evidence_kernels.CDF_MOST + 1e-9, 1 / evidence_kernels.CDF_PER_UNIT)
    # Beyond the table there is nothing, to the last bit.
    cdf = (ndtr(z) - ndtr(z[0])) / (ndtr(z[-1]) - ndtr(z[0]))
    radii = np.array([*rssi_radii_mm, 0.0], float)
    if isinstance(area, Disc):
        return float(area.radius_mm), np.zeros((2, 2)), 1.0, True, float(area.radius_mm), radii, cdf
    if isinstance(area, ProbabilityMap):
        tables, cell, reach = read_tables(area, (), softness_mm, 0.5)
        chance = -2.0 * np.expm1(tables[-1].astype(float))
        return 0.0, np.ascontiguousarray(chance), 1.0 / cell, False, reach, radii, cdf
    extent = 2.0 * (area.reach_mm + evidence_kernels.CDF_MOST * max(softness_mm, 0.1 * area.reach_mm))
    cell = max(0.5, extent / _MAX_TABLE_SIDE)
    n = math.ceil(extent / cell) + 2
    axis = (np.arange(n) - (n - 1) / 2) * cell
    depth = -area.signed_distance(np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1))
    return 0.0, np.ascontiguousarray(depth, float), 1.0 / cell, True, float(area.reach_mm), radii, cdf


def init(ready: Filter, start: Start, key: int) -> Belief:
    """The belief before the first step; told nothing, the filter waits for two tags (eq. 13)."""
    settings, rules = ready.settings, ready.model[3]
    k, n = settings.n_headings, settings.n_cells
    mass, spare, origins = np.zeros((k, n, n)), np.zeros((k, n, n)), np.zeros((k, 2))
    box, frame, shape = np.zeros(6, np.int64), np.zeros(window_kernels.N_FRAME), np.zeros(window_kernels.N_SHAPE)
    marginals, search = np.zeros((3, max(k, n))), np.zeros(N_SEARCH)
    pose, covariance = moments_of_start(start)
    held = moments_of(pose, covariance)
    frame[window_kernels.CELL], frame[window_kernels.TURN] = settings.cell_mm, settings.cell_rad
    if not isinstance(start, UnknownStart):
        search[STAGE] = 2.0
        kernels.begin(pose, covariance, rules[6], rules[4], mass, spare, origins, box, frame)
        window_kernels.moments(mass, origins, box, frame, marginals, shape, held.reshape(1, -1), 0)
        window_kernels.trim(mass, box, marginals, 1.0)
        # The window's moments took its place.
        held = moments_of(pose, covariance)
    arrays = (mass, spare, origins, box, frame, shape, marginals, held, search)
    return belief(key, arrays, held.copy())


def flops_per_step(ready: Filter, load: Load) -> float:
    """Floating-point operations per step, about, as if the belief filled its window; see `operations`."""
    settings, rows = ready.settings, load.reads
    if settings.learns_from_nothing:
        rows += load.silent_polls * tags_within(load, ready.model[2][4] + 2.0 * load.spread_mm)
    return settings.n_cells**2 * settings.n_headings * (_MOVE + _MEASURE + rows * _WEIGH)


def share_lost(state: Belief) -> float:
    """Share of the belief's mass that left the window since the start.

    More than a few thousandths over a run says that the window was too small.
    """
    return float(state.arrays[4][window_kernels.LOST])


def cells(state: Belief) -> tuple[float, float]:
    """Side of a cell [mm] and turn between layers [rad] as they are now."""
    return float(state.arrays[4][window_kernels.CELL]), float(state.arrays[4][window_kernels.TURN])
