"""Posterior of one tag's place from a survey: soft detection field, reads and non-reads, unknown shifts of the reference.

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
from dataclasses import dataclass

import numpy as np

from rfiddesign import require
from rfiddesign.estimators.tag_mapping import _soft_kernels as kernels
from rfiddesign.models.robot import Robot
from rfiddesign.models.soft_field import read_tables

#: Tables of what a poll says of a tag.
NOTHING, READ, ANOTHER = 0, 1, 2
# A stationary robot would make visits without an end.
_MOST_CELLS = 400
# The prior and the blur are done with beyond so many sigmas.
_PRIOR_SIGMAS, _BLUR_SIGMAS = 4.0, 3.0
_LEAST_CELL_MM, _MOST_CELL_MM = 1.0, 5.0
_CELLS_PER_SIGMA = 2.5
# Blur of the border of a field that is known well [mm].
_BORDER_MM = 1.0


@dataclass(frozen=True)
class ReferenceError:
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
    """Places about a centre, with what is needed to weigh them; made once for all tags of a survey.

    Parameters
    ----------
    n : cells per side; cell_mm : their side.
    log_prior : (n, n) logarithm of the prior's share in each cell.
    model : tables, their cell, the distance beyond which a place is out of reach, and the blur, as the kernel takes
        them.
    """

    n: int
    cell_mm: float
    log_prior: np.ndarray
    model: tuple

    @property
    def reach_mm(self) -> float:
        """Distance from an antenna beyond which all places are alike to it [mm]."""
        return self.model[2]

    @property
    def half_mm(self) -> float:
        """Half the side of the grid with the rim that the blur uses up."""
        return 0.5 * self.cell_mm * (self.n + self.model[3].size - 1)

    @property
    def axis_mm(self) -> np.ndarray:
        """Centres of the cells along an axis (n,), about the grid's centre."""
        return self.cell_mm * (np.arange(self.n) - 0.5 * (self.n - 1))


@dataclass(frozen=True)
class Posterior:
    """Where a tag lies.

    Parameters
    ----------
    mean_mm : (2,) about the grid's centre [mm]; covariance_mm2 : (2, 2), the cells' own spread included.
    log_evidence : logarithm of the chance of all that was polled, had the tag's place come from the prior.
    """

    mean_mm: np.ndarray
    covariance_mm2: np.ndarray
    log_evidence: float


def soft_grid(robot: Robot, reference: ReferenceError, prior_mm: float, visit_s: float) -> SoftGrid:
    """Lay a grid for tags with a prior of `prior_mm` per axis, passed over in `visit_s` seconds."""
    require.within("prior_mm", prior_mm, low=0.1, high=1000.0)
    shift_mm = reference.pose_mm * math.sqrt(reference.mean_share(visit_s))
    finest = min(prior_mm, max(reference.pose_mm, _BORDER_MM))
    cell = min(max(finest / _CELLS_PER_SIGMA, _LEAST_CELL_MM), _MOST_CELL_MM)
    n = 2 * math.ceil(_PRIOR_SIGMAS * prior_mm / cell) + 1
    rim = math.ceil(_BLUR_SIGMAS * shift_mm / cell)
    if n + 2 * rim > _MOST_CELLS:
        cell *= (n + 2 * rim) / _MOST_CELLS
        n, rim = 2 * math.ceil(_PRIOR_SIGMAS * prior_mm / cell) + 1, math.ceil(_BLUR_SIGMAS * shift_mm / cell)
    arms = np.hypot(*np.asarray(robot.layout.poses_mm)[:, :2].T)
    softness = math.sqrt(
        _BORDER_MM**2
        + reference.pose_mm**2 * (1.0 - reference.mean_share(visit_s))
        + reference.heading_rad**2 * float(np.mean(arms**2))
        + cell**2 / 12.0
    )
    tables, table_cell = outcome_tables(robot, softness)
    taps = np.exp(-0.5 * (cell * np.arange(-rim, rim + 1) / shift_mm) ** 2) if rim else np.ones(1)
    along = -0.5 * (cell * (np.arange(n) - 0.5 * (n - 1)) / prior_mm) ** 2
    prior = along[:, None] + along
    prior -= np.log(np.exp(prior).sum())
    return SoftGrid(n, cell, prior, (tables, table_cell, _reach(tables, table_cell), taps / taps.sum()))


def outcome_tables(robot: Robot, softness_mm: float) -> tuple[np.ndarray, float]:
    """Log likelihoods (3, a, b) of NOTHING, READ and ANOTHER in cells about the antenna, and the side of a cell [mm]."""
    tables, cell, _ = read_tables(robot.area, (), float(softness_mm), float(robot.reads.read_probability))
    nothing = tables[-1].astype(float)
    silent = nothing if robot.reads.answers == "all" else np.log1p(0.5 * np.expm1(nothing))
    return np.ascontiguousarray([nothing, tables[0], silent], float), cell


def _reach(tables: np.ndarray, cell: float) -> float:
    """Distance beyond which no table differs from what holds far away by more than a billionth."""
    u, v = (cell * (np.arange(n) - (n - 1) / 2) for n in tables.shape[1:])
    differs = np.any(np.abs(tables - tables[:, :1, :1]) > 1e-9, axis=0)
    return float(np.max(np.hypot(u[:, None], v)[differs], initial=0.0)) + cell


def posterior(grid: SoftGrid, polls: tuple[np.ndarray, ...], visit_start: np.ndarray, weights: np.ndarray) -> Posterior:
    """The posterior of a tag.

    Parameters
    ----------
    polls : x, y of the antenna about the grid's centre [mm], its direction, and what it says of the tag, (p,) each.
    visit_start : (n_visits + 1,) first poll of each visit; weights : (n_visits,) of each.
    """
    total = np.zeros((grid.n, grid.n))
    x, y, yaw, outcome = polls
    kernels.add_visits(x, y, yaw, outcome, visit_start, weights, grid.model, grid.cell_mm, total)
    total += grid.log_prior
    most = total.max()
    mass = np.exp(total - most)
    sum_ = float(mass.sum())
    mass /= sum_
    axis = grid.axis_mm
    mean = np.array([mass.sum(axis=1) @ axis, mass.sum(axis=0) @ axis])
    x_off, y_off = axis - mean[0], axis - mean[1]
    covariance = np.array(
        [
            [mass.sum(axis=1) @ x_off**2, x_off @ mass @ y_off],
            [x_off @ mass @ y_off, mass.sum(axis=0) @ y_off**2],
        ]
    )
    return Posterior(mean, covariance + grid.cell_mm**2 / 12.0 * np.eye(2), float(most + math.log(sum_)))
