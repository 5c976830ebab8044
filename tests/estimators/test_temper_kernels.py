"""Tempering: a likelihood too sharp for the particles there are, applied in stages."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rfiddesign.estimators import _temper_kernels as kernels
from rfiddesign.estimators import particle_filter
from rfiddesign.estimators.start import UncertainStart
from rfiddesign.geometry import compose, listed
from rfiddesign.models.recording import Reads
from tests.estimators.clouds import cloud_of, particles_of
from tests.estimators.field_filter import built, key_of

PROPERTY = settings(max_examples=100, deadline=None, derandomize=True)


def effective(log_weights):
    weights = np.exp(log_weights - log_weights.max())
    return weights.sum() ** 2 / (weights @ weights)


@PROPERTY
@given(seed=st.integers(0, 2**32 - 1), sharpness=st.sampled_from([0.1, 3.0, 100.0, 3000.0]), n=st.integers(2, 600))
def test_the_exponent_leaves_the_sample_size_asked_for_and_hardly_more(seed, sharpness, n):
    """Never less; a greater exponent, by a thirtieth or to twice as much, leaves less."""
    rng = np.random.Generator(np.random.PCG64(seed))
    log = (-sharpness * rng.exponential(1.0, n)).astype(np.float32)
    cloud = cloud_of(*particles_of(n, rng), log=log)
    found = kernels.exponent_for(n, 0.5 * n, cloud)
    assert 0.0 < found < 1.0
    assert effective(found * log.astype(float)) >= 0.5 * n * (1 - 1e-3)
    beyond = max(found + 1 / 32, 2.1 * found)
    assert beyond >= 1.0 or effective(beyond * log.astype(float)) <= 0.5 * n * (1 + 1e-3)
    for exponent in (0.1, 1.0):
        best = kernels.best_of(n, cloud)
        assert kernels.effective_size(n, exponent, best, cloud) == pytest.approx(
            effective(np.maximum(exponent * (log - log.max()), -80.0).astype(float)), rel=1e-3
        )


# Three antennas that all read the weakest of their signals: the tags lie in rings of 5 mm.
THREE = listed([(150.0, 0.0, 0.0), (-100.0, 180.0, 0.0), (-80.0, -190.0, 0.0)])
RADII = (60.0, 55.0, 30.0)
TRUE_POSE = np.array([9.0, -14.0, 0.05])
START = UncertainStart((0.0, 0.0, 0.0), np.diag([20.0**2, 20.0**2, 0.08**2]).tolist())
BEARINGS = (0.3, 2.1, 4.4)


def sharp_estimates(n_particles, n, **switches):
    """Estimated poses (n, 3) and effective sample sizes after one step of such reads, by repetitions of the filter."""
    ready = built(THREE, radii=RADII, uses_rssi=True, softness_mm=1.0, reinitialize=False, n_particles=n_particles,
                  learns_from_nothing=False, **switches)  # fmt: skip
    places = compose(TRUE_POSE, THREE.poses_mm)[:, :2]
    tags = places + 57.5 * np.column_stack([np.cos(BEARINGS), np.sin(BEARINGS)])
    poses, sizes = np.empty((n, 3)), np.empty(n)
    for repetition in range(n):
        state = particle_filter.init(ready, START, key_of(repetition))
        state = particle_filter.update(ready, state, Reads(np.arange(3), tags, np.zeros(3, int)))
        found = particle_filter.estimate(state)
        poses[repetition], sizes[repetition] = found.pose, found.effective_sample_size
    return poses, sizes


def test_500_particles_reach_what_a_million_tell_of_evidence_that_only_one_in_a_thousand_survives():
    exact, sizes = sharp_estimates(1_000_000, 2, is_tempered=False)
    assert 1e-4 < sizes.mean() / 1e6 < 0.01
    assert np.abs(exact[0] - exact[1])[:2].max() < 1.0
    (plain, few), (tempered, many) = (sharp_estimates(500, 200, is_tempered=on) for on in (False, True))
    off = [np.hypot(*(found - exact.mean(axis=0))[:, :2].T) for found in (plain, tempered)]
    turned = [np.abs(found[:, 2] - exact[:, 2].mean()) for found in (plain, tempered)]
    assert np.median(few) < 10
    assert np.median(many) > 150
    assert np.sqrt((off[1] ** 2).mean()) < 0.4 * np.sqrt((off[0] ** 2).mean())
    assert np.sqrt((turned[1] ** 2).mean()) < 0.4 * np.sqrt((turned[0] ** 2).mean())


def test_evidence_that_leaves_enough_particles_is_applied_at_once():
    """Also where these are a small share of very many."""
    for n, is_same in ((500, False), (200_000, True)):
        (plain, _), (tempered, _) = (sharp_estimates(n, 1, is_tempered=on) for on in (False, True))
        assert np.array_equal(plain, tempered) == is_same
