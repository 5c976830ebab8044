"""Drives that take snapshots of a scene's tags: training data, and what is localized by them."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from rfiddesign import require
from rfiddesign.floor.errands import errands
from rfiddesign.floor.scene import Scene
from rfiddesign.models.detection_field import DetectionField
from rfiddesign.models.motion import DifferentialMotion, Motion, OdometryFaults
from rfiddesign.models.snapshots import MAX_CYCLES, SnapshotLog, Snapshots
from rfiddesign.models.uhf import PAIRS_OF_B21
from rfiddesign.numerics._noise_kernels import fill_fine_uniform, fill_normal, run_key, step_key
from rfiddesign.simulation import _snapshot_kernels as kernels
from rfiddesign.simulation._recording_kernels import record_odometry
from rfiddesign.simulation.trajectory import drive, route_length_mm

# uhf_snapshots, table I: cycles, mean duration of an inquiry and its standard deviation [s].
_INQUIRIES = ((2, 0.77, 0.02), (4, 1.46, 0.02), (6, 1.99, 0.03), (8, 2.66, 0.05))
#: Time between the poses of an errand drive, and between reports of its odometry [s].
FINE_S = 0.02
MAX_DURATION_S = 7_200.0
MAX_ANTENNAS = 64
# Read probabilities that are held at a time: 32 MB.
_MAX_CHANCES = 8_000_000
# Streams of a drive's draws, apart from those of worlds.
_STREAM_MANNER, _STREAM_ROUTE, _STREAM_INQUIRY, _STREAM_REFERENCE, _STREAM_COUNTS = range(48, 53)


@dataclass(frozen=True)
class DriveSettings:
    """How a robot drives while it takes snapshots, and what it carries.

    It drives from place to place all over the floor, each time the shortest way, and turns in place at corners.

    The defaults fit the drives of uhf_snapshots, of 89 to 188 m in at least five minutes.

    Parameters
    ----------
    duration_s : length of a drive; inquiries that end later are left out [s].
    least_speed_mm_per_s, most_speed_mm_per_s : a drive's speed is drawn from between them.
    turn_rate_rad_per_s : speed of the turns in place at corners.
    motion, faults : the true noise of the odometry, and what is systematically wrong with it.
    reference_mm, reference_rad : standard deviation of the reference poses, per axis and of the heading; drawn afresh
        for every inquiry.
    stamp_share : when in an inquiry its pose is taken: 0.5 in its middle, 1 at its end, when the reader reports.
    mountings : poses (x, y [mm], yaw [rad]) of the antennas on the robot.
    """

    duration_s: float = 300.0
    least_speed_mm_per_s: float = 380.0
    most_speed_mm_per_s: float = 640.0
    turn_rate_rad_per_s: float = 1.2
    motion: Motion = field(default_factory=DifferentialMotion)
    faults: OdometryFaults = field(default_factory=OdometryFaults)
    reference_mm: float = 30.0
    reference_rad: float = 0.02
    stamp_share: float = 0.5
    mountings: tuple[tuple[float, float, float], ...] = PAIRS_OF_B21

    def __post_init__(self) -> None:
        require.within("duration_s", self.duration_s, low=1.0, high=MAX_DURATION_S)
        require.within("least_speed_mm_per_s", self.least_speed_mm_per_s, low=1.0, high=10_000.0)
        require.within("most_speed_mm_per_s", self.most_speed_mm_per_s, low=self.least_speed_mm_per_s, high=10_000.0)
        require.within("turn_rate_rad_per_s", self.turn_rate_rad_per_s, low=1e-3, high=100.0)
        require.within("reference_mm", self.reference_mm, low=0.0, high=1_000.0)
        require.within("reference_rad", self.reference_rad, low=0.0, high=1.0)
        require.within("stamp_share", self.stamp_share, low=0.0, high=1.0)
        if not 1 <= len(self.mountings) <= MAX_ANTENNAS:
            raise ValueError(f"mountings has {len(self.mountings)} antennas, must have 1 to {MAX_ANTENNAS}")
        for mounting in self.mountings:
            if len(mounting) != 3:
                raise ValueError(f"mountings: one has {len(mounting)} numbers, must have three: x, y, yaw")
            for name, value in zip(("x", "y", "yaw"), mounting, strict=True):
                require.within(f"mountings, {name}", value, low=-1e5, high=1e5)


def inquiry_duration_s(n_cycles: int, n_antennas: int = 2) -> tuple[float, float]:
    """Mean and standard deviation [s] of the duration of an inquiry (uhf_snapshots, table I, of two antenna pairs).

    Between the table's numbers of cycles both are interpolated; beyond, they go on in proportion to the cycles, and so
    they do with the antennas, which take turns.
    """
    require.count("n_cycles", n_cycles, at_most=MAX_CYCLES)
    require.count("n_antennas", n_antennas, at_most=MAX_ANTENNAS)
    cycles, means, deviations = np.array(_INQUIRIES).T
    inside = float(np.clip(n_cycles, cycles[0], cycles[-1]))
    factor = n_cycles / inside * n_antennas / 2
    return float(np.interp(inside, cycles, means)) * factor, float(np.interp(inside, cycles, deviations)) * factor


def record_snapshots(
    field: DetectionField, scene: Scene, settings: DriveSettings, n_cycles: int, *, seed: int, day: int, number: int
) -> SnapshotLog:
    """Drive through a scene on errands and record snapshots, see `record_along`.

    Parameters
    ----------
    field : what the antennas read by, of the scene's tags.
    scene : where the robot drives.
    settings : how.
    n_cycles : cycles of each antenna per inquiry.
    seed, day, number : all draws of the drive depend on them alone; the route does not on `n_cycles`.

    Raises
    ------
    ValueError : if the field is of other tags, not one inquiry fits into the drive, or the floor is too small for it.
    """
    if field.n_tags != scene.n_tags:
        raise ValueError(f"field is of {field.n_tags} tags, must be of the scene's {scene.n_tags}")
    key = drive_key(seed, day, number)
    return record_along(field, drive_poses(scene, settings, key), FINE_S, settings, n_cycles, key)


def record_along(
    field: DetectionField, poses: NDArray[np.float64], dt_s: float, settings: DriveSettings, n_cycles: int,
    key: np.uint64,
) -> SnapshotLog:  # fmt: skip
    """Record snapshots on a drive along given poses.

    Inquiries follow each other without pause. In each, the antennas take turns: cycle 1 of every antenna, cycle 2 of
    every antenna and so on, evenly over the inquiry's duration, while the robot drives on. The odometry reports at
    every pose; what it says between two stamps is added up.

    Parameters
    ----------
    field : what the antennas read by.
    poses : (n, 3) of the robot at 0, `dt_s`, 2 `dt_s`, ..., headings unwrapped; it drives straight between them.
    settings : odometry, reference and antennas; how long and how fast is in the poses.
    n_cycles : cycles of each antenna per inquiry.
    key : of all draws.

    Raises
    ------
    ValueError : if not one inquiry fits into the drive.
    """
    edges = _inquiries((len(poses) - 1) * dt_s, (n_cycles, len(settings.mountings)), key)
    n_antennas = len(settings.mountings)
    # Times of the cycles (n, n_cycles, n_antennas): in the middle of their slots.
    slot = (np.arange(n_cycles * n_antennas).reshape(n_cycles, n_antennas) + 0.5) / (n_cycles * n_antennas)
    times = edges[:-1, None, None] + np.diff(edges)[:, None, None] * slot
    stamps = edges[:-1] + settings.stamp_share * np.diff(edges)
    true_poses = _poses_at(poses, dt_s, stamps)
    reference = _reference_poses(true_poses, settings, key)
    antennas = tuple(
        _snapshots(field, _poses_at(poses, dt_s, times[:, :, a].ravel()), reference, mounting, n_cycles, (key, a))
        for a, mounting in enumerate(settings.mountings)
    )
    return SnapshotLog(stamps, true_poses, reference, _odometry(poses, dt_s, stamps, settings, key), antennas)


def drive_key(seed: int, day: int, number: int) -> np.uint64:
    """Key of the random streams of a drive."""
    for name, value in (("seed", seed), ("day", day), ("number", number)):
        require.seed(name, value)
    of_day = np.uint64(run_key(np.uint64(seed), np.uint64(day)))
    return np.uint64(run_key(of_day, np.uint64(number)))


def drive_poses(scene: Scene, settings: DriveSettings, key: np.uint64) -> NDArray[np.float64]:
    """Poses of a drive every `FINE_S` seconds, (n, 3), headings unwrapped."""
    draw = np.empty(1)
    fill_fine_uniform(np.uint64(step_key(key, _STREAM_MANNER, 0)), draw)
    slow, fast = settings.least_speed_mm_per_s, settings.most_speed_mm_per_s
    speed = slow + draw[0] * (fast - slow)
    length_mm = route_length_mm(speed, settings.duration_s)
    waypoints = errands(scene.floor, np.uint64(step_key(key, _STREAM_ROUTE, 0)), length_mm)
    n_steps = math.ceil(settings.duration_s / FINE_S)
    return drive(waypoints, speed, None, settings.turn_rate_rad_per_s, FINE_S, n_steps)


def _inquiries(duration_s: float, what: tuple[int, int], key: np.uint64) -> NDArray[np.float64]:
    """Times (n + 1,) between the inquiries of a drive, from its begin on [s]; `what` are cycles and antennas."""
    mean, deviation = inquiry_duration_s(*what)
    draws = np.empty(math.ceil(duration_s / (mean - 7.0 * deviation)) + 1, np.float32)
    fill_normal(np.uint64(step_key(key, _STREAM_INQUIRY, 0)), draws)
    edges = np.concatenate([[0.0], np.cumsum(mean + deviation * draws.astype(float))])
    edges = edges[edges <= duration_s]
    if len(edges) < 2:
        raise ValueError(f"duration_s is {duration_s:g}: an inquiry of {what[0]} cycles takes {mean:g} s")
    return edges


def _poses_at(poses: NDArray, dt_s: float, times: NDArray) -> NDArray[np.float64]:
    """Poses (n, 3) of a drive at some times (n,), between those it has by straight lines."""
    own = np.arange(len(poses)) * dt_s
    return np.column_stack([np.interp(times, own, column) for column in poses.T])


def _reference_poses(true_poses: NDArray, settings: DriveSettings, key: np.uint64) -> NDArray[np.float64]:
    draws = np.empty(true_poses.size, np.float32)
    fill_normal(np.uint64(step_key(key, _STREAM_REFERENCE, 0)), draws)
    scale = np.array([settings.reference_mm, settings.reference_mm, settings.reference_rad])
    return true_poses + scale * draws.reshape(true_poses.shape)


def _odometry(
    poses: NDArray, dt_s: float, stamps: NDArray, settings: DriveSettings, key: np.uint64
) -> NDArray[np.float64]:
    """Reported motion (n, 3) between the stamps."""
    steps = np.empty((len(poses) - 1, 3))
    record_odometry(key, poses, (settings.motion.noise(dt_s), settings.faults.compiled), steps)
    reckoned, odometry = np.empty(poses.shape), np.empty((len(stamps), 3))
    kernels.dead_reckon(poses[0], steps, reckoned)
    kernels.increments(_poses_at(reckoned, dt_s, stamps), odometry)
    return odometry


def _mounted(poses: NDArray, mounting: tuple[float, float, float]) -> NDArray[np.float64]:
    out = np.empty(poses.shape)
    kernels.antenna_poses(np.ascontiguousarray(poses), np.array(mounting, float), out)
    return out


def _snapshots(
    field: DetectionField, poses: NDArray, reference: NDArray, mounting: tuple[float, float, float], n_cycles: int,
    draws: tuple[np.uint64, int],
) -> Snapshots:  # fmt: skip
    """Snapshots of one antenna on a robot that is at `poses` (n n_cycles, 3) in its cycles.

    `draws` : key, and number of the antenna.
    """
    n, n_tags = len(reference), field.n_tags
    key, antenna = draws
    n_at_once = max(1, _MAX_CHANCES // (n_cycles * n_tags))
    start, tags, counts = np.zeros(n + 1, np.int64), [], []
    for first in range(0, n, n_at_once):
        last = min(first + n_at_once, n)
        chances = field.read_probability(_mounted(poses[first * n_cycles : last * n_cycles], mounting))
        room = (last - first) * n_tags
        tag, count = np.empty(room, np.int32), np.empty(room, np.int16)
        n_entries = kernels.draw_counts(
            key, _STREAM_COUNTS + antenna, first, n_cycles, chances, start[first : last + 1], tag, count
        )
        tags.append(tag[:n_entries].copy())
        counts.append(count[:n_entries].copy())
    at = _mounted(reference, mounting)
    return Snapshots(n_cycles, n_tags, at, start, np.concatenate(tags), np.concatenate(counts))
