"""What antennas whose poses are known read on a drive: the input of those who ask where the tags are."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

MAX_POLLS = 10_000_000


@dataclass(frozen=True, eq=False)
class Polls:
    """Polls in the order of time, each of one antenna, and the tags that they read.

    Parameters
    ----------
    poses : (n_polls, 3) x [mm], y [mm] and heading [rad] of the antenna that polled.
    read_poll : (n_reads,) number of the poll, not falling.
    read_tag : (n_reads,) number of the tag that it read, from 0 to n_tags - 1.
    read_distance_mm : (n_reads,) least communication distance to which the reader could be set to read it [mm]; thus
        the stronger the signal, the less.
    n_tags : how many tags there are, read or not.

    Raises
    ------
    ValueError : if shapes do not fit, a pose is not finite or a number names no poll or tag.
    """

    poses: np.ndarray
    read_poll: np.ndarray
    read_tag: np.ndarray
    read_distance_mm: np.ndarray
    n_tags: int

    def __post_init__(self) -> None:
        if self.poses.ndim != 2 or self.poses.shape[1] != 3 or len(self.poses) > MAX_POLLS:
            raise ValueError(f"poses has shape {self.poses.shape}, must be (n_polls, 3), at most {MAX_POLLS:,} polls")
        if not np.isfinite(self.poses).all():
            raise ValueError("poses has a value that is not finite")
        if not self.read_poll.shape == self.read_tag.shape == self.read_distance_mm.shape == (self.n_reads,):
            raise ValueError("read_poll, read_tag and read_distance_mm must have one entry for each read")
        for name, values, n in (
            ("read_poll", self.read_poll, len(self.poses)),
            ("read_tag", self.read_tag, self.n_tags),
        ):
            if self.n_reads and not 0 <= values.min() <= values.max() < n:
                raise ValueError(f"{name} has a number outside 0 to {n - 1}")
        if (np.diff(self.read_poll) < 0).any():
            raise ValueError("read_poll falls, must be in the order of time")

    @property
    def n_reads(self) -> int:
        """Number of reads."""
        return self.read_poll.size

    def reads_of(self, tag: int) -> np.ndarray:
        """Rows of the reads of a tag, in the order of time."""
        starts, rows = self._by_tag
        return rows[starts[tag] : starts[tag + 1]]

    @cached_property
    def _by_tag(self) -> tuple[np.ndarray, np.ndarray]:
        """Where the rows of each tag begin (n_tags + 1,) among all rows sorted by tag, and these."""
        rows = np.argsort(self.read_tag, kind="stable")
        return np.searchsorted(self.read_tag[rows], np.arange(self.n_tags + 1)), rows
