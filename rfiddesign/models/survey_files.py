"""The log of a survey as files: `poses.csv`, `reads.csv` and `schedule.csv` in one folder, numbers only.

- `poses.csv`: `time_s,stretch,x_mm,y_mm,heading_rad`; times rise; a stretch is a part of the drive without gaps.
- `reads.csv`: `time_s,antenna,tag`; antennas count from 0 as in the layout, tags have the ids of `tags.csv`.
- `schedule.csv`: `antenna,first_s,period_s`; antenna a polls at first + k period.
"""

from pathlib import Path

import numpy as np

from rfiddesign.errors import StudyError
from rfiddesign.models.survey_log import SurveyLog
from rfiddesign.results.folder import replacing

POSES, READS, SCHEDULE = "poses.csv", "reads.csv", "schedule.csv"
HEADERS = {
    POSES: ("time_s", "stretch", "x_mm", "y_mm", "heading_rad"),
    READS: ("time_s", "antenna", "tag"),
    SCHEDULE: ("antenna", "first_s", "period_s"),
}
MAX_BYTES = 500_000_000
# Largest size of a value in each column: a century, the largest floor, whole numbers that fit 32 bits.
_LARGEST = {
    "time_s": 4e9, "stretch": 2**31 - 1, "x_mm": 5e6, "y_mm": 5e6, "heading_rad": 1e6, "antenna": 9_999,
    "tag": 2**31 - 1, "first_s": 4e9, "period_s": 1e4,
}  # fmt: skip
_WHOLE = ("stretch", "antenna", "tag")
_LEAST_PERIOD_S = 1e-4
_FORMATS = {
    POSES: "{:.6f},{:.0f},{:.3f},{:.3f},{:.6f}\n",
    READS: "{:.6f},{:.0f},{:.0f}\n",
    SCHEDULE: "{:.0f},{:.9f},{:.9f}\n",
}


def read_survey_log(folder: str | Path) -> SurveyLog:
    """Read the log of a survey from its folder.

    Raises
    ------
    StudyError : naming the file and what is wrong, if a file is missing, too large, or not what it should be.
    """
    folder = Path(folder)
    poses, reads, schedule = (_read(folder / name) for name in (POSES, READS, SCHEDULE))
    path = folder / SCHEDULE
    if not len(schedule):
        raise StudyError("has no antenna", file=path)
    if sorted(schedule[:, 0].tolist()) != list(range(len(schedule))):
        raise StudyError(f"must have the antennas 0 to {len(schedule) - 1}, one row each", file=path)
    schedule = schedule[np.argsort(schedule[:, 0])]
    if schedule[:, 2].min() < _LEAST_PERIOD_S:
        raise StudyError(
            f"has the period {schedule[:, 2].min():g} s, at least {_LEAST_PERIOD_S:g} is allowed", file=path
        )
    try:
        return SurveyLog(
            poses[:, 0], poses[:, 1].astype(np.int64), poses[:, 2:], schedule[:, 1], schedule[:, 2],
            reads[:, 0], reads[:, 1].astype(np.int64), reads[:, 2].astype(np.int64),
        )  # fmt: skip
    except ValueError as error:
        raise StudyError(str(error), file=folder) from None


def write_survey_log(folder: str | Path, log: SurveyLog) -> None:
    """Write a log so that `read_survey_log` reads it: times to 1 us, places to 1 um, headings to 1 urad."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    tables = {
        POSES: np.column_stack([log.time_s, log.stretch, log.poses]),
        READS: np.column_stack([log.read_time_s, log.read_antenna, log.read_tag]),
        SCHEDULE: np.column_stack([np.arange(log.n_antennas), log.first_poll_s, log.poll_period_s]),
    }
    for name, table in tables.items():
        row = _FORMATS[name].format
        with replacing(folder / name) as temporary, temporary.open("w", encoding="ascii", newline="\n") as stream:
            stream.write(",".join(HEADERS[name]) + "\n")
            stream.writelines(row(*values) for values in table.tolist())


def _read(path: Path) -> np.ndarray:
    """The numbers of a file (n, columns)."""
    header = HEADERS[path.name]
    try:
        if path.stat().st_size > MAX_BYTES:
            raise StudyError(f"has {path.stat().st_size:,} bytes, at most {MAX_BYTES:,} are allowed", file=path)
        lines = path.read_text(encoding="ascii").splitlines()
    except OSError as error:
        raise StudyError(f"cannot be read: {error.strerror}", file=path) from None
    except UnicodeDecodeError:
        raise StudyError("is not plain text", file=path) from None
    if not lines or lines[0].strip() != ",".join(header):
        raise StudyError(f"begins with {(lines or [''])[0][:60]!r}, must begin with {','.join(header)}", file=path)
    rows = lines[1:]
    if not rows:
        return np.empty((0, len(header)))
    try:
        table = np.loadtxt(rows, delimiter=",", comments=None, ndmin=2)
    except (ValueError, OverflowError):
        table = None
    if table is None or table.shape != (len(rows), len(header)):
        number = next((i for i, row in enumerate(rows) if not _is_row(row, len(header))), 0)
        raise StudyError(f"line {number + 2} is {rows[number][:60]!r}, must be {len(header)} numbers", file=path)
    for name, column in zip(header, table.T, strict=True):
        is_wrong = ~(np.abs(column) <= _LARGEST[name])
        if name in _WHOLE:
            is_wrong |= (column != np.floor(column)) | (column < 0)
        if np.any(is_wrong):
            number = int(np.flatnonzero(is_wrong)[0])
            kind = "a whole number from 0 to" if name in _WHOLE else "a number of size at most"
            raise StudyError(
                f"line {number + 2}: {name} is {column[number]:g}, must be {kind} {_LARGEST[name]:,.0f}", file=path
            )
    return table


def _is_row(row: str, n: int) -> bool:
    try:
        return len([float(cell) for cell in row.split(",")]) == n
    except ValueError:
        return False
