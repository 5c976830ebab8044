"""What is believed of one tag's place: masses of the cells of a square window, each counting at its cell's middle.

The same grid as in Markov localization with the roles swapped: there the robot's place is sought and the tag's known.
All functions return new windows.  Logarithms are kept, without the factors that all cells share, whose sum is kept
beside them.
"""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from rfiddesign import require
from rfiddesign.estimators.tag_mapping import _observation_kernels as observation_kernels
from rfiddesign.estimators.tag_mapping import _window_kernels as kernels
from rfiddesign.models.log_field import LogField

# 16 MB.
MAX_CELLS = 2001
# Logarithms that are multiples of this add without rounding as long as sums stay below 1,024: beliefs that are alike
# remain alike, in whatever order they came to be.
EXACT_STEP = 2.0**-14
MAX_EXACT = 1000.0


@dataclass(frozen=True, eq=False)
class Window:
    """A belief in one tag's place.

    Parameters
    ----------
    centre_mm : middle of the middle cell [mm].
    cell_mm : side of a cell [mm].
    logs : (n, n) float32, n odd: logarithms of masses by y (rows) and x; minus infinity where the tag cannot be.
    log_scale : what is to be added to all of them for the chance of all that was observed, with the tag in the cell.
    box : rows box[0] to box[1] - 1 and columns box[2] to box[3] - 1 hold all mass; the whole window if not given.
    """

    centre_mm: tuple[float, float]
    cell_mm: float
    logs: np.ndarray
    log_scale: float = 0.0
    box: tuple[int, int, int, int] | None = None

    def __post_init__(self) -> None:
        if self.box is None:
            n = len(self.logs)
            object.__setattr__(self, "box", (0, n, 0, n))

    @property
    def low_mm(self) -> tuple[float, float]:
        """Middle of the lowest cell [mm]."""
        half = (len(self.logs) // 2) * self.cell_mm
        return self.centre_mm[0] - half, self.centre_mm[1] - half

    @property
    def _frame(self) -> tuple[float, float, float]:
        return *self.low_mm, float(self.cell_mm)


class Ellipses(NamedTuple):
    """What one read says: one logarithm in an ellipse, another in what a second one has beyond it, 0 elsewhere.

    Both have one end of their long axis at the antenna and lie ahead of it; a length of 0 is no ellipse.

    Fields
    ------
    inner_mm, inner_log : long axis of the first [mm], and what it adds.
    outer_mm, outer_log : those of the second.
    ratio : short axis to long one, of both.
    far_log : logarithm of the chance of the read elsewhere, to which the others are relative.
    """

    inner_mm: float
    inner_log: float
    outer_mm: float
    outer_log: float
    ratio: float
    far_log: float


def flat_window(centre_mm: ArrayLike, radius_mm: float, cell_mm: float) -> Window:
    """A tag anywhere within a radius of a place, each cell as likely as any other."""
    window = _empty(centre_mm, radius_mm, cell_mm)
    kernels.fill_flat(window.logs, radius_mm / cell_mm)
    return _normalized(window)


def gaussian_window(centre_mm: ArrayLike, covariance_mm2: ArrayLike, half_width_mm: float, cell_mm: float) -> Window:
    """A tag about a place, normally distributed as far as the window goes.

    Raises
    ------
    ValueError : if the covariance (2, 2) is not positive definite, or narrower than a third of a cell [mm].
    """
    covariance = np.asarray(covariance_mm2, float)
    if covariance.shape != (2, 2) or not np.isfinite(covariance).all():
        raise ValueError(f"covariance_mm2 of shape {covariance.shape}: must be a finite 2 x 2 matrix")
    if np.linalg.eigvalsh(covariance)[0] < (cell_mm / 3) ** 2:
        raise ValueError(f"covariance_mm2 is narrower than a third of a cell of {cell_mm:g} mm: cells must be smaller")
    window, precision = _empty(centre_mm, half_width_mm, cell_mm), np.linalg.inv(covariance) * cell_mm**2
    kernels.fill_gaussian(window.logs, precision[0, 0], precision[0, 1], precision[1, 1])
    return _normalized(window)


def weigh_by_ellipses(window: Window, pose: ArrayLike, ellipses: Ellipses) -> Window:
    """Weigh by one read of an antenna at a pose (3,) [mm, mm, rad]."""
    logs, (x, y, heading) = window.logs.copy(), (require.finite("pose", value) for value in np.asarray(pose, float))
    observation_kernels.weigh_by_ellipses(logs, *window._frame, x, y, heading, *ellipses[:5])
    return replace(window, logs=logs, log_scale=window.log_scale + ellipses.far_log)


def weigh_by_polls(window: Window, poses: ArrayLike, is_read: ArrayLike, field: LogField) -> Window:
    """Weigh by polls of an antenna, each of which read the tag or did not.

    Parameters
    ----------
    poses : (m, 3) or (3,) x [mm], y [mm] and heading [rad] of the antenna at each poll.
    is_read : (m,) or one, whether the poll read the tag.
    field : what reads and silence say, looked up by bilinear interpolation at the middles of the cells.
    """
    return weigh_by_words(window, poses, np.where(np.asarray(is_read, bool), 0, len(field.tables) - 1), field)


def weigh_by_words(window: Window, poses: ArrayLike, said: ArrayLike, field: LogField) -> Window:
    """As `weigh_by_polls`; `said` (m,) or one: which of the field's tables it is that a poll said."""
    poses = np.ascontiguousarray(np.atleast_2d(np.asarray(poses, float)))
    said = np.ascontiguousarray(np.broadcast_to(np.asarray(said, np.int64), len(poses)))
    if poses.shape[1:] != (3,) or not np.isfinite(poses).all():
        raise ValueError(f"poses of shape {poses.shape}: must be finite, (m, 3)")
    n_things, _, n_v = field.tables.shape
    if said.size and not 0 <= said.min() <= said.max() < n_things:
        raise ValueError(f"said has a number outside 0 to {n_things - 1}, the field's tables")
    logs, box, n = window.logs.copy(), np.array(window.box), len(window.logs)
    lowered = observation_kernels.weigh_by_polls(
        logs, box, *window._frame, poses, said, field.tables.reshape(n_things, -1), n_v,
        field.low_u, field.low_v, field.cell_mm, np.empty(n, np.int32), np.empty((2, n), np.float32),
        np.empty(n, np.float32),
    )  # fmt: skip
    scale = window.log_scale + lowered + float(field.far[said].sum())
    return replace(window, logs=logs, log_scale=scale, box=tuple(box.tolist()))


def moments(window: Window) -> tuple[np.ndarray, np.ndarray]:
    """Mean (2,) [mm] and covariance (2, 2) [mm^2] of the tag's place, which may be anywhere within its cell."""
    told, cell = _moments(window), window.cell_mm
    mean = np.array(window.centre_mm) + cell * told[1:3]
    return mean, cell**2 * (told[[[3, 4], [4, 5]]] + np.eye(2) / 12.0)


def log_evidence(window: Window) -> float:
    """Logarithm of the chance of all that was observed, for a tag that lay where the window had it at first."""
    told = _moments(window)
    return window.log_scale + told[6] + math.log(told[0])


def peak(window: Window) -> np.ndarray:
    """Centre of gravity (2,) [mm] of the cells with the largest mass."""
    n, box = len(window.logs), np.array(window.box)
    best = kernels.largest(window.logs, box, np.empty(n, np.float32))
    _, x, y = kernels.peak(window.logs, box, best, np.empty(n, np.int32))
    return np.array(window.centre_mm) + window.cell_mm * np.array([x, y])


def masses(window: Window) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Masses (n, n) by y and x, which sum to 1, and the places x (n,) and y (n,) of their cells [mm]."""
    logs = window.logs.astype(float)
    mass = np.exp(logs - logs.max())
    steps = (np.arange(len(logs)) - len(logs) // 2) * window.cell_mm
    return mass / mass.sum(), window.centre_mm[0] + steps, window.centre_mm[1] + steps


def _empty(centre_mm: ArrayLike, half_width_mm: float, cell_mm: float) -> Window:
    x, y = (require.finite("centre_mm", value) for value in np.asarray(centre_mm, float))
    half = require.positive("half_width_mm", half_width_mm) / require.positive("cell_mm", cell_mm)
    if half > MAX_CELLS // 2:
        raise ValueError(
            f"cell_mm is {cell_mm:g}, too small for +-{half_width_mm:g} mm: at most {MAX_CELLS} cells a side"
        )
    n = 2 * math.ceil(half - 1e-9) + 1
    return Window((x, y), float(cell_mm), np.empty((n, n), np.float32))


def _normalized(window: Window) -> Window:
    told = _moments(window)
    return replace(window, log_scale=-(told[6] + math.log(told[0])))


def _moments(window: Window) -> np.ndarray:
    """The six of `moments_of_sums`, and the largest logarithm."""
    n, box, told = len(window.logs), np.array(window.box), np.zeros(7)
    told[6] = kernels.largest(window.logs, box, np.empty(n, np.float32))
    if not math.isfinite(told[6]):
        raise ValueError("window: no cell has any mass")
    kernels.moments(window.logs, box, told[6], np.empty((3, n)), told[:6])
    return told
