"""rssi_kalman_navifloor: how often the filters rank as published, and by how much they differ run by run."""

from itertools import pairwise

import numpy as np
from matplotlib.figure import Figure

from rfiddesign.report.figures.style import CYCLE, LINE_STYLES, new_figure, styled
from rfiddesign.reproduce.context import Context
from rfiddesign.reproduce.rows import Row, row_of
from rfiddesign.simulation.run import Trace

PATH_TABLE = "table II"
TABLES = (PATH_TABLE, "random headings")
RANKING = ("QEKF", "QRSSI", "CEKF", "CRSSI")
# The first has the larger error, as published.
PAIRS = (("QEKF", "QRSSI"), ("CEKF", "CRSSI"), ("QRSSI", "CEKF"), ("QEKF", "CEKF"))
SHOWN = ("QEKF", "CEKF", "QRSSI", "CRSSI")


def analyse(context: Context) -> tuple[list[Row], dict[str, Figure]]:
    """Paired differences, shares of seeds, and the paths of one run."""
    rows = []
    for table in TABLES:
        errors = {name: context.errors[table, name]["rmse_mm"] for name in RANKING}
        for worse, better in PAIRS:
            difference = errors[worse] - errors[better]
            rows.append(row_of(table, f"{worse} minus {better}", "rmse_mm", difference))
            rows.append(row_of(table, f"{worse} worse than {better}", "share_of_seeds", difference > 0))
        is_ranked = np.all([errors[a] > errors[b] for a, b in pairwise(RANKING)], axis=0)
        rows.append(row_of(table, " > ".join(RANKING), "share_of_seeds", is_ranked))
    return rows, {"paths": paths_figure(context.traces(PATH_TABLE, SHOWN)), "rmse": rmse_figure(context)}


@styled
def paths_figure(traces: dict[str, Trace]) -> Figure:
    """Where the robot was in run 0, and where the filters had it."""
    figure = new_figure(5.2)
    axes = figure.subplots()
    true = next(iter(traces.values())).true_poses
    tags = _tags_about(true)
    axes.plot(tags[:, 0], tags[:, 1], ".", color="#b0b7c3", markersize=3, label="tags")
    axes.plot(true[:, 0], true[:, 1], color="black", linewidth=2.5, label="true path")
    for (name, trace), colour, line in zip(traces.items(), CYCLE, LINE_STYLES, strict=False):
        axes.plot(trace.poses[:, 0], trace.poses[:, 1], color=colour, linestyle=line, linewidth=1.2, label=name)
    axes.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal")
    figure.legend(loc="outside upper center", ncols=3)
    return figure


def _tags_about(poses: np.ndarray, pitch: float = 250.0) -> np.ndarray:
    low, high = poses[:, :2].min(axis=0) - pitch, poses[:, :2].max(axis=0) + pitch
    x, y = (np.arange(np.ceil(a / pitch), np.floor(b / pitch) + 1) * pitch for a, b in zip(low, high, strict=True))
    return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)


@styled
def rmse_figure(context: Context) -> Figure:
    """Spread of the errors over the seeds, on the published path and over random headings."""
    names = [row for table, row in context.errors if table == PATH_TABLE]
    figure = new_figure(0.9 + 0.24 * len(names))
    places = np.arange(len(names), 0, -1)
    panels = figure.subplots(1, 2, sharex=True, sharey=True)
    for axes, table in zip(panels, TABLES, strict=True):
        axes.boxplot(
            [context.errors[table, name]["rmse_mm"] for name in names], positions=places, orientation="horizontal",
            whis=(5, 95), showfliers=False, medianprops={"color": CYCLE[1]}, manage_ticks=False, widths=0.5,
        )  # fmt: skip
        for place, name in zip(places, names, strict=True):
            published = context.loaded.expected.published.get(table, {}).get(name, {}).get("rmse_mm")
            if published is not None:
                axes.plot(published, place, marker="D", color=CYCLE[0], markersize=4, linestyle="none")
        axes.set_xlabel("RMSE [mm]")
        axes.set_title(table if table != PATH_TABLE else "published path", loc="left")
    # Once both are drawn, so that neither sticks out.
    panels[0].set_xlim(left=0)
    panels[0].set_yticks(places, names)
    panels[0].locator_params(axis="x", nbins=5)
    figure.supxlabel("diamonds: published; boxes: quartiles; whiskers: 5 and 95 % of seeds", fontsize=7.5)
    return figure
