"""A tag's window is weighed as brute force weighs every cell, and is Markov localization with the roles swapped."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from rfiddesign.estimators import markov
from rfiddesign.estimators.markov import Markov
from rfiddesign.estimators.start import UncertainStart
from rfiddesign.estimators.tag_mapping import _window_kernels as kernels
from rfiddesign.estimators.tag_mapping.window import (
    Ellipses,
    Window,
    flat_window,
    gaussian_window,
    log_evidence,
    masses,
    moments,
    peak,
    weigh_by_ellipses,
    weigh_by_polls,
)
from rfiddesign.geometry import Disc, PolygonArea, RoundedRectangle, listed
from rfiddesign.models.log_field import log_field, log_field_of
from rfiddesign.models.recording import Reads
from rfiddesign.models.robot import Robot
from tests.estimators.markov_drives import DT, NO_NOISE
from tests.estimators.tag_mapping.numpy_windows import cells_of, in_ellipse, looked_up, moments_of, seen_from

coordinate = st.floats(-2500.0, 2500.0)
heading = st.floats(-7.0, 7.0)
pose = st.tuples(coordinate, coordinate, heading)
length = st.one_of(st.just(0.0), st.floats(5.0, 3000.0))


def zeros(centre=(13.0, -7.0), n=101, cell=20.0):
    return Window(centre, cell, np.zeros((n, n), np.float32))


@given(pose, length, length, st.floats(0.05, 1.5))
@example((-1035.0, 0.0, 0.0), 0.0, 14.0, 1.0)
@example((1045.0, 0.0, 0.0), 14.0, 30.0, 1.0)
@settings(deadline=None, max_examples=300)
def test_an_ellipse_weighs_the_cells_that_its_inequality_names_and_no_other(pose, inner, outer, ratio):
    window = weigh_by_ellipses(zeros(), pose, Ellipses(inner, 2.0, outer, 1.0, ratio, 0.0))
    places = cells_of(window)
    is_inner, is_outer = in_ellipse(pose, places, inner, ratio), in_ellipse(pose, places, outer, ratio)
    assert np.array_equal(window.logs, np.where(is_inner, 2.0, np.where(is_outer, 1.0, 0.0)))


@given(st.sampled_from(range(4)), st.integers(1, 30))
def test_cells_on_the_border_of_an_ellipse_are_in_it_along_every_axis(quarter, n):
    """The antenna in a cell's middle, the far end of the ellipse in another's."""
    window = weigh_by_ellipses(
        zeros(cell=10.0), (13.0, -7.0, quarter * math.pi / 2), Ellipses(n * 10.0, 1.0, 0, 0, 0.35, 0)
    )
    along = np.rint([math.cos(quarter * math.pi / 2), math.sin(quarter * math.pi / 2)]).astype(int)
    column, row = 50 + n * along
    assert window.logs[50, 50] == window.logs[row, column] == 1.0
    assert window.logs[row + along[1], column + along[0]] == 0.0


FIELD = log_field_of(np.random.default_rng(8).uniform(0, 0.99, (23, 31)), 37.0, (-100.0, -500.0))


@given(pose, st.booleans())
@settings(deadline=None, max_examples=30)
def test_a_table_is_looked_up_between_its_entries(pose, is_read):
    window = weigh_by_polls(zeros(), pose, is_read, FIELD)
    told = looked_up(pose, cells_of(window), FIELD.tables[0 if is_read else 1], FIELD)
    assert window.logs == pytest.approx(told, abs=2e-3)
    assert window.log_scale == pytest.approx(math.log(1e-3) if is_read else 0.0)


@pytest.mark.parametrize("quarter", range(-2, 5))
def test_a_table_turned_by_quarters_is_the_table_itself(quarter):
    """Cells as large as the table's, the antenna in the middle of one."""
    table = log_field_of(np.random.default_rng(3).uniform(0, 0.9, (9, 15)), 20.0, (-40.0, -80.0))
    window = weigh_by_polls(zeros(), (13.0, -7.0, quarter * math.pi / 2), True, table)
    turned = np.rot90(window.logs, quarter)  # rows along y fall in pictures, so that this turns the floor back
    assert pytest.approx(table.tables[0], abs=1e-3) == turned[50 - 5 : 50 + 12, 50 - 3 : 50 + 8].T
    assert np.count_nonzero(turned > 1e-3) == np.count_nonzero(table.tables[0] > 1e-3)


def test_moments_and_the_peak_are_those_of_the_cells():
    rng = np.random.default_rng(1)
    window = Window((100.0, 50.0), 4.0, rng.normal(0, 3, (31, 31)).astype(np.float32))
    mass, x, y = masses(window)
    mean, covariance = moments(window)
    own, spread = moments_of(np.exp(window.logs.astype(float)), cells_of(window))
    assert mean == pytest.approx(own, abs=1e-3)
    assert covariance == pytest.approx(spread + np.eye(2) * 16 / 12, abs=1e-2)
    assert mass.sum() == pytest.approx(1.0)
    row, column = np.unravel_index(np.argmax(window.logs), window.logs.shape)
    assert peak(window) == pytest.approx([x[column], y[row]])


@given(st.lists(st.tuples(st.integers(0, 20), st.integers(0, 20)), min_size=1, max_size=30))
def test_cells_that_tie_share_the_peak(cells):
    window = Window((0.0, 0.0), 10.0, np.full((21, 21), -1.0, np.float32))
    for row, column in cells:
        window.logs[row, column] = 2.0
    row, column = np.array(sorted(set(cells))).mean(axis=0)
    assert peak(window) == pytest.approx([(column - 10) * 10.0, (row - 10) * 10.0])


def test_a_prior_is_flat_in_its_circle_or_normal():
    flat = flat_window((1000.0, 500.0), 300.0, 10.0)
    mass = masses(flat)[0]
    is_inside = np.hypot(*np.moveaxis(cells_of(flat) - (1000.0, 500.0), -1, 0)) <= 300.0
    assert np.array_equal(mass > 0, is_inside)
    assert mass[is_inside] == pytest.approx(1 / is_inside.sum())
    wanted = np.array([[400.0, 150.0], [150.0, 300.0]])
    mean, covariance = moments(gaussian_window((1000.0, 500.0), wanted, 200.0, 5.0))
    assert mean == pytest.approx([1000.0, 500.0], abs=1e-6)
    assert covariance == pytest.approx(wanted + np.eye(2) * 25 / 12, rel=1e-3)
    assert log_evidence(flat) == pytest.approx(0.0, abs=1e-6)


def test_polls_by_the_ten_thousand_are_summed_as_finely_as_one():
    """A robot that stands: all polls say one of two things, which multiplies these."""
    prior, field = gaussian_window((0.0, 0.0), np.eye(2) * 900.0, 120.0, 6.0), log_field(Disc(60.0), 20.0, 0.8)
    pose, n, n_read = (20.0, 10.0, 0.3), 30_000, 9_000
    is_read = np.arange(n) % 10 < 3
    after = weigh_by_polls(prior, np.tile(pose, (n, 1)), is_read, field)
    read, silent = (looked_up(pose, cells_of(prior), table, field) for table in field.tables)
    logs = prior.logs + n_read * read + (n - n_read) * silent
    mean, covariance = moments(after)
    own, spread = moments_of(np.exp(logs - logs.max()), cells_of(prior))
    assert mean == pytest.approx(own, abs=0.5)
    assert covariance == pytest.approx(spread + np.eye(2) * 3.0, rel=0.05)
    exact = logs.max() + np.log(np.exp(logs - logs.max()).sum()) + prior.log_scale + n_read * field.far[0]
    assert log_evidence(after) == pytest.approx(exact, rel=1e-5)
    assert np.abs(after.logs[np.isfinite(after.logs)]).max() < 100.0


def test_the_evidence_is_the_chance_of_all_polls_summed_over_where_the_tag_may_lie():
    rng = np.random.default_rng(5)
    prior = gaussian_window((0.0, 0.0), np.eye(2) * 900.0, 120.0, 6.0)
    field = log_field(RoundedRectangle(120.0, 80.0, 10.0), 8.0, 0.8)
    poses = np.column_stack([rng.uniform(-120, 120, (20, 2)), rng.uniform(-4, 4, 20)])
    is_read = rng.random(20) < 0.4
    after, chance = weigh_by_polls(prior, poses, is_read, field), masses(prior)[0]
    for pose, read in zip(poses, is_read, strict=True):
        said = 0 if read else 1
        chance = chance * np.exp(looked_up(pose, cells_of(prior), field.tables[said], field) + field.far[said])
    assert log_evidence(after) == pytest.approx(math.log(chance.sum()), abs=1e-3)
    mean, covariance = moments(after)
    own, spread = moments_of(chance, cells_of(prior))
    assert mean == pytest.approx(own, abs=0.01)
    assert covariance == pytest.approx(spread + np.eye(2) * 3.0, rel=1e-3)


@pytest.mark.parametrize("seed", range(3))
def test_the_roles_may_be_swapped(seed):
    """A robot of unknown position that knows the tag believes of itself what it would of the tag, seen from there.

    The robot's antenna is where the tag is, mirrored through the middle between both: its area is turned by half.
    """
    rng = np.random.default_rng(seed)
    area = PolygonArea(((-40.0, -30.0), (170.0, -60.0), (90.0, 120.0)))
    field = log_field(area, 15.0, 0.9)
    centre, tag = np.array([400.0, 300.0]), np.array([460.0, 340.0])
    ways = np.column_stack([rng.uniform(-150, 150, (12, 2)), rng.uniform(-4, 4, 12)])
    is_read = rng.random(12) < 0.5
    # The robot begins at `centre` in truth and drives `ways`; then the tag is sought about `tag`.
    tags = weigh_by_polls(flat_window(tag, 300.0, 10.0), ways + np.array([*centre, 0.0]), is_read, field)
    # Now the tag is known, and the robot's begin is sought about `centre`: a tag at `tag` sees the robot's begin p as
    # an antenna at tag - way sees a tag, its area mirrored.
    mirrored = np.column_stack([tag - ways[:, :2], ways[:, 2] + math.pi])
    robots = weigh_by_polls(flat_window(centre, 300.0, 10.0), mirrored, is_read, field)
    assert robots.logs[::-1, ::-1] == pytest.approx(tags.logs, abs=5e-3)
    assert moments(robots)[0] - centre == pytest.approx(tag - moments(tags)[0], abs=0.05)
    assert moments(robots)[1] == pytest.approx(moments(tags)[1], rel=1e-3)


def test_markov_localization_and_tag_mapping_believe_the_same_of_each_other():
    """The filter's own reads, Gaussian as in eq. 10, from a start as vague as the tag's prior."""
    sigma, heading, place = 50.0, 0.6, np.array([120.0, 40.0, 0.0])
    prior, tag = np.array([[2400.0, 600.0], [600.0, 1700.0]]), np.array([150.0, 95.0])
    start = np.zeros((3, 3))
    start[:2, :2] = prior
    ready = markov.build(Markov(NO_NOISE, n_cells=141), Robot(listed([tuple(place)]), Disc(2 * sigma)), DT)
    state = markov.init(ready, UncertainStart((0.0, 0.0, heading), tuple(map(tuple, start))), 1)
    robot = markov.estimate(markov.update(ready, state, Reads(np.array([0]), tag[None])))
    # The same Gaussian as a table, as far as nothing of either belief goes.
    axis = np.arange(-180.0, 181.0, 5.0)
    chance = 0.999 * np.exp(-(axis[:, None] ** 2 + axis**2) / (2 * sigma**2))
    field = log_field_of(chance, 5.0, (axis[0], axis[0]))
    c, s = math.cos(heading), math.sin(heading)
    antenna = np.array([c * place[0] - s * place[1], s * place[0] + c * place[1]])
    window = weigh_by_polls(gaussian_window(tag, prior, 700.0, 10.0), (*antenna, heading), True, field)
    mean, covariance = moments(window)
    # What draws the robot toward the tag draws the tag toward the antenna.
    assert robot.pose[:2] == pytest.approx(tag - mean, abs=0.5)
    assert robot.covariance[:2, :2] == pytest.approx(covariance - np.eye(2) * 100.0 / 12, rel=0.01, abs=10.0)


def test_sums_of_exact_steps_tie_whatever_their_order():
    rng = np.random.default_rng(2)
    logs = np.zeros((3, 3), np.float32)
    amounts = np.round(rng.uniform(0, 0.6, 3000) * 2**14) / 2**14
    for cell in range(9):
        for amount in rng.permutation(amounts):
            logs[cell // 3, cell % 3] += np.float32(amount)
    assert len(np.unique(logs)) == 1
    kernels.lower(logs, np.array([0, 3, 0, 3]), 2.0**-14)
    assert len(np.unique(logs)) == 1


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda: flat_window((0.0, 0.0), 3000.0, 1.0), "cell_mm"),
        (lambda: flat_window((0.0, math.nan), 3000.0, 10.0), "centre_mm"),
        (lambda: flat_window((0.0, 0.0), -1.0, 10.0), "half_width_mm"),
        (lambda: gaussian_window((0.0, 0.0), [[1.0, 0.0], [0.0, 1.0]], 100.0, 10.0), "covariance_mm2"),
        (lambda: gaussian_window((0.0, 0.0), [1.0, 0.0], 100.0, 10.0), "covariance_mm2"),
        (lambda: weigh_by_polls(zeros(), [[0.0, math.inf, 0.0]], True, FIELD), "poses"),
        (lambda: log_field_of([[1.0]], 10.0, (0.0, 0.0)), "probability"),
        (lambda: log_field_of([0.5], 10.0, (0.0, 0.0)), "probability"),
    ],
)
def test_what_cannot_be_is_refused_by_name(make, named):
    with pytest.raises(ValueError, match=named):
        make()


def test_an_antenna_ahead_of_its_area_sees_by_u_and_v():
    """A tag ahead of the antenna has u above 0, one to its left v above 0."""
    assert seen_from((10.0, 0.0, math.pi / 2), np.array([10.0, 5.0])) == pytest.approx([5.0, 0.0])
    field = log_field_of(np.full((3, 1), 0.9), 20.0, (100.0, 60.0))
    window = weigh_by_polls(zeros((0.0, 0.0)), (0.0, 0.0, math.pi / 2), True, field)
    assert peak(window) == pytest.approx([-60.0, 120.0])
