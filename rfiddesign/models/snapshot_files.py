"""The log of a drive with snapshots as files: fields are learned from recorded drives as from simulated ones.

- `antennas.csv`: `antenna,x_mm,y_mm,yaw_rad,n_cycles`: where each antenna (pair) sits on the robot, and the cycles of
  a snapshot.
- `inquiries.csv`: `time_s,x_mm,y_mm,heading_rad,ahead_mm,left_mm,turn_rad`: pose by the reference localizer in the
  middle of each inquiry, and what the odometry reported since the one before, in the robot's frame there.
- `counts.csv`: `inquiry,antenna,tag,count`: how often a tag was read; inquiries, antennas and tags count from 0.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rfiddesign.errors import StudyError
from rfiddesign.geometry import compose
from rfiddesign.models.number_files import (
    LARGEST_MM,
    LARGEST_RAD,
    LARGEST_S,
    LARGEST_WHOLE,
    Column,
    read_numbers,
    write_numbers,
)
from rfiddesign.models.snapshots import MAX_CYCLES, SnapshotLog, Snapshots

ANTENNAS, INQUIRIES, COUNTS = "antennas.csv", "inquiries.csv", "counts.csv"
MAX_ANTENNAS = 100
# Of a table that looks them up.
MAX_TAGS = 2**16
_ANTENNA = Column("antenna", MAX_ANTENNAS - 1)
_X, _Y = Column("x_mm", LARGEST_MM, 3), Column("y_mm", LARGEST_MM, 3)
COLUMNS = {
    ANTENNAS: (_ANTENNA, _X, _Y, Column("yaw_rad", LARGEST_RAD, 6), Column("n_cycles", MAX_CYCLES)),
    INQUIRIES: (
        Column("time_s", LARGEST_S, 6), _X, _Y, Column("heading_rad", LARGEST_RAD, 6),
        Column("ahead_mm", LARGEST_MM, 3), Column("left_mm", LARGEST_MM, 3), Column("turn_rad", LARGEST_RAD, 6),
    ),
    COUNTS: (Column("inquiry", LARGEST_WHOLE), _ANTENNA, Column("tag", MAX_TAGS - 1), Column("count", MAX_CYCLES)),
}  # fmt: skip


def read_snapshot_logs(folders: Sequence[str | Path], n_tags: int | None = None) -> list[SnapshotLog]:
    """Read recorded drives of one robot among the same tags; where the robot was in truth is what the reference says.

    Parameters
    ----------
    folders : one for each drive.
    n_tags : how many tags there are, for drives that are read by several calls; None: as many as these drives tell.

    Raises
    ------
    StudyError : naming file and line of what is missing or wrong, or the folder whose antennas differ from the first's.
    """
    tables = [{name: read_numbers(Path(folder) / name, COLUMNS[name]) for name in COLUMNS} for folder in folders]
    for table in tables:
        table[ANTENNAS] = table[ANTENNAS][np.argsort(table[ANTENNAS][:, 0])]
    n_tags = n_tags or max((int(table[COUNTS][:, 2].max(initial=0)) + 1 for table in tables), default=1)
    logs = []
    for folder, table in zip(folders, tables, strict=True):
        if not np.array_equal(table[ANTENNAS], tables[0][ANTENNAS]):
            raise StudyError(f"differs from that of {folders[0]}", file=Path(folder) / ANTENNAS)
        logs.append(_log_of(Path(folder), table, n_tags))
    return logs


def write_snapshot_log(folder: str | Path, log: SnapshotLog, mountings: Sequence[Sequence[float]]) -> None:
    """Write a log with the poses of its antennas on the robot; what was true is not written.

    Raises
    ------
    ValueError : if there are not as many mountings as antennas.
    """
    folder, mountings = Path(folder), np.asarray(mountings, float).reshape(-1, 3)
    if len(mountings) != len(log.antennas):
        raise ValueError(f"mountings has {len(mountings)} poses, must have {len(log.antennas)}, one for each antenna")
    folder.mkdir(parents=True, exist_ok=True)
    counts = []
    for a, part in enumerate(log.antennas):
        inquiry = np.repeat(np.arange(len(log)), np.diff(part.start))
        counts.append(np.column_stack([inquiry, np.full(len(inquiry), a), part.tag, part.count]))
    cycles = [part.n_cycles for part in log.antennas]
    tables = {
        ANTENNAS: np.column_stack([np.arange(len(mountings)), mountings, cycles]),
        INQUIRIES: np.column_stack([log.time_s, log.reference_poses, log.odometry]),
        COUNTS: np.concatenate(counts),
    }
    for name, table in tables.items():
        write_numbers(folder / name, COLUMNS[name], table)


def _log_of(folder: Path, table: dict[str, np.ndarray], n_tags: int) -> SnapshotLog:
    antennas, inquiries, counts = (table[name] for name in COLUMNS)
    if not len(antennas):
        raise StudyError("has no antenna", file=folder / ANTENNAS)
    if sorted(antennas[:, 0].tolist()) != list(range(len(antennas))):
        raise StudyError(f"must have the antennas 0 to {len(antennas) - 1}, one row each", file=folder / ANTENNAS)
    n = len(inquiries)
    for column, name, bound in ((0, "inquiry", n), (1, "antenna", len(antennas))):
        if len(counts) and counts[:, column].max() >= bound:
            line = int(np.argmax(counts[:, column] >= bound)) + 2
            raise StudyError(
                f"line {line}: {name} is {counts[line - 2, column]:g}, there are {bound}", file=folder / COUNTS
            )
    poses, odometry = inquiries[:, 1:4], inquiries[:, 4:].copy()
    # What was driven before the first inquiry is no part of the log.
    odometry[:1] = 0.0
    try:
        parts = []
        for number, *mounting, n_cycles in antennas.tolist():
            rows = counts[counts[:, 1] == number][:, [0, 2, 3]].astype(np.int64)
            rows = rows[np.lexsort((rows[:, 1], rows[:, 0]))]
            start = np.searchsorted(rows[:, 0], np.arange(n + 1))
            at = compose(poses, mounting) if n else np.empty((0, 3))
            parts.append(Snapshots(int(n_cycles), n_tags, at, start, rows[:, 1], rows[:, 2]))
        return SnapshotLog(inquiries[:, 0], poses, poses, odometry, tuple(parts))
    except ValueError as error:
        raise StudyError(str(error), file=folder) from None
