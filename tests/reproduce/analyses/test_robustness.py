"""Paired ratios on errors made up, and figures that show every number and fit their paper."""

from itertools import pairwise

import numpy as np
import pytest

from rfiddesign.report.figures.style import CYCLE, WIDTH_IN, in_style
from rfiddesign.reproduce import load_reproduction
from rfiddesign.reproduce.analyses import robustness
from rfiddesign.reproduce.context import Context

ESTIMATORS = (*robustness.SHOWN, "reference-40000")


def errors_of(position, lost=0.0, time=1.0):
    position = np.asarray(position, float)
    return {
        "position_mean_mm": position,
        "lost_share": np.full(position.size, lost),
        "us_per_step": np.array([time]),
    }


@pytest.fixture(scope="module")
def loaded():
    return load_reproduction("estimator-robustness")


@pytest.fixture
def context(loaded, monkeypatch):
    """The k-th estimator errs by k + 1 mm and takes 10^(k - 2) us; only the study's references miss conditions."""
    errors = {}
    for row in loaded.file.rows:
        for k, name in enumerate(ESTIMATORS):
            if row.row.startswith(f"{name} "):
                errors[row.table, row.row] = errors_of([k + 0.9, k + 1.1], time=10.0 ** (k - 2))

    def measure(self, case, n_runs, what):
        assert case.scenario.world.faults.scale_x == -0.02
        assert n_runs == loaded.file.quick_runs
        return errors_of([3.0, 4.0, 5.0] if case.scenario.is_delay_known else [6.0, 8.0, 10.0])

    monkeypatch.setattr(Context, "measure", measure)
    return Context(loaded, True, 1, (), errors, lambda *_: None)


def test_ratios_are_of_means_and_their_errors_paired(context):
    ours, other = np.array([1.0, 2.0, 6.0]), np.array([2.0, 2.0, 5.0])
    context.errors["8x100", "pmg matched"] = errors_of(ours, time=0.5)
    context.errors["8x100", "particle-filter matched"] = errors_of(other, time=4.0)
    for name in ("reference", "reference-40000"):
        context.errors["8x100", f"{name} matched"] = errors_of(ours)
    rows, _ = robustness.analyse(context)
    found = {(row.table, row.row, row.metric): row for row in rows}
    row = found["8x100", "pmg / particle-filter matched", "position_ratio"]
    residuals = (ours - other) / 3.0
    assert (row.measured, row.stderr) == (1.0, pytest.approx(residuals.std(ddof=1) / np.sqrt(3)))
    same = found["8x100", "pmg / reference matched", "position_ratio"]
    assert (same.measured, same.stderr) == (1.0, 0.0)
    time = found["8x100", "particle-filter us / pmg us matched", "us_ratio"]
    assert (time.measured, time.stderr, time.unit) == (8.0, None, "1")
    assert found["1x16", "pmg / particle-filter all", "position_ratio"].measured == pytest.approx(1 / 2)
    assert found["1x16", "reference / reference-40000 matched", "position_ratio"].measured == pytest.approx(3 / 8)
    assert found["1x16", "particle-filter us / pmg us all", "us_ratio"].measured == pytest.approx(10.0)
    assert len(rows) == 8 * 6


def test_what_a_filter_gains_that_is_told_of_the_delay_is_shown_with_odometry_of_either_sign(context):
    context.errors["8x16", "particle-filter all"] = errors_of([10.0, 20.0])
    context.errors["8x16", "particle-filter all, delay compensated"] = errors_of([11.0, 22.0])
    found = {(row.table, row.row): row for row in robustness.analyse(context)[0]}
    long, short = (found["8x16", f"delay compensated / not, all{more}"] for more in ("", ", odometry short"))
    assert (long.measured, long.stderr) == (pytest.approx(1.1), pytest.approx(0.0, abs=1e-12))
    assert (short.measured, short.metric) == (0.5, "position_ratio")


def test_every_claim_of_a_ratio_is_of_a_row_that_there_is(context, loaded):
    rows = {(row.table, row.row, row.metric) for row in robustness.analyse(context)[0]}
    rows |= {(row.table, row.row, metric) for row in loaded.file.rows for metric in row.metrics}
    assert {(claim.table, claim.row, claim.metric) for claim in loaded.expected.claims} <= rows


def points(axes):
    return [line for line in axes.lines if line.get_marker() not in ("None", None)]


def test_a_mark_for_every_estimator_and_condition_and_open_where_tracks_are_lost(context, loaded):
    context.errors["1x16", "pmg all"] = errors_of([50.0, 70.0], lost=0.03)
    figure = robustness.mismatch_figure(context, ("8x100", "1x16"), tuple(loaded.file.grids[0].conditions))
    first, second = figure.axes
    n_shown = sum(table == "8x100" and "40000" not in row for table, row in context.errors)
    assert len(points(first)) == len(points(second)) == n_shown
    assert not [mark for mark in points(first) if mark.get_markerfacecolor() == "white"]
    (lost,) = [mark for mark in points(second) if mark.get_markerfacecolor() == "white"]
    assert (lost.get_xdata()[0], lost.get_color()) == (60.0, CYCLE[0])
    # On the line of its condition.
    place = list(loaded.file.grids[0].conditions).index("all")
    assert abs(lost.get_ydata()[0] - figure.axes[0].get_yticks()[place]) < 0.5
    labels = [label.get_text() for label in first.get_yticklabels()]
    assert labels == list(loaded.file.grids[0].conditions)
    for axes in figure.axes:
        low, high = axes.get_xlim()
        assert all(low < mark.get_xdata()[0] < high for mark in points(axes))


def test_errors_stand_over_the_time_they_take(context):
    figure = robustness.time_figure(context, ("8x100", "4x25", "1x16"))
    marks = points(figure.axes[0])
    assert [mark.get_xdata()[0] for mark in marks] == pytest.approx([10.0 ** (k - 2) for k in range(7)])
    assert [mark.get_ydata()[0] for mark in marks] == pytest.approx([k + 1.0 for k in range(7)])
    assert [axes.get_visible() for axes in figure.axes] == [True, True, True, False]


def test_words_beside_ticks_do_not_meet(context):
    """Errors that span little, as of a single reader."""
    for name in ESTIMATORS:
        for condition in ("matched", "all"):
            key = ("1x16", f"{name} {condition}")
            if key in context.errors:
                context.errors[key] = errors_of([17.0 if condition == "matched" else 36.0])
    figure = robustness.mismatch_figure(context, ("8x100", "1x16"), ("matched", "all"))
    with in_style():
        figure.draw_without_rendering()
        for axes in figure.axes:
            labels = [label.get_window_extent() for label in axes.get_xticklabels() if label.get_text()]
            assert len(labels) >= 3
            assert all(left.x1 + 2 < right.x0 for left, right in pairwise(labels))


def test_no_figure_sticks_out_of_its_paper(context):
    for name, figure in robustness.analyse(context)[1].items():
        assert figure.get_figwidth() == WIDTH_IN
        with in_style():
            figure.draw_without_rendering()
            paper = figure.get_tightbbox()
        assert paper.x0 >= 0, name
        assert paper.y0 >= 0, name
        assert paper.x1 <= figure.get_figwidth(), name
        assert paper.y1 <= figure.get_figheight(), name
