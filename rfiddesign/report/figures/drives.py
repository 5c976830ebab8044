"""How far a robot drives without a read, by heading."""

from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from rfiddesign.report.figures.scales import set_scale
from rfiddesign.report.figures.style import BLUE, GREY, VERMILLION, new_figure, no_data, styled
from rfiddesign.results.study_result import CoverageRecord


@styled
def drives_figure(coverage: CoverageRecord) -> Figure:
    """Draw mean and 95th percentile of the distance to the next read by heading; headings along rows stand out."""
    figure = new_figure(3.6)
    drives = sorted(coverage.drives, key=lambda drive: drive.heading_deg)
    if not drives:
        return no_data(figure, "No heading was looked at.")
    axes = figure.subplots()
    headings = [drive.heading_deg for drive in drives]
    aligned = [drive for drive in drives if drive.is_aligned]
    for drive in aligned:
        axes.axvline(drive.heading_deg, color=GREY, lw=0.8, ls=":", zorder=1)
    for name, metric, colour, style in (("95th percentile", "p95_mm", BLUE, "-"), ("mean", "mean_mm", BLUE, "--")):
        axes.plot(
            headings,
            [getattr(drive, metric) for drive in drives],
            color=colour,
            ls=style,
            lw=1.2,
            marker="o",
            ms=3.5,
            label=name,
        )
    for i, metric in enumerate(("p95_mm", "mean_mm")):
        axes.plot(
            [d.heading_deg for d in aligned],
            [getattr(d, metric) for d in aligned],
            ls="none",
            marker="D",
            ms=6.5,
            color=VERMILLION,
            mec="white",
            mew=0.6,
            zorder=4,
            label="along rows of tags" if i == 0 and aligned else None,
        )
    values = [value for drive in drives for value in (drive.p95_mm, drive.mean_mm)]
    positive = [value for value in values if value > 0] or [1.0]
    if min(values) > 0:
        set_scale(axes.yaxis, min(positive), max(positive))
    else:
        set_scale(axes.yaxis, 0.0, max(positive))
    axes.set_xlabel("heading against the tags' lattice [°]" if aligned else "heading [°]")
    axes.xaxis.set_major_locator(MaxNLocator(7, steps=[1, 1.5, 3, 4.5, 9, 10]))
    axes.set_ylabel("distance to the next read [mm]")
    figure.legend(loc="outside lower center", ncols=3, columnspacing=1.2, handletextpad=0.5)
    return figure
