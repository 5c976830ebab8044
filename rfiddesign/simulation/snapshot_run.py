"""One run of snapshot localization: what training drives taught, held against a drive of another day."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from shapely.geometry.base import BaseGeometry

from rfiddesign.estimators.snapshot import SnapshotMcl, build, init, track
from rfiddesign.estimators.verbs import N_ESTIMATE
from rfiddesign.geometry.se2 import wrap_angle
from rfiddesign.models.detection_field import DetectionField
from rfiddesign.models.fingerprint import FingerprintField, Smoothing
from rfiddesign.models.fingerprint_table import FingerprintTable, TableGrid, tabulate
from rfiddesign.models.snapshots import SnapshotLog


@dataclass(frozen=True, eq=False)
class Trained:
    """What is known of a place when localization begins.

    Parameters
    ----------
    field : chances of all tags; a `FingerprintField` or any other detection field.
    table : the same to be looked up.
    logs : the training drives: known tags, and poses to start from.
    antennas : (n_antennas, 3) poses of the antennas on the robot.
    drivable : where the robot's centre can be.
    """

    field: DetectionField
    table: FingerprintTable
    logs: tuple[SnapshotLog, ...]
    antennas: np.ndarray
    drivable: BaseGeometry


@dataclass(frozen=True)
class SnapshotTrace:
    """Truth and estimate (n, 3) of a run after each inquiry, and the errors (n,) [mm], [rad]."""

    time_s: np.ndarray
    true_poses: np.ndarray
    poses: np.ndarray
    position_error_mm: np.ndarray
    heading_error_rad: np.ndarray


def train(
    logs: Sequence[SnapshotLog], drivable: BaseGeometry, antennas: np.ndarray, smoothing: Smoothing | None = None,
    grid: TableGrid | None = None, field: DetectionField | None = None,
) -> Trained:  # fmt: skip
    """Learn a field from drives and tabulate it where antennas can be.

    Parameters
    ----------
    field : what to tabulate in place of a field learned from the drives.
    """
    antennas = np.asarray(antennas, float).reshape(-1, 3)
    grid = grid or TableGrid()
    if field is None:
        field = FingerprintField([part for log in logs for part in log.antennas], smoothing)
    lever = float(np.hypot(antennas[:, 0], antennas[:, 1]).max())
    table = tabulate(field, drivable.buffer(lever + grid.cell_mm), grid)
    return Trained(field, table, tuple(logs), antennas, drivable)


def localize(trained: Trained, settings: SnapshotMcl, log: SnapshotLog, key: int) -> SnapshotTrace:
    """Track a drive; `key` names the run's random streams (`_noise_kernels.run_key`)."""
    n_cycles = log.antennas[0].n_cycles
    ready = build(settings, trained.table, trained.antennas, trained.drivable, list(trained.logs), n_cycles)
    estimates = np.empty((len(log), N_ESTIMATE))
    state = init(ready, log, key)
    estimates[0] = state.moments
    track(ready, state, log, len(log), estimates)
    off = estimates[:, :3] - log.true_poses
    return SnapshotTrace(
        log.time_s, log.true_poses, estimates[:, :3], np.hypot(off[:, 0], off[:, 1]), np.abs(wrap_angle(off[:, 2]))
    )
