"""What a survey recorded: where a reference localizer had the robot, when its antennas polled, and what they read.

A drive is cut into stretches: times without a gap in which poses may be interpolated.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rfiddesign.geometry import ReaderLayout

# A robot with ten antennas that poll twenty times a second for half a day.
MAX_POLLS = 10_000_000
# A longer way between two poses is not known well enough to interpolate [s].
MAX_GAP_S = 1.0
# A read is of the poll next to it, if that is not farther than this share of the time between polls.
READ_TOLERANCE = 0.25
# Times come from decimal files [s].
_TIME_ROUNDING_S = 2e-6


@dataclass(frozen=True)
class SurveyPolls:
    """Every poll of a survey in the order of time.

    Parameters
    ----------
    time_s : (n,) when.
    antenna_poses : (n, 3) where the reference localizer had the antenna [mm, mm, rad].
    stretch : (n,) stretch of the drive.
    has_read : (n,) whether any tag answered.
    read_poll, read_tag : (r,) poll and tag of each read, by rising poll.
    """

    time_s: np.ndarray
    antenna_poses: np.ndarray
    stretch: np.ndarray
    has_read: np.ndarray
    read_poll: np.ndarray
    read_tag: np.ndarray


@dataclass(frozen=True)
class SurveyLog:
    """The log of a survey.

    Parameters
    ----------
    time_s : (m,) times of the reference poses [s], rising.
    stretch : (m,) number of the stretch that each pose is in, never falling.
    poses : (m, 3) the reference localizer's x [mm], y [mm], heading [rad].
    first_poll_s, poll_period_s : (n_antennas,) antenna a polls at first + k period, for every whole k within a stretch.
    read_time_s, read_antenna, read_tag : (r,) the reads: when, by which antenna, which tag; in any order.

    Raises
    ------
    ValueError : if the arrays do not fit each other, times do not rise, poses within a stretch are over 1 s apart, no
        stretch has two poses, or there are more than 10 million polls.
    """

    time_s: np.ndarray
    stretch: np.ndarray
    poses: np.ndarray
    first_poll_s: np.ndarray
    poll_period_s: np.ndarray
    read_time_s: np.ndarray
    read_antenna: np.ndarray
    read_tag: np.ndarray

    def __post_init__(self) -> None:
        m, r = len(self.time_s), len(self.read_time_s)
        if m < 2 or self.poses.shape != (m, 3) or self.stretch.shape != (m,):
            raise ValueError(f"poses have shape {self.poses.shape}, must be (n, 3) with n >= 2 times and stretches")
        if self.read_antenna.shape != (r,) or self.read_tag.shape != (r,):
            raise ValueError("reads must have a time, an antenna and a tag each")
        if not np.all(np.diff(self.time_s) > 0):
            raise ValueError(f"times of poses do not rise after {self.time_s[_first(np.diff(self.time_s) <= 0)]:g} s")
        if np.any(np.diff(self.stretch) < 0):
            raise ValueError(f"stretches fall after {self.time_s[_first(np.diff(self.stretch) < 0)]:g} s")
        if not len(self.first_poll_s) or len(self.first_poll_s) != len(self.poll_period_s):
            raise ValueError("the schedule must have a first poll and a period for each antenna")
        if not np.all(self.poll_period_s > 0):
            raise ValueError("the schedule has a period that is not above 0 s")
        gaps = np.where(np.diff(self.stretch) == 0, np.diff(self.time_s), 0.0)
        if np.any(gaps > MAX_GAP_S + _TIME_ROUNDING_S):
            i = _first(gaps > MAX_GAP_S + _TIME_ROUNDING_S)
            raise ValueError(
                f"poses have a gap of {gaps[i]:g} s after {self.time_s[i]:g} s, at most {MAX_GAP_S:g} s is allowed"
                " within a stretch: number stretches anew at gaps"
            )
        if not self.driven_s > 0:
            raise ValueError("no stretch has two poses")
        n_polls = self.driven_s * float(np.sum(1.0 / self.poll_period_s))
        if not n_polls <= MAX_POLLS:
            raise ValueError(f"the log has {n_polls:.3g} polls, at most {MAX_POLLS:,} are allowed")
        n_counted = len(self._first_rows) * self.n_antennas
        if n_counted > MAX_POLLS:
            raise ValueError(
                f"the log has {len(self._first_rows):,} stretches of {self.n_antennas:,} antennas, at most"
                f" {MAX_POLLS:,} together are allowed"
            )
        unknown = (self.read_antenna < 0) | (self.read_antenna >= self.n_antennas)
        if np.any(unknown):
            i = _first(unknown)
            raise ValueError(f"read {i} is of antenna {self.read_antenna[i]}, the schedule has {self.n_antennas}")

    @property
    def arrays(self) -> tuple[np.ndarray, ...]:
        """All that was recorded."""
        return (
            self.time_s, self.stretch, self.poses, self.first_poll_s, self.poll_period_s, self.read_time_s,
            self.read_antenna, self.read_tag,
        )  # fmt: skip

    @property
    def n_antennas(self) -> int:
        """Antennas on the robot."""
        return len(self.first_poll_s)

    @cached_property
    def _first_rows(self) -> np.ndarray:
        return np.concatenate([[0], np.flatnonzero(np.diff(self.stretch)) + 1])

    @property
    def _begins_s(self) -> np.ndarray:
        return self.time_s[self._first_rows]

    @property
    def _ends_s(self) -> np.ndarray:
        return self.time_s[np.concatenate([self._first_rows[1:], [len(self.time_s)]]) - 1]

    @property
    def driven_mm(self) -> float:
        """Way within the stretches [mm]."""
        ways = np.hypot(*np.diff(self.poses[:, :2], axis=0).T)
        return float(ways[np.diff(self.stretch) == 0].sum())

    @property
    def driven_s(self) -> float:
        """Duration of the stretches [s]."""
        return float(np.sum(self._ends_s - self._begins_s))

    @property
    def mean_speed_mm_per_s(self) -> float:
        """Way within the stretches over their duration [mm/s]."""
        return self.driven_mm / self.driven_s

    def before(self, stretch: int) -> "SurveyLog":
        """The log without the stretch of that number and those after it."""
        kept = self.stretch < stretch
        if np.count_nonzero(kept) < 2:
            raise ValueError(f"stretch is {stretch}: nothing was driven before")
        is_read = self.read_time_s <= self.time_s[kept][-1] + _TIME_ROUNDING_S
        return SurveyLog(
            self.time_s[kept], self.stretch[kept], self.poses[kept], self.first_poll_s, self.poll_period_s,
            self.read_time_s[is_read], self.read_antenna[is_read], self.read_tag[is_read],
        )  # fmt: skip

    def polls(self, layout: ReaderLayout) -> SurveyPolls:
        """Every poll, with the place of its antenna by linear interpolation between poses.

        A stretch has the polls after its first pose up to its last one.

        Raises
        ------
        ValueError : if the layout has not as many antennas as the schedule, or a read belongs to no poll.
        """
        if layout.n_readers != self.n_antennas:
            raise ValueError(f"the schedule has {self.n_antennas} antennas, the layout has {layout.n_readers}")
        begins, ends = self._begins_s[:, None], self._ends_s[:, None]
        first = np.floor((begins - self.first_poll_s + _TIME_ROUNDING_S) / self.poll_period_s).astype(np.int64) + 1
        last = np.floor((ends - self.first_poll_s + _TIME_ROUNDING_S) / self.poll_period_s).astype(np.int64)
        counts = np.maximum(last - first + 1, 0)
        offsets = np.concatenate([[0], np.cumsum(counts.ravel())])[:-1].reshape(counts.shape)
        read_row = self._rows_of_reads(first, counts, offsets)
        n = int(counts.sum())
        cell = np.repeat(np.arange(counts.size), counts.ravel())
        number = np.arange(n) - offsets.ravel()[cell] + first.ravel()[cell]
        antenna, stretch = cell % self.n_antennas, cell // self.n_antennas
        time = self.first_poll_s[antenna] + number * self.poll_period_s[antenna]
        order = np.lexsort((antenna, time))
        place = np.empty(n, np.int64)
        place[order] = np.arange(n)
        time, antenna, stretch = time[order], antenna[order], stretch[order]
        read_poll = place[read_row]
        by_poll = np.argsort(read_poll, kind="stable")
        has_read = np.zeros(n, bool)
        has_read[read_poll] = True
        return SurveyPolls(
            time, self._antenna_poses(time, antenna, np.asarray(layout.poses_mm, float)), stretch, has_read,
            read_poll[by_poll], self.read_tag[by_poll],
        )  # fmt: skip

    def _rows_of_reads(self, first: np.ndarray, counts: np.ndarray, offsets: np.ndarray) -> np.ndarray:
        """Place of each read's poll among those by stretch, antenna and time."""
        antenna = self.read_antenna
        position = (self.read_time_s - self.first_poll_s[antenna]) / self.poll_period_s[antenna]
        number = np.rint(position).astype(np.int64)
        time = self.first_poll_s[antenna] + number * self.poll_period_s[antenna]
        stretch = np.searchsorted(self._begins_s, time - _TIME_ROUNDING_S, side="left") - 1
        within = np.clip(stretch, 0, None)
        k = number - first[within, antenna]
        is_lost = (
            (np.abs(position - number) > READ_TOLERANCE) | (stretch < 0) | (k < 0) | (k >= counts[within, antenna])
        )
        if np.any(is_lost):
            i = _first(is_lost)
            raise ValueError(f"read {i} at {self.read_time_s[i]:.6f} s is of no poll of antenna {antenna[i]}")
        return offsets[within, antenna] + k

    def _antenna_poses(self, time: np.ndarray, antenna: np.ndarray, mounted: np.ndarray) -> np.ndarray:
        """Where antennas (n,) were at times (n,) within stretches."""
        before = np.clip(
            np.searchsorted(self.time_s, time - _TIME_ROUNDING_S, side="left") - 1, 0, len(self.time_s) - 2
        )
        share = (time - self.time_s[before]) / (self.time_s[before + 1] - self.time_s[before])
        step = self.poses[before + 1] - self.poses[before]
        # The short way round.
        step[:, 2] -= 2 * np.pi * np.round(step[:, 2] / (2 * np.pi))
        poses = self.poses[before] + np.clip(share, 0.0, 1.0)[:, None] * step
        cosine, sine = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        x, y, yaw = mounted[antenna].T
        return np.column_stack(
            [poses[:, 0] + cosine * x - sine * y, poses[:, 1] + sine * x + cosine * y, poses[:, 2] + yaw]
        )


def _first(mask: np.ndarray) -> int:
    return int(np.flatnonzero(mask)[0])
