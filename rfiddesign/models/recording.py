"""What a robot recorded on one drive: odometry and reads, with the truth beside them where it is known."""

from dataclasses import dataclass

import numpy as np


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
    """

    dt_s: float
    true_poses: np.ndarray
    odometry: np.ndarray
    read_start: np.ndarray
    read_antenna: np.ndarray
    read_tag: np.ndarray
    read_tag_mm: np.ndarray
    read_age_s: np.ndarray

    @property
    def n_steps(self) -> int:
        """Number of steps."""
        return self.odometry.shape[0]

    @property
    def n_reads(self) -> int:
        """Number of reads over all steps."""
        return int(self.read_start[-1])
