"""The log of a survey as files: `poses.csv`, `reads.csv` and `schedule.csv` in one folder, numbers only.

- `poses.csv`: `time_s,stretch,x_mm,y_mm,heading_rad`; times rise; a stretch is a part of the drive without gaps
  of over 1 s.
- `reads.csv`: `time_s,antenna,tag`; antennas count from 0 as in the layout, tags have the ids of `tags.csv`.
- `schedule.csv`: `antenna,first_s,period_s`; antenna a polls at first + k period.
"""

from pathlib import Path

import numpy as np

from rfiddesign.errors import StudyError
from rfiddesign.models.number_files import (
    LARGEST_MM,
    LARGEST_RAD,
    LARGEST_S,
    LARGEST_WHOLE,
    Column,
    read_numbers,
    write_numbers,
)
from rfiddesign.models.survey_log import SurveyLog

POSES, READS, SCHEDULE = "poses.csv", "reads.csv", "schedule.csv"
_TIME, _ANTENNA = Column("time_s", LARGEST_S, 6), Column("antenna", 9_999)
COLUMNS = {
    POSES: (
        _TIME, Column("stretch", LARGEST_WHOLE), Column("x_mm", LARGEST_MM, 3), Column("y_mm", LARGEST_MM, 3),
        Column("heading_rad", LARGEST_RAD, 6),
    ),
    READS: (_TIME, _ANTENNA, Column("tag", LARGEST_WHOLE)),
    SCHEDULE: (_ANTENNA, Column("first_s", LARGEST_S, 9), Column("period_s", 1e4, 9)),
}  # fmt: skip
_LEAST_PERIOD_S = 1e-4


def read_survey_log(folder: str | Path) -> SurveyLog:
    """Read the log of a survey from its folder.

    Raises
    ------
    StudyError : naming the file and what is wrong, if a file is missing, too large, or not what it should be.
    """
    folder = Path(folder)
    poses, reads, schedule = (read_numbers(folder / name, columns) for name, columns in COLUMNS.items())
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
        write_numbers(folder / name, COLUMNS[name], table)
