"""The board as a page and a chart."""

import datetime
import importlib.metadata
import platform
from pathlib import Path

from tests.benchmarks.board import Board

_PACKAGES = ("numba", "numpy", "shapely", "particles", "stonesoup", "filterpy")


def save(board: Board, folder: Path) -> None:
    """Write README.md and the chart to `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    versions = ", ".join(f"{name} {importlib.metadata.version(name)}" for name in _PACKAGES)
    page = f"""# Benchmarks

Measured by `pytest tests/benchmarks --benchmark-only --save-table docs/benchmarks` on {datetime.date.today()}:
{_processor()}, {platform.system()}, Python {platform.python_version()}, {versions}.
Each row is one interleaved run, the minimum of many, single-threaded unless said.  Timings vary between machines; the
ratios vary less.

{board.table()}

What the search for the cheapest design takes, and how often it is right, is counted in [search.md](search.md).

![times of one MCL step, and growth of the cost](benchmarks.svg)

## How cost grows

{board.growth()}

## Where the main job's time goes

`rfiddesign run studies/willow-office` with one worker, kernels on disk; processor time.

{board.profile()}
"""
    (folder / "README.md").write_text(page, encoding="utf-8")
    _chart(board).savefig(folder / "benchmarks.svg", metadata={"Date": None})


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def _chart(board: Board):
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot

    row = next(row for row in board.rows if row.work.startswith("MCL step"))
    curves = {name: points for name, points in board.curves.items() if len(points) > 2}
    n_columns = 3
    n_rows = -(-(1 + len(curves)) // n_columns)
    figure, axes = pyplot.subplots(n_rows, n_columns, figsize=(10, 3.1 * n_rows), layout="constrained")
    first, *others = axes.ravel()
    names, times = ["rfiddesign", *row.peers], [row.ours, *row.peers.values()]
    bars = first.barh(names, times, color=["#0072B2"] + ["#999999"] * len(row.peers))
    first.bar_label(bars, [f"{time:,.0f}" if time >= 100 else f"{time:.2f}" for time in times], padding=3)
    first.set(xscale="log", xlabel=row.unit, title="One MCL step", xlim=(1, 8 * max(times)))
    first.invert_yaxis()
    for axis in others[len(curves) :]:
        axis.set_axis_off()
    for axis, (name, points) in zip(others, curves.items(), strict=False):
        what, _, unit = name.partition(" [")
        axis.plot(*zip(*points, strict=True), "o-", color="#0072B2")
        axis.set(xscale="log", xlabel=what, ylabel=unit.rstrip("]"), ylim=(0, 1.12 * max(y for _, y in points)))
        axis.grid(alpha=0.3)
    return figure
