"""Simulate what a robot records while it drives: the truth of a run, apart from any estimator."""

from typing import NamedTuple

import numpy as np

from rfiddesign.design import Design
from rfiddesign.floor import TagMap
from rfiddesign.geometry import TagPattern
from rfiddesign.models.read_field import ReadField, read_field
from rfiddesign.models.reads import MOST_ANSWERS
from rfiddesign.models.recording import Recording
from rfiddesign.simulation import _recording_kernels as kernels
from rfiddesign.simulation.scenario import World


class Rig(NamedTuple):
    """A design in a world as compiled runs take it.

    Fields: wheels: noise (3, 3) of a step's odometry, see `Motion.noise`, and its faults; robot: antennas (n, 3) in the
    robot's frame, and when each polls (`Schedule`); world: read probability, installation error [mm], share of dead
    tags, read time and delay [steps], tags that answer at most; field: what an antenna reads in truth; lattice: origin
    [mm] and inverse basis [1/mm] of the tags' lattice, zeros if it cannot help.
    """

    wheels: tuple[np.ndarray, tuple[float, ...]]
    robot: tuple[np.ndarray, np.ndarray, np.ndarray, int]
    world: tuple[float, float, float, float, float, int]
    field: ReadField
    lattice: tuple[float, ...]


def rig_of(design: Design, world: World, dt_s: float) -> Rig:
    """The rig of `design` in `world` with steps of `dt_s` seconds."""
    antennas, reads = np.asarray(design.layout.poses_mm, float), world.reads
    schedule = reads.schedule(len(antennas), dt_s)
    n_answers = MOST_ANSWERS if reads.answers == "all" else 1
    return Rig(
        (world.motion.noise(dt_s), world.faults.compiled),
        (antennas, schedule.phases, schedule.slots, schedule.period),
        (
            float(reads.read_probability), float(world.installation_error_mm), float(world.dead_share),
            reads.read_time_s / dt_s, reads.delay_s / dt_s, n_answers,
        ),
        _scaled(read_field(design.antenna.area, design.antenna.rssi_radii_mm), float(world.field_scale)),
        # The lattice tells what is near at the time of the poll, not what was.
        (0.0,) * 6 if reads.delay_s > 0 else _lattice_of(design.pattern),
    )  # fmt: skip


def installed(tags: TagMap) -> tuple:
    """A tag map as the compiled poll takes it."""
    return (
        tags.installed_x, tags.installed_y, tags.tag_id, tags.cell_start, 1.0 / tags.cell_mm,
        float(tags.origin_mm[0]), float(tags.origin_mm[1]), tags.n_x, tags.n_y,
    )  # fmt: skip


def record(design: Design, tags: TagMap, poses: np.ndarray, dt_s: float, world: World, key: np.uint64) -> Recording:
    """Drive `design` along `poses` (n_steps + 1, 3) over a freshly installed floor with the `tags` of its pattern.

    The odometry noise depends on `key` alone, so that every design meets the same; so do each tag's installation error
    and whether it is dead, which makes every run one floor out of all that an installer may leave behind.
    """
    return record_with(rig_of(design, world, dt_s), tags, poses, dt_s, key)


def record_with(rig: Rig, tags: TagMap, poses: np.ndarray, dt_s: float, key: np.uint64) -> Recording:
    """As `record`, for a rig."""
    n_steps = poses.shape[0] - 1
    odometry = np.empty((n_steps, 3))
    kernels.record_odometry(key, poses, rig.wheels, odometry)
    room = n_steps * len(rig.robot[0]) * rig.world[-1]
    read_start = np.empty(n_steps + 1, np.int64)
    read_antenna, read_row, read_rssi = (np.empty(room, np.int32) for _ in range(3))
    read_age = np.empty(room)
    n_reads = kernels.record_reads(
        key, poses, 0, n_steps, float(dt_s), rig.robot, rig.world, rig.field, installed(tags), rig.lattice,
        (read_start, read_antenna, read_row, read_age, read_rssi),
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
        read_rssi=read_rssi[:n_reads].copy(),
    )


def _scaled(field: ReadField, factor: float) -> ReadField:
    """The field grown about its antenna by `factor`: all its lengths are, chances stay."""
    return field._replace(
        half_length_mm=field.half_length_mm * factor,
        half_width_mm=field.half_width_mm * factor,
        corner_mm=field.corner_mm * factor,
        reach_mm=field.reach_mm * factor,
        cell_mm=field.cell_mm * factor,
        rssi_radii=field.rssi_radii * factor,
    )


def _lattice_of(pattern: TagPattern) -> tuple[float, ...]:
    """Origin and inverse basis of the pattern's lattice, as `record_reads` takes them."""
    lattice = pattern.lattice
    if lattice is None:
        return (0.0,) * 6
    inverse = np.linalg.inv(np.array(lattice.basis_mm, float).T)
    return (*map(float, lattice.origin_mm), *(float(value) for value in inverse.ravel()))
