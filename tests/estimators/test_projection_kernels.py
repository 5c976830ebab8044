"""What a poll says of a Gaussian over the pose equals sums over a fine grid, and mixtures keep their moments."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import ndtr

from rfiddesign.estimators import _border_kernels as border
from rfiddesign.estimators import _mixture_kernels as mixture
from rfiddesign.estimators import _plane_kernels as plane
from rfiddesign.estimators import _projection_kernels as projection
from rfiddesign.geometry import Disc, Rectangle, RoundedRectangle

LEAST = 1e-3
NO_TABLE = (np.zeros((0, 0)), 1.0, 0.0)


def mixture_of(*parts):
    """Rows of a mixture from (weight, pose, covariance)."""
    mix = np.zeros((len(parts) + 4, mixture.N_COLUMNS))
    for row, (weight, pose, P) in zip(mix, parts, strict=False):
        row[0], row[1:4] = weight, pose
        row[4:10] = np.asarray(P)[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]]
        row[10:12] = math.sin(pose[2]), math.cos(pose[2])
    return mix


def moments(mix, n):
    """Weight, mean and covariance of a mixture."""
    w, mean = mix[:n, 0], mix[:n, 1:4]
    P = np.array([[[r[4], r[5], r[7]], [r[5], r[6], r[8]], [r[7], r[8], r[9]]] for r in mix[:n]])
    centre = w @ mean / w.sum()
    off = mean - centre
    return w.sum(), centre, np.einsum("k,kij->ij", w, P + off[:, :, None] * off[:, None, :]) / w.sum()


def covariance_of(rng, sigmas):
    """A random correlation with these sigmas."""
    a = rng.normal(size=(3, 5))
    P = a @ a.T
    d = np.asarray(sigmas) / np.sqrt(np.diag(P))
    return P * np.outer(d, d)


def by_sums(pose, P, antenna, tags, chance, n=241):
    """Evidence and moments of the pose, z taken as linear in it, by sums over a fine grid of the plane."""
    x, y, yaw = antenna
    p = tags[0] - pose[:2]
    both = pose[2] + yaw
    c, s = math.cos(pose[2]), math.sin(pose[2])
    robot = np.array([c * p[0] + s * p[1], c * p[1] - s * p[0]])
    R = np.array([[math.cos(yaw), math.sin(yaw)], [-math.sin(yaw), math.cos(yaw)]])
    z0 = R @ (robot - [x, y])
    H = np.array([[-math.cos(both), -math.sin(both), 0.0], [math.sin(both), -math.cos(both), 0.0]])
    H[:, 2] = R @ [robot[1], -robot[0]]
    S = H @ P @ H.T
    L = np.linalg.cholesky(S)
    axis = np.linspace(-6, 6, n)
    xi = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1).reshape(-1, 2)
    w = np.exp(-0.5 * (xi**2).sum(axis=1))
    w /= w.sum()
    z = z0 + xi @ L.T
    turn = np.array([[math.cos(both), math.sin(both)], [-math.sin(both), math.cos(both)]])
    likely = w * chance(np.stack([z + turn @ (tag - tags[0]) for tag in tags]))
    e = likely.sum()
    mean = likely @ xi / e
    cov = np.einsum("k,ki,kj->ij", likely, xi, xi) / e - np.outer(mean, mean)
    B = P @ H.T @ np.linalg.inv(L).T
    return e, pose + B @ mean, P + B @ (cov - np.eye(2)) @ B.T


def inside_of(area, softness, inner=None):
    def inside(z):
        chance = ndtr(-area.signed_distance(z) / softness)
        if inner is not None:
            chance = chance - ndtr((inner - np.linalg.norm(z, axis=-1)) / softness)
        return chance

    return inside


def shape_of(area, inner=plane.NO_INNER):
    if isinstance(area, Disc):
        return 0.0, 0.0, area.radius_mm, inner
    corner = getattr(area, "corner_mm", 0.0)
    return area.length_mm / 2 - corner, area.width_mm / 2 - corner, corner, plane.NO_INNER


def looked_at(mix, antenna, tags, shape, softness, is_read, by):
    """Component 0 after a poll, by closed form or by grid; None where there is no closed form."""
    x, y, yaw = antenna
    antenna = (x, y, math.sin(yaw), math.cos(yaw))
    found = np.zeros(projection.N_FOUND)
    seen = projection.seen_from(mix, 0, antenna, *tags[0])
    if by == "border":
        base, gain = (LEAST, 0.98 - LEAST) if is_read else (1.0, -0.98)
        if not border.look_across(mix, 0, seen, shape, softness, base, gain, found):
            return None
    else:
        scratch = tuple(np.zeros(size) for size in ((2, plane.N_GRID), (2, plane.N_GRID), (plane.N_GRID,) * 2))
        if is_read:
            plane.look_at_read(mix, 0, seen, shape, softness, 0.98, NO_TABLE, scratch, found)
        else:
            product = np.zeros((plane.N_GRID,) * 2)
            plane.look_at_none(
                mix, 0, seen, np.array(tags), len(tags), shape, softness, 0.98, NO_TABLE, scratch, product, found
            )
    projection.learn(mix, 0, found)
    _, mean, P = moments(mix, 1)
    return found[projection.EVIDENCE], mean, P


def error_of(found, expected, P):
    """Errors of evidence, of the mean in prior sigmas, and of the variances as shares of the prior's."""
    sigma = np.sqrt(np.diag(P))
    off = found[1] - expected[1]
    off[2] = (off[2] + math.pi) % (2 * math.pi) - math.pi
    return (
        abs(found[0] - expected[0]),
        np.abs(off / sigma).max(),
        np.abs((found[2] - expected[2]) / np.outer(sigma, sigma)).max(),
    )


AREAS = [Disc(46.0), Rectangle(320.0, 230.0), RoundedRectangle(120.0, 90.0, 30.0)]


def random_case(seed, area, sigma):
    """A Gaussian beside the border of an area, an antenna and a tag."""
    rng = np.random.default_rng(seed)
    P = covariance_of(rng, rng.uniform(0.3, 1.0, 3) * [sigma, sigma, sigma / 200.0])
    pose = np.array([*rng.uniform(-500, 500, 2), rng.uniform(-3, 3)])
    antenna = (*rng.uniform(-200, 200, 2), rng.uniform(-3, 3))
    # The mean lies within two sigmas of the border.
    angle = rng.uniform(0, 2 * math.pi)
    direction = np.array([math.cos(angle), math.sin(angle)])
    near = next(r for r in np.arange(0.0, 300.0, 0.5) if area.signed_distance(r * direction) >= 0)
    z = (near + sigma * rng.uniform(-2, 2)) * direction
    both = pose[2] + antenna[2]
    c, s = math.cos(pose[2]), math.sin(pose[2])
    place = pose[:2] + np.array([c * antenna[0] - s * antenna[1], s * antenna[0] + c * antenna[1]])
    tag = place + np.array(
        [math.cos(both) * z[0] - math.sin(both) * z[1], math.sin(both) * z[0] + math.cos(both) * z[1]]
    )
    return pose, P, antenna, tag


def chance_of(inside, is_read):
    """The chance of a poll whose antenna sees one tag with the chance `inside`."""
    return (lambda z: LEAST + (0.98 - LEAST) * inside(z[0])) if is_read else (lambda z: 1.0 - 0.98 * inside(z[0]))


def worst_errors(area, sigma, softness, is_read, by, inner=None):
    """Largest errors of `error_of` over many Gaussians, and how many there were; next to impossible polls left out."""
    worst, n, inside = np.zeros(3), 0, inside_of(area, softness, inner)
    shape = shape_of(area) if inner is None else shape_of(area, inner)
    for seed in range(60):
        pose, P, antenna, tag = random_case(seed, area, sigma)
        expected = by_sums(pose, P, antenna, [tag], chance_of(inside, is_read))
        found = looked_at(mixture_of((1.0, pose, P)), antenna, [tag], shape, softness, is_read, by)
        if found is not None and expected[0] > 0.05:
            worst, n = np.maximum(worst, error_of(found, expected, P)), n + 1
    return worst, n


@pytest.mark.parametrize("is_read", [True, False])
@pytest.mark.parametrize("area", [Rectangle(320.0, 230.0), RoundedRectangle(320.0, 230.0, 40.0)], ids=repr)
def test_beside_a_straight_border_the_closed_form_is_exact(area, is_read):
    worst, n = worst_errors(area, 5.0, 1.5, is_read, "border")
    assert n > 20
    assert np.all(worst < 1e-3)


@pytest.mark.parametrize(
    ("sigma", "most"), [(1.0, (0.003, 0.02, 0.04)), (2.0, (0.005, 0.05, 0.08)), (5.0, (0.015, 0.16, 0.19))]
)
@pytest.mark.parametrize("is_read", [True, False])
def test_beside_a_bent_border_the_closed_form_errs_with_the_bend(is_read, sigma, most):
    """In sigmas of the prior and shares of its variances: most of what is left out is the place along the border."""
    worst, n = worst_errors(Disc(46.0), sigma, 1.5, is_read, "border")
    assert n > 40
    assert np.all(worst < most)


@pytest.mark.parametrize("is_read", [True, False])
@pytest.mark.parametrize("area", AREAS, ids=repr)
def test_a_wide_gaussian_s_moments_on_the_grid_of_64_are_those_of_a_fine_one(area, is_read):
    worst, n = worst_errors(area, 40.0, 2.0, is_read, "plane")
    assert n > 40
    assert np.all(worst < (0.05, 0.3, 0.3))
    typical, _ = worst_errors(area, 10.0, 2.0, is_read, "plane")
    assert np.all(typical < (0.04, 0.18, 0.2))


def test_several_tags_not_read_are_taken_together():
    """Their chances multiply at every point of the plane."""
    rng = np.random.default_rng(3)
    area, pose = Disc(46.0), np.array([0.0, 0.0, 0.4])
    P = covariance_of(rng, (20.0, 25.0, 0.02))
    tags = [np.array([40.0, 10.0]), np.array([-50.0, 30.0]), np.array([10.0, -70.0])]
    inside = inside_of(area, 2.0)
    expected = by_sums(pose, P, (0.0, 0.0, 0.0), tags, lambda z: np.prod([1.0 - 0.98 * inside(v) for v in z], axis=0))
    found = looked_at(mixture_of((1.0, pose, P)), (0.0, 0.0, 0.0), tags, shape_of(area), 2.0, is_read=False, by="plane")
    assert np.all(np.array(error_of(found, expected, P)) < (0.02, 0.06, 0.06))


@pytest.mark.parametrize(("sigma", "most"), [(1.0, (0.005, 0.02, 0.04)), (3.0, (0.01, 0.08, 0.1))])
def test_a_ring_of_rssi_has_a_closed_form(sigma, most):
    worst, n = worst_errors(Disc(60.0), sigma, 1.0, True, "border", inner=55.0)
    assert n > 30
    assert np.all(worst < most)


def test_a_poll_that_says_nothing_new_changes_nothing():
    """A read deep in a large field, and no read far from every tag."""
    pose, P = np.array([10.0, 20.0, 0.3]), np.diag([4.0, 9.0, 1e-4])
    shape = shape_of(Disc(200.0))
    for tag, is_read, evidence in (((12.0, 25.0), True, 0.98), ((900.0, 0.0), False, 1.0)):
        mix = mixture_of((1.0, pose, P))
        found = looked_at(mix, (0.0, 0.0, 0.0), [np.array(tag)], shape, 1.0, is_read, "border")
        assert found[0] == pytest.approx(evidence)
        assert np.array_equal(mix, mixture_of((1.0, pose, P)))


@given(st.floats(-9, 9))
def test_the_normal_distribution_is_scipy_s(z):
    density, below = border.normal(z)
    assert below == pytest.approx(ndtr(np.clip(z, -8, 8)), abs=2e-7)
    assert density == pytest.approx(math.exp(-0.5 * np.clip(z, -8, 8) ** 2) / math.sqrt(2 * math.pi), abs=1e-7)


@given(st.floats(0, 5.2))
def test_the_grid_s_exponential_is_right(x):
    assert plane.exp_minus(x) == pytest.approx(math.exp(-x), rel=1e-6)


# Mixtures

seeds = st.integers(0, 10_000)


def random_parts(seed, n):
    rng = np.random.default_rng(seed)
    heading = rng.uniform(-2, 2)
    return [
        (
            rng.uniform(0.1, 1.0),
            np.array([*rng.normal(0, 30, 2), heading + rng.uniform(-0.3, 0.3)]),
            covariance_of(rng, rng.uniform(0.5, 20.0, 3) * [1.0, 1.0, 0.005]),
        )
        for _ in range(n)
    ]


@given(seeds)
@settings(deadline=None)
def test_splitting_keeps_weight_mean_and_covariance(seed):
    parts = random_parts(seed, 1)
    rng = np.random.default_rng(seed)
    direction = rng.normal(size=3)
    # One sigma along any direction that the covariance has.
    direction = parts[0][2] @ direction / math.sqrt(direction @ parts[0][2] @ direction)
    mix = mixture_of(*parts)
    before = moments(mix, 1)
    assert mixture.split(mix, 1, 0, *direction) == 3
    after = moments(mix, 3)
    assert after[0] == pytest.approx(before[0])
    assert after[1] == pytest.approx(before[1], abs=1e-9)
    assert after[2] == pytest.approx(before[2], rel=1e-6, abs=1e-9)
    assert mix[1, 10:12] == pytest.approx([math.sin(mix[1, 3]), math.cos(mix[1, 3])])


@given(seeds, st.integers(2, 7), st.integers(1, 3))
@settings(deadline=None)
def test_merging_keeps_weight_mean_and_covariance(seed, n, most):
    mix = mixture_of(*random_parts(seed, n))
    before = moments(mix, n)
    left = mixture.merge(mix, n, most)
    assert left <= most
    for a, b in zip(moments(mix, left), before, strict=True):
        assert a == pytest.approx(b, rel=1e-7, abs=1e-7)


def test_of_three_components_the_two_alike_merge():
    P = np.diag([4.0, 4.0, 1e-4])
    mix = mixture_of((0.3, np.zeros(3), P), (0.3, np.array([50.0, 0.0, 0.0]), P), (0.4, np.array([50.5, 0.0, 0.0]), P))
    assert mixture.merge(mix, 3, 2) == 2
    assert sorted(mix[:2, 1]) == pytest.approx([0.0, 50.0 + 0.5 * 4 / 7])


def test_components_of_next_to_no_weight_are_dropped():
    P = np.eye(3)
    mix = mixture_of((1e-9, np.ones(3), P), (0.5, np.zeros(3), P))
    assert mixture.normalize(mix, 2) == 1
    assert mix[0, 0] == 1.0
    assert mix[0, 1] == 0.0


def test_the_estimate_of_a_mixture_is_its_mean_and_covariance():
    parts = random_parts(7, 5)
    mix, out = mixture_of(*parts), np.zeros((1, 10))
    n = mixture.normalize(mix, 5)
    _, mean, P = moments(mix, n)
    mixture.write_estimate(mix, n, out, 0)
    assert out[0, :3] == pytest.approx(mean)
    assert out[0, 3:9] == pytest.approx(P[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]])


def test_rounding_cannot_take_positive_definiteness():
    rng = np.random.default_rng(5)
    for _ in range(200):
        mix = mixture_of((1.0, np.zeros(3), covariance_of(rng, (5.0, 5.0, 0.1))))
        mix[0, 4:10] += rng.normal(0, 10.0 ** rng.uniform(-9, 2), 6)
        mixture.keep_positive(mix, 0)
        _, _, P = moments(mix, 1)
        assert np.linalg.eigvalsh(P).min() > 0
