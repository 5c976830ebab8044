"""What a robot recorded on one drive: odometry and reads, with the truth beside them where it is known."""

from dataclasses import dataclass, field

import numpy as np

NO_RSSI = -1


@dataclass(frozen=True)
class Recording:
    """One drive in steps of `dt_s`.  Step t leads from pose t to pose t + 1; its reads are heard at its end.

    Parameters
    ----------
    dt_s : duration of a step [s].
    true_poses : (n_steps + 1, 3) x [mm], y [mm], heading [rad].
    odometry : (n_steps, 3) measured motion of each step in the robot's frame at its begin [mm, mm, rad].
    read_start : (n_steps + 1,) reads of step t are rows read_start[t] to read_start[t + 1] - 1 of what follows.
    read_antenna : (n_reads,) index of the reading antenna.
    read_tag : (n_reads,) number of the read tag in its map.
    read_tag_mm : (n_reads, 2) position of the read tag according to the map [mm].
    read_age_s : (n_reads,) time between the poll and the end of its step [s].
    read_rssi : (n_reads,) int32 step of the signal's strength; -1: none.
    """

    dt_s: float
    true_poses: np.ndarray
    odometry: np.ndarray
    read_start: np.ndarray
    read_antenna: np.ndarray
    read_tag: np.ndarray
    read_tag_mm: np.ndarray
    read_age_s: np.ndarray
    read_rssi: np.ndarray | None = None

    def __post_init__(self) -> None:
        if self.read_rssi is None:
            object.__setattr__(self, "read_rssi", np.full(len(self.read_antenna), NO_RSSI, np.int32))

    @property
    def n_steps(self) -> int:
        """Number of steps."""
        return self.odometry.shape[0]

    @property
    def n_reads(self) -> int:
        """Number of reads over all steps."""
        return int(self.read_start[-1])

    @property
    def log(self) -> tuple:
        """The recording as compiled estimators take it.

        (odometry (n, 3), read_start (n + 1,), read_antenna (r,), read_tag_mm (r, 2), read_age (r,), read_rssi (r,),
        dt).
        """
        return (
            self.odometry, self.read_start, self.read_antenna, self.read_tag_mm, self.read_age_s, self.read_rssi,
            float(self.dt_s),
        )  # fmt: skip


@dataclass(frozen=True)
class Reads:
    """The reads of one step.

    Parameters
    ----------
    antenna : (n_reads,) index of each reading antenna.
    tag_mm : (n_reads, 2) position of each read tag on the map [mm].
    rssi : (n_reads,) step of the signal's strength, -1: none; none at all if not given.
    age_s : (n_reads,) time between the poll and the end of the step [s]; 0 if not given.
    """

    antenna: np.ndarray = field(default_factory=lambda: np.empty(0, np.int64))
    tag_mm: np.ndarray = field(default_factory=lambda: np.empty((0, 2)))
    rssi: np.ndarray | None = None
    age_s: np.ndarray | None = None

    def log(self, increment: np.ndarray, dt_s: float) -> tuple:
        """A recording of one step as compiled estimators take it, see `Recording.log`."""
        antenna = np.asarray(self.antenna, np.int32)
        n = antenna.size
        rssi = np.full(n, NO_RSSI, np.int32) if self.rssi is None else np.asarray(self.rssi, np.int32)
        age = np.zeros(n) if self.age_s is None else np.asarray(self.age_s, float)
        tags = np.asarray(self.tag_mm, float).reshape(-1, 2)
        return (
            np.asarray(increment, float).reshape(1, 3), np.array([0, n], np.int64), antenna, tags, age, rssi,
            float(dt_s),
        )  # fmt: skip
