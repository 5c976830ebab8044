"""The posterior of a tag's place: closed forms against quadrature and linear algebra, kernels against plain numpy."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import dblquad
from scipy.interpolate import RegularGridInterpolator

from rfiddesign.estimators.tag_mapping.soft_grid import ANOTHER, NOTHING, READ, ReferenceDrift, posterior, soft_grid
from rfiddesign.estimators.tag_mapping.window import masses
from rfiddesign.geometry import Disc, ReaderLayout, Rectangle
from rfiddesign.models.reads import ReadModel
from rfiddesign.models.robot import Robot

ONE = ReaderLayout("one", ((0.0, 0.0, 0.0),))
ROBOT = Robot(ONE, Disc(30.0), reads=ReadModel(read_probability=0.95))
times = st.lists(st.floats(0.0, 100.0), min_size=1, max_size=8, unique_by=lambda value: round(value, 3))


@given(duration_s=st.floats(1e-3, 200.0), correlation_s=st.floats(0.1, 100.0))
def test_the_mean_error_over_a_visit_has_the_variance_of_the_double_integral(duration_s, correlation_s):
    share = ReferenceDrift(20.0, 0.0, correlation_s).mean_share(duration_s)
    kernel = lambda s, t: math.exp(-(t - s) / correlation_s)  # noqa: E731 - the integrand below the diagonal
    below, _ = dblquad(kernel, 0.0, duration_s, 0.0, lambda t: t)
    assert share == pytest.approx(2.0 * below / duration_s**2, rel=1e-4)


@given(times=times, correlation_s=st.floats(0.5, 50.0))
def test_weights_of_visits_are_those_of_the_best_linear_estimate(times, correlation_s):
    at = np.sort(times)
    correlation = np.exp(-np.abs(at[:, None] - at) / correlation_s)
    weights = ReferenceDrift(20.0, 0.0, correlation_s).visit_weights(at)
    # The matrix is ill-conditioned where times are close; what it must give back is not.
    assert correlation @ weights == pytest.approx(np.ones(len(at)), abs=1e-9)
    assert 1.0 - 1e-9 <= weights.sum() <= len(at) + 1e-9


def brute_force(grid, poses, outcome, visit_start, weights):
    """Mass (n, n) by y and x and log evidence: the product of the polls' chances, averaged over shifts one by one."""
    n_v, low_u, low_v, cell = grid.frame
    tables = grid.tables.astype(float).reshape(3, -1, n_v)
    axes = [low + cell * np.arange(size) for low, size in zip((low_u, low_v), tables.shape[1:], strict=True)]
    chances = [
        RegularGridInterpolator(axes, table + far, bounds_error=False, fill_value=far)
        for table, far in zip(tables, (0.0, grid.far_read, 0.0), strict=True)
    ]
    prior, x, y = masses(grid.prior)
    places = np.stack(np.meshgrid(x, y), axis=-1)
    rim = grid.taps.size // 2
    total = np.log(prior)
    for v in range(len(weights)):
        chance = np.zeros_like(total)
        for j in range(-rim, rim + 1):
            for i in range(-rim, rim + 1):
                logs = np.zeros_like(total)
                for k in range(visit_start[v], visit_start[v + 1]):
                    dx, dy = np.moveaxis(places + grid.prior.cell_mm * np.array([i, j]) - poses[k, :2], -1, 0)
                    c, s = math.cos(poses[k, 2]), math.sin(poses[k, 2])
                    logs += chances[outcome[k]](np.stack([c * dx + s * dy, c * dy - s * dx], axis=-1))
                chance += float(grid.taps[i + rim]) * float(grid.taps[j + rim]) * np.exp(logs)
        total += weights[v] * np.log(chance)
    return np.exp(total) / np.exp(total).sum(), math.log(np.exp(total).sum())


@pytest.mark.parametrize("area", [Disc(30.0), Rectangle(80.0, 40.0)], ids=["disc", "rectangle"])
def test_the_posterior_is_the_product_averaged_over_all_shifts(area):
    draw = np.random.default_rng(4)
    grid = soft_grid(replace(ROBOT, area=area), ReferenceDrift(12.0, 0.01, 5.0), 12.0, 1.0)
    poses = np.column_stack([draw.uniform(-50, 50, (12, 2)), draw.uniform(-3, 3, 12)])
    outcome = draw.integers(0, 3, 12)
    visit_start, weights = np.array([0, 5, 8, 12]), np.array([1.0, 0.7, 0.4])
    found = posterior(grid, poses, outcome, visit_start, weights)
    mass, evidence = brute_force(grid, poses, outcome, visit_start, weights)
    _, x, y = masses(grid.prior)
    mean = np.array([mass.sum(axis=0) @ x, mass.sum(axis=1) @ y])
    dx, dy = x - mean[0], y - mean[1]
    xy = dy @ mass @ dx
    covariance = np.array([[mass.sum(axis=0) @ dx**2, xy], [xy, mass.sum(axis=1) @ dy**2]])
    assert found.mean_mm == pytest.approx(mean, abs=0.02)
    assert found.covariance_mm2 == pytest.approx(covariance + grid.prior.cell_mm**2 / 12 * np.eye(2), rel=2e-3, abs=0.1)
    assert found.log_evidence == pytest.approx(evidence, abs=2e-3)


def silent(grid, outcome):
    """Log evidence of one poll over the nominal place that did not read the tag."""
    return posterior(grid, np.zeros((1, 3)), np.array([outcome]), np.array([0, 1]), np.ones(1)).log_evidence


def test_silence_is_weaker_evidence_where_another_tag_answered():
    """Exactly known pose and place: the field over the tag is read with 0.95, and shared by two with half of that."""
    grid = soft_grid(ROBOT, ReferenceDrift(0.0, 0.0, 1.0), 1.0, 1.0)
    assert math.exp(silent(grid, NOTHING)) == pytest.approx(0.05, rel=1e-3)
    assert math.exp(silent(grid, ANOTHER)) == pytest.approx(1.0 - 0.95 / 2, rel=1e-3)


def test_where_all_tags_answer_another_one_changes_nothing():
    reads = ReadModel(read_probability=0.95, answers="all")
    grid = soft_grid(replace(ROBOT, reads=reads), ReferenceDrift(0.0, 0.0, 1.0), 1.0, 1.0)
    assert silent(grid, ANOTHER) == silent(grid, NOTHING)


def test_visits_at_one_moment_count_once():
    grid = soft_grid(ROBOT, ReferenceDrift(20.0, 0.0, 10.0), 30.0, 1.0)
    poses, outcome = np.array([[15.0, 0.0, 0.0]] * 3), np.full(3, READ)
    once = posterior(grid, poses[:1], outcome[:1], np.array([0, 1]), np.ones(1))
    weights = ReferenceDrift(20.0, 0.0, 10.0).visit_weights(np.array([0.0, 1e-9, 2e-9]))
    thrice = posterior(grid, poses, outcome, np.array([0, 1, 2, 3]), weights)
    assert thrice.covariance_mm2 == pytest.approx(once.covariance_mm2, rel=1e-4, abs=1e-3)
    far_apart = posterior(grid, poses, outcome, np.array([0, 1, 2, 3]), np.ones(3))
    assert np.trace(far_apart.covariance_mm2) < 0.8 * np.trace(once.covariance_mm2)


@pytest.mark.parametrize(("pose_mm", "prior_mm"), [(200.0, 2.0), (1000.0, 1000.0), (0.0, 0.1), (0.0, 1000.0)])
def test_windows_stay_small(pose_mm, prior_mm):
    grid = soft_grid(ROBOT, ReferenceDrift(pose_mm, 0.0, 10.0), prior_mm, 1.0)
    assert len(grid.prior.logs) + grid.taps.size - 1 <= 406
    found = posterior(grid, np.zeros((1, 3)), np.array([READ]), np.array([0, 1]), np.ones(1))
    assert np.all(np.linalg.eigvalsh(found.covariance_mm2) > 0.0)


def test_a_reference_that_is_far_too_coarse_is_refused():
    with pytest.raises(ValueError, match="pose_mm is 1000"):
        soft_grid(ROBOT, ReferenceDrift(1000.0, 0.0, 10.0), 2.0, 1.0)


@pytest.mark.parametrize("prior_mm", [0.0, -1.0, math.nan, 1e6])
def test_a_prior_out_of_bounds_is_refused(prior_mm):
    with pytest.raises(ValueError, match="prior_mm"):
        soft_grid(ROBOT, ReferenceDrift(), prior_mm, 1.0)
