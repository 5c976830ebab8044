"""Greedy, search, bound and proof against brute force on small covers, and what they promise on larger ones."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_array

from rfiddesign.optimize.tag_placement import _search_kernels as kernels
from rfiddesign.optimize.tag_placement.bound import Proof, row_weights
from rfiddesign.optimize.tag_placement.cover import Cover
from rfiddesign.optimize.tag_placement.search import (
    _arrays,
    conflicts_of,
    greedy_choice,
    proved,
    searched,
)


def cover_from(matrix, need):
    rows = csr_array(matrix.astype(np.int8))
    need = np.broadcast_to(need, len(matrix)).astype(np.int32)
    return Cover(rows, rows.T.tocsr(), need, np.arange(matrix.shape[1]), 0, 0, np.empty((0, 3)))


def lower_bound(cover, places):
    proof = Proof(0, np.zeros(len(places), np.int64))
    proof.add(cover, row_weights(cover, places, np.zeros(len(places))))
    return proof.bound


def is_served(cover, chosen):
    return bool((cover.rows.toarray().astype(int) @ chosen >= cover.need).all())


def line(rng, n_places, n_rows, n_cover, width=8):
    """Places on a line, in any order, and rows that each see some of those about a point of it."""
    at = rng.permutation(n_places)
    centres = rng.uniform(0, n_places, n_rows)
    matrix = (np.abs(at[None] - centres[:, None]) < width / 2) & (rng.random((n_rows, n_places)) < 0.8)
    need = rng.integers(1, n_cover + 1, n_rows)
    is_servable = matrix.sum(axis=1) >= need
    return cover_from(matrix[is_servable], need[is_servable]), np.stack([at, 0.0 * at], axis=-1).astype(float)


def fewest(matrix, need, conflicts):
    for size in range(matrix.shape[1] + 1):
        for chosen in itertools.combinations(range(matrix.shape[1]), size):
            if (matrix[:, chosen].sum(axis=1) >= need).all() and not conflicts[np.ix_(chosen, chosen)].any():
                return size
    return None


@given(st.integers(0, 2**32 - 1), st.integers(1, 3), st.sampled_from([0.0, 1.5]))
@settings(max_examples=25)
def test_bound_optimum_search_and_greedy_are_in_order(seed, n_cover, min_distance):
    cover, places = line(np.random.default_rng(seed), 9, 7, n_cover, width=5 if min_distance == 0 else 8)
    conflicts = conflicts_of(places, min_distance)
    greedy, n_lacking = greedy_choice(cover, conflicts)
    optimum = fewest(cover.rows.toarray(), cover.need, conflicts.toarray())
    bound = lower_bound(cover, places)
    if optimum is None:
        assert n_lacking > 0
        return
    assert bound <= optimum
    exact = proved(cover, conflicts)
    assert exact.sum() == optimum
    assert not conflicts.toarray()[np.ix_(exact, exact)].any()
    if n_lacking == 0:
        found = searched(cover, conflicts, greedy, 300, seed % 1000)
        assert optimum <= found.sum() <= greedy.sum()
        assert is_served(cover, found)
        assert is_served(cover, greedy)
        assert not conflicts.toarray()[np.ix_(found, found)].any()


@pytest.mark.parametrize("min_distance", [0.0, 1.5])
@pytest.mark.parametrize("n_cover", [1, 2])
def test_the_search_improves_on_greedy_and_nothing_is_to_spare(n_cover, min_distance):
    cover, places = line(np.random.default_rng(3), 400, 700, n_cover, width=24)
    conflicts = conflicts_of(places, min_distance)
    greedy, n_lacking = greedy_choice(cover, conflicts)
    assert n_lacking == 0
    found = searched(cover, conflicts, greedy, 20_000, 1)
    assert lower_bound(cover, places) <= found.sum() < greedy.sum()
    for chosen in (greedy, found):
        assert is_served(cover, chosen)
        assert not conflicts.toarray()[np.ix_(chosen, chosen)].any()
        for place in np.flatnonzero(chosen):
            without = chosen.copy()
            without[place] = False
            assert not is_served(cover, without)
    # The same however often it is interrupted to report, and another seed is another search.
    assert (searched(cover, conflicts, greedy, 20_000, 1) == found).all()


def test_the_state_of_a_search_stays_true():
    n_cover = 2
    cover, places = line(np.random.default_rng(5), 60, 90, n_cover, width=14)
    matrix = _arrays(cover, conflicts_of(places, 1.5))
    greedy, _ = greedy_choice(cover, conflicts_of(places, 1.5))
    state = kernels.start(matrix, cover.need, greedy, 7)
    dense = cover.rows.toarray().astype(np.int64)
    for until in range(1, 200):
        kernels.search(matrix, cover.need, greedy, state, until)
        is_in, counts, blocked, weight, score, chosen, _, lacking, _, _, counters = state
        assert (counts == dense @ is_in).all()
        assert set(chosen[: counters[0]]) == set(np.flatnonzero(is_in))
        assert set(lacking[: counters[1]]) == set(np.flatnonzero(counts < cover.need))
        assert (blocked == conflicts_of(places, 1.5).toarray().astype(int) @ is_in).all()
        needed = np.where(is_in, (weight * (counts <= cover.need)) @ dense, (weight * (counts < cover.need)) @ dense)
        assert (score == needed).all()


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=25)
def test_any_weights_prove_a_bound(seed):
    rng = np.random.default_rng(seed)
    cover, _ = line(rng, 10, 7, 2, width=6)
    weights = rng.uniform(-0.2, rng.uniform(0.1, 3), cover.rows.shape[0])
    optimum = fewest(cover.rows.toarray(), cover.need, np.zeros((10, 10), bool))
    proof = Proof(0, np.zeros(10, np.int64))
    # Rows may be added in parts.
    for rows in np.array_split(np.arange(cover.rows.shape[0]), 2):
        proof.add(cover_from(cover.rows.toarray()[rows], cover.need[rows]), weights[rows])
    assert proof.bound <= optimum


def test_the_bound_by_tiles_is_near_that_of_the_whole(monkeypatch):
    cover, places = line(np.random.default_rng(8), 900, 1400, 2, width=20)
    monkeypatch.setattr("rfiddesign.optimize.tag_placement.bound.TILE_ROWS", 10_000)
    whole = lower_bound(cover, places)
    monkeypatch.setattr("rfiddesign.optimize.tag_placement.bound.TILE_ROWS", 150)
    assert 0.95 * whole <= lower_bound(cover, places) <= whole
