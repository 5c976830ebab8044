"""Posterior of one tag's place from a survey: soft field, reads and non-reads, unknown shifts of the reference.

How the error of the reference is taken in
------------------------------------------
A reference localizer is off by an error that hardly changes while the robot passes over a tag and is another one when
it comes back: here a stationary Gauss-Markov process with standard deviation s per axis and correlation exp(-t / T).
So polls of one visit are not independent.  With u the mean error over a visit that lasts D, and a = D / T,

    var u = s^2 r,   r = 2 (a - 1 + exp(-a)) / a^2,   and the error wanders about u with variance s^2 (1 - r).

1. *Within a visit* u shifts all antennas alike.  The product of the polls' likelihoods at the tag's place minus an
   unknown shift, averaged over u, is that product blurred by a Gaussian of variance s^2 r: exact for a constant shift.
   The wander softens the border of the field.
2. *Between visits* the errors are correlated, too: K_ij = exp(-|t_i - t_j| / T).  Of n equally good measurements
   with that correlation the best linear estimate weighs the i-th by w_i = (K^-1 1)_i and knows as much as sum w_i
   independent ones.  Each visit's likelihood is taken to the power w_i: n visits at one moment count once, visits far
   apart count fully.

What a poll says of one tag: it was read; nothing was read; another tag was read.  Where readers return one of the tags
in view, the last is weaker: a tag in view beside the one that answered would have stayed silent with a chance of 1/2.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from rfiddesign import require
from rfiddesign.estimators.tag_mapping import _soft_kernels as kernels
from rfiddesign.estimators.tag_mapping.window import Window, gaussian_window, log_evidence, moments
from rfiddesign.models.log_field import log_field
from rfiddesign.models.robot import Robot

#: Tables of what a poll says of a tag.
NOTHING, READ, ANOTHER = 0, 1, 2
# Cells per side of a window, with the rim that a blur uses up.
_MOST_CELLS = 400
# The prior and the blur are done with beyond so many sigmas.
_PRIOR_SIGMAS, _BLUR_SIGMAS, _NEAR_SIGMAS = 4.0, 3.0, 2.5
_LEAST_CELL_MM, _MOST_CELL_MM = 1.0, 5.0
_CELLS_PER_SIGMA = 2.5
# Blur of the border of a field that is known well [mm].
_BORDER_MM = 1.0


@dataclass(frozen=True)
class ReferenceDrift:
    """How far a reference localizer is off: a Gauss-Markov process on each axis.

    Parameters
    ----------
    pose_mm : standard deviation per axis [mm].
    heading_rad : that of the heading [rad].
    correlation_s : time in which the correlation falls to 1/e [s].
    """

    pose_mm: float = 20.0
    heading_rad: float = 0.005
    correlation_s: float = 10.0

    def __post_init__(self) -> None:
        require.within("pose_mm", self.pose_mm, low=0.0, high=1000.0)
        require.within("heading_rad", self.heading_rad, low=0.0, high=1.0)
        require.within("correlation_s", self.correlation_s, low=1e-3, high=1e6)

    def mean_share(self, duration_s: float) -> float:
        """Variance of the mean error over a time as a share of the error's."""
        a = duration_s / self.correlation_s
        return 1.0 - a / 3.0 if a < 1e-3 else 2.0 * (a - 1.0 + math.exp(-a)) / a**2

    def visit_weights(self, time_s: np.ndarray) -> np.ndarray:
        """Weights (n,) of visits at rising times (n,): K^-1 1 in closed form."""
        if len(time_s) == 0:
            return np.empty(0)
        gain = 1.0 / (1.0 + np.exp(-np.diff(time_s) / self.correlation_s))
        return np.concatenate([[1.0], gain]) + np.concatenate([gain, [1.0]]) - 1.0


@dataclass(frozen=True, eq=False)
class SoftGrid:
    """What is needed to weigh places about any centre; made once for all tags of a survey.

    Parameters
    ----------
    prior : window about (0, 0) with the prior in it.
    tables : (3, n_u * n_v) float32 log likelihoods of NOTHING, READ and ANOTHER, relative to those far away.
    frame : entries per row of a table, place of the first [mm, mm], way from entry to entry [mm].
    taps : (2 p + 1,) float32 blur in steps of a cell.
    far_read : log likelihood of a read far away.
    near_mm : distance from the prior's centre within which polls are worth a look [mm]: the field's reach, and 2.5
        sigmas of where the tag and the reference may be.
    """

    prior: Window
    tables: np.ndarray
    frame: tuple[int, float, float, float]
    taps: np.ndarray
    far_read: float
    near_mm: float


@dataclass(frozen=True)
class Posterior:
    """Where a tag lies.

    Parameters
    ----------
    mean_mm : (2,) about the prior's centre [mm]; covariance_mm2 : (2, 2).
    log_evidence : logarithm of the chance of all that was polled, had the tag's place come from the prior.
    """

    mean_mm: np.ndarray
    covariance_mm2: np.ndarray
    log_evidence: float


def soft_grid(robot: Robot, reference: ReferenceDrift, prior_mm: float, visit_s: float) -> SoftGrid:
    """Make ready for tags with a prior of `prior_mm` per axis, passed over in `visit_s` seconds.

    Raises
    ------
    ValueError : if the prior is out of bounds, or the reference's error more than a hundred times as large.
    """
    require.within("prior_mm", prior_mm, low=0.1, high=1000.0)
    share = reference.mean_share(visit_s)
    shift_mm = reference.pose_mm * math.sqrt(share)
    cell = min(max(min(prior_mm, reference.pose_mm) / _CELLS_PER_SIGMA, _LEAST_CELL_MM), _MOST_CELL_MM)
    widest_mm = 2.0 * (_PRIOR_SIGMAS * prior_mm + _BLUR_SIGMAS * shift_mm)
    cell = min(max(cell, widest_mm / _MOST_CELLS), 2.0 * prior_mm)
    if widest_mm / cell > _MOST_CELLS + 1:
        raise ValueError(
            f"pose_mm is {reference.pose_mm:g}, too large to be of any use for tags laid to {prior_mm:g} mm"
        )
    prior = gaussian_window((0.0, 0.0), prior_mm**2 * np.eye(2), _PRIOR_SIGMAS * prior_mm, cell)
    arms = np.hypot(*np.asarray(robot.layout.poses_mm)[:, :2].T)
    softness = math.sqrt(
        _BORDER_MM**2
        + reference.pose_mm**2 * (1.0 - share)
        + reference.heading_rad**2 * float(np.mean(arms**2))
        + cell**2 / 12.0
    )
    field = log_field(robot.area, softness, float(robot.reads.read_probability))
    read, nothing = field.tables[0], field.tables[-1]
    another = nothing if robot.reads.answers == "all" else np.log1p(0.5 * np.expm1(nothing))
    tables = np.array([nothing.ravel(), read.ravel(), another.ravel()], np.float32)
    rim = math.ceil(_BLUR_SIGMAS * shift_mm / cell)
    taps = np.exp(-0.5 * (cell * np.arange(-rim, rim + 1) / shift_mm) ** 2) if rim else np.ones(1)
    frame = (read.shape[1], field.low_u, field.low_v, field.cell_mm)
    near_mm = field.reach_mm + _NEAR_SIGMAS * math.hypot(prior_mm, reference.pose_mm)
    return SoftGrid(prior, tables, frame, np.float32(taps / taps.sum()), float(field.far[0]), near_mm)


def posterior(
    grid: SoftGrid, poses: np.ndarray, outcome: np.ndarray, visit_start: np.ndarray, weights: np.ndarray
) -> Posterior:
    """The posterior of a tag.

    Parameters
    ----------
    poses : (m, 3) antennas about the prior's centre [mm, mm, rad], visit by visit.
    outcome : (m,) NOTHING, READ or ANOTHER: what each poll says of the tag.
    visit_start : (n_visits + 1,) first poll of each visit; weights : (n_visits,) of each.
    """
    logs = grid.prior.logs.copy()
    poses, outcome = np.ascontiguousarray(poses, float), np.ascontiguousarray(outcome, np.int64)
    scale = kernels.add_visits(
        poses, outcome, visit_start, weights, grid.tables, grid.frame, grid.taps, grid.prior.cell_mm, logs
    )
    of_visit = np.repeat(weights, np.diff(visit_start))
    scale += grid.far_read * float(of_visit[outcome == READ].sum())
    window = replace(grid.prior, logs=logs, log_scale=grid.prior.log_scale + scale)
    return Posterior(*moments(window), log_evidence(window))
