"""Run a reproduction: simulate its cases, work out what its analysis adds, hold its claims against the numbers."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from rfiddesign.errors import StudyError
from rfiddesign.reproduce.analyses import ANALYSES
from rfiddesign.reproduce.context import Context
from rfiddesign.reproduce.load import Reproduction, case_of
from rfiddesign.reproduce.measure import METRICS, Errors, measure
from rfiddesign.reproduce.rows import Claim, Row, row_of
from rfiddesign.reproduce.timing import N_QUICK_ROUNDS, N_ROUNDS, TIME, us_per_step


@dataclass(frozen=True)
class Reproduced:
    """What a reproduction found.

    Parameters
    ----------
    name, title : of the study.
    is_quick : whether counts were reduced.
    rows : every number, published or not.
    claims : bounds of expected.toml, held against the numbers.
    figures : by name.
    """

    name: str
    title: str
    is_quick: bool
    rows: tuple[Row, ...]
    claims: tuple[Claim, ...]
    figures: dict[str, Figure]

    def as_json(self) -> dict[str, Any]:
        """Everything but the figures as plain data."""
        return {
            "study": self.name,
            "title": self.title,
            "is_quick": self.is_quick,
            "rows": [row.as_json() for row in self.rows],
            "claims": [claim.as_json() for claim in self.claims],
        }


def reproduce(
    loaded: Reproduction, *, is_quick: bool = False, n_workers: int | None = None,
    on_progress: Callable[[str, int, int], None] | None = None,
) -> Reproduced:  # fmt: skip
    """Run a reproduction.

    Results depend on the study and its seed alone, not on the number of workers; times are those of this machine.

    Parameters
    ----------
    is_quick : the reduced number of runs.
    n_workers : threads; None: one per core.
    on_progress : called with what is under way, how many of its runs are done and how many there are.

    Raises
    ------
    StudyError : if a row asks for a metric that there is not.
    """
    file = loaded.file
    for section in file.rows:
        for metric in section.metrics:
            if metric not in (*METRICS, TIME):
                raise StudyError(
                    f"found {metric!r}, must be one of {', '.join((*METRICS, TIME))}",
                    file=loaded.path, key=f"rows ({section.table}, {section.row}).metrics",
                )  # fmt: skip
    errors: dict[tuple[str, str], Errors] = {}
    for number, section in enumerate(file.rows):
        n_runs = file.quick_runs if is_quick else section.runs or file.runs
        progress = _counter(f"{section.table}, {section.row} ({number + 1} of {len(file.rows)})", n_runs, on_progress)
        errors[section.table, section.row] = measure(case_of(loaded, section), n_runs, file.seed, n_workers, progress)
    for key, time in _times(loaded, is_quick, on_progress).items():
        errors[key][TIME] = np.array([time])
    rows: list[Row] = []
    for section in file.rows:
        published = loaded.expected.published.get(section.table, {}).get(section.row, {})
        for metric in section.metrics:
            values = errors[section.table, section.row][metric]
            rows.append(row_of(section.table, section.row, metric, values, published.get(metric)))
    context = Context(loaded, is_quick, n_workers, tuple(rows), errors, on_progress or (lambda *_: None))
    more, figures = ANALYSES[file.analysis](context)
    rows += more
    measured = {(row.table, row.row, row.metric): row.measured for row in rows}
    claims = tuple(
        Claim(claim, measured.get((claim.table, claim.row, claim.metric))) for claim in loaded.expected.claims
    )
    return Reproduced(loaded.name, file.title, is_quick, tuple(rows), claims, figures)


def _times(
    loaded: Reproduction, is_quick: bool, on_progress: Callable[[str, int, int], None] | None
) -> dict[tuple[str, str], float]:
    """Computing times of the rows that ask for them [us], those of a table in one go."""
    asking = [section for section in loaded.file.rows if TIME in section.metrics]
    n_rounds, times = N_QUICK_ROUNDS if is_quick else N_ROUNDS, {}
    for table in dict.fromkeys(section.table for section in asking):
        cases = {section.row: case_of(loaded, section) for section in asking if section.table == table}
        progress = _counter(f"{table}, computing times", n_rounds * len(cases), on_progress)
        found = us_per_step(cases, loaded.file.seed, progress, is_quick=is_quick)
        times |= {(table, row): time for row, time in found.items()}
    return times


def _counter(what: str, n_runs: int, on_progress: Callable[[str, int, int], None] | None) -> Callable[[], None]:
    done = 0

    def count() -> None:
        nonlocal done
        done += 1
        if on_progress is not None:
            on_progress(what, done, n_runs)

    return count
