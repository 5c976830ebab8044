"""Simulate what a robot records while it drives: the truth of a run, apart from any estimator."""

import numpy as np

from rfiddesign.design import Design
from rfiddesign.floor import TagMap
from rfiddesign.geometry import TagPattern
from rfiddesign.models.read_field import read_field
from rfiddesign.models.recording import Recording
from rfiddesign.simulation import _recording_kernels as kernels
from rfiddesign.simulation.scenario import World


def record(design: Design, tags: TagMap, poses: np.ndarray, dt_s: float, world: World, key: np.uint64) -> Recording:
    """Drive `design` along `poses` (n_steps + 1, 3) over a freshly installed floor with the `tags` of its pattern.

    The odometry noise depends on `key` alone, so that every design meets the same; so does each tag's installation
    error, which makes every run one floor out of all that an installer may leave behind.
    """
    antennas = np.asarray(design.layout.poses_mm, float)
    n_steps, n_antennas = poses.shape[0] - 1, antennas.shape[0]
    odometry = np.empty((n_steps, 3))
    kernels.record_odometry(key, poses, np.array(world.motion.step_deviations(dt_s)), odometry)
    room = n_steps * n_antennas
    read_start = np.empty(n_steps + 1, np.int64)
    read_antenna, read_row, read_age = np.empty(room, np.int32), np.empty(room, np.int32), np.empty(room)
    installed = (
        tags.installed_x, tags.installed_y, tags.tag_id, tags.cell_start, 1.0 / tags.cell_mm,
        float(tags.origin_mm[0]), float(tags.origin_mm[1]), tags.n_x, tags.n_y,
    )  # fmt: skip
    n_reads = kernels.record_reads(
        key, poses, dt_s, (antennas, world.reads.phases(n_antennas)),
        (world.reads.read_probability, world.installation_error_mm), read_field(design.antenna.area), installed,
        _lattice_of(design.pattern),
        (read_start, read_antenna, read_row, read_age),
    )  # fmt: skip
    rows = read_row[:n_reads]
    return Recording(
        dt_s=dt_s,
        true_poses=poses,
        odometry=odometry,
        read_start=read_start,
        read_antenna=read_antenna[:n_reads].copy(),
        read_tag=tags.tag_id[rows],
        read_tag_mm=np.column_stack([tags.nominal_x[rows], tags.nominal_y[rows]]).astype(float),
        read_age_s=read_age[:n_reads].copy(),
    )


def _lattice_of(pattern: TagPattern) -> tuple[float, ...]:
    """Origin and inverse basis of the pattern's lattice, as `record_reads` takes them."""
    lattice = pattern.lattice
    if lattice is None:
        return (0.0,) * 6
    inverse = np.linalg.inv(np.array(lattice.basis_mm, float).T)
    return (*map(float, lattice.origin_mm), *(float(value) for value in inverse.ravel()))
