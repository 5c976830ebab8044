"""The runs of a study on disk: each is kept the moment it is done, so that an interrupted study goes on from there."""

import sqlite3
from collections.abc import Iterable
from dataclasses import fields
from pathlib import Path
from typing import Self

from rfiddesign.errors import StudyError
from rfiddesign.metrics import RunMetrics

_METRICS = tuple(field.name for field in fields(RunMetrics))
_COLUMNS = ("scenario", "design", "run", *_METRICS)


class RunTable:
    """All runs of a study in one SQLite file.  Only one process may have it open.

    Raises
    ------
    StudyError : if the file is in use, is no run table, or cannot be written.
    """

    def __init__(self, path: Path):
        self._path = path
        try:
            self._connection = sqlite3.connect(path, timeout=1.0, isolation_level=None)
            self._connection.execute("PRAGMA locking_mode=EXCLUSIVE")
            self._connection.execute("PRAGMA journal_mode=WAL")
            self._connection.execute("PRAGMA synchronous=NORMAL")
            columns = f"{', '.join(_COLUMNS)}, PRIMARY KEY (scenario, design, run)"
            self._connection.execute(f"CREATE TABLE IF NOT EXISTS runs ({columns}) WITHOUT ROWID")
        except sqlite3.Error as error:
            raise StudyError(_in_words(error), file=path) from None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self._connection.close()

    def runs(self) -> dict[tuple[int, int], list[RunMetrics]]:
        """The stored runs 0, 1, ... of each (scenario, design), up to the first that is missing."""
        found: dict[tuple[int, int], list[RunMetrics]] = {}
        try:
            rows = self._connection.execute(f"SELECT {', '.join(_COLUMNS)} FROM runs ORDER BY scenario, design, run")
            for scenario, design, run, *values in rows:
                kept = found.setdefault((scenario, design), [])
                if run == len(kept):
                    kept.append(_metrics(values))
        except sqlite3.Error as error:
            raise StudyError(_in_words(error), file=self._path) from None
        return found

    def add(self, rows: Iterable[tuple[int, int, int, RunMetrics]]) -> None:
        """Store runs (scenario, design, run, metrics); all of them or, if the process dies, none."""
        marks = ", ".join("?" * len(_COLUMNS))
        try:
            self._connection.execute("BEGIN")
            self._connection.executemany(
                f"INSERT OR REPLACE INTO runs VALUES ({marks})",
                ((*key, *_values(metrics)) for *key, metrics in rows),
            )
            self._connection.execute("COMMIT")
        except sqlite3.Error as error:
            raise StudyError(_in_words(error), file=self._path) from None
        finally:
            # Ctrl-C may come at any row, and the runs are stored once more on the way out.
            if self._connection.in_transaction:
                self._connection.execute("ROLLBACK")


def _values(metrics: RunMetrics) -> tuple[float | int, ...]:
    values = (getattr(metrics, name) for name in _METRICS)
    return tuple(int(value) if isinstance(value, bool) else value for value in values)


def _metrics(values: list) -> RunMetrics:
    *numbers, is_complete = values
    return RunMetrics(*numbers, is_complete=bool(is_complete))


def _in_words(error: sqlite3.Error) -> str:
    if "locked" in str(error):
        return "is in use by another run"
    return f"cannot be used: {error}"
