"""A detection field learned from training snapshots: no model of antennas, tags or walls (uhf_snapshots)."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from rfiddesign import require
from rfiddesign.models._fingerprint_kernels import kernel_mean
from rfiddesign.models.snapshots import Snapshots, concatenated
from rfiddesign.models.step_prior import StepPrior

# Tags times poses that one answer may hold: 1 GB.
MAX_ANSWERS = 250_000_000
# Cells that snapshots are sorted into.
MAX_CELLS = 10_000_000


@dataclass(frozen=True)
class Smoothing:
    """How snapshots speak for the poses about them (uhf_snapshots, eq. 5 and section IV-A).

    The distance of two antenna poses is the root of (way / sigma_mm)^2 + (turn / sigma_rad)^2: the paper wants a metric
    that respects orientation and does not print its weight.

    Parameters
    ----------
    sigma_mm, sigma_rad : bandwidth of the kernel by way and by turn.
    beta : weight of the estimate without snapshots.
    reach : snapshots farther than this many bandwidths do not count.
    prior : of a tag's chance to be read.
    """

    sigma_mm: float = 500.0
    sigma_rad: float = math.radians(30.0)
    beta: float = 0.25
    reach: float = 2.0
    prior: StepPrior = field(default_factory=StepPrior)

    def __post_init__(self) -> None:
        require.within("sigma_mm", self.sigma_mm, low=1.0, high=1e5)
        require.within("sigma_rad", self.sigma_rad, low=1e-3, high=1e3)
        require.within("beta", self.beta, low=0.0, high=1e3, is_low_open=True)
        require.within("reach", self.reach, low=0.5, high=10.0)


class FingerprintField:
    """Read probabilities of all tags by antenna pose, as training snapshots tell them: a `DetectionField`.

    Parameters
    ----------
    training : snapshots with the antenna poses that a reference localizer gave them; simulated or recorded.
    smoothing : see there.

    Raises
    ------
    ValueError : if there are no snapshots, they differ in the number of tags or of cycles, or lie too far apart.
    """

    def __init__(self, training: Sequence[Snapshots], smoothing: Smoothing | None = None):
        smoothing = smoothing or Smoothing()
        if not any(len(part) for part in training):
            raise ValueError("training has no snapshots, must have at least one")
        joined = concatenated(training)
        self.smoothing, self.n_tags, self.n_cycles = smoothing, joined.n_tags, joined.n_cycles
        self.n_snapshots = len(joined.poses)
        width = smoothing.reach * smoothing.sigma_mm
        low, high = joined.poses[:, :2].min(axis=0), joined.poses[:, :2].max(axis=0)
        sides = np.floor((high - low) / width) + 1
        if not np.prod(sides) <= MAX_CELLS:
            raise ValueError(
                f"training extends over {high[0] - low[0]:g} by {high[1] - low[1]:g} mm: too far for kernels that"
                f" reach {width:g} mm"
            )
        n_x, n_y = (int(side) for side in sides)
        column, row = np.floor((joined.poses[:, :2] - low) / width).astype(np.int64).T
        cell = np.minimum(row, n_y - 1) * n_x + np.minimum(column, n_x - 1)
        order = np.argsort(cell, kind="stable")
        start = np.searchsorted(cell[order], np.arange(n_x * n_y + 1))
        estimates = smoothing.prior.estimates(joined.n_cycles)
        self._trained = joined.poses[order]
        self._cells = (start, float(low[0]), float(low[1]), 1.0 / width, n_x, n_y)
        self._rows = _in_order(joined, order)
        self._values = estimates - estimates[0]
        self._metric = (smoothing.sigma_mm**-2.0, smoothing.sigma_rad**-2.0, smoothing.reach**2)
        self._prior = (float(estimates[0]), smoothing.prior.mean, float(smoothing.beta))

    @property
    def n_bytes(self) -> int:
        """Memory of the training map [bytes]."""
        arrays = (self._trained, self._cells[0], *self._rows, self._values)
        return sum(array.nbytes for array in arrays)

    @property
    def poses(self) -> np.ndarray:
        """Antenna poses (n_snapshots, 3) at which it was trained, in no particular order."""
        return self._trained

    def read_probability(self, antenna_poses: np.ndarray) -> np.ndarray:
        """Chance (n, n_tags), float32, that an antenna at each pose (n, 3) [mm, mm, rad] reads each tag in a cycle."""
        return self.with_support(antenna_poses)[0]

    def with_support(self, antenna_poses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """`read_probability`, and how many snapshots there are about each pose: the sum (n,) of their kernels."""
        poses = np.ascontiguousarray(antenna_poses, float)
        if poses.ndim != 2 or poses.shape[1] != 3 or not np.isfinite(poses).all():
            raise ValueError(f"antenna_poses: shape {poses.shape}, must be finite and (n, 3)")
        if len(poses) * self.n_tags > MAX_ANSWERS:
            raise ValueError(f"antenna_poses has {len(poses):,} rows, must have {MAX_ANSWERS // self.n_tags:,} at most")
        out, support = np.empty((len(poses), self.n_tags), np.float32), np.empty(len(poses))
        kernel_mean(
            poses, self._trained, self._cells, self._rows, self._values, self._metric, self._prior, out, support
        )
        return out, support


def _in_order(snapshots: Snapshots, order: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(start, tag, count) of snapshots in another order."""
    lengths = np.diff(snapshots.start)[order]
    start = np.concatenate([[0], np.cumsum(lengths)])
    entry = np.repeat(snapshots.start[order] - start[:-1], lengths) + np.arange(start[-1])
    return start, snapshots.tag[entry], snapshots.count[entry]
