"""Plots of coverage show the numbers they are given, with units, and nothing runs out of the figure."""

import io
import itertools

import numpy as np
import pytest
import shapely
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from rfiddesign.catalog import antenna
from rfiddesign.geometry import (
    Coverage,
    HeadingDrive,
    antenna_outlines,
    blind_distances,
    coverage,
    make_layout,
    make_pattern,
)
from rfiddesign.geometry.travel import travel
from rfiddesign.report import coverage_plots as plots

CROSS, EYES = make_layout("cross-8"), antenna("60x60")
DENSITIES = (4.0, 25.0, 100.0)


def seen(one: float, two: float = 0.0, reads: float = 1.0, two_tags: float = 0.0) -> Coverage:
    return Coverage((one, two, 0.0), reads, two_tags, "exact", 0.0)


def drive(heading_deg: float, p95_mm: float, *, is_aligned: bool = False) -> HeadingDrive:
    return HeadingDrive(heading_deg, p95_mm / 2, p95_mm, 2 * p95_mm, 0.0, is_aligned)


def robots() -> Figure:
    outlines = antenna_outlines(CROSS, EYES.outline()), antenna_outlines(CROSS, EYES.area.outline())
    return plots.robots_plot({"cross of eight": outlines, "the same": outlines}, 320.0)


def floors() -> Figure:
    region = shapely.box(-90, -90, 910, 910)
    kinds = ("square", "triangular", "striped", "random")
    return plots.floors_plot({kind: make_pattern(kind, tags_per_m2=25).lay(region) for kind in kinds}, region)


def densities() -> Figure:
    floors = [make_pattern("square", tags_per_m2=density) for density in DENSITIES]
    curves = {name: [coverage(CROSS, antenna(name).area, floor) for floor in floors] for name in ("30x30", "60x60")}
    return plots.density_plot(DENSITIES, curves, tuple(plots.QUANTITIES)[:4])


def headings() -> Figure:
    return plots.heading_plot([0, 45, 90], {"pitch 150 mm": np.array([0.2, 0.9, 0.2]), "pitch 200 mm": np.zeros(3)})


def drives() -> Figure:
    kinds = ("square", "triangular", "random")
    angles = range(0, 91, 15)
    floors = {kind: make_pattern(kind, tags_per_m2=25) for kind in kinds}
    return plots.drives_plot({kind: blind_distances(CROSS, EYES.area, floor, angles) for kind, floor in floors.items()})


def lanes() -> Figure:
    swaths = travel(CROSS, EYES.area, make_pattern("square", pitch_mm=200), 0.0).swaths
    return plots.lanes_plot({f"pitch {pitch} mm": (swaths, float(pitch)) for pitch in (150, 200, 250, 300)})


def spacings() -> Figure:
    inner, outer = range(60, 191, 10), range(120, 271, 10)
    shares = np.array([[(b - a) / 400 if b - a >= 60 else np.nan for a in inner] for b in outer])
    maps = {f"pitch {pitch} mm": shares for pitch in (150, 200, 250, 300)}
    return plots.spacing_plot(inner, outer, maps, marked_mm=(150, 250))


FIGURES = {draw.__name__: draw for draw in (robots, floors, densities, headings, drives, lanes, spacings)}


@pytest.fixture(params=FIGURES)
def figure(request) -> Figure:
    return FIGURES[request.param]()


def test_nothing_runs_out_of_the_figure(figure):
    figure.savefig(io.BytesIO(), format="png")
    left, bottom, right, top = figure.bbox.extents
    for part in (*figure.axes, *figure.legends):
        x0, y0, x1, y1 = part.get_tightbbox().extents
        assert x0 >= left - 1, part
        assert y0 >= bottom - 1, part
        assert x1 <= right + 1, part
        assert y1 <= top + 1, part


def test_panels_get_most_of_the_figure(figure):
    # A line without points makes matplotlib's layout squeeze the axes to a strip.
    heights = [axes.get_window_extent().height for axes in figure.axes if axes.get_label() != "<colorbar>"]
    assert min(heights) > 0.4 * figure.bbox.height


def test_no_words_cover_others(figure):
    figure.savefig(io.BytesIO(), format="png")
    for axes in (child for panel in figure.axes for child in (panel, *panel.child_axes)):
        shown = zip(axes.get_xticks(), axes.get_xticklabels(), strict=True)
        low, high = sorted(axes.get_xlim())
        labels = [label.get_window_extent() for place, label in shown if low <= place <= high]
        for left, right in itertools.pairwise(sorted(labels, key=lambda extent: extent.x0)):
            assert left.x1 < right.x0, axes.get_xlabel()
    titles = sorted((axes.title.get_window_extent() for axes in figure.axes), key=lambda extent: extent.x0)
    assert all(left.x1 < right.x0 for left, right in itertools.pairwise(title for title in titles if title.width > 1))
    blocks = [*figure.axes, *figure.legends, *([figure._supxlabel] if figure._supxlabel else [])]
    extents = [block.get_tightbbox() for block in blocks]
    for i, extent in enumerate(extents):
        assert not any(extent.overlaps(other) for other in extents[:i]), blocks[i]


def test_every_axis_names_its_unit(figure):
    units = ("[mm]", "[°]", "[% of places]", "[%]", "per m²", "reads per poll, mean", "antenna")
    for axes in figure.axes:
        for label in (axes.get_xlabel(), axes.get_ylabel()):
            assert label == "" or label.endswith(units), label
    named = [axes.get_xlabel() or (figure._supxlabel and figure._supxlabel.get_text()) for axes in figure.axes]
    assert all(named)
    assert figure.axes[0].get_ylabel()


def test_figures_leave_no_pyplot_state(figure):
    import matplotlib.pyplot as plt

    assert plt.get_fignums() == []


def test_curves_show_coverage_at_each_density():
    curve = [seen(0.1, 0.0, 0.1), seen(0.5, 0.2, 1.0, 0.05), seen(1.0, 0.9, 8.0, 0.5)]
    figure = plots.density_plot(DENSITIES, {"name": curve}, ("one_reader", "two_readers", "reads", "two_tags"))
    values = [axes.lines[0].get_ydata() for axes in figure.axes]
    np.testing.assert_allclose(values, [[10, 50, 100], [0, 20, 90], [0.1, 1, 8], [0, 5, 50]])
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["name"]


def test_pitches_stand_over_the_densities_of_their_square_lattices():
    figure = plots.density_plot(DENSITIES, {"name": [seen(0.5)] * 3}, ("one_reader",))
    (pitches,) = figure.axes[0].child_axes
    ticks = dict(
        zip([label.get_text() for label in pitches.get_xticklabels()], pitches.xaxis.get_majorticklocs(), strict=True)
    )
    assert ticks == pytest.approx({"100": 100.0, "150": 1e6 / 150**2, "250": 16.0, "500": 4.0})


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (((4.0,), {"name": []}), "'name': 0 values, must be 1"),
        (((4.0,), {"name": [seen(1.0)]}, ("four_readers",)), "'four_readers': must be one of one_reader, "),
    ],
)
def test_wrong_arguments_are_named(arguments, words):
    with pytest.raises(ValueError, match=words):
        plots.density_plot(*arguments)


def test_drives_are_drawn_by_heading_and_those_along_rows_are_marked():
    curve = [drive(45, 80), drive(0, 5000, is_aligned=True), drive(30, 0)]
    (axes,) = plots.drives_plot({"cross": curve}).axes
    line = axes.lines[0]
    np.testing.assert_array_equal(line.get_xdata(), [0, 30, 45])
    np.testing.assert_array_equal(line.get_ydata(), [5000, plots.SHORTEST_MM, 80])
    assert line.get_markevery() == [0]


def test_lanes_that_no_antenna_reads_stay_coloured():
    # Two antennas of 60 mm at 0 and 100 mm to the left, rows 250 mm apart: the robot reads with its centre from 220 to
    # 250 and 0 to 30, and from 120 to 180, as it is to the right of a row, that is 250 - 100 = 150 left of the next.
    swaths = np.array([[-30.0, 30.0], [70.0, 130.0]])
    (axes,) = plots.lanes_plot({"rows": (swaths, 250.0)}).axes
    read = [
        patch.get_x() + np.array([0, patch.get_width()])
        for patch in axes.patches
        if to_hex(patch.get_fc()) == "#ffffff"
    ]
    assert sorted(tuple(lane) for lane in read) == [(-30.0, 30.0), (120.0, 180.0), (220.0, 280.0)]
    assert axes.get_title() == "rows\n52% never read"
    assert to_hex(axes.get_facecolor()) == plots.BLIND_LANE


def test_maps_show_where_no_lane_is_blind_in_white():
    shares = np.array([[0.0, 0.2], [0.001, np.nan]])
    figure = plots.spacing_plot([100, 120], [200, 220], {"floor": shares}, marked_mm=(100, 220))
    image = figure.axes[0].images[0]
    colours = [[to_hex(colour) for colour in row] for row in image.to_rgba(image.get_array())]
    # 20 % begins a step; an inner distance goes across and an outer one up.
    assert colours == [["#ffffff", plots.BLIND_COLOURS[3].lower()], [plots.BLIND_COLOURS[0], plots.UNBUILDABLE]]
    assert image.get_extent() == [90, 130, 190, 230]
    (mark,) = figure.axes[0].lines
    assert (mark.get_xdata()[0], mark.get_ydata()[0]) == (100, 220)
