"""Reproductions of floor systems: robots over tagged floors, simulated case by case."""

from dataclasses import replace

import numpy as np

from rfiddesign.errors import StudyError
from rfiddesign.reproduce.analyses import ANALYSES
from rfiddesign.reproduce.cases import case_of
from rfiddesign.reproduce.config import ReproductionFile
from rfiddesign.reproduce.context import Context
from rfiddesign.reproduce.measure import METRICS, Errors
from rfiddesign.reproduce.measure import measure as measure_case
from rfiddesign.reproduce.measured import Measured
from rfiddesign.reproduce.progress import OnProgress, counter
from rfiddesign.reproduce.reproduction import Reproduction
from rfiddesign.reproduce.rows import Row, row_of
from rfiddesign.reproduce.timing import N_QUICK_ROUNDS, N_ROUNDS, TIME, us_per_step

File = ReproductionFile


def prepared(loaded: Reproduction) -> Reproduction:
    """The reproduction with the rows of its grids; StudyError for a case that cannot be built or an unknown metric."""
    loaded = replace(loaded, file=loaded.file.with_grids())
    for section in loaded.file.rows:
        case_of(loaded, section)
        for metric in section.metrics:
            if metric not in (*METRICS, TIME):
                raise StudyError(
                    f"found {metric!r}, must be one of {', '.join((*METRICS, TIME))}",
                    file=loaded.path, key=f"rows ({section.table}, {section.row}).metrics",
                )  # fmt: skip
    return loaded


def measure(loaded: Reproduction, n_workers: int | None, on_progress: OnProgress, *, is_quick: bool) -> Measured:
    """Simulate the cases, and work out what the study's analysis adds; see `kinds.Kind`."""
    file = loaded.file
    errors: dict[tuple[str, str], Errors] = {}
    for number, section in enumerate(file.rows):
        n_runs = file.quick_runs if is_quick else section.runs or file.runs
        progress = counter(f"{section.table}, {section.row} ({number + 1} of {len(file.rows)})", n_runs, on_progress)
        case = case_of(loaded, section)
        errors[section.table, section.row] = measure_case(case, n_runs, file.seed, n_workers, progress)
    for key, time in _times(loaded, is_quick, on_progress).items():
        errors[key][TIME] = np.array([time])
    rows: list[Row] = []
    for section in file.rows:
        published = loaded.expected.published.get(section.table, {}).get(section.row, {})
        for metric in section.metrics:
            values = errors[section.table, section.row][metric]
            rows.append(row_of(section.table, section.row, metric, values, published.get(metric)))
    context = Context(loaded, is_quick, n_workers, tuple(rows), errors, on_progress)
    more, figures = ANALYSES[file.analysis](context)
    return Measured([*rows, *more], figures)


def _times(loaded: Reproduction, is_quick: bool, on_progress: OnProgress) -> dict[tuple[str, str], float]:
    """Computing times of the rows that ask for them [us], those of a table in one go."""
    asking = [section for section in loaded.file.rows if TIME in section.metrics]
    n_rounds, times = N_QUICK_ROUNDS if is_quick else N_ROUNDS, {}
    for table in dict.fromkeys(section.table for section in asking):
        cases = {section.row: case_of(loaded, section) for section in asking if section.table == table}
        progress = counter(f"{table}, computing times", n_rounds * len(cases), on_progress)
        found = us_per_step(cases, loaded.file.seed, progress, is_quick=is_quick)
        times |= {(table, row): time for row, time in found.items()}
    return times
