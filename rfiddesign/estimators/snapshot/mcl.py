"""The particle filter of uhf_snapshots: odometry moves it, snapshots weigh it by a table, the floor bounds it."""

import math
from dataclasses import dataclass, field, replace

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from rfiddesign import require
from rfiddesign.estimators._estimate_kernels import N_ESTIMATE, estimate
from rfiddesign.estimators._particle_kernels import N_FIELDS, aligned_zeros, load, room_for
from rfiddesign.estimators.mcl import check_particles
from rfiddesign.estimators.snapshot import _snapshot_kernels as kernels
from rfiddesign.estimators.snapshot.likelihood import binomial_logs
from rfiddesign.estimators.verbs import workspace
from rfiddesign.floor import prepared_copy
from rfiddesign.models.fingerprint_table import FingerprintTable, level_chances
from rfiddesign.models.motion import DifferentialMotion, Motion
from rfiddesign.models.snapshots import SnapshotLog
from rfiddesign.numerics._lane_kernels import LANES
from rfiddesign.numerics._math_kernels import BINARY_UNITS_PER_RADIAN
from rfiddesign.numerics._noise_kernels import STREAM_PLACE, fill_fine_uniform, step_key

STARTS = ("snapshots", "uniform")
# Side of the cells that say where the robot can be.
_FLOOR_CELL_MM = 50.0
MAX_FLOOR_CELLS = 50_000_000


@dataclass(frozen=True)
class SnapshotMcl:
    """Settings of the filter.

    Parameters
    ----------
    motion : noise that the filter adds to the odometry.
    n_particles : number of particles.
    k_prime : tags that count in the likelihood of a snapshot (k' of eq. 9); None: all that training knows.
    start : "snapshots": at poses of training snapshots, as likely as the first snapshot is there (section IV-C);
        "uniform": anywhere in the box around the drivable floor.
    start_noise_mm, start_noise_rad : by how much particles from training poses are scattered.
    weighs_start : whether particles drawn from training poses, as likely as the first snapshot is there, are then
        weighed by it as well.  Section IV-C writes it so: (r_i, w_i), r_i drawn by w_i.  Bayes' rule uses it once.
    """

    motion: Motion = field(default_factory=DifferentialMotion)
    n_particles: int = 2000
    k_prime: int | None = 50
    start: str = "snapshots"
    start_noise_mm: float = 100.0
    start_noise_rad: float = math.radians(5.0)
    weighs_start: bool = False

    def __post_init__(self) -> None:
        check_particles(self.n_particles)
        if self.k_prime is not None:
            require.count("k_prime", self.k_prime, at_most=100_000)
        if self.start not in STARTS:
            raise ValueError(f"start is {self.start!r}, must be one of {', '.join(STARTS)}")
        require.within("start_noise_mm", self.start_noise_mm, low=0.0, high=1e4)
        require.within("start_noise_rad", self.start_noise_rad, low=0.0, high=math.pi)


@dataclass(frozen=True, eq=False)
class SnapshotFilter:
    """The filter made ready for a place and a robot.

    Parameters
    ----------
    settings : as given.
    model : what its kernels take, see `_snapshot_kernels.track`.
    n_cycles : cycles of a snapshot.
    training_poses : (n, 3) robot poses that it may start from.
    """

    settings: SnapshotMcl
    model: tuple
    n_cycles: int
    training_poses: np.ndarray


@dataclass(frozen=True, eq=False)
class SnapshotBelief:
    """What the filter knows between steps: the run's key, steps taken, particles, and the estimate (N_ESTIMATE,)."""

    key: np.uint64
    step: int
    arrays: tuple
    moments: np.ndarray


def build(
    settings: SnapshotMcl, table: FingerprintTable, antennas: np.ndarray, drivable: BaseGeometry,
    training: list[SnapshotLog], n_cycles: int,
) -> SnapshotFilter:  # fmt: skip
    """Make the filter ready.

    Parameters
    ----------
    table : chances of all tags by antenna pose.
    antennas : (n_antennas, 3) poses on the robot [mm, mm, rad].
    drivable : where the robot's centre can be.
    training : the drives that say which tags are known and where a filter may start.
    n_cycles : cycles of a snapshot.

    Raises
    ------
    ValueError : if a log's tags are not those of the table, or the floor is too large.
    """
    is_known = np.zeros(table.n_tags, bool)
    for part in (part for log in training for part in log.antennas):
        if part.n_tags != table.n_tags:
            raise ValueError(f"training knows {part.n_tags} tags, must be the {table.n_tags} of the table")
        is_known[part.tag] = True
    logs = binomial_logs(level_chances(), n_cycles).astype(np.float32)
    n_known = int(is_known.sum())
    most = n_known if settings.k_prime is None else settings.k_prime
    poses = np.concatenate([log.reference_poses for log in training])
    model = (
        np.ascontiguousarray(antennas, float), table.compiled, logs, is_known, most, n_known, _floor_of(drivable),
        settings.motion.noise(1.0),
    )  # fmt: skip
    return SnapshotFilter(settings, model, n_cycles, np.ascontiguousarray(poses, float))


def init(ready: SnapshotFilter, log: SnapshotLog, key: int) -> SnapshotBelief:
    """The belief after the first snapshots of a log have started the filter; `key` names the run's random streams.

    A filter that starts from training poses has used the first snapshots by that.

    Raises
    ------
    ValueError : if the log is empty or has other antennas, cycles or tags than the filter.
    """
    _check(ready, log)
    n, settings = ready.settings.n_particles, ready.settings
    arrays = _arrays(n)
    drawn, headings, cloud = arrays
    if settings.start == "uniform":
        _scatter(ready, np.uint64(key), drawn, headings)
        belief = SnapshotBelief(np.uint64(key), 0, arrays, np.full(N_ESTIMATE, np.nan))
        return track(ready, belief, log, 1, np.empty((len(log.time_s), N_ESTIMATE)))
    logs = np.empty(len(ready.training_poses), np.float32)
    kernels.weigh_poses(0, _compiled(log), ready.model, ready.training_poses, _room(ready), logs)
    noise = np.array([settings.start_noise_mm, settings.start_noise_rad])
    if not kernels.draw_poses(np.uint64(key), logs, ready.training_poses, noise, drawn, headings, n):
        _scatter(ready, np.uint64(key), drawn, headings)
    if settings.weighs_start:
        belief = SnapshotBelief(np.uint64(key), 0, arrays, np.full(N_ESTIMATE, np.nan))
        return track(ready, belief, log, 1, np.empty((len(log), N_ESTIMATE)))
    moments = np.empty((1, N_ESTIMATE))
    load(drawn, headings, cloud)
    estimate(n, cloud, moments, 0)
    return SnapshotBelief(np.uint64(key), 1, arrays, moments[0])


def track(
    ready: SnapshotFilter, state: SnapshotBelief, log: SnapshotLog, last: int, estimates: np.ndarray
) -> SnapshotBelief:
    """Run the filter from its state's step up to step `last` of a log; row t of `estimates` is after step t.

    Raises
    ------
    ValueError : if `last` is not a step of the log, `estimates` has another shape or the log other antennas or cycles.
    """
    _check(ready, log)
    if not state.step <= last <= len(log.time_s):
        raise ValueError(f"last is {last!r}, must be from {state.step} to {len(log.time_s)}, the log's end")
    if estimates.ndim != 2 or len(estimates) < last or estimates.shape[1] != N_ESTIMATE:
        raise ValueError(f"estimates has shape {estimates.shape}, must have at least {last} rows of {N_ESTIMATE}")
    arrays = workspace(state)
    if state.step < last:
        kernels.track(
            state.key, state.step, last, ready.settings.n_particles, _compiled(log), ready.model, arrays, _room(ready),
            estimates,
        )  # fmt: skip
    moments = estimates[last - 1].copy() if state.step < last else state.moments
    return replace(state, step=last, arrays=arrays, moments=moments)


def _check(ready: SnapshotFilter, log: SnapshotLog) -> None:
    """Raise ValueError for a log that the filter's kernels cannot take."""
    if not len(log):
        raise ValueError("log has no inquiry, must have at least one")
    n_antennas, n_tags = len(ready.model[0]), len(ready.model[3])
    if len(log.antennas) != n_antennas:
        raise ValueError(f"log has {len(log.antennas)} antennas, must have {n_antennas}")
    for part in log.antennas:
        if (part.n_cycles, part.n_tags) != (ready.n_cycles, n_tags):
            raise ValueError(
                f"log has {part.n_cycles} cycles and {part.n_tags} tags, must have {ready.n_cycles} and {n_tags}"
            )


def _compiled(log: SnapshotLog) -> tuple:
    """A log as kernels take it: the antennas' rows in turn."""
    n_antennas, n_steps = len(log.antennas), len(log.time_s)
    lengths = np.column_stack([np.diff(part.start) for part in log.antennas]).ravel()
    start = np.concatenate([[0], np.cumsum(lengths)])
    tag, count = np.empty(start[-1], np.int32), np.empty(start[-1], np.int16)
    for a, part in enumerate(log.antennas):
        row = np.repeat(np.arange(n_steps), np.diff(part.start))
        place = start[row * n_antennas + a] + np.arange(len(row)) - part.start[row]
        tag[place], count[place] = part.tag, part.count
    return np.ascontiguousarray(log.odometry, float), start.astype(np.int64), tag, count


def _arrays(n_particles: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    room, width = room_for(n_particles), -(-n_particles // LANES) * LANES
    return (
        aligned_zeros((3, room), np.float32), aligned_zeros((room,), np.int32),
        aligned_zeros((N_FIELDS, width), np.float32),
    )  # fmt: skip


def _room(ready: SnapshotFilter) -> tuple[np.ndarray, np.ndarray]:
    return np.where(ready.model[3], 0, -1).astype(np.int16), np.zeros(ready.n_cycles + 1, np.int64)


def _floor_of(drivable: BaseGeometry) -> tuple[np.ndarray, float, float, float]:
    """The drivable floor in cells: (is_drivable (n_y, n_x), x0, y0, cells per mm)."""
    low_x, low_y, high_x, high_y = drivable.bounds
    n_x, n_y = (math.ceil((high - low) / _FLOOR_CELL_MM) for low, high in ((low_x, high_x), (low_y, high_y)))
    if n_x * n_y > MAX_FLOOR_CELLS:
        raise ValueError(f"drivable is {(high_x - low_x) / 1e3:g} by {(high_y - low_y) / 1e3:g} m: too large")
    x = low_x + (np.arange(n_x) + 0.5) * _FLOOR_CELL_MM
    y = low_y + (np.arange(n_y) + 0.5) * _FLOOR_CELL_MM
    is_drivable = shapely.contains_xy(prepared_copy(drivable), *np.meshgrid(x, y))
    if not is_drivable.any():
        raise ValueError(f"drivable has no place for a robot: it is narrower than {_FLOOR_CELL_MM:g} mm")
    return is_drivable, low_x, low_y, 1.0 / _FLOOR_CELL_MM


def _scatter(ready: SnapshotFilter, key: np.uint64, drawn: np.ndarray, headings: np.ndarray) -> None:
    """Draw particles anywhere in the box around the floor, with any heading, as all filters of unknown starts do."""
    is_drivable, x0, y0, per_mm = ready.model[6]
    n = ready.settings.n_particles
    draws = np.empty(3 * n)
    fill_fine_uniform(np.uint64(step_key(key, STREAM_PLACE, 0)), draws)
    x, y, turns = draws.reshape(3, n)
    drawn[0, :n] = x0 + x * is_drivable.shape[1] / per_mm
    drawn[1, :n] = y0 + y * is_drivable.shape[0] / per_mm
    headings[:n] = ((turns - 0.5) * 2 * math.pi * BINARY_UNITS_PER_RADIAN).astype(np.int64).astype(np.int32)
