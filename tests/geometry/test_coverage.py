"""Coverage against brute force: dense grids of lattice phases and headings with plain numpy, and shapely's unions."""

import itertools
import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import affinity

from rfiddesign.geometry.areas import Disc, Rectangle, Ring, RoundedRectangle
from rfiddesign.geometry.coverage import coverage, coverage_by_heading
from rfiddesign.geometry.ellipse_area import Ellipse
from rfiddesign.geometry.lattice import Lattice
from rfiddesign.geometry.layouts import ReaderLayout, listed, make_layout, single
from rfiddesign.geometry.patterns import LatticePattern, ListedPattern, make_pattern
from rfiddesign.geometry.polygon_area import PolygonArea

SQUARE, TRIANGULAR = make_pattern("square", pitch_mm=100.0), make_pattern("triangular", pitch_mm=100.0)
SKEW = LatticePattern("skew", Lattice(((90.0, 15.0), (20.0, 70.0))))
YAWED = listed([(0, 0, 0.3), (210, 30, 0.9), (-150, 40, 0.0), (20, -190, 2.0)])


def numbers(result):
    return np.array([*result.k_coverage, result.expected_reads, result.two_tags_share])


def count_tags(positions, angle, area, lattice):
    """How many tags an antenna sees from each of the positions (n, 2) when its x axis points to `angle`."""
    basis = np.array(lattice.basis_mm)
    share = positions @ np.linalg.inv(basis)
    share -= np.floor(share)
    x0, y0 = (share @ basis).T.copy()
    steps = math.ceil(area.reach_mm * math.hypot(*basis.ravel()) / lattice.cell_area_mm2) + 1
    longest_diagonal = max(math.hypot(*basis.sum(axis=0)), math.hypot(*(basis[0] - basis[1])))
    cosine, sine = math.cos(angle), math.sin(angle)
    seen = np.zeros(len(positions), dtype=np.int8)
    for i, j in itertools.product(range(-steps, steps + 2), repeat=2):
        tag = np.array([i, j]) @ basis
        if math.hypot(*(tag - basis.sum(axis=0) / 2)) > area.reach_mm + longest_diagonal / 2:
            continue  # out of sight from anywhere in the cell
        x, y = tag[0] - x0, tag[1] - y0
        if isinstance(area, Disc):
            seen += x * x + y * y <= area.radius_mm**2
        else:
            is_along = np.abs(cosine * x + sine * y) <= area.length_mm / 2
            seen += is_along & (np.abs(cosine * y - sine * x) <= area.width_mm / 2)
    return seen


def brute_force(layout, area, pattern, headings, n_phases):
    """The same numbers by counting: a grid of phases, shifted at random for each heading."""
    rng = np.random.default_rng(5)
    basis = np.array(pattern.lattice.basis_mm)
    grid = np.stack(np.meshgrid(np.arange(n_phases), np.arange(n_phases)), axis=-1).reshape(-1, 2)
    total = np.zeros(5)
    for heading in headings:
        phases = (grid + rng.random(2)) / n_phases @ basis
        cosine, sine = math.cos(heading), math.sin(heading)
        readers, has_two = np.zeros(len(phases), dtype=int), np.zeros(len(phases), dtype=bool)
        for yaw in np.unique(layout.poses_mm[:, 2]):
            x, y, _ = layout.poses_mm[layout.poses_mm[:, 2] == yaw].T
            offsets = np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=-1)
            antennas = (offsets[:, None] + phases).reshape(-1, 2)
            seen = count_tags(antennas, heading + yaw, area, pattern.lattice).reshape(len(x), -1)
            readers += (seen > 0).sum(axis=0)
            has_two |= (seen > 1).any(axis=0)
        total += [*((readers >= k).mean() for k in (1, 2, 3)), readers.mean(), has_two.mean()]
    return total / len(headings)


def by_shapely(layout, outline, pattern, heading):
    """The same numbers at one heading by overlaying polygons within one cell of the lattice."""
    basis = np.array(pattern.lattice.basis_mm)
    cell = shapely.Polygon([(0, 0), basis[0], basis.sum(axis=0), basis[1]])
    at_least, two = [cell.difference(cell)] * 4, []
    reads = 0.0
    for x, y, yaw in layout.poses:
        # An antenna at q + R a sees the tag t if t - q - R a lies in its area, so for q in t - R a - area.
        turned = affinity.rotate(outline, heading + yaw + math.pi, origin=(0, 0), use_radians=True)
        offset = -np.array(
            [math.cos(heading) * x - math.sin(heading) * y, math.sin(heading) * x + math.cos(heading) * y]
        )
        copies = []
        low, high = np.floor(np.linalg.solve(basis.T, -offset)) - 6, np.floor(np.linalg.solve(basis.T, -offset)) + 7
        for i, j in itertools.product(*(range(int(a), int(b) + 1) for a, b in zip(low, high, strict=True))):
            copy = affinity.translate(turned, *(offset + np.array([i, j]) @ basis))
            if copy.intersects(cell):
                copies.append(copy.intersection(cell))
        seen = shapely.union_all(copies)
        two += [a.intersection(b) for a, b in itertools.combinations(copies, 2)]
        reads += seen.area
        for k in (3, 2, 1):
            deeper = seen if k == 1 else at_least[k - 1].intersection(seen)
            at_least[k] = at_least[k].union(deeper)
    levels = [*(at_least[k].area for k in (1, 2, 3)), reads, shapely.union_all(two).area]
    return np.array(levels) / cell.area


def even_headings(n, turn=2 * math.pi):
    return turn * (np.arange(n) + 0.5) / n


@pytest.mark.parametrize("pattern", [SQUARE, TRIANGULAR], ids=["square", "triangular"])
@pytest.mark.parametrize("radius", [30.0, 62.0])
def test_cross_of_eight_with_discs_agrees_with_counting(pattern, radius):
    layout, area = make_layout("cross-8"), Disc(radius)
    expected = brute_force(layout, area, pattern, even_headings(180, math.pi / 2), 160)
    result = coverage(layout, area, pattern)
    assert result.method == "exact"
    assert numbers(result) == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize(
    ("pitch_mm", "layout"),
    [(250.0, make_layout("cross-8")), (400.0, make_layout("cross-8")), (400.0, YAWED)],
    ids=["cross-8 at 250 mm", "cross-8 at 400 mm", "yawed at 400 mm"],
)
@pytest.mark.parametrize("kind", ["square", "triangular"])
def test_large_rectangles_agree_with_counting(kind, pitch_mm, layout):
    pattern, area = make_pattern(kind, pitch_mm=pitch_mm), Rectangle(320.0, 230.0)
    # Within half a turn every lattice comes back to itself, and so does a rectangle.
    expected = brute_force(layout, area, pattern, even_headings(240, math.pi), 120)
    result = coverage(layout, area, pattern)
    assert result.method == "scanline"
    assert numbers(result) == pytest.approx(expected, abs=1e-4)


def test_cross_of_96_agrees_with_counting():
    layout, area = make_layout("cross-96"), Disc(9.0)
    expected = brute_force(layout, area, SQUARE, even_headings(400, math.pi / 2), 50)
    result = numbers(coverage(layout, area, SQUARE))
    assert result[:3] == pytest.approx(expected[:3], abs=1e-4)
    # 96 readers add up, so that a grid's error in their sum is some ten times that of a fraction.
    assert result[3:] == pytest.approx(expected[3:], abs=1e-3)


@pytest.mark.parametrize("pattern", [SQUARE, TRIANGULAR, SKEW], ids=["square", "triangular", "skew"])
@pytest.mark.parametrize("radius", [20.0, 55.0])
def test_discs_agree_with_overlaid_polygons_at_every_heading(pattern, radius):
    fine = shapely.Point(0, 0).buffer(radius, quad_segs=400)
    # A polygon of the disc's own area: what remains of the chords is of the order of 1e-6.
    outline = affinity.scale(fine, *[math.sqrt(math.pi * radius**2 / fine.area)] * 2, origin=(0, 0))
    headings = np.array([0.0, 0.2, math.pi / 4, 1.9])
    exact = coverage_by_heading(make_layout("cross-8"), Disc(radius), pattern.lattice, headings)
    expected = [by_shapely(make_layout("cross-8"), outline, pattern, heading) for heading in headings]
    assert exact == pytest.approx(np.array(expected), abs=2e-5)


@pytest.mark.parametrize(
    "area",
    [
        Rectangle(320.0, 230.0),
        RoundedRectangle(90.0, 60.0, 20.0),
        Ellipse(70.0, 20.0),
        Ring(25.0, 45.0),
        PolygonArea(((-50.0, -40.0), (60.0, -40.0), (60.0, 0.0), (-10.0, 5.0), (-20.0, 45.0))),
    ],
    ids=lambda area: type(area).__name__,
)
def test_any_outline_agrees_with_overlaid_polygons(area):
    pattern = make_pattern("triangular", pitch_mm=240.0)
    headings = even_headings(16)
    scanned = coverage_by_heading(YAWED, area, pattern.lattice, headings)
    expected = np.array([by_shapely(YAWED, area.outline(), pattern, heading) for heading in headings])
    # Where a side lies nearly along the lines a single heading is off by as much as a line weighs.
    assert scanned == pytest.approx(expected, abs=3e-3)
    assert scanned.mean(axis=0) == pytest.approx(expected.mean(axis=0), abs=2e-4)


def test_scanlines_agree_with_the_exact_arcs():
    disc = Disc(45.0)
    corners = shapely.get_coordinates(disc.outline())[:-1] * math.sqrt(disc.area_mm2 / disc.outline().area)
    scanned = numbers(coverage(make_layout("cross-8"), PolygonArea(tuple(map(tuple, corners))), SQUARE))
    assert scanned == pytest.approx(numbers(coverage(make_layout("cross-8"), disc, SQUARE)), abs=1.5e-4)


def test_antennas_that_coincide_modulo_the_lattice_count_each():
    layout = listed([(0, 0), (100, 0), (0, -200), (300, 100)])
    levels = coverage_by_heading(layout, Disc(20.0), SQUARE.lattice, np.array([0.0]), k_max=5)[0]
    share = math.pi * 20.0**2 / 100.0**2
    assert levels == pytest.approx([share] * 4 + [0.0, 4 * share, 0.0], abs=1e-12)


def test_a_view_wider_than_the_cell_always_holds_two_tags():
    for area in (Disc(250.0), Rectangle(600.0, 500.0)):
        result = coverage(make_layout("cross-8"), area, SQUARE, k_max=9)
        assert numbers(result) == pytest.approx([1.0] * 8 + [0.0, 8.0, 1.0])


def test_result_reads_alike_for_the_same_lattice_in_another_basis():
    twin = LatticePattern("twin", Lattice(((300.0, 100.0), (400.0, 100.0))))  # the same points as pitch 100: det -10^4
    for area in (Disc(33.0), Rectangle(70.0, 40.0)):
        assert numbers(coverage(YAWED, area, twin)) == pytest.approx(numbers(coverage(YAWED, area, SQUARE)), abs=1e-4)


coordinates = st.floats(-300, 300).map(lambda value: round(value, 3))
layouts = st.lists(st.tuples(coordinates, coordinates, st.floats(-3, 3)), min_size=1, max_size=6).map(
    lambda poses: ReaderLayout("drawn", tuple(poses))
)
areas = st.one_of(
    st.floats(1, 120).map(Disc), st.tuples(st.floats(5, 200), st.floats(5, 200)).map(lambda sides: Rectangle(*sides))
)
lattices = st.sampled_from([SQUARE.lattice, TRIANGULAR.lattice, SKEW.lattice])


@settings(max_examples=150, deadline=None)
@given(layouts, areas, lattices, st.floats(0, 6.3))
def test_at_every_heading_levels_fall_with_k_and_add_up_to_the_reads(layout, area, lattice, heading):
    n = layout.n_readers
    levels = coverage_by_heading(layout, area, lattice, np.array([heading]), k_max=n)[0]
    at_least, reads, two = levels[:n], levels[n], levels[n + 1]
    assert (np.diff(at_least) <= 1e-9).all()
    assert levels.min() >= -1e-9
    assert max(at_least[0], two) <= 1 + 1e-9
    assert at_least.sum() == pytest.approx(reads, abs=1e-8)
    # Each antenna sees at most as many tags on average as fit its area.
    assert at_least[0] <= reads + 1e-9
    assert reads <= n * area.area_mm2 / lattice.cell_area_mm2 * 1.001 + 2e-3


@settings(max_examples=100, deadline=None)
@given(layouts, st.floats(1, 120), lattices, st.floats(0, 6.3), st.floats(0, 6.3))
def test_turning_lattice_and_robot_together_changes_nothing(layout, radius, lattice, heading, turn):
    cosine, sine = math.cos(turn), math.sin(turn)
    turned = Lattice(tuple((cosine * x - sine * y, sine * x + cosine * y) for x, y in lattice.basis_mm))
    here = coverage_by_heading(layout, Disc(radius), lattice, np.array([heading]))
    there = coverage_by_heading(layout, Disc(radius), turned, np.array([heading + turn]))
    assert there == pytest.approx(here, abs=1e-7)


@settings(max_examples=25, deadline=None)
@given(layouts, areas, lattices, st.floats(0, 6.3))
def test_averages_do_not_depend_on_how_the_lattice_lies(layout, area, lattice, turn):
    cosine, sine = math.cos(turn), math.sin(turn)
    turned = Lattice(tuple((cosine * x - sine * y, sine * x + cosine * y) for x, y in lattice.basis_mm))
    here = coverage(layout, area, LatticePattern("here", lattice))
    there = coverage(layout, area, LatticePattern("there", turned))
    # Either is off by up to 1e-4, and the sum of reads by that of each reader.
    assert numbers(there) == pytest.approx(numbers(here), abs=2e-4)


@settings(max_examples=100, deadline=None)
@given(st.floats(0.1, 24.9), lattices, st.integers(1, 8), st.floats(0, 6.3))
def test_discs_that_never_meet_cover_the_sum_of_their_areas(radius, lattice, n, heading):
    # Antennas on the lattice's own quarter points, half a lattice vector apart at least, never share a view.
    a, b = np.array(lattice.basis_mm)
    radius *= 0.7
    places = [(0.0, 0.0), *(0.5 * a, 0.5 * b, 0.5 * (a + b))][: min(n, 4)]
    turn = [[math.cos(heading), -math.sin(heading)], [math.sin(heading), math.cos(heading)]]
    layout = listed([tuple(np.array(place) @ np.array(turn)) for place in places])
    levels = coverage_by_heading(layout, Disc(radius), lattice, np.array([heading]))[0]
    share = len(places) * math.pi * radius**2 / lattice.cell_area_mm2
    assert levels == pytest.approx([share, 0, 0, share, 0], abs=1e-10)


def test_one_antenna_sees_its_area_over_the_cell():
    for area in (Disc(30.0), Rectangle(60.0, 40.0), Ellipse(40.0, 20.0), Ring(20.0, 40.0)):
        result = coverage(single(), area, SQUARE)
        assert result.k_coverage[0] == pytest.approx(area.area_mm2 / 100.0**2, abs=5e-5)
        assert result.expected_reads == pytest.approx(result.k_coverage[0], abs=1e-12)


def test_random_tags_are_covered_as_a_poisson_field_would_be():
    # With no least distance the number of tags in an area is Poisson: 1 - exp(-mean) for one antenna.
    pattern = make_pattern("random", tags_per_m2=100.0, min_distance_mm=0.0, seed=3)
    area = Disc(60.0)
    mean = 100e-6 * area.area_mm2
    result = coverage(single(), area, pattern)
    assert result.method == "sampled"
    assert 0 < result.stderr < 0.02
    assert result.k_coverage[0] == pytest.approx(1 - math.exp(-mean), abs=4 * result.stderr)
    assert result.two_tags_share == pytest.approx(1 - math.exp(-mean) * (1 + mean), abs=4 * result.stderr)
    assert result == coverage(single(), area, pattern)


def test_a_listed_lattice_is_sampled_to_within_its_error():
    tags = SQUARE.lay(shapely.box(0, 0, 4000, 4000))
    layout = listed([(0, 0), (60, 20)])
    result = coverage(layout, Rectangle(70.0, 50.0), ListedPattern(tags))
    exact = coverage(layout, Rectangle(70.0, 50.0), SQUARE)
    # Beyond the list there are no tags: its outermost 60 mm see fewer.
    assert numbers(result) == pytest.approx(numbers(exact), abs=4 * result.stderr + 0.02)


def test_a_given_number_of_headings_states_what_it_is_worth():
    few, many = (coverage(make_layout("cross-8"), Disc(30.0), SQUARE, n_headings=n) for n in (6, 600))
    converged = coverage(make_layout("cross-8"), Disc(30.0), SQUARE)
    assert numbers(many) == pytest.approx(numbers(converged), abs=1e-5)
    assert np.abs(numbers(few) - numbers(converged)).max() < few.stderr
    assert many.stderr < 1e-4 < few.stderr


@pytest.mark.parametrize(("argument", "value"), [("k_max", 0), ("n_headings", 0), ("n_headings", 1.5), ("k_max", "2")])
def test_bad_numbers_are_named(argument, value):
    with pytest.raises(ValueError, match=f"{argument} = "):
        coverage(make_layout("cross-8"), Disc(30.0), SQUARE, **{argument: value})
