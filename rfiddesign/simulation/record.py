"""Simulate what a robot records while it drives: the truth of a run, apart from any estimator."""

from typing import NamedTuple

import numpy as np

from rfiddesign.design import Design
from rfiddesign.floor import TagMap
from rfiddesign.geometry import TagPattern
from rfiddesign.models.read_field import ReadField, read_field
from rfiddesign.models.recording import Recording
from rfiddesign.simulation import _recording_kernels as kernels
from rfiddesign.simulation.scenario import World


class Rig(NamedTuple):
    """A design in a world as compiled runs take it.

    Fields: deviations (3,) of a step's odometry [mm, mm, rad]; robot: antennas (n, 3) in the robot's frame and the
    fraction of a step at which each polls (n,); world: read probability and installation error [mm]; field: what an
    antenna reads; lattice: origin [mm] and inverse basis [1/mm] of the tags' lattice, zeros if there is none.
    """

    deviations: np.ndarray
    robot: tuple[np.ndarray, np.ndarray]
    world: tuple[float, float]
    field: ReadField
    lattice: tuple[float, ...]


def rig_of(design: Design, world: World, dt_s: float) -> Rig:
    """The rig of `design` in `world` with steps of `dt_s` seconds."""
    antennas = np.asarray(design.layout.poses_mm, float)
    return Rig(
        np.array(world.motion.step_deviations(dt_s)),
        (antennas, world.reads.phases(len(antennas))),
        (float(world.reads.read_probability), float(world.installation_error_mm)),
        read_field(design.antenna.area),
        _lattice_of(design.pattern),
    )


def installed(tags: TagMap) -> tuple:
    """A tag map as the compiled poll takes it."""
    return (
        tags.installed_x, tags.installed_y, tags.tag_id, tags.cell_start, 1.0 / tags.cell_mm,
        float(tags.origin_mm[0]), float(tags.origin_mm[1]), tags.n_x, tags.n_y,
    )  # fmt: skip


def record(design: Design, tags: TagMap, poses: np.ndarray, dt_s: float, world: World, key: np.uint64) -> Recording:
    """Drive `design` along `poses` (n_steps + 1, 3) over a freshly installed floor with the `tags` of its pattern.

    The odometry noise depends on `key` alone, so that every design meets the same; so does each tag's installation
    error, which makes every run one floor out of all that an installer may leave behind.
    """
    rig = rig_of(design, world, dt_s)
    n_steps = poses.shape[0] - 1
    odometry = np.empty((n_steps, 3))
    kernels.record_odometry(key, poses, rig.deviations, odometry)
    room = n_steps * len(design.layout.poses_mm)
    read_start = np.empty(n_steps + 1, np.int64)
    read_antenna, read_row, read_age = np.empty(room, np.int32), np.empty(room, np.int32), np.empty(room)
    n_reads = kernels.record_reads(
        key, poses, 0, n_steps, float(dt_s), rig.robot, rig.world, rig.field, installed(tags), rig.lattice,
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
