"""Projected-moment Gaussian filter (PMG): a few Gaussians over the pose that learn from every poll, read or not.

The likelihood is that of `particle_filter`: the field of the antennas.  What a poll says depends on a tag's place in
the antenna's frame, a plane; the moments of the belief there, after the poll, move a Gaussian over the pose as a
measurement moves a Kalman filter (`_projection_kernels`).  Where a Gaussian is wide beside the field it is split, so
that the mixture follows what no Gaussian is; components that became alike are merged (Runnalls 2007).  Told nothing, or
carried away, the robot has 32 headings at the first tag that it reads, and evidence decides.

`portable` has the same in C: what changes in a kernel changes there.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from rfiddesign import require
from rfiddesign.estimators import _hypotheses_kernels as hypotheses_kernels
from rfiddesign.estimators import _mixture_kernels as mixture_kernels
from rfiddesign.estimators import _pmg_kernels as kernels
from rfiddesign.estimators._border_kernels import FARTHEST
from rfiddesign.estimators._plane_kernels import NO_INNER
from rfiddesign.estimators.mcl import motion_noise
from rfiddesign.estimators.operations import SIN_COS_64, STEP_VARIANCES, Load, tags_within
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
from rfiddesign.geometry import DetectionArea, Disc, Rectangle, RoundedRectangle
from rfiddesign.models.motion import Motion, OmnidirectionalMotion
from rfiddesign.models.robot import Robot
from rfiddesign.models.shape import radius_of
from rfiddesign.models.soft_field import blur_mm, read_tables

__all__ = [
    "Pmg",
    "build",
    "components",
    "estimate",
    "flops_per_step",
    "init",
    "predict",
    "track",
    "update",
    "workspace",
]

KERNELS = Kernels(kernels.predict, kernels.update, kernels.track)
MAX_COMPONENTS = 64
# A known start is known to this much: covariances must stay positive definite.
_KNOWN = (1e-4, 1e-4, 1e-10)
# A heading less certain than this is split into components this far apart at the start [rad].
_WIDE_HEADING, _HEADING_STEP = 0.35, 2 * math.pi / hypotheses_kernels.N_HYPOTHESES

# Floating-point operations of a component: `carry`, and its share of the estimate; of a poll: where its antenna was,
# and where on the floor that is; of a tag beside it: its distance, and what `look_across` asks before it is done with a
# tag whose border is far; of one whose border is near: the rest of that, and `learn`.
_CARRY, _WRITE, _ANTENNA, _PLACE, _NEAR, _QUICK, _ACROSS = SIN_COS_64 + STEP_VARIANCES + 66, 36, 40, 30, 5, 60, 150


@dataclass(frozen=True)
class Pmg:
    """Settings of the filter.

    Parameters
    ----------
    motion : noise that the filter adds to the odometry.
    n_components : Gaussians kept while tracking.
    uses_rssi : whether a read with RSSI j puts the tag into the ring between the radii of j and j + 1.
    learns_from_nothing : whether a poll that read nothing speaks against places with a tag in view.
    softness_mm : standard deviation by which the field's border is blurred [mm]: installation errors and the like.  A
        poll that says what the one before said counts again only after that much of way: it is the same error.
    radius_tolerance : share by which the field may be larger or smaller than it is believed; blurs the border, too.
    read_probability : chance that a tag in the field is read, as the filter believes; at most 0.999.
    split_sigma : a Gaussian is split where it is wider than this, in radii of the field (half its lesser side).
    gate, patience : reads less likely than `gate` under all components contradict the belief; after `patience` of them
        in a row the robot may as well be anywhere about the tag.
    is_age_compensated : as in `mcl.Mcl`.
    """

    motion: Motion = field(default_factory=OmnidirectionalMotion)
    n_components: int = 7
    uses_rssi: bool = True
    learns_from_nothing: bool = True
    softness_mm: float = 1.0
    radius_tolerance: float = 0.0
    read_probability: float = 0.98
    split_sigma: float = 0.5
    gate: float = 2.1e-3
    patience: int = 3
    is_age_compensated: bool = True

    def __post_init__(self) -> None:
        if not isinstance(self.n_components, int) or not 1 <= self.n_components <= MAX_COMPONENTS:
            raise ValueError(f"n_components is {self.n_components!r}, must be from 1 to {MAX_COMPONENTS}")
        require.within("softness_mm", self.softness_mm, low=0.0, high=1e4)
        require.within("radius_tolerance", self.radius_tolerance, low=0.0, high=1.0)
        require.within("read_probability", self.read_probability, low=0.01, high=0.999)
        require.within("split_sigma", self.split_sigma, low=0.05, high=100.0)
        require.within("gate", self.gate, low=0.0, high=0.5)
        if not isinstance(self.patience, int) or not 1 <= self.patience <= 1_000_000:
            raise ValueError(f"patience is {self.patience!r}, must be from 1 to 1,000,000")


def build(settings: Pmg, robot: Robot, dt_s: float) -> Filter:
    """Make the filter ready for a robot whose antennas are heard every `dt_s` seconds.

    Raises
    ------
    ValueError : if the motion's noise turns the robot by more than 0.49 rad (one sigma) within a step.
    """
    poses = np.asarray(robot.layout.poses_mm, float)
    schedule = robot.reads.schedule(len(poses), dt_s)
    uses_rssi = settings.uses_rssi and bool(robot.rssi_radii_mm)
    softness = blur_mm(robot.area, settings.softness_mm, settings.radius_tolerance)
    shapes, table, per_cell, reach = _field(robot.area, robot.rssi_radii_mm if uses_rssi else (), softness)
    levers = np.hypot(poses[:, 0], poses[:, 1])
    model = (
        np.column_stack([poses[:, :2], np.sin(poses[:, 2]), np.cos(poses[:, 2]), levers]),
        motion_noise(settings.motion, dt_s),
        shapes,
        (table, per_cell, reach if table.size else 0.0),
        (
            float(softness), float(settings.read_probability), settings.n_components, float(settings.split_sigma),
            float(settings.gate), _size(robot.area), reach, settings.patience,
        ),
        (
            robot.reads.answers == "all", schedule.slots, schedule.phases, schedule.period, uses_rssi,
            settings.learns_from_nothing, settings.is_age_compensated, robot.reads.delay_s / dt_s,
        ),
    )  # fmt: skip
    return Filter(settings, dt_s, len(poses), KERNELS, model)


def _field(area: DetectionArea, radii_mm: tuple[float, ...], softness_mm: float) -> tuple:
    """The field as the compiled filter takes it.

    Returns
    -------
    shapes (1 + n_rssi, 4): what lies within `corner` of a box of half sides, but beyond `inner`, for any read and for
    each step of RSSI; table (n, m) of the chance to be in a field of any other shape, and 1 / side of its cells; reach
    [mm].
    """
    none = np.zeros((0, 0))
    if isinstance(area, Disc):
        inner = (*radii_mm[1:], NO_INNER)[: len(radii_mm)]
        rows = [
            (0.0, 0.0, area.radius_mm, NO_INNER),
            *((0.0, 0.0, *ring) for ring in zip(radii_mm, inner, strict=True)),
        ]
        return np.array(rows, float), none, 1.0, float(area.reach_mm)
    if isinstance(area, Rectangle | RoundedRectangle):
        corner = area.corner_mm if isinstance(area, RoundedRectangle) else 0.0
        rows = [(area.length_mm / 2 - corner, area.width_mm / 2 - corner, corner, NO_INNER)]
        return np.array(rows, float), none, 1.0, float(area.reach_mm)
    tables, cell, reach = read_tables(area, (), softness_mm, 0.5)
    chance = np.ascontiguousarray(-2.0 * np.expm1(tables[-1].astype(float)))
    return np.array([(0.0, 0.0, reach, NO_INNER)]), chance, 1.0 / cell, float(reach)


def _size(area: DetectionArea) -> float:
    """Radius of the largest disc in the area, about [mm]."""
    if isinstance(area, Rectangle | RoundedRectangle):
        return min(area.length_mm, area.width_mm) / 2
    return radius_of(area)


def init(ready: Filter, start: Start, key: int) -> Belief:
    """The belief before the first step; told nothing, the filter waits for the first tag."""
    n_most = ready.settings.n_components
    rows = hypotheses_kernels.N_HYPOTHESES + n_most + 4
    mix, numbers = np.zeros((rows, mixture_kernels.N_COLUMNS)), np.zeros(kernels.N_NUMBERS, np.int64)
    heard = np.zeros((ready.n_antennas, kernels.N_HEARD))
    heard[:, kernels.LAST_N] = -1.0
    pose, covariance = moments_of_start(start)
    held = moments_of(pose, covariance)
    numbers[kernels.CAP] = n_most
    if not isinstance(start, UnknownStart):
        held = moments_of(pose, covariance + np.diag(_KNOWN))
        parts = _by_heading(pose, covariance + np.diag(_KNOWN))
        for row, (weight, mean, P) in zip(mix, parts, strict=False):
            row[mixture_kernels.WEIGHT] = weight
            row[mixture_kernels.X : mixture_kernels.XX] = mean
            row[mixture_kernels.XX : mixture_kernels.SINE] = P[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]]
            row[mixture_kernels.SINE :] = math.sin(mean[2]), math.cos(mean[2])
        numbers[kernels.N] = len(parts)
        numbers[kernels.CAP] = max(n_most, len(parts))
    return belief(key, (mix, numbers, heard, held), held.copy())


def _by_heading(pose: np.ndarray, covariance: np.ndarray) -> list[tuple[float, np.ndarray, np.ndarray]]:
    """A Gaussian as components (weight, mean, covariance) whose headings are certain enough to be linear in."""
    sigma = math.sqrt(covariance[2, 2])
    if sigma <= _WIDE_HEADING:
        return [(1.0, pose, covariance)]
    half = min(3.0 * sigma, math.pi)
    n = min(math.ceil(2 * half / _HEADING_STEP), hypotheses_kernels.N_HYPOTHESES)
    offs = (np.arange(n) - (n - 1) / 2) * (2 * half / n)
    weights = np.exp(-0.5 * (offs / sigma) ** 2)
    slope = covariance[:, 2] / covariance[2, 2]
    # What position and heading share goes with the heading; each component keeps a cell of it.
    rest = covariance - np.outer(slope, slope) * (covariance[2, 2] - (2 * half / n) ** 2 / 12)
    return [(w, pose + off * slope, rest) for w, off in zip(weights / weights.sum(), offs, strict=True)]


def components(state: Belief) -> np.ndarray:
    """The mixture (n, 12): weight; x, y, heading; var_x, cov_xy, var_y, cov_xh, cov_yh, var_h; its sine and cosine."""
    mix, numbers, _, _ = state.arrays
    return mix[: numbers[kernels.N]].copy()


def flops_per_step(ready: Filter, load: Load) -> float:
    """Floating-point operations per step with one component, about; see `operations`."""
    reach, silent = ready.model[4][6], load.silent_polls if ready.settings.learns_from_nothing else 0.0
    tags = tags_within(load, reach + 3.2 * math.sqrt(2.0) * load.spread_mm)
    # Tags whose border the belief's sigmas reach.
    near = min(tags, load.tags_per_mm2 * 2.0 * math.pi * reach * 2.0 * FARTHEST * load.spread_mm)
    read = load.reads * (_ANTENNA + _QUICK + _ACROSS)
    return _CARRY + _WRITE + read + silent * (_ANTENNA + _PLACE + tags * (_NEAR + _QUICK) + near * _ACROSS)
