"""Figures of a tag mapping: errors along the line, a belief before and after the turn, errors in the office."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from rfiddesign.estimators.tag_mapping import by_reads
from rfiddesign.estimators.tag_mapping.window import peak
from rfiddesign.report.figures.style import BLACK, BLUE, CYCLE, LINE_STYLES, VERMILLION, new_figure, plain_map, styled
from rfiddesign.reproduce.tag_mapping import line, office
from rfiddesign.reproduce.tag_mapping.config import TagMappingFile
from rfiddesign.reproduce.tag_mapping.models import NAMES, papers_models

# Run that the figures of the line show.
_RUN = 0
_COLOURS = dict(zip(NAMES, CYCLE, strict=False))
_LINES = dict(zip(NAMES, LINE_STYLES, strict=False))
# What a picture of a belief shows: to either side of the tag along the line, and across it [mm].
_ALONG_MM, _ACROSS_MM = 1100.0, (-400.0, 1500.0)


@styled
def line_figure(file: TagMappingFile) -> Figure:
    """Error over the driven way, without a desk (thick) and above one (thin)."""
    offsets = file.line.offsets_mm
    figure = new_figure(0.7 + 1.5 * len(offsets))
    panels = figure.subplots(len(offsets), 1, sharex=True, squeeze=False)[:, 0]
    for axes, offset in zip(panels, offsets, strict=True):
        for desk, signal, width in (("", file.line.free_db, 2.0), (", desk", file.line.desk_db, 0.9)):
            past = line.drive(file, offset, signal, _RUN)
            for name, settings in papers_models(file.mapping).items():
                axes.plot(
                    past.driven_mm / 1e3, line.errors(settings, past) / 10.0, color=_COLOURS[name],
                    linestyle=_LINES[name], linewidth=width, label=name + desk, drawstyle="steps-post",
                )  # fmt: skip
        axes.axvline(file.line.length_mm / 1e3, color=BLACK, linewidth=0.8, linestyle=":")
        axes.set(ylabel="error [cm]", ylim=(0, None))
        axes.set_title(f"L = {offset / 10:g} cm", loc="right", y=0.8)
    panels[0].annotate(
        "turn", (file.line.length_mm / 1e3, 0.55), (3, 0), xycoords=("data", "axes fraction"),
        textcoords="offset points", va="top",
    )  # fmt: skip
    panels[-1].set_xlabel("driven way [m]")
    figure.legend(
        *panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=4, handlelength=1.6, columnspacing=1.0
    )
    return figure


@styled
def posterior_figure(file: TagMappingFile) -> Figure:
    """Beliefs in the tag's place of both models, just before the turn and in the end, at the least offset."""
    offset = file.line.offsets_mm[0]
    past = line.drive(file, offset, file.line.free_db, _RUN)
    n_before = int((past.read_at < past.n_before).sum())
    figure = new_figure(4.3)
    panels = figure.subplots(2, 2, sharex=True, sharey=True)
    for row, (name, settings) in zip(panels, papers_models(file.mapping).items(), strict=True):
        for axes, (when, n) in zip(
            row, (("before the turn", n_before), ("in the end", past.polls.n_reads)), strict=True
        ):
            state, rows = by_reads.init(), past.polls.reads_of(0)[:n]
            for read in rows:
                pose = past.polls.poses[past.polls.read_poll[read]]
                state = by_reads.update(settings, state, pose, past.polls.read_distance_mm[read])
            _draw_belief(axes, state, past.tag_mm)
            axes.set_title(f"{NAMES[name]},\n{when}", fontsize=8)
    for axes in panels[-1]:
        axes.set_xlabel("along the line [m]")
    for axes in panels[:, 0]:
        axes.set_ylabel("across it [m]")
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3)
    return figure


def _draw_belief(axes: Axes, state: by_reads.Belief, tag: np.ndarray) -> None:
    plain_map(axes)
    if state.window is not None:
        logs, cell = state.window.logs, state.window.cell_mm
        low, high = np.array(state.window.low_mm) - cell / 2, np.array(state.window.low_mm) + (len(logs) - 0.5) * cell
        axes.imshow(
            np.exp(logs - logs.max()), cmap="Greys", vmin=0.0, vmax=1.3, origin="lower",
            extent=(low[0], high[0], low[1], high[1]),
        )  # fmt: skip
        at = peak(state.window)
        axes.plot(*at, "o", color=BLUE, markersize=5, label="estimate")
    axes.plot(*tag, "x", color=VERMILLION, markersize=6, markeredgewidth=1.8, label="tag")
    axes.axhline(0.0, color=BLACK, linewidth=0.8, linestyle="--", label="line of the robot")
    axes.set(xlim=(tag[0] - _ALONG_MM, tag[0] + _ALONG_MM), ylim=_ACROSS_MM)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MultipleLocator(500.0))
        axis.set_major_formatter(lambda value, _: f"{value / 1e3:g}")


@styled
def office_figure(file: TagMappingFile, runs: dict[str, list[office.OfficeErrors]]) -> Figure:
    """Error over the way in contact and the way since the first read, of both readers."""
    marks = office.marks_mm(file.office) / 1e3
    figure = new_figure(4.8)
    panels = figure.subplots(len(runs), len(office.WAYS), sharex=True, sharey=True, squeeze=False)
    for row, (table, found) in zip(panels, runs.items(), strict=True):
        for axes, way in zip(row, office.WAYS, strict=True):
            for name, words in NAMES.items():
                curve = np.stack([one.mean_mm[name, way] for one in found]) / 10.0
                axes.plot(
                    marks, office.column_means(curve), color=_COLOURS[name], linestyle=_LINES[name], label=words
                )  # fmt: skip
            axes.set(xscale="log", yscale="log")
            axes.set_title(f"{table}, {way}", fontsize=8)
            for axis in (axes.xaxis, axes.yaxis):
                axis.set_major_formatter(lambda value, _: f"{value:g}")
                axis.set_minor_formatter(lambda value, _: "")
        row[0].set_ylabel("mean error [cm]")
    for axes in panels[-1]:
        axes.set_xlabel("way [m]")
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return figure
