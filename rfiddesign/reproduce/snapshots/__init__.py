"""The kind "snapshots": localization by RFID snapshots in simulated worlds (uhf_snapshots)."""

import numpy as np

from rfiddesign.errors import StudyError
from rfiddesign.models.uhf import UhfField
from rfiddesign.reproduce.measured import Measured
from rfiddesign.reproduce.progress import OnProgress, counter
from rfiddesign.reproduce.reproduction import Reproduction
from rfiddesign.reproduce.rows import Row, unit_of
from rfiddesign.reproduce.snapshots.config import SnapshotsFile
from rfiddesign.reproduce.snapshots.experiments import FEW_CYCLES, STARTS, STEPS, Errors, K, tasks
from rfiddesign.reproduce.snapshots.figures import figures_of
from rfiddesign.reproduce.snapshots.speed import speed_rows
from rfiddesign.reproduce.workers import in_threads

File = SnapshotsFile
#: Tables of the paper, which get all metrics.
PAPERS = ("table III", "table IV")


def prepared(loaded: Reproduction) -> Reproduction:
    """The reproduction as it is; StudyError for settings that do not go together."""
    file = loaded.file
    built = {
        "uhf": lambda: UhfField(**file.uhf.model_dump(exclude_none=True)),
        "drive": file.drive.settings,
        "smoothing": file.smoothing.smoothing,
        "filter": lambda: [file.filter.settings(K), file.filter.grid(), file.filter.grid(file.quick.table_factor)],
    }
    for key, build in built.items():
        try:
            build()
        except ValueError as error:
            raise StudyError(str(error), file=loaded.path, key=key) from None
    return loaded


def measure(loaded: Reproduction, n_workers: int | None, on_progress: OnProgress, *, is_quick: bool) -> Measured:
    """Simulate all data sets; see `kinds.Kind`.  Timings come first, while nothing else runs."""
    file, published = loaded.file, loaded.expected.published
    on_progress("timing the look-up table", 0, 1)
    times = speed_rows(file, is_quick=is_quick)
    errors: Errors = {}
    work = tasks(file, is_quick=is_quick)
    count = counter("data sets", len(work), on_progress)
    for found in in_threads(lambda task: task(), work, n_workers):
        for key, values in found.items():
            errors.setdefault(key, []).extend(values)
        count()
    rows = []
    for (table, row), values in errors.items():
        step = table.rpartition(", ")[2]
        if table.startswith("table II, "):
            # Table II looks at two steps of the same rows.
            named = {
                f"{step.replace(' ', '')}_{kind}_m": number
                for kind, number in (("mean", _mean(values)), ("median", _median(values)))
            }
            table = "table II"
        else:
            named = _of_runs(values, file.lost_m)
            if table not in PAPERS:
                named = {name: named[name] for name in ("median_m", "failure_rate")}
        printed = published.get(table, {}).get(row, {})
        rows += [
            Row(table, row, name, printed.get(name), value, stderr, unit_of(name))
            for name, (value, stderr) in named.items()
        ]
    rows += _leads(errors)
    rows.sort(key=lambda row: row.table)
    return Measured(rows + times, figures_of(loaded, errors))


def _leads(errors: Errors) -> list[Row]:
    """By how much the median of snapshot sampling after one step is below that of the better other way to begin [m]."""
    *others, ours = STARTS
    rows = []
    for n in FEW_CYCLES:
        first = {name: _median(errors[f"table II, step {STEPS[0]}", f"{name} {n}"])[0] for name in STARTS}
        lead = min(first[name] for name in others) - first[ours]
        rows.append(Row("table II", f"lead of snapshot sampling {n}", "step1_median_m", None, lead, None, "m"))
    return rows


def _of_runs(values: list[float], lost_m: float) -> dict[str, tuple[float, float | None]]:
    """Quantiles of the runs' mean errors and the share that failed."""
    array = np.array(values)
    share = float(np.mean(array > lost_m))
    return {
        "median_m": _median(values),
        "p90_m": (float(np.quantile(array, 0.9)), None),
        "mean_m": _mean(values),
        "q25_m": (float(np.quantile(array, 0.25)), None),
        "q75_m": (float(np.quantile(array, 0.75)), None),
        "failure_rate": (share, float(np.sqrt(share * (1 - share) / array.size))),
        "runs": (float(array.size), None),
    }


def _mean(values: list[float]) -> tuple[float, float | None]:
    array = np.array(values)
    return float(array.mean()), float(array.std(ddof=1) / np.sqrt(array.size)) if array.size > 1 else None


def _median(values: list[float]) -> tuple[float, float | None]:
    """The median, and half of what lies between the order statistics one deviation of the ranks about it."""
    array, n = np.sort(values), len(values)
    if n < 4:
        return float(np.median(array)), None
    off = 0.5 * np.sqrt(n)
    low, high = max(int(np.floor(n / 2 - off)), 0), min(int(np.ceil(n / 2 + off)), n - 1)
    return float(np.median(array)), float(array[high] - array[low]) / 2
