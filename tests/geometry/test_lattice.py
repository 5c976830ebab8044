import math

import numpy as np
import pytest
import shapely
import shapely.affinity
from hypothesis import assume, given
from hypothesis import strategies as st

from rfiddesign.geometry import Lattice

SQUARE = Lattice(((100.0, 0.0), (0.0, 100.0)))
steps = st.floats(-200, 200)


@st.composite
def lattices(draw):
    ax, ay, bx, by = (draw(steps) for _ in range(4))
    assume(abs(ax * by - ay * bx) > 2000)
    return Lattice(((ax, ay), (bx, by)), (draw(steps), draw(steps)))


@st.composite
def floors(draw):
    """A star-shaped room with a pillar and a second room: reflex corners, a hole and two parts."""
    n = draw(st.integers(4, 24))
    rng = np.random.Generator(np.random.PCG64(draw(st.integers(0, 2**32))))
    angle = np.sort(rng.uniform(0, 2 * math.pi, n))
    radius = rng.uniform(300, 1500, n)
    room = shapely.Polygon(np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)).buffer(0)
    pillar = shapely.Point(rng.uniform(-300, 300, 2)).buffer(rng.uniform(20, 250), quad_segs=3)
    annex = shapely.affinity.rotate(shapely.box(1600, -500, 2300, 900), rng.uniform(0, 90))
    return room.difference(pillar).union(annex)


def brute_force(lattice, region):
    """All points of a generous block of indices, asked one by one whether shapely holds them inside."""
    x_min, y_min, x_max, y_max = region.bounds
    corners = lattice.index_of([(x_min, y_min), (x_min, y_max), (x_max, y_min), (x_max, y_max)])
    (i_low, j_low), (i_high, j_high) = corners.min(axis=0) - 2, corners.max(axis=0) + 2
    i, j = np.meshgrid(np.arange(int(i_low), int(i_high) + 1), np.arange(int(j_low), int(j_high) + 1))
    points = lattice.at(np.stack([i.ravel(), j.ravel()], axis=-1))
    return points[shapely.contains_xy(region, points)]


def clear_of(border, points):
    """The points further from a border than rounding reaches."""
    return points[shapely.distance(border, shapely.points(points)) > 1e-5]


def as_set(points):
    return {(round(x, 6), round(y, 6)) for x, y in points.tolist()}


@given(lattices(), floors())
def test_the_scanline_finds_the_points_that_shapely_finds(lattice, floor):
    laid = lattice.lay(floor)
    expected = brute_force(lattice, floor)
    assert as_set(clear_of(floor.boundary, laid)) == as_set(clear_of(floor.boundary, expected))


@given(lattices(), floors())
def test_points_come_sorted_by_y_then_x_and_once(lattice, floor):
    laid = lattice.lay(floor)
    np.testing.assert_array_equal(laid, laid[np.lexsort((laid[:, 0], laid[:, 1]))])
    assert len(as_set(laid)) == len(laid)


@given(lattices(), floors(), st.floats(0, math.pi))
def test_a_floor_cut_in_two_has_the_same_points_as_the_whole(lattice, floor, angle):
    half_plane = shapely.affinity.rotate(shapely.box(0, -9000, 9000, 9000), angle, origin=(0, 0), use_radians=True)
    one, other = floor.intersection(half_plane), floor.difference(half_plane)
    together = np.concatenate([lattice.lay(one), lattice.lay(other)])
    assert as_set(clear_of(one.boundary, together)) == as_set(clear_of(one.boundary, lattice.lay(floor)))


@pytest.mark.parametrize("pitch", [100.0, 1000 / 3, 90.0, 1000 / math.sqrt(123)])
def test_a_room_of_ten_by_seven_steps_has_seventy_points_however_it_is_cut(pitch):
    # Borders run through lattice points: of each pair of rooms exactly one gets the points in between.
    lattice = Lattice(((pitch, 0.0), (0.0, pitch)))
    assert len(lattice.lay(shapely.box(0, 0, 10 * pitch, 7 * pitch))) == 70
    assert len(lattice.lay(shapely.box(-30 * pitch, 11 * pitch, -20 * pitch, 18 * pitch))) == 70
    west, east = shapely.box(0, 0, 4 * pitch, 7 * pitch), shapely.box(4 * pitch, 0, 10 * pitch, 7 * pitch)
    assert as_set(np.concatenate([lattice.lay(west), lattice.lay(east)])) == as_set(
        lattice.lay(shapely.box(0, 0, 10 * pitch, 7 * pitch))
    )


@given(lattices(), st.floats(-500, 500), st.floats(-500, 500), st.floats(1, 900), st.floats(1, 900))
def test_the_points_in_a_box_are_those_between_its_bounds(lattice, x, y, width, height):
    box = shapely.box(x, y, x + width, y + height)
    found = lattice.points_in(box.bounds)
    assert (shapely.distance(box, shapely.points(found)) < 1e-5).all()
    expected = brute_force(lattice, box)
    assert as_set(expected) <= as_set(found)
    np.testing.assert_array_equal(found, found[np.lexsort((found[:, 0], found[:, 1]))])


def test_a_box_holds_the_points_on_its_border():
    assert as_set(SQUARE.points_in((0, 0, 200, 100))) == {(x, y) for x in (0, 100, 200) for y in (0, 100)}


@given(lattices(), st.tuples(st.integers(-999, 999), st.integers(-999, 999)))
def test_indices_and_points_are_two_names_of_the_same(lattice, index):
    np.testing.assert_allclose(lattice.index_of(lattice.at(index)), index, atol=1e-6)


def test_an_empty_region_has_no_points():
    assert SQUARE.lay(shapely.Polygon()).shape == (0, 2)
    assert SQUARE.lay(shapely.box(10, 10, 90, 90)).shape == (0, 2)


def test_absurd_numbers_of_points_are_refused_before_memory_is_taken():
    fine = Lattice(((0.001, 0.0), (0.0, 0.001)))
    with pytest.raises(ValueError, match="number of tags = 1e\\+12: must be at most 50000000"):
        fine.lay(shapely.box(0, 0, 1000, 1000))
    with pytest.raises(ValueError, match="must be at most 50000000"):
        fine.points_in((0, 0, 1000, 1000))
    # A thread has hardly any area, yet crosses a million million rows.
    with pytest.raises(ValueError, match="must be at most 50000000"):
        fine.lay(shapely.box(0, 0, 1e-8, 1e9))


def test_parallel_vectors_span_no_lattice():
    with pytest.raises(ValueError, match="must not be parallel"):
        Lattice(((1.0, 2.0), (-2.0, -4.0)))
    with pytest.raises(ValueError, match="basis_mm = nan"):
        Lattice(((1.0, math.nan), (0.0, 1.0)))


@given(lattice=lattices())
def test_the_smallest_distance_is_that_of_a_brute_force_over_neighbours(lattice):
    """Also of skewed bases, whose nearest points are many steps apart."""
    i, j = np.meshgrid(np.arange(-60, 61), np.arange(-60, 61))
    offsets = lattice.at(np.stack([i, j], axis=-1)) - lattice.origin_mm
    distances = np.hypot(*np.moveaxis(offsets, -1, 0))
    # The shortest of a lattice of this area is not longer than this (Hermite).
    assert lattice.min_distance_mm <= math.sqrt(2 / math.sqrt(3) * lattice.cell_area_mm2) * (1 + 1e-9)
    assert lattice.min_distance_mm == pytest.approx(distances[distances > 1e-6].min(), rel=1e-9)


@pytest.mark.parametrize(
    ("basis", "distance"),
    [
        (((100.0, 0.0), (0.0, 100.0)), 100.0),
        (((100.0, 0.0), (50.0, 50.0 * math.sqrt(3))), 100.0),
        (((100.0, 0.0), (0.0, 60.0)), 60.0),
        (((100.0, 0.0), (990.0, 7.0)), math.hypot(10.0, 7.0)),
        (((30.0, 40.0), (33.0, 44.5)), 0.0),
    ],
)
def test_smallest_distances_known_by_hand(basis, distance):
    if distance == 0.0:
        # (33, 44.5) - (30, 40) = (3, 4.5), and ten times that less (30, 40) = (0, 5).
        distance = math.hypot(3.0, 0.5)
    assert Lattice(basis).min_distance_mm == pytest.approx(distance)


@given(st.floats(0, 2 * math.pi), st.floats(1, 500))
def test_a_turned_triangular_lattice_has_a_reduced_basis(turn, pitch):
    """Two of its vectors are as long, and rounding once sent the reduction from one to the other for ever."""
    directions = turn, turn + math.pi / 3
    basis = Lattice(tuple((pitch * math.cos(at), pitch * math.sin(at)) for at in directions)).reduced_basis_mm
    assert np.linalg.norm(basis, axis=1) == pytest.approx(pitch)
    assert np.linalg.det(basis) == pytest.approx(pitch**2 * math.sqrt(0.75))


@given(lattices())
def test_no_vector_of_a_lattice_is_shorter_than_the_first_of_its_reduced_basis(lattice):
    a, b = lattice.reduced_basis_mm
    assert np.linalg.det([a, b]) == pytest.approx(lattice.cell_area_mm2)
    i, j = np.meshgrid(np.arange(-3, 4), np.arange(-3, 4))
    indices = np.stack([i.ravel(), j.ravel()], axis=-1)[np.any([i.ravel(), j.ravel()], axis=0)]
    lengths = np.linalg.norm(lattice.at(indices) - lattice.origin_mm, axis=1)
    shortest = np.linalg.norm(a)
    assert shortest <= lengths.min() + 1e-9
    assert shortest <= np.linalg.norm(b) <= np.linalg.norm(b - a) + 1e-6
    assert np.linalg.norm(b) <= np.linalg.norm(b + a) + 1e-6
