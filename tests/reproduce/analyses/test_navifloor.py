"""How often the filters rank as published, on errors made up; and figures that fit their paper."""

import numpy as np
import pytest

from rfiddesign.report.figures.style import WIDTH_IN, in_style
from rfiddesign.reproduce import load_reproduction
from rfiddesign.reproduce.analyses import hf_multireader, navifloor, smart_floor
from rfiddesign.reproduce.context import Context
from rfiddesign.simulation.run import Trace

ERRORS = {
    "QEKF": [40.0, 39.0, 41.0, 38.0],
    "QRSSI": [39.0, 38.0, 42.0, 36.0],
    "CEKF": [30.0, 37.0, 33.0, 37.0],
    "CRSSI": [29.0, 36.0, 31.0, 30.0],
    "PFRSSI, nothing seen": [10.0, 20.0, 90.0, 190.0],
}


@pytest.fixture(scope="module")
def context():
    errors = {(table, name): {"rmse_mm": np.array(v)} for table in navifloor.TABLES for name, v in ERRORS.items()}
    errors["random headings", "PFRSSI, nothing seen"] = {"rmse_mm": np.array([10.0, 20.0, 290.0, 390.0])}
    return Context(load_reproduction("rssi-kalman-navifloor"), True, 1, (), errors, lambda *_: None)


def a_trace():
    poses = np.column_stack([np.linspace(1000, 3000, 50), np.linspace(4500, 7500, 50), np.zeros(50)])
    return Trace(0.05, poses, poses + 10.0, np.full(49, 14.1), np.full(49, 0.1))


def test_differences_are_paired_and_shares_are_of_seeds(context):
    rows, figures = navifloor.analyse(context)
    found = {(row.table, row.row, row.metric): row for row in rows}
    difference = found["table II", "QEKF minus QRSSI", "rmse_mm"]
    assert difference.measured == pytest.approx((1 + 1 - 1 + 2) / 4)
    assert difference.stderr == pytest.approx(np.std([1, 1, -1, 2], ddof=1) / 2)
    assert difference.unit == "mm"
    assert found["table II", "QEKF worse than QRSSI", "share_of_seeds"].measured == 0.75
    # The third seed has QRSSI above QEKF, the last CEKF above QRSSI.
    assert found["table II", "QEKF > QRSSI > CEKF > CRSSI", "share_of_seeds"].measured == 0.5
    assert found["random headings", "CEKF worse than CRSSI", "share_of_seeds"].measured == 1.0
    assert set(figures) == {"paths", "rmse"}


def test_boxes_of_both_tables_fit_their_axes_and_stand_beside_what_was_published(context):
    """The two panels share an axis, and the longest whisker is in the second."""
    figure = navifloor.rmse_figure(context)
    low, high = figure.axes[1].get_xlim()
    drawn = [max(line.get_xdata()) for line in figure.axes[1].lines]
    assert low == 0
    assert 300 < max(drawn) < high
    assert [label.get_text() for label in figure.axes[0].get_yticklabels()] == list(ERRORS)
    tops = figure.axes[0].transData.transform([(0, tick) for tick in figure.axes[0].get_yticks()])[:, 1]
    assert np.all(np.diff(tops) < 0)
    diamonds = [line for line in figure.axes[0].lines if line.get_marker() == "D"]
    # CEKF and QEKF; RSSI is withheld.
    assert sorted(float(line.get_xdata()[0]) for line in diamonds) == [29.5, 39.4]
    assert not [line for line in figure.axes[1].lines if line.get_marker() == "D"]


def test_no_figure_sticks_out_of_its_paper_and_every_axis_says_what_it_shows(context):
    curves = {
        name: np.array([(s, 0.8 + s / 5, 0.02) for s in hf_multireader.SIGMAS]) for name in hf_multireader.SYSTEMS
    }
    figures = {
        "sigma": hf_multireader.sigma_figure(curves),
        "paths": navifloor.paths_figure({name: a_trace() for name in navifloor.SHOWN}),
        "rmse": navifloor.rmse_figure(context),
        "errors": smart_floor.errors_figure({name: a_trace() for name in smart_floor.ROWS}),
        "chance": smart_floor.chance_figure({name: [0.3, 0.5, 0.7, 0.9] for name in smart_floor.patterns()}),
    }
    for name, figure in figures.items():
        assert figure.get_figwidth() == WIDTH_IN
        with in_style():
            figure.draw_without_rendering()
            paper = figure.get_tightbbox()
        assert paper.x0 >= -0.03, name
        assert paper.y0 >= -0.03, name
        assert paper.x1 <= figure.get_figwidth() + 0.03, name
        assert paper.y1 <= figure.get_figheight() + 0.03, name
        for axes in figure.axes:
            assert axes.get_xlabel(), name
            assert axes.get_ylabel() or name == "rmse", name


def test_tags_about_a_path_are_those_of_its_grid():
    path = np.array([[1000.0, 4500.0, 0.0], [1400.0, 4700.0, 0.0]])
    tags = navifloor._tags_about(path)
    assert {tuple(tag) for tag in tags.tolist()} == {
        (x, y) for x in (750.0, 1000.0, 1250.0, 1500.0) for y in (4250.0, 4500.0, 4750.0)
    }
