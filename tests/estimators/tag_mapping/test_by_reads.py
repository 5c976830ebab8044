"""Tags mapped from reads: the posterior is the product of likelihoods, as brute force makes it, ties and all."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rfiddesign.estimators.tag_mapping import by_reads
from rfiddesign.estimators.tag_mapping.by_reads import ByReads
from rfiddesign.estimators.tag_mapping.likelihood import AdaptiveLikelihood, FixedLikelihood
from rfiddesign.estimators.tag_mapping.window import log_evidence, masses, moments
from rfiddesign.models.polls import Polls
from tests.estimators.tag_mapping.numpy_windows import cells_of, in_ellipse

DISTANCES = np.array([700.0, 1000.0, 1400.0, 2000.0])
FIXED, ADAPTIVE = FixedLikelihood(2000.0), AdaptiveLikelihood(2000.0)
MODELS = pytest.mark.parametrize("likelihood", [FIXED, ADAPTIVE], ids=["fixed", "adaptive"])
# Coarse cells, so that brute force is quick and ties are many.
COARSE = {"cell_mm": 50.0, "radius_mm": 1500.0}


def likelihood_of(model, pose, distance, places):
    """As the paper prints it: three areas."""
    if isinstance(model, FixedLikelihood):
        return np.where(in_ellipse(pose, places, model.length_mm), 0.9, 0.5)
    is_core = in_ellipse(pose, places, 1.2 * distance)
    is_expanded = in_ellipse(pose, places, model.expanded_mm)
    return np.where(is_core, 0.9, np.where(is_expanded, 0.7, 0.5))


def reads_about(rng, n, first=(300.0, -200.0)):
    """Polls about a place, all of which read tag 1 of two."""
    poses = np.column_stack([rng.normal(first, 250.0, (n, 2)), rng.uniform(-1.0, 1.0, n)])
    return Polls(poses, np.arange(n), np.ones(n, int), rng.choice(DISTANCES, n), 2)


@MODELS
@pytest.mark.parametrize("seed", range(4))
def test_the_posterior_is_the_product_of_the_likelihoods(likelihood, seed):
    polls = reads_about(np.random.default_rng(seed), 12)
    _, state = by_reads.follow(ByReads(likelihood, **COARSE), polls, 1)
    places = cells_of(state.window)
    chance = (np.hypot(*np.moveaxis(places - polls.poses[0, :2], -1, 0)) <= 1500.0).astype(float)
    chance /= chance.sum()
    for pose, distance in zip(polls.poses, polls.read_distance_mm, strict=True):
        chance = chance * likelihood_of(likelihood, pose, distance, places)
    mass, _, _ = masses(state.window)
    assert mass == pytest.approx(chance / chance.sum(), rel=2e-3)
    assert log_evidence(state.window) == pytest.approx(math.log(chance.sum()), abs=2e-3)


@MODELS
@pytest.mark.parametrize("seed", range(6))
def test_the_tag_is_put_to_the_centre_of_gravity_of_all_best_cells(likelihood, seed):
    """Which are those that the products, taken as whole numbers of each factor, say tie."""
    polls = reads_about(np.random.default_rng(seed), 9)
    places_after, state = by_reads.follow(ByReads(likelihood, **COARSE), polls, 1)
    places = cells_of(state.window)
    is_inside = np.hypot(*np.moveaxis(places - polls.poses[0, :2], -1, 0)) <= 1500.0
    exact, n_best = np.ones(is_inside.shape, object), []
    for k, (pose, distance) in enumerate(zip(polls.poses, polls.read_distance_mm, strict=True)):
        exact = exact * np.rint(10 * likelihood_of(likelihood, pose, distance, places)).astype(int)
        is_best = (exact == exact[is_inside].max()) & is_inside
        assert places_after[k] == pytest.approx(places[is_best].mean(axis=0), abs=1e-6)
        n_best.append(is_best.sum())
    # Ties are the rule.
    assert np.median(n_best) > 1


@MODELS
def test_reads_one_by_one_and_all_at_once_are_the_same(likelihood):
    settings = ByReads(likelihood, **COARSE)
    polls, state = reads_about(np.random.default_rng(3), 7), by_reads.init()
    places, at_once = by_reads.follow(settings, polls, 1)
    for k in range(7):
        state = by_reads.update(settings, state, polls.poses[k], polls.read_distance_mm[k])
        assert by_reads.estimate(state)[0] == pytest.approx(places[k])
    assert np.array_equal(state.window.logs, at_once.window.logs)
    assert state.n_reads == at_once.n_reads == 7
    assert state.window.log_scale == pytest.approx(at_once.window.log_scale)


@given(st.permutations(range(8)), st.integers(0, 100))
@settings(deadline=None, max_examples=30)
def test_the_order_of_reads_plays_no_role_once_the_window_is_open(order, seed):
    polls = reads_about(np.random.default_rng(seed), 9)
    rows = [0, *(1 + k for k in order)]
    shuffled = Polls(polls.poses[rows], polls.read_poll, polls.read_tag, polls.read_distance_mm[rows], 2)
    settings = ByReads(ADAPTIVE, **COARSE)
    (ours, state), (other, shuffled_state) = (by_reads.follow(settings, each, 1) for each in (polls, shuffled))
    assert np.array_equal(state.window.logs, shuffled_state.window.logs)
    assert np.array_equal(ours[-1], other[-1])


def test_a_robot_that_stands_for_an_hour_reads_what_it_read_at_once():
    """7,200 reads from one place: sums leave what float32 adds exactly, unless they are lowered on the way."""
    pose, n = np.array([[100.0, 50.0, 0.4]]), 7200
    polls = Polls(np.repeat(pose, n, axis=0), np.arange(n), np.zeros(n, int), np.full(n, 700.0), 1)
    places, state = by_reads.follow(ByReads(ADAPTIVE, **COARSE), polls, 0)
    assert np.array_equal(places[0], places[-1])
    n_core = (in_ellipse(pose[0], cells_of(state.window), 840.0)).sum()
    assert (state.window.logs == state.window.logs.max()).sum() == n_core
    assert np.isfinite(state.window.log_scale)


def test_the_mean_square_about_the_estimate_is_that_of_the_posterior():
    polls = reads_about(np.random.default_rng(5), 6)
    _, state = by_reads.follow(ByReads(FIXED, **COARSE), polls, 1)
    place, square = by_reads.estimate(state)
    mass, _, _ = masses(state.window)
    off = cells_of(state.window) - place
    assert square == pytest.approx(np.einsum("ij,ijk,ijl->kl", mass, off, off) + np.eye(2) * 2500.0 / 12, rel=1e-4)
    assert np.linalg.eigvalsh(square - moments(state.window)[1])[1] > -1e-6


def test_only_tags_that_were_read_are_on_the_map():
    polls = reads_about(np.random.default_rng(1), 5)
    settings = ByReads(FIXED, **COARSE)
    mapped = by_reads.map_tags(settings, polls)
    assert mapped.tag_id.tolist() == [1]
    assert mapped.n_reads.tolist() == [5]
    assert mapped.mean_mm[0] == pytest.approx(by_reads.follow(settings, polls, 1)[0][-1])
    places, state = by_reads.follow(settings, polls, 0)
    assert places.shape == (0, 2)
    with pytest.raises(ValueError, match="not read yet"):
        by_reads.estimate(state)
    nothing = Polls(np.zeros((0, 3)), *(np.zeros(0, int),) * 2, np.zeros(0), 3)
    assert by_reads.map_tags(settings, nothing).n_tags == 0


@pytest.mark.parametrize("distance", DISTANCES)
def test_the_core_grows_with_the_distance_as_equation_3_says_and_its_axes_stay_in_proportion(distance):
    said = ADAPTIVE.ellipses(distance)
    assert said.inner_mm == pytest.approx(distance + 0.2 * distance)
    assert said.outer_mm == 2000.0
    assert said.ratio == 7 / 20
    assert said.inner_log == pytest.approx(math.log(0.9 / 0.5), abs=1e-4)
    assert said.outer_log == pytest.approx(math.log(0.7 / 0.5), abs=1e-4)
    assert FIXED.ellipses(distance) == FIXED.ellipses(700.0)


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda: FixedLikelihood(0.0), "length_mm"),
        (lambda: FixedLikelihood(2000.0, inside=0.4), "inside"),
        (lambda: FixedLikelihood(2000.0, outside=0.0), "outside"),
        (lambda: AdaptiveLikelihood(math.nan), "expanded_mm"),
        (lambda: AdaptiveLikelihood(2000.0, core=0.6), "core"),
        (lambda: AdaptiveLikelihood(2000.0).ellipses(0.0), "distance_mm"),
        (lambda: ByReads(cell_mm=1.0), "cell_mm"),
        (lambda: ByReads(radius_mm=-1.0), "radius_mm"),
    ],
)
def test_settings_that_make_no_sense_are_refused_by_name(make, named):
    with pytest.raises(ValueError, match=named):
        make()
