"""Where the combination model wins, on curves made up; and how far table 2 is."""

import math

import numpy as np
import pytest

from rfiddesign.reproduce.analyses.hf_multireader import (
    SIGMAS,
    _distance_to_table_2,
    _winning_range,
    sigma_figure,
)
from rfiddesign.reproduce.context import Context
from rfiddesign.reproduce.rows import Row


def found_on(sigmas, ratios):
    curve = np.column_stack([sigmas, ratios, np.full(len(sigmas), 0.05)])
    rows = _winning_range("a system", curve)
    assert {(row.table, row.row, row.unit) for row in rows} == {("figure sigma", "a system", "1")}
    return {row.metric: row.measured for row in rows}


def test_the_range_ends_where_straight_lines_between_the_ratios_cross_one():
    found = found_on([0.5, 0.7, 1.0, 1.5, 2.0, 3.0], [1.4, 1.2, 0.8, 0.7, 0.9, 1.3])
    assert found == {
        "wins_from_sigma_per_radius": pytest.approx(0.85),
        "wins_to_sigma_per_radius": pytest.approx(2.25),
        "best_sigma_per_radius": 1.5,
        "best_ratio": 0.7,
    }


def test_the_range_is_that_about_the_best_sigma_alone():
    """It wins at 0.5 again, past a sigma at which it loses."""
    found = found_on([0.5, 0.7, 1.0, 1.5], [0.9, 1.1, 0.5, 1.5])
    assert found["wins_from_sigma_per_radius"] == pytest.approx(0.75)
    assert found["wins_to_sigma_per_radius"] == pytest.approx(1.25)


def test_a_range_that_does_not_end_ends_where_it_was_tried():
    found = found_on([0.5, 1.0, 2.0], [0.9, 0.8, 0.95])
    assert (found["wins_from_sigma_per_radius"], found["wins_to_sigma_per_radius"]) == (0.5, 2.0)
    at_the_border = found_on([0.5, 1.0, 2.0], [0.7, 0.8, 1.2])
    assert at_the_border["wins_from_sigma_per_radius"] == at_the_border["best_sigma_per_radius"] == 0.5
    assert at_the_border["wins_to_sigma_per_radius"] == pytest.approx(1.5)


def test_a_model_that_never_wins_has_no_range():
    assert found_on([0.5, 1.0, 2.0], [1.3, 1.0, 1.2]) == {"best_sigma_per_radius": 1.0, "best_ratio": 1.0}


def test_the_distance_to_table_2_is_of_the_means_of_x_and_y_that_were_published():
    rows = (
        Row("table 2", "a", "x_mm", 2.0, 2.0 * math.e, None, "mm"),
        Row("table 2", "a", "y_mm", 2.0, 2.0, None, "mm"),
        Row("table 2", "a", "theta_rad", 2.0, 200.0, None, "rad"),
        Row("table 2", "b", "x_mm", None, 200.0, None, "mm"),
        Row("table 3", "a", "x_mm", 2.0, 200.0, None, "mm"),
    )
    row = _distance_to_table_2(Context(None, True, 1, rows, {}, lambda *_: None))
    assert row.measured == pytest.approx(math.sqrt(1 / 2))


def test_the_figure_shows_every_system_and_keeps_its_bars_inside():
    curves = {name: np.array([(sigma, 0.8 + sigma / 5, 0.02) for sigma in SIGMAS]) for name in ("8 readers", "96")}
    (axes,) = sigma_figure(curves).axes
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["8 readers", "96"]
    assert axes.get_xlabel() == "likelihood sigma / radius of the detection area"
    assert axes.get_ylim()[0] == 0
