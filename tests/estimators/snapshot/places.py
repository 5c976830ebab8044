"""A small room of tags whose chances are known by formula, and drives through it."""

import math

import numpy as np
import shapely

from rfiddesign.models.fingerprint_table import TableGrid, tabulate
from rfiddesign.models.snapshots import SnapshotLog, Snapshots

ROOM = shapely.box(0, 0, 4000, 3000)
ANTENNAS = np.array([[150.0, 100.0, math.pi / 4], [150.0, -100.0, -math.pi / 4]])
N_CYCLES = 2


class Walls:
    """Tags every 400 mm along the walls, read within 2.5 m ahead of the antenna."""

    def __init__(self):
        x, y = np.arange(200, 4000, 400.0), np.arange(200, 3000, 400.0)
        self.tags = np.concatenate(
            [
                np.column_stack([x, np.zeros_like(x)]),
                np.column_stack([x, np.full_like(x, 3000.0)]),
                np.column_stack([np.zeros_like(y), y]),
                np.column_stack([np.full_like(y, 4000.0), y]),
            ]
        )
        self.n_tags = len(self.tags)

    def read_probability(self, antenna_poses):
        to = self.tags - np.asarray(antenna_poses)[:, None, :2]
        distance = np.hypot(to[..., 0], to[..., 1])
        off = np.arctan2(to[..., 1], to[..., 0]) - np.asarray(antenna_poses)[:, 2:]
        margin = 2.5 - distance / 1000 - 2.0 * (1 - np.cos(off))
        return (0.95 / (1 + np.exp(-4 * margin))).astype(np.float32)


def antenna_poses(poses, antenna):
    """Poses (n, 3) of an antenna on robots at `poses` (n, 3)."""
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    x, y = poses[:, 0] + c * antenna[0] - s * antenna[1], poses[:, 1] + s * antenna[0] + c * antenna[1]
    return np.column_stack([x, y, poses[:, 2] + antenna[2]])


def log_at(poses, seed, odometry_noise=0.0):
    """A log whose inquiries were made standing at `poses` (n, 3)."""
    rng, field = np.random.default_rng(seed), Walls()
    parts = []
    for antenna in ANTENNAS:
        at = antenna_poses(poses, antenna)
        parts.append(Snapshots.of_counts(rng.binomial(N_CYCLES, field.read_probability(at)), at, N_CYCLES))
    step = np.diff(poses, axis=0)
    c, s = np.cos(poses[:-1, 2]), np.sin(poses[:-1, 2])
    odometry = np.zeros((len(poses), 3))
    odometry[1:, 0] = c * step[:, 0] + s * step[:, 1]
    odometry[1:, 1] = -s * step[:, 0] + c * step[:, 1]
    odometry[1:, 2] = step[:, 2]
    way = np.hypot(odometry[:, 0], odometry[:, 1])
    odometry[:, 0] += odometry_noise * rng.normal(size=len(poses)) * np.sqrt(way)
    return SnapshotLog(np.arange(len(poses)) * 0.77, poses, poses, odometry, tuple(parts))


def circle(n, laps=1.0, radius=900.0):
    """Poses (n, 3) around the middle of the room, facing along."""
    angle = np.linspace(0, 2 * math.pi * laps, n)
    x, y = 2000 + radius * np.cos(angle), 1500 + radius * np.sin(angle)
    return np.column_stack([x, y, angle + math.pi / 2])


def anywhere(n, seed):
    """Poses (n, 3) anywhere in the room."""
    rng = np.random.default_rng(seed)
    return np.column_stack([rng.uniform(100, 3900, n), rng.uniform(100, 2900, n), rng.uniform(-math.pi, math.pi, n)])


def true_table(grid=None):
    """The table of the true field."""
    return tabulate(Walls(), ROOM.buffer(300), grid or TableGrid())
