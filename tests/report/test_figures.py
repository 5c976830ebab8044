"""Figures say what their axes are, fit their paper and show what the records hold."""

import math

import numpy as np
import pytest
from shapely.geometry import Point, box

from rfiddesign.geometry import LAYOUTS
from rfiddesign.report.album import pictures
from rfiddesign.report.contents import read_contents
from rfiddesign.report.figures import TestedDesigns, tags_figure
from rfiddesign.report.figures.cost_error import pareto_front
from rfiddesign.report.figures.coverage import map_window, nearest_tag, readers_in_view
from rfiddesign.report.figures.drawing import inline_svg, svg_of
from rfiddesign.report.figures.place import Window, standing_place
from rfiddesign.report.figures.scales import log_ticks
from rfiddesign.report.figures.style import WIDTH_IN, in_style
from rfiddesign.results.study_result import AntennaPose


@pytest.fixture(scope="module")
def contents(folder):
    return read_contents(folder)


@pytest.fixture(scope="module")
def figures(contents):
    drawn = {picture.name: picture.figure for picture in pictures(contents)}
    with in_style():
        for figure in drawn.values():
            figure.draw_without_rendering()
    return drawn


def shows_numbers(axis) -> bool:
    ticks = [tick.get_text().lstrip("−") for tick in axis.get_ticklabels() if tick.get_visible()]
    return any(tick[:1].isdigit() and "robot" not in tick for tick in ticks)


def test_every_axis_has_a_label_with_its_unit(figures):
    """An axis that shows numbers says of what and in which unit; counts of readers have none."""
    n_checked = 0
    for name, figure in figures.items():
        for axes in figure.axes:
            for axis in filter(shows_numbers, (axes.xaxis, axes.yaxis)):
                label = axis.get_label_text()
                assert "[" in label or label == "readers that see a tag", (name, label)
                n_checked += 1
    assert n_checked >= 2 * len(figures)


def test_nothing_sticks_out_of_a_figure(figures):
    """All words lie within the paper, in a font that is legible where a page shows the figure at its natural size."""
    for name, figure in figures.items():
        assert figure.get_figwidth() == WIDTH_IN
        with in_style():
            box_ = figure.get_tightbbox()
        assert box_.x0 >= -0.03, name
        assert box_.y0 >= -0.03, name
        assert box_.x1 <= figure.get_figwidth() + 0.03, name
        assert box_.y1 <= figure.get_figheight() + 0.03, name
        texts = figure.findobj(lambda artist: hasattr(artist, "get_fontsize"))
        assert min(text.get_fontsize() for text in texts if text.get_text()) >= 8.5, name


def test_a_hundred_thousand_tags_are_drawn_as_a_small_picture(contents):
    side = 36_000
    grid = np.stack(np.meshgrid(np.arange(0, side, 100.0), np.arange(0, side, 100.0)), axis=-1).reshape(-1, 2)
    assert len(grid) > 100_000
    svg = svg_of(tags_figure(box(0, 0, side, side), grid, contents.answers[0].chosen, (18_000, 18_000)), "tags")
    assert len(svg) < 1_500_000


def test_the_front_has_no_design_that_is_dearer_and_worse():
    """Hand-made: the second costs more and errs more, the fourth is only known to err at least that much."""
    designs = TestedDesigns(
        cost=np.array([1.0, 2.0, 3.0, 2.5]),
        error=np.array([10.0, 12.0, 5.0, 1.0]),
        verdict=np.array(["refuted", "refuted", "certified", "refuted"]),
        complete_share=np.array([1.0, 1.0, 0.99, 0.2]),
    )
    np.testing.assert_array_equal(pareto_front(designs), [0, 2])


def test_readers_in_view_agree_with_counting_one_by_one(contents):
    """At each place each reader is held against each tag, with plain trigonometry."""
    chosen = contents.answers[0].chosen.model_copy(
        update={"antennas": [AntennaPose(x_mm=x, y_mm=y, yaw_rad=0) for x, y, _ in LAYOUTS["cross-8"]().poses]}
    )
    rng = np.random.Generator(np.random.PCG64(3))
    tags = rng.uniform(-600, 600, (150, 2))
    window, heading = Window(-60, -40, 60, 40), math.radians(20)
    counts = readers_in_view(chosen, tags, window, heading)
    n = len(counts)
    radius = 30.0
    for row, column in rng.integers(0, n, (60, 2)):
        x = -60 + 120 * (column + 0.5) / n
        y = -40 + 80 * (row + 0.5) / n
        expected = 0
        for pose in chosen.antennas:
            ax = x + math.cos(heading) * pose.x_mm - math.sin(heading) * pose.y_mm
            ay = y + math.sin(heading) * pose.x_mm + math.cos(heading) * pose.y_mm
            expected += any(math.hypot(tx - ax, ty - ay) <= radius for tx, ty in tags)
        assert counts[row, column] == expected


def test_the_coverage_map_is_one_cell_about_a_tag(contents):
    answer = contents.answers[0]
    place = standing_place(contents.plan.navigable)
    tag = nearest_tag(answer.tags_mm, place)
    assert any(np.array_equal(tag, other) for other in answer.tags_mm)
    window = map_window(answer.chosen, tag)
    pitch = 1e3 / math.sqrt(answer.chosen.tags_per_m2)
    assert window.x_max - window.x_min == pytest.approx(pitch)
    assert window.y_max - window.y_min == pytest.approx(pitch)


def test_a_standing_place_is_where_the_robot_can_be():
    angle = box(0, 0, 5000, 300).union(box(0, 0, 300, 5000))
    assert angle.contains(Point(standing_place(angle)))


@pytest.mark.parametrize(("low", "high"), [(1.0, 1e4), (12.0, 55.0), (0.3, 2.9), (1.05e4, 3.3e4), (9.0, 9e6)])
def test_logarithmic_axes_have_two_to_six_ticks_within_them(low, high):
    ticks = log_ticks(low, high)
    assert 2 <= len(ticks) <= 9
    assert all(low <= tick <= high for tick in ticks)
    assert ticks == sorted(ticks)


def test_an_inlined_figure_keeps_its_references_and_escapes_its_words():
    svg = '<?xml version="1.0"?>\n<svg width="1"><metadata>http://x</metadata><g id="a"/><use xlink:href="#a"/></svg>\n'
    inlined = inline_svg(svg, "fig", 'a "<b>"')
    assert inlined.startswith('<svg role="img" aria-label="a &quot;&lt;b&gt;&quot;" width="1">')
    assert 'id="fig--a"' in inlined
    assert 'xlink:href="#fig--a"' in inlined
    assert "http://x" not in inlined
