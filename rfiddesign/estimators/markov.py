"""Markov localization on a moving grid of positions, with the heading by a Kalman filter (markov_kalman_smart_floor).

Equations as corrected: 8 is a Gaussian in way and direction, 10 in the distance between antenna and tag, 11 adds the
two places' variances.  Two things are done another way than the paper has them:

- The grid (eq. 5) moves with the robot by the odometry's exact motion, so that nothing is interpolated; only what the
  motion adds in uncertainty blurs the grid (eqs. 6, 7), and only when it must: before a read, or when it is some cells.
- Eq. 8 draws an error of the direction for each step anew, so that ever shorter steps would make it vanish.  Here the
  heading's error stays: a way w moves the position by error times w across it.  The covariance of position and heading
  that this makes is kept beside the grid, as of a parameter that one considers but does not estimate from the position
  (Schmidt), and the paper's direction between two places corrects the heading.
"""

from dataclasses import dataclass, field

import numpy as np

from rfiddesign import require
from rfiddesign.estimators import _acquisition_kernels as acquisition_kernels
from rfiddesign.estimators import _markov_belief_kernels as belief_kernels
from rfiddesign.estimators import _markov_kernels as kernels
from rfiddesign.estimators.mcl import motion_noise
from rfiddesign.estimators.operations import ANTENNA_THEN, ATAN2_64, EXP_32, SIN_COS_64, STEP_VARIANCES, Load
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
from rfiddesign.models.motion import DifferentialMotion, Motion
from rfiddesign.models.robot import Robot
from rfiddesign.models.shape import radius_of

__all__ = ["Markov", "build", "estimate", "flops_per_step", "grid", "init", "predict", "track", "update", "workspace"]

MAX_CELLS = 1001
KERNELS = Kernels(kernels.predict_step, kernels.update_step, kernels.track)

# Floating-point operations: `_markov_belief_kernels.predict` and `_markov_kernels._write`, each step; a read's share in
# the place to weigh by; `_correct_heading`.
_PREDICT, _WRITE, _PER_READ, _HEADING = SIN_COS_64 + STEP_VARIANCES + 66, 50, ANTENNA_THEN + 20, 2 * ATAN2_64 + 50
# Per cell and step with a read: one blur, as a rule along two directions by the cells to either side, and `weigh`.
_BLUR, _WEIGH = 2 * 5, 8
# Per cell of a side: the two factors of eq. 10.
_FACTORS = 2 * (EXP_32 + 6)


@dataclass(frozen=True)
class Markov:
    """Settings of the filter.

    Parameters
    ----------
    motion : noise that the filter believes the odometry to have.
    n_cells : cells along each side of the grid, odd.
    cell_mm : side of a cell [mm].
    sigma_per_radius : standard deviation of eq. 10 in radii of the antenna's area; at least half a cell is used.
    corrects_heading : whether places correct the heading ("X-Y-theta"), or it is that of the odometry ("X-Y").
    baseline_mm : two places under different tags correct the heading if they are at least this far apart [mm]; more
        than the diameter of the area, within which both places err alike.
    is_age_compensated : whether a read is applied to where its antenna was when it polled, or to where it is when the
        step ends.
    """

    motion: Motion = field(default_factory=DifferentialMotion)
    n_cells: int = 141
    cell_mm: float = 10.0
    sigma_per_radius: float = 0.5
    corrects_heading: bool = True
    baseline_mm: float = 300.0
    is_age_compensated: bool = True

    def __post_init__(self) -> None:
        if not isinstance(self.n_cells, int) or not 3 <= self.n_cells <= MAX_CELLS or self.n_cells % 2 == 0:
            raise ValueError(f"n_cells is {self.n_cells!r}, must be an odd number from 3 to {MAX_CELLS}")
        require.within("cell_mm", self.cell_mm, low=0.1, high=1e4)
        require.within("sigma_per_radius", self.sigma_per_radius, low=0.01, high=100.0)
        require.within("baseline_mm", self.baseline_mm, low=1.0, high=1e6)


def build(settings: Markov, robot: Robot, dt_s: float) -> Filter:
    """Make the filter ready for a robot whose antennas are heard every `dt_s` seconds.

    Raises
    ------
    ValueError : if the motion's noise turns the robot by more than 0.49 rad (one sigma) within a step.
    """
    poses, centre = np.asarray(robot.layout.poses_mm, float), np.asarray(robot.area.centroid_mm, float)
    cosine, sine = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    # Eq. 10 measures from the middle of what the antenna sees.
    offset = np.stack([cosine * centre[0] - sine * centre[1], sine * centre[0] + cosine * centre[1]], axis=-1)
    radius = radius_of(robot.area)
    model = (
        float(settings.cell_mm), poses[:, :2] + offset, motion_noise(settings.motion, dt_s),
        (settings.sigma_per_radius * radius) ** 2, radius, settings.corrects_heading, float(settings.baseline_mm),
        settings.is_age_compensated, robot.reads.delay_s / dt_s,
    )  # fmt: skip
    return Filter(settings, dt_s, len(poses), KERNELS, model)


def init(ready: Filter, start: Start, key: int) -> Belief:
    """The belief before the first step; `key` is not used, since nothing is drawn."""
    n, cell = ready.settings.n_cells, float(ready.settings.cell_mm)
    numbers, grids = np.zeros(belief_kernels.N_NUMBERS), np.zeros((2, n, n))
    search, (pose, covariance) = np.zeros(acquisition_kernels.N_SEARCH), moments_of_start(start)
    moments = moments_of(pose, covariance)
    if not isinstance(start, UnknownStart):
        belief_kernels.begin(cell, pose, covariance, numbers, grids, belief_kernels.make_room(n))
    else:
        numbers[[belief_kernels.MIDDLE_X, belief_kernels.MIDDLE_Y]] = moments[:2]
        numbers[[belief_kernels.GRID_XX, belief_kernels.GRID_YY, belief_kernels.VARIANCE]] = moments[[3, 5, 8]]
    return belief(key, (numbers, grids, search), moments)


def flops_per_step(ready: Filter, load: Load) -> float:
    """Floating-point operations per step, about; see `operations`."""
    n = ready.settings.n_cells
    weighing = (_BLUR + _WEIGH) * n**2 + _FACTORS * n + _HEADING * ready.settings.corrects_heading
    return _PREDICT + _WRITE + load.reads * _PER_READ + load.read_share * weighing


def grid(ready: Filter, state: Belief) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Masses of the cells (n, n), by y then x, with their places x (n,) and y (n,) [mm]; without motion still due."""
    numbers, grids, _ = state.arrays
    n, cell = ready.settings.n_cells, ready.settings.cell_mm
    steps = (np.arange(n) - n // 2) * cell
    masses = grids[int(numbers[belief_kernels.WHICH])]
    total = masses.sum()
    x, y = numbers[belief_kernels.MIDDLE_X] + steps, numbers[belief_kernels.MIDDLE_Y] + steps
    return masses / total if total > 0.0 else masses.copy(), x, y
