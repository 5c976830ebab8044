"""Snapshots: how often each tag was read in short series of inquiry cycles, and where the antenna was."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rfiddesign import require

MAX_CYCLES = 1_000
MAX_TAGS = 2**31 - 1
#: Counts of a dense table: 1 GB at most.
MAX_DENSE = 500_000_000


@dataclass(frozen=True, eq=False)
class Snapshots:
    """Snapshots of one antenna, each a row of counts; tags that were not read are left out.

    Parameters
    ----------
    n_cycles : cycles of each snapshot, N in uhf_snapshots: no count is higher.
    n_tags : tags there are: numbers of tags are below.
    poses : (n, 3) of the antenna (x, y [mm], boresight [rad]) as the reference localizer has them.
    start : (n + 1,) snapshot i has the entries start[i] to start[i + 1] - 1 of `tag` and `count`.
    tag : (m,) numbers of the tags that were read, rising within each snapshot.
    count : (m,) how often, 1 to n_cycles.

    Raises
    ------
    ValueError : if shapes do not fit, or numbers, counts or poses are out of bounds.
    """

    n_cycles: int
    n_tags: int
    poses: NDArray[np.float64]
    start: NDArray[np.int64]
    tag: NDArray[np.int32]
    count: NDArray[np.int16]

    def __post_init__(self) -> None:
        require.count("n_cycles", self.n_cycles, at_most=MAX_CYCLES)
        require.count("n_tags", self.n_tags, at_most=MAX_TAGS)
        for name, kind in (("poses", np.float64), ("start", np.int64), ("tag", np.int32), ("count", np.int16)):
            array = _kept(name, getattr(self, name), kind)
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        n, m = len(self.poses), len(self.tag)
        if self.poses.shape != (n, 3) or not np.isfinite(self.poses).all():
            raise ValueError(f"poses: shape {self.poses.shape}, must be finite and (n, 3)")
        if self.start.shape != (n + 1,) or self.start[0] != 0 or self.start[-1] != m or (np.diff(self.start) < 0).any():
            raise ValueError(f"start: must be {n + 1} numbers that rise from 0 to the {m} entries of tag")
        if self.tag.shape != (m,) or self.count.shape != (m,):
            raise ValueError(f"tag, count: shapes {self.tag.shape}, {self.count.shape}, must be the same (m,)")
        if m and (self.tag.min() < 0 or self.tag.max() >= self.n_tags):
            raise ValueError(f"tag: holds {self.tag.min()} to {self.tag.max()}, must be within 0 to {self.n_tags - 1}")
        if m and (self.count.min() < 1 or self.count.max() > self.n_cycles):
            raise ValueError(
                f"count: holds {self.count.min()} to {self.count.max()}, must be within 1 to {self.n_cycles}"
            )
        row = np.repeat(np.arange(n), np.diff(self.start))
        if ((np.diff(self.tag) <= 0) & (np.diff(row) == 0)).any():
            raise ValueError("tag: must rise within each snapshot")

    def __len__(self) -> int:
        return len(self.poses)

    @classmethod
    def of_counts(cls, counts: NDArray, poses: NDArray, n_cycles: int) -> "Snapshots":
        """Snapshots of a dense table of counts (n, n_tags), taken at `poses` (n, 3)."""
        counts = np.asarray(counts)
        if counts.ndim != 2:
            raise ValueError(f"counts has shape {counts.shape}, must be (n, n_tags)")
        if counts.size and counts.min() < 0:
            raise ValueError(f"counts: holds {counts.min()}, must be at least 0")
        row, tag = np.nonzero(counts)
        start = np.concatenate([[0], np.cumsum(np.bincount(row, minlength=len(counts)))])
        return cls(n_cycles, counts.shape[1], poses, start, tag, counts[row, tag])

    def dense(self) -> NDArray[np.int16]:
        """Counts (n, n_tags).

        Raises
        ------
        ValueError : if that is more than 1 GB.
        """
        if len(self) * self.n_tags > MAX_DENSE:
            raise ValueError(
                f"{len(self):,} snapshots of {self.n_tags:,} tags: a dense table would have more than 1 GB"
            )
        counts = np.zeros((len(self), self.n_tags), np.int16)
        counts[np.repeat(np.arange(len(self)), np.diff(self.start)), self.tag] = self.count
        return counts


def part_of(log: "SnapshotLog", first: int, last: int) -> "SnapshotLog":
    """Rows first..last-1 of a log, as a drive of its own; ValueError for rows that it does not have."""
    if not 0 <= first <= last <= len(log):
        raise ValueError(f"rows {first} to {last} are not within 0 to {len(log)}, the log's end")
    rows = slice(first, last)
    odometry = log.odometry[rows].copy()
    odometry[:1] = 0.0
    antennas = []
    for snapshots in log.antennas:
        start = snapshots.start[first : last + 1]
        entries = slice(start[0], start[-1])
        antennas.append(
            replace(
                snapshots, poses=snapshots.poses[rows], start=start - start[0], tag=snapshots.tag[entries],
                count=snapshots.count[entries],
            )
        )  # fmt: skip
    return SnapshotLog(log.time_s[rows], log.true_poses[rows], log.reference_poses[rows], odometry, tuple(antennas))


def concatenated(parts: Sequence[Snapshots]) -> Snapshots:
    """Several lists of snapshots, of the same number of cycles and the same tags, as one.

    Raises
    ------
    ValueError : if there is none, or cycles or tags differ.
    """
    if not parts:
        raise ValueError("parts is empty, must hold at least one list of snapshots")
    first = parts[0]
    for part in parts:
        if (part.n_cycles, part.n_tags) != (first.n_cycles, first.n_tags):
            raise ValueError(
                f"parts: have {first.n_cycles} and {part.n_cycles} cycles, {first.n_tags} and {part.n_tags} tags;"
                " must agree"
            )
    begin = np.cumsum([0] + [len(part.tag) for part in parts])
    starts = [part.start[:-1] + before for part, before in zip(parts, begin, strict=False)]
    return Snapshots(
        first.n_cycles, first.n_tags, np.concatenate([part.poses for part in parts]),
        np.concatenate([*starts, begin[-1:]]), np.concatenate([part.tag for part in parts]),
        np.concatenate([part.count for part in parts]),
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class SnapshotLog:
    """What one drive recorded: a row per inquiry, stamped with one time within it, as its middle or its end.

    Parameters
    ----------
    time_s : (n,) stamps, rising [s].
    true_poses, reference_poses : (n, 3) of the robot at the stamps: where it was, and what the reference localizer says
        (x, y [mm], heading [rad]).
    odometry : (n, 3) reported motion from the stamp of the row before, in the robot's frame there; row 0 is zeros.
    antennas : the snapshots of each antenna (pair), n rows each; `poses` are those of the reference at the stamps.

    Raises
    ------
    ValueError : if shapes do not fit or times do not rise.
    """

    time_s: NDArray[np.float64]
    true_poses: NDArray[np.float64]
    reference_poses: NDArray[np.float64]
    odometry: NDArray[np.float64]
    antennas: tuple[Snapshots, ...]

    def __post_init__(self) -> None:
        time = _kept("time_s", self.time_s, np.float64)
        n = len(time)
        if time.shape != (n,) or not np.isfinite(time).all() or (np.diff(time) <= 0).any():
            raise ValueError("time_s: must be finite and rise")
        time.flags.writeable = False
        object.__setattr__(self, "time_s", time)
        for name in ("true_poses", "reference_poses", "odometry"):
            array = _kept(name, getattr(self, name), np.float64)
            if array.shape != (n, 3) or not np.isfinite(array).all():
                raise ValueError(f"{name}: shape {array.shape}, must be finite and ({n}, 3)")
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        if n and self.odometry[0].any():
            raise ValueError("odometry: row 0 must be zeros")
        if not self.antennas:
            raise ValueError("antennas is empty, must hold the snapshots of at least one antenna")
        for snapshots in self.antennas:
            if len(snapshots) != n:
                raise ValueError(f"antennas: one has {len(snapshots)} snapshots, must have {n}")

    def __len__(self) -> int:
        return len(self.time_s)


def _kept(name: str, values: NDArray, kind: type) -> NDArray:
    """A copy of an array as a kind of number; whole numbers must fit."""
    array = np.asarray(values)
    if np.issubdtype(kind, np.integer) and array.size:
        if not np.issubdtype(array.dtype, np.integer):
            raise ValueError(f"{name}: has numbers of type {array.dtype}, must be whole numbers")
        bounds = np.iinfo(kind)
        if array.min() < bounds.min or array.max() > bounds.max:
            raise ValueError(f"{name}: holds {array.min()} to {array.max()}, must be within {kind.__name__}")
    return np.array(array, kind, order="C")
