"""Tag patterns, and the random points beneath two of them."""

import math

import numpy as np
import pytest
import shapely
import shapely.affinity
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from rfiddesign.geometry import PATTERN_KINDS, Disc, TagPattern, displaced, make_pattern
from rfiddesign.geometry.random_points import lattice_uniform

HALL = shapely.box(-3000, -2000, 17000, 18000).difference(shapely.Point(5000, 5000).buffer(4000))
LAID_KINDS = [kind for kind in PATTERN_KINDS if kind != "list"]
every_kind = pytest.mark.parametrize("kind", LAID_KINDS)


def winding_floor(n_corners):
    """A rough coast line of `n_corners` about an area of 1,300 m2: as a building's map gives, with deep bays."""
    rng = np.random.Generator(np.random.PCG64(5))
    angle = np.linspace(0, 2 * math.pi, n_corners, endpoint=False)
    radius = 20_000 * (1 + 0.3 * np.sin(9 * angle) + 0.02 * rng.uniform(-1, 1, n_corners))
    return shapely.Polygon(np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1))


@every_kind
@pytest.mark.parametrize("tags_per_m2", [16.0, 100.0, 123.4])
def test_a_pattern_has_the_density_that_was_asked_for(kind, tags_per_m2):
    pattern = make_pattern(kind, tags_per_m2=tags_per_m2, seed=4)
    assert isinstance(pattern, TagPattern)
    assert pattern.name == kind
    assert pattern.tags_per_m2 == pytest.approx(tags_per_m2, rel=1e-12)
    expected = tags_per_m2 * HALL.area / 1e6
    # Lattices miss by their border alone; independent draws by five standard deviations at most.
    tolerance = 5 * math.sqrt(expected) if kind in ("random", "thinned") else 0.01 * expected
    assert len(pattern.lay(HALL)) == pytest.approx(expected, abs=tolerance)


@every_kind
def test_tags_lie_on_the_floor_and_come_sorted_by_y_then_x(kind):
    tags = make_pattern(kind, tags_per_m2=50, seed=1).lay(HALL)
    assert tags.dtype == np.float64
    assert shapely.covers(HALL.buffer(1e-5), shapely.points(tags)).all()
    np.testing.assert_array_equal(tags, tags[np.lexsort((tags[:, 0], tags[:, 1]))])


@every_kind
def test_the_same_study_lays_the_same_tags_however_its_floor_is_cut(kind):
    pattern = make_pattern(kind, tags_per_m2=30, seed=2)
    whole = pattern.lay(HALL)
    np.testing.assert_array_equal(whole, make_pattern(kind, tags_per_m2=30, seed=2).lay(HALL))
    cut = shapely.affinity.rotate(shapely.box(3000, -9e4, 9e4, 9e4), 31)
    parts = np.concatenate([pattern.lay(HALL.intersection(cut)), pattern.lay(HALL.difference(cut))])
    np.testing.assert_array_equal(parts[np.lexsort((parts[:, 0], parts[:, 1]))], whole)


@pytest.mark.parametrize("kind", ["random", "thinned"])
def test_another_seed_lays_other_tags(kind):
    one, other = (make_pattern(kind, tags_per_m2=30, seed=seed).lay(HALL) for seed in (2, 3))
    assert len({map(tuple, one.tolist())} & {map(tuple, other.tolist())}) == 0
    assert not np.array_equal(one[:100], other[:100])


@pytest.mark.parametrize(("tags_per_m2", "pitch"), [(16, 250), (25, 200), (100, 100), (400, 50)])
def test_square_densities_of_the_paper_have_round_pitches(tags_per_m2, pitch):
    lattice = make_pattern("square", tags_per_m2=tags_per_m2).lattice
    assert lattice.basis_mm == ((pitch, 0), (0, pitch))
    assert lattice == make_pattern("square", pitch_mm=pitch).lattice


def test_a_triangular_lattice_has_six_neighbours_at_one_pitch():
    pattern = make_pattern("triangular", pitch_mm=100)
    tags = pattern.lay(HALL)
    middle = tags[np.hypot(*(tags - (13_000, 12_000)).T).argmin()]
    distance = np.sort(np.hypot(*(tags - middle).T))
    np.testing.assert_allclose(distance[1:7], 100)
    assert distance[7] == pytest.approx(100 * math.sqrt(3))
    # findings 3: at equal spacing it takes 15 % more tags than a square one.
    assert pattern.tags_per_m2 / make_pattern("square", pitch_mm=100).tags_per_m2 == pytest.approx(1.1547, abs=1e-4)


def test_striped_rows_are_three_pitches_apart_unless_told():
    assert make_pattern("striped", pitch_mm=50).lattice.basis_mm == ((50, 0), (0, 150))
    assert make_pattern("striped", pitch_mm=50, row_ratio=8).lattice.basis_mm == ((50, 0), (0, 400))
    staggered = make_pattern("staggered", pitch_mm=80, row_ratio=1.5, stagger=0.25)
    assert staggered.lattice.basis_mm == ((80, 0), (20, 120))
    assert make_pattern("staggered", tags_per_m2=100.0).lattice.basis_mm == ((100, 0), (50, 100))


def test_a_thinned_lattice_keeps_its_share_and_nothing_else():
    thinned = make_pattern("thinned", tags_per_m2=25, keep=0.25, seed=9)
    assert thinned.lattice is None
    assert thinned.base.lattice == make_pattern("square", pitch_mm=100).lattice
    every_tag = set(map(tuple, thinned.base.lay(HALL).tolist()))
    assert set(map(tuple, thinned.lay(HALL).tolist())) < every_tag


@given(st.floats(1, 5000), st.floats(0, 0.54), st.integers(0, 2**63 - 1))
@settings(max_examples=30)
def test_random_tags_keep_their_distance(tags_per_m2, distance_in_pitches, seed):
    pitch = 1000 / math.sqrt(tags_per_m2)
    pattern = make_pattern("random", tags_per_m2=tags_per_m2, min_distance_mm=distance_in_pitches * pitch, seed=seed)
    side = 30 * pitch
    tags = pattern.lay(shapely.box(-side / 3, -side / 2, side, side))
    nearest = cKDTree(tags).query(tags, k=2)[0][:, 1]
    assert nearest.min() > distance_in_pitches * pitch
    assert len(tags) == pytest.approx(1800, abs=6 * math.sqrt(1800))


def test_random_tags_are_unpredictable_beyond_their_distance():
    # A hidden lattice would show as a gap or peak in the distances of pairs; here the pair density is flat.
    tags = make_pattern("random", pitch_mm=100, seed=8).lay(shapely.box(0, 0, 30_000, 30_000))
    inner = tags[(np.abs(tags - 15_000) < 14_000).all(axis=1)]
    radii = np.linspace(120, 900, 14)
    pairs = np.diff(cKDTree(inner).count_neighbors(cKDTree(tags), radii))
    expected = len(inner) * 1e-4 * math.pi * np.diff(radii**2)
    np.testing.assert_allclose(pairs / expected, 1, atol=0.03)


def test_hashed_numbers_of_lattice_points_are_uniform_and_independent_of_their_neighbours():
    indices = np.stack(np.meshgrid(np.arange(-250, 250), np.arange(-250, 250)), axis=-1).reshape(-1, 2)
    uniform = lattice_uniform(11, indices)
    counts = np.histogram(uniform, bins=50, range=(0, 1))[0]
    # Chi-squared with 49 degrees of freedom: above 94 with probability 1e-4.
    assert np.sum((counts - 5000) ** 2 / 5000) < 94
    field = uniform.reshape(500, 500)
    off_diagonal = ~np.eye(500, dtype=bool)
    pairs = {
        "next i": (field[:, 1:], field[:, :-1]),
        "next j": (field[1:], field[:-1]),
        "i and j swapped": (field[off_diagonal], field.T[off_diagonal]),
        "next seed": (uniform, lattice_uniform(12, indices)),
    }
    for a, b in pairs.values():
        assert abs(np.corrcoef(a.ravel(), b.ravel())[0, 1]) < 0.01


def test_hashed_numbers_are_the_same_on_every_machine():
    def splitmix64(state):
        state = (state + 0x9E3779B97F4A7C15) % 2**64
        state = (state ^ (state >> 30)) * 0xBF58476D1CE4E5B9 % 2**64
        state = (state ^ (state >> 27)) * 0x94D049BB133111EB % 2**64
        return state ^ (state >> 31)

    # First output of S. Vigna's reference implementation for seed 0.
    assert splitmix64(0) == 0xE220A8397B1DCDAF
    expected = splitmix64(splitmix64(splitmix64(7) ^ (-3 % 2**64)) ^ 5) / 2**64
    assert lattice_uniform(7, np.array([[-3, 5]]))[0] == pytest.approx(expected, abs=2**-52)


def test_a_listed_pattern_keeps_what_lies_on_the_floor():
    points = [(50.0, 90.0), (10.0, 20.0), (500.0, 0.0), (5.0, 20.0), (0.0, 0.0)]
    pattern = make_pattern("list", points_mm=points)
    laid = pattern.lay(shapely.box(0, 0, 100, 100))
    np.testing.assert_array_equal(laid, [(0, 0), (5, 20), (10, 20), (50, 90)])
    square = make_pattern("list", points_mm=[(0, 0), (1000, 0), (1000, 1000), (0, 1000)])
    assert square.tags_per_m2 == 4
    assert square.lattice is None


def test_installation_error_has_its_spread_on_each_axis_and_its_seed():
    tags = make_pattern("square", tags_per_m2=100).lay(HALL)
    moved = displaced(tags, 10.0, seed=3)
    np.testing.assert_allclose((moved - tags).std(axis=0), 10, rtol=0.02)
    np.testing.assert_allclose((moved - tags).mean(axis=0), 0, atol=0.3)
    np.testing.assert_array_equal(moved, displaced(tags, 10.0, seed=3))
    assert not np.array_equal(moved, displaced(tags, 10.0, seed=4))
    np.testing.assert_array_equal(displaced(tags, 0.0, seed=3), tags)


@pytest.mark.parametrize("kind", ["square", "triangular", "striped", "thinned"])
def test_half_a_million_tags_are_laid_over_a_building(kind):
    floor = winding_floor(1500)
    pattern = make_pattern(kind, tags_per_m2=522_000 / (floor.area / 1e6), seed=1)
    assert len(pattern.lay(floor)) == pytest.approx(522_000, rel=0.01)


@pytest.mark.parametrize(
    ("kind", "arguments", "message"),
    [
        ("hexagonal", {"pitch_mm": 100}, "pattern = 'hexagonal': must be one of square, triangular, random, striped"),
        ("square", {}, "tags_per_m2 = None, pitch_mm = None: give exactly one"),
        ("square", {"pitch_mm": 100, "tags_per_m2": 100}, "tags_per_m2 = 100, pitch_mm = 100: give exactly one"),
        ("square", {"pitch_mm": -100}, "pitch_mm = -100: must be a finite number above 0"),
        ("square", {"tags_per_m2": math.inf}, "tags_per_m2 = inf: must be"),
        ("square", {"pitch_mm": 100, "keep": 0.5}, "keep: has no meaning for pattern 'square'"),
        ("striped", {"pitch_mm": 100, "row_ratio": 0}, "row_ratio = 0: must be"),
        ("staggered", {"pitch_mm": 100, "stagger": 1.0}, "stagger = 1.0: must be"),
        ("striped", {"pitch_mm": 100, "stagger": 0.5}, "stagger: has no meaning"),
        ("thinned", {"pitch_mm": 100, "keep": 1.5}, "keep = 1.5: must be a share"),
        ("random", {"tags_per_m2": 100, "min_distance_mm": 60}, "min_distance_mm = 60: must be at most 54.99"),
        ("random", {"tags_per_m2": 100, "seed": -1}, "seed = -1: must be a whole number"),
        ("list", {}, "points_mm: a pattern 'list' needs it"),
        ("list", {"points_mm": [(0, 0)], "pitch_mm": 5}, "points_mm: a pattern 'list' needs it, and neither"),
        ("list", {"points_mm": [(0, 0, 0)]}, "points_mm of shape \\(1, 3\\): must be"),
    ],
)
def test_bad_patterns_are_refused_with_what_is_allowed(kind, arguments, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        make_pattern(kind, **arguments)


@every_kind
def test_a_million_million_tags_are_refused(kind):
    pattern = make_pattern(kind, tags_per_m2=1e12)
    with pytest.raises(ValueError, match=r"tags = .*: must be at most"):
        pattern.lay(Disc(1000.0).outline())


@every_kind
@pytest.mark.parametrize("tags_per_m2", [16.0, 100.0])
def test_no_two_tags_lie_closer_than_the_smallest_distance(kind, tags_per_m2):
    """Lattices have pairs that close, thinned or not; of random tags it bounds a pair's distance tightly."""
    pattern = make_pattern(kind, tags_per_m2=tags_per_m2, seed=2)
    nearest = cKDTree(tags := pattern.lay(HALL)).query(tags, k=2)[0][:, 1].min()
    assert nearest == pytest.approx(pattern.min_distance_mm, rel=0.05 if kind == "random" else 1e-6)
    assert nearest >= pattern.min_distance_mm - 1e-6


def test_the_smallest_distance_of_a_list_is_that_of_its_closest_pair():
    points = np.random.Generator(np.random.PCG64(6)).uniform(0, 1000, (300, 2))
    apart = np.hypot(*np.moveaxis(points[:, None] - points, -1, 0))
    brute_force = apart[~np.eye(300, dtype=bool)].min()
    assert make_pattern("list", points_mm=points).min_distance_mm == pytest.approx(brute_force, rel=1e-12)
    assert make_pattern("list", points_mm=points[:1]).min_distance_mm == math.inf
    assert make_pattern("list", points_mm=[*points, points[7]]).min_distance_mm == 0.0
